"""Optimal control: what is found from many starts, whether it holds, and what it takes.

Beside `ocp.solve` stand Radau collocation by CasADi's Opti and, where it is installed, rockit, on
the same models from the same starts with the same Ipopt. The referee is the same for all: the model
with layers of 1e-5 under the controls, and exact Coulomb friction with stiction. Times are
processor time of a whole call, building and checking included.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from math import isfinite, nan
from pathlib import Path
from statistics import median
from time import process_time
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import NDArray

from ocp.formulation.problem import Problem
from ocp.problems.catalogue import READY
from ocp.problems.ready import Ready
from ocp.solve import solve
from ocp.solving.perturbed import perturbed
from ocp.solving.starts import Start, initial_points
from ocp.transcription.grid import make_meshes
from ocp.transcription.schemes import Radau
from ocp.transcription.transcribe import discretise
from symfric.bench.ocp_contenders import Attempt, has_rockit, opti, rockit
from symfric.bench.ocp_mpc import MpcRow, mpc_rows
from symfric.bench.ocp_referee import attempt_of, landed
from symfric.bench.ocp_size import SizeRow, size_rows

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
Tell = Callable[[str, float], None]


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
class OcpBenchmark:
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

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain data."""
        return {
            "rows": [asdict(r) for r in self.rows],
            "sizes": [asdict(r) for r in self.sizes],
            "mpc": [asdict(r) for r in self.mpc],
            "skipped": self.skipped,
        }

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Miss against time, a panel for each problem with friction."""
        from symfric.bench.ocp_picture import plot_ocp  # noqa: PLC0415  (matplotlib is slow)

        return plot_ocp(self.rows, path)


def bench_ocp(
    *,
    quick: bool = False,
    cases: Sequence[str] | None = None,
    progress: Tell | None = None,
) -> OcpBenchmark:
    """Measure all problems on this machine; some minutes, `quick` one.

    Args:
        quick: 3 starts, no far ones, the others on one layer.
        cases: names of ready problems; all of them if none.
    """
    ready = [READY[name] for name in cases or READY]
    rows: list[OcpRow] = []
    for k, one in enumerate(ready):
        if progress is not None:
            progress(one.name, k / len(ready))
        rows += _case(one, quick)
    skipped = {} if has_rockit() else {"rockit": "not installed"}
    wanted = cases is None
    return OcpBenchmark(
        tuple(rows),
        tuple(size_rows(quick)) if wanted else (),
        tuple(mpc_rows(quick)) if wanted else (),
        skipped,
    )


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
