"""Optimal control: what is found from many starts, whether it holds, and what it takes.

Beside `ocp.solve` stand Radau collocation by CasADi's Opti and, where it is installed, rockit, on
the same models from the same starts with the same Ipopt. The referee is the same for all: the model
with layers of 1e-5 under the controls, and exact Coulomb friction with stiction. Times are
processor time of a whole call, building and checking included.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from statistics import median
from time import process_time
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from ocp.formulation.phase import Span
from ocp.formulation.problem import Problem
from ocp.friction.event_check import set_valued
from ocp.problems import READY, Ready
from ocp.solve import solve
from ocp.solving.one_solve import perturbed
from ocp.solving.solution import Solution
from ocp.solving.starts import Start, initial_points
from ocp.transcription.schemes import Radau, make_meshes
from ocp.transcription.transcribe import discretise
from symfric.bench import table
from symfric.bench.ocp_contenders import Attempt, has_rockit, opti, rockit
from symfric.bench.ocp_costs import MpcRow, SizeRow, mpc_rows, size_rows
from symfric.integrator import Hold, simulate

Array = NDArray[np.float64]
STARTS, RANDOM = 12, 50
NEAR, FAR = 0.1, 0.5
"""Scales of the starts, see `perturbed`: near the default guess, and anywhere in the bounds."""
WANTED = 1e-4
"""Relative miss up to which a motion counts as landed."""
BEST = 1e-3
"""Relative cost above the best one found up to which it counts as found."""
WIDTHS = (1e-1, 1e-2, 1e-3)
"""Layers [m/s] on which the others solve."""
INTERVALS = 100


@final
@dataclass(frozen=True)
class OcpRow:
    """One solver on one problem, medians over its starts.

    Attributes:
        case, solver: names; of the others with the layer they solve on.
        starts: near the default guess ("near") or far from it ("far"), and their number.
        solved: share in which the solver says so.
        landed: share that misses by no more than 1e-4, in the model itself and with exact friction.
        best: share within 0.1 % of the best known cost, or of the best one of this run.
        cost: median J; `optimum`: best known one, NaN where there is none.
        off: (cost - optimum) / |optimum|.
        miss, exact: relative miss of the model, and with exact friction (NaN without friction).
        iterations: of the solver.
        time_s: processor time of a call [s].
    """

    case: str
    solver: str
    starts: str
    count: int
    solved: float
    landed: float
    best: float
    cost: float
    optimum: float
    off: float
    miss: float
    exact: float
    iterations: float
    time_s: float


@final
@dataclass(frozen=True, eq=False)
class OcpBenchmark(table.Report):
    """All rows of one run of the benchmark.

    Attributes:
        rows: problems by solvers.
        sizes: what derivatives of large programs take.
        mpc: controllers on plants of other laws.
        skipped: who was left out -> why.
    """

    rows: tuple[OcpRow, ...]
    sizes: tuple[SizeRow, ...]
    mpc: tuple[MpcRow, ...]
    skipped: dict[str, str]

    def shown(self) -> Iterator[table.Table | str]:
        """Problems by solvers, sizes of programs, controllers."""
        yield table.of(
            "Optimal control: medians over the starts; verified solutions miss no end condition "
            "by more than 1e-4, with the model and with exact Coulomb friction",
            self.rows,
            {"case": "case", "solver": "solver", "starts": lambda r: f"{r.count} {r.starts}",
             "verified": lambda r: f"{r.landed:.0%}",
             "best cost reached": lambda r: f"{r.best:.0%}", "cost J": "cost",
             "cost above the best [%]": table.shortened("off", 100, 2),
             "relative miss": table.shortened("miss", digits=2),
             "relative miss, exact friction": table.shortened("exact", digits=2),
             "iterations": table.rounded("iterations"),
             "processor time [s]": table.shortened("time_s", digits=2)},
        )  # fmt: skip
        if self.sizes:
            yield table.of(
                "Derivatives of the program of a cart-pendulum in the virtual machine", self.sizes,
                {"intervals": "intervals", "unknowns": "unknowns", "nonzeros": "nonzeros",
                 "build time [s]": table.shortened("build_s"),
                 "Jacobian [ms]": table.shortened("jacobian_ms"),
                 "Hessian [ms]": table.shortened("hessian_ms"),
                 "growth exponent": table.shortened("exponent")},
            )  # fmt: skip
        if self.mpc:
            yield table.of(
                "Model predictive controller of a drive", self.mpc,
                {"plant": "plant", "cycles": "cycles",
                 "median time per cycle [ms]": table.shortened("median_ms"),
                 "largest time [ms]": table.shortened("worst_ms"),
                 "largest processor time [ms]": table.shortened("worst_cpu_ms"),
                 "most QPs per cycle": "iterations", "failed cycles": "unconverged",
                 "unreported failures": "unreported",
                 "distance from the goal [mm]": table.shortened("off_mm")},
            )  # fmt: skip
        yield from table.not_run(self.skipped)

    def drawn(self) -> tuple[Any, ...]:
        """Miss against time, a panel for each problem with friction."""
        return "ocp", self.rows


def bench_ocp(
    *,
    quick: bool = False,
    cases: Sequence[str] | None = None,
    progress: table.Progress = None,
) -> OcpBenchmark:
    """Measure all problems on this machine; some minutes, `quick` one.

    Args:
        quick: 3 starts, no far ones, the others on one layer.
        cases: names of ready problems; all of them if none.
    """
    ready = [READY[name] for name in cases or READY]
    rows = [
        row for one in table.each(ready, progress, lambda r: r.name) for row in _case(one, quick)
    ]
    skipped = {} if has_rockit() else {"rockit": "not installed"}
    sizes, mpc = ((), ()) if cases else (tuple(size_rows(quick)), tuple(mpc_rows(quick)))
    return OcpBenchmark(tuple(rows), sizes, mpc, skipped)


def starts_of(problem: Problem, count: int, scale: float) -> Iterator[dict[str, Array]]:
    """Guesses of all states and inputs by name; the first one of near starts is the default."""
    into = discretise(problem, Radau()).on(make_meshes(problem, 50))
    points = initial_points(into)
    for seed in range(count):
        moved = points if seed == 0 and scale == NEAR else perturbed(into, points, scale, seed)
        names = [v.name for v in problem.spans[0].model.x]
        inputs = [v.name for v in problem.spans[0].model.u]
        lengths = np.array([span.T for span in moved.spans])
        begins = np.concatenate([[0.0], np.cumsum(lengths)])
        at = np.concatenate(
            [b + T * m for b, T, m in zip(begins, lengths, into.meshes, strict=False)]
        )
        looks = np.linspace(0.0, begins[-1], 201)
        nodes = np.hstack([span.nodes for span in moved.spans])
        held = np.hstack([np.hstack([span.u, span.u[:, -1:]]) for span in moved.spans])
        yield {n: np.interp(looks, at, row) for n, row in zip(names, nodes, strict=True)} | {
            n: np.interp(looks, at, row) for n, row in zip(inputs, held, strict=True)
        }


def _case(ready: Ready, quick: bool) -> Iterator[OcpRow]:
    problem = ready.make()
    near = list(starts_of(problem, 3 if quick else STARTS, NEAR))
    yield _row(ready, "symfric", "near", [_ours(problem, guess) for guess in near], problem)
    if ready.friction and not quick:
        far = starts_of(problem, RANDOM, FAR)
        yield _row(ready, "symfric", "far", [_ours(problem, guess) for guess in far], problem)
    if not ready.friction:
        yield _others(ready, "Opti", problem, near, nan)
        return
    for width in WIDTHS[:1] if quick else WIDTHS:
        smooth = ready.make(v_t=width)
        yield _others(ready, "Opti", smooth, near, width)
        if has_rockit():
            found = [rockit(smooth, INTERVALS)]
            yield _row(ready, f"rockit {width:g}", "default", found, problem)


def _ours(problem: Problem, guess: Start) -> Attempt:
    begin = process_time()
    found = solve(problem, guess=guess, throw=False)
    return attempt_of(found, process_time() - begin)


def _others(
    ready: Ready, name: str, smooth: Problem, starts: Sequence[dict[str, Array]], width: float
) -> OcpRow:
    found = [opti(smooth, INTERVALS, guess) for guess in starts[:3]]
    label = f"{name} {width:g}" if isfinite(width) else name
    return _row(ready, label, "near", found, ready.make())


SOLVED = ("SOLVED", "ACCEPTABLE", "SUCCESS", "Solve_Succeeded", "Solved_To_Acceptable_Level")


def _row(
    ready: Ready, solver: str, starts: str, found: Sequence[Attempt], problem: Problem
) -> OcpRow:
    misses = [landed(problem, a) for a in found]
    exact = [landed(problem, a, exact=True) if ready.friction else nan for a in found]
    holds = [
        m <= WANTED and (not ready.friction or e <= WANTED)
        for m, e in zip(misses, exact, strict=True)
    ]
    held = [a.cost for a, good in zip(found, holds, strict=True) if good]
    known = ready.optimum if isfinite(ready.optimum) else min(held, default=nan)
    cost = median(a.cost for a in found)
    size = abs(known) or 1.0
    return OcpRow(
        case=ready.name,
        solver=solver,
        starts=starts,
        count=len(found),
        solved=_share([a.answer in SOLVED for a in found]),
        landed=_share(holds),
        best=_share([good and a.cost <= known + BEST * size
                for a, good in zip(found, holds, strict=True)]),
        cost=cost,
        optimum=ready.optimum,
        off=(cost - known) / size,
        miss=_middle(misses),
        exact=_middle(exact),
        iterations=median(a.iterations for a in found),
        time_s=median(a.time_s for a in found),
    )  # fmt: skip


def _share(flags: Sequence[bool]) -> float:
    return sum(flags) / len(flags)


def _middle(values: Sequence[float]) -> float:
    """The median, in which a motion that could not be simulated counts as infinitely far off."""
    if not isfinite(values[0]) and all(v != v for v in values):
        return nan
    return median(v if v == v else float("inf") for v in values)


# ---- how far motions are off what a problem asks for, whoever found the controls ----


def attempt_of(solution: Solution, time_s: float) -> Attempt:
    """The solution of `ocp.solve` as an `Attempt`."""
    motion, meshes, controls = solution.motions[0], [], []
    for stretch in motion.phases:
        inside = (motion.t_control >= stretch.begin - 1e-12) & (motion.t_control < stretch.end)
        meshes.append((motion.t_control[inside] - stretch.begin) / stretch.T)
        controls.append({name: u[inside] for name, u in motion.controls.items()})
    return Attempt(
        cost=solution.cost,
        iterations=solution.iterations,
        answer=solution.status.name,
        time_s=time_s,
        durations=tuple(stretch.T for stretch in motion.phases),
        controls=tuple(controls),
        meshes=tuple(meshes),
    )


def landed(problem: Problem, attempt: Attempt, *, exact: bool = False, rtol: float = 1e-9) -> float:
    """Largest relative miss of ends and middle points under the controls, simulated.

    Of a state relative to its range, or its nominal value; NaN where the motion cannot be
    simulated.

    Args:
        exact: with exact Coulomb friction and stiction in place of the laws.
    """
    state: dict[str, float] = {}
    modes: dict[str, int] = {}
    worst, clock = 0.0, 0.0
    for span, T, controls in zip(problem.spans, attempt.durations, attempt.controls, strict=True):
        mesh = attempt.meshes[span.phase] if attempt.meshes else None
        looks = sorted({*span.nodes, *np.linspace(0, 1, 101).tolist()})
        how: dict[str, Any] = {
            "t_start": clock,
            "x0": _begin(span, state),
            "u": _held_controls(span, controls, mesh, clock, T),
            "p": {v.name: float(x) for v, x in zip(span.model.p, span.p, strict=True)},
            "t_eval": clock + T * np.array(looks),
            "rtol": rtol,
            "throw": False,
        }
        if exact:
            run = set_valued(span.model, clock + T, modes=modes, **how)
            modes = dict(run.pieces[-1].modes) if run.pieces else {}
        else:
            run = simulate(span.model, clock + T, **how)
        if not run.status.ok:
            return nan
        worst = max(worst, _miss(span, {n: run[n] for n in span.nodes[1.0]}, looks))
        state, clock = {n: float(run[n][-1]) for n in span.nodes[1.0]}, clock + T
    return worst


def _begin(span: Span, before: Mapping[str, float]) -> dict[str, float]:
    linked = {link.state for link in span.links}
    return {
        v.name: before[v.name] if v.name in linked else float(np.mean(span.nodes[0.0][v.name]))
        for v in span.model.x
    }


def _held_controls(
    span: Span, controls: Mapping[str, Array], mesh: Array | None, clock: float, T: float
) -> dict[str, Hold]:
    N = next(iter(controls.values())).size
    at = clock + T * (np.arange(N) / N if mesh is None else mesh)
    at[0] = clock
    return {n: Hold(at, np.clip(u, *span.boxes[n])) for n, u in controls.items()}


def _miss(span: Span, signals: Mapping[str, Array], looks: Sequence[float]) -> float:
    nominal = {v.name: v.nominal for v in span.model.x}
    worst = 0.0
    for s, boxes in span.nodes.items():
        for name, (low, high) in boxes.items():
            if s > 0 and isfinite(low) and isfinite(high):
                x = float(signals[name][looks.index(s)])
                size = max(float(np.abs(signals[name]).max()), nominal[name])
                worst = max(worst, (low - x) / size, (x - high) / size)
    return worst
