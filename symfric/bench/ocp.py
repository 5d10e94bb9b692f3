"""Optimal control: solutions from many starts, their verification, and their cost.

`ocp.solve` is compared with Radau collocation in CasADi's Opti and, if installed, in rockit, on the
same models, from the same starts and with the same Ipopt. All controls are verified in the same
way: with the model and layers of 1e-5, and with exact Coulomb friction with stiction. Times are
processor times of a whole call, including building and verification.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from math import inf, isfinite, nan, pi
from statistics import median
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocp.formulation.expressions import at_end, effort, track
from ocp.formulation.phase import Phase, Span, clipped, limits
from ocp.formulation.problem import Problem
from ocp.friction.event_check import set_valued
from ocp.problems import READY, Ready, guide
from ocp.solve import solve
from ocp.solving.solution import Solution
from ocp.solving.starts import Start, initial_points
from ocp.transcription.schemes import Radau, make_meshes
from ocp.transcription.transcribe import discretise
from symfric.bench.ocp_contenders import Attempt, has_rockit, opti, rockit
from symfric.bench.report import Found, Progress, Report, curves
from symfric.foundation.parameters import Variable
from symfric.foundation.programs import find_compiler
from symfric.integrator import Hold, simulate
from symfric.laws import BrownMcPhee, ExactCoulomb, Law, LuGre
from symfric.model import Model
from symfric.scenes.blocks import drive

Array = NDArray[np.float64]
STARTS, RANDOM = 12, 50
NEAR, FAR = 0.1, 0.5
"""Scales of the starts, see `starts_of`: near the default guess, and anywhere in the bounds."""
WAVES = 4
"""Number of half waves in a perturbation."""
WANTED = 1e-4
"""Largest relative miss of a verified motion."""
BEST = 1e-3
"""Largest relative difference from the best cost that counts as equal."""
WIDTHS = (1e-1, 1e-2, 1e-3)
"""Widths [m/s] of the layers of problems for other tools."""
INTERVALS = 100
TITLE = (
    "Optimal control: medians over the starts; verified solutions miss no end condition by more "
    "than 1e-4, with the model and with exact Coulomb friction"
)
EXACT = "relative miss, exact friction"


def bench(
    quick: bool = False, cases: Sequence[str] | None = None, progress: Progress = None
) -> Report:
    """Measure all problems on this machine in a few minutes, or in one minute with `quick`.

    Args:
        quick: use 3 near starts, and one layer for other tools.
        cases: names of ready problems; by default all problems, and controllers.
        progress: called with the current item and the fraction done.
    """
    tasks: dict[str, Callable[[], Iterator[Found]]] = {
        name: partial(_case, READY[name], quick) for name in cases or READY
    }
    if not cases:
        tasks["controllers"] = partial(controllers, quick)
    draw = curves("case", ("solver",), "processor time [s]", EXACT)
    report = Report((TITLE, draw))
    if not has_rockit():
        report.notes.append("rockit: not run, not installed")
    return report.collect(tasks, progress)


def starts_of(problem: Problem, count: int, scale: float) -> Iterator[dict[str, Array]]:
    """Yield guesses of all states and inputs by name; the first near start is the default one.

    A random sum of half waves is added to each signal. Its standard deviation is `scale` times half
    the width of the bounds, or the larger of the largest and the nominal value without bounds. Free
    durations are multiplied by exp(scale r / 2), r normal.
    """
    into = discretise(problem, Radau()).on(make_meshes(problem, 50))
    model, first = problem.spans[0].model, int(scale == NEAR)
    for seed in range(count):
        random, begins = np.random.default_rng(seed), [0.0]
        at, nodes, held = list[Array](), list[Array](), list[Array]()
        parts = zip(problem.spans, into.meshes, initial_points(into).spans, strict=True)
        for span, mesh, old in parts:
            x, u, time = old.nodes, old.u, old.T
            if seed >= first:
                x = x + _waves(random, scale, span, model.x, x)(mesh)
                u = u + _waves(random, scale, span, model.u, u)((mesh[1:] + mesh[:-1]) / 2)
                time *= float(np.exp(0.5 * scale * random.standard_normal()))
            time = clipped(time, limits(span.T))
            at.append(begins[-1] + time * mesh)
            begins.append(begins[-1] + time)
            nodes.append(x)
            held.append(np.hstack([u, u[:, -1:]]))
        times = np.linspace(0.0, begins[-1], 201)
        rows = zip((*model.x, *model.u), (*np.hstack(nodes), *np.hstack(held)), strict=True)
        yield {v.name: np.interp(times, np.concatenate(at), row) for v, row in rows}


def _waves(
    random: np.random.Generator, scale: float, span: Span, group: Sequence[Variable], rows: Array
) -> Callable[[Array], Array]:
    """Return random sums of half waves over [0, 1], one row for each variable."""

    def size(v: Variable, row: Array) -> float:
        low, high = span.boxes[v.name]
        bounded = isfinite(low) and isfinite(high)
        return 0.5 * (high - low) if bounded else max(v.nominal, float(np.abs(row).max()))

    sizes = [scale * size(v, row) for v, row in zip(group, rows, strict=True)]
    a = [random.standard_normal((2, WAVES)) * one / np.sqrt(WAVES) for one in sizes]

    def at(fractions: Array) -> Array:
        angles = pi * np.arange(1, WAVES + 1)[:, None] * fractions
        return np.array([one[0] @ np.sin(angles) + one[1] @ np.cos(angles) for one in a])

    return at


def _case(ready: Ready, quick: bool) -> Iterator[Found]:
    """Solve one problem with all tools; tools without homotopy solve it with smooth layers."""
    problem = ready.make()
    row = partial(_row, ready, problem)
    near = list(starts_of(problem, 3 if quick else STARTS, NEAR))
    yield row("symfric", "near", [_ours(problem, guess) for guess in near])
    if not ready.friction:
        yield row("Opti", "near", [opti(problem, INTERVALS, guess) for guess in near[:3]])
        return
    if not quick:
        far = starts_of(problem, RANDOM, FAR)
        yield row("symfric", "far", [_ours(problem, guess) for guess in far])
    for width in WIDTHS[:1] if quick else WIDTHS:
        smooth = ready.make(v_t=width)
        found = [opti(smooth, INTERVALS, guess) for guess in near[:3]]
        yield row(f"Opti {width:g}", "near", found)
        if has_rockit():
            yield row(f"rockit {width:g}", "default", [rockit(smooth, INTERVALS, near[0])])


def _ours(problem: Problem, guess: Start) -> Attempt:
    begin = process_time()
    found = solve(problem, guess=guess, throw=False)
    return attempt_of(found, process_time() - begin)


SOLVED = ("SOLVED", "ACCEPTABLE", "SUCCESS", "Solve_Succeeded", "Solved_To_Acceptable_Level")


def _row(
    ready: Ready, problem: Problem, solver: str, starts: str, found: Sequence[Attempt]
) -> Found:
    """Return medians over the starts; the best cost is the known cost or the best of this run."""
    misses = [landed(problem, a) for a in found]
    exact = [landed(problem, a, exact=True) if ready.friction else nan for a in found]
    holds = [
        m <= WANTED and (not ready.friction or e <= WANTED)
        for m, e in zip(misses, exact, strict=True)
    ]
    held = [a.cost for a, good in zip(found, holds, strict=True) if good]
    known = ready.optimum if isfinite(ready.optimum) else min(held, default=nan)
    cost, size = median(a.cost for a in found), abs(known) or 1.0
    share = 100.0 / len(found)
    return TITLE, {
        "case": ready.name, "solver": solver, "starts": f"{len(found)} {starts}",
        "reported as solved [%]": share * sum(a.status in SOLVED for a in found),
        "verified [%]": share * sum(holds),
        "best cost reached [%]": share * sum(c <= known + BEST * size for c in held),
        "cost J": cost, "best known J": ready.optimum,
        "cost above the best [%]": 100.0 * (cost - known) / size,
        "relative miss": _middle(misses), EXACT: _middle(exact),
        "iterations": median(a.iterations for a in found),
        "processor time [s]": median(a.time_s for a in found),
    }  # fmt: skip


def _middle(values: Sequence[float]) -> float:
    """Return the median; the error of a motion that could not be simulated counts as infinite."""
    known = [v if v == v else inf for v in values]
    return median(known) if min(known) < inf else nan


# ---- verification of the controls of all tools ----


def attempt_of(solution: Solution, time_s: float) -> Attempt:
    """Return the solution of `ocp.solve` as an `Attempt`."""
    motion, meshes, controls = solution.motions[0], [], []
    for stretch in motion.phases:
        inside = (motion.t_control >= stretch.begin - 1e-12) & (motion.t_control < stretch.end)
        meshes.append((motion.t_control[inside] - stretch.begin) / stretch.T)
        controls.append({name: u[inside] for name, u in motion.controls.items()})
    return Attempt(
        cost=solution.cost,
        iterations=solution.iterations,
        status=solution.status.name,
        time_s=time_s,
        durations=tuple(stretch.T for stretch in motion.phases),
        controls=tuple(controls),
        meshes=tuple(meshes),
    )


def landed(problem: Problem, attempt: Attempt, *, exact: bool = False, rtol: float = 1e-9) -> float:
    """Return the largest relative miss of end and middle conditions under the simulated controls.

    The miss of a state is relative to its range or nominal value; NaN if the simulation fails.

    Args:
        problem, attempt: problem and its solution.
        exact: use exact Coulomb friction with stiction instead of the laws.
        rtol: relative tolerance of the simulation.
    """
    state: dict[str, float] = {}
    modes: dict[str, int] = {}
    worst, clock = 0.0, 0.0
    for span, T, controls in zip(problem.spans, attempt.durations, attempt.controls, strict=True):
        N = next(iter(controls.values())).size
        mesh = attempt.meshes[span.phase] if attempt.meshes else np.arange(N) / N
        held_from = clock + T * np.array(mesh)
        held_from[0] = clock
        linked = {link.state for link in span.links}
        times = sorted({*span.nodes, *np.linspace(0, 1, 101).tolist()})
        how: dict[str, Any] = {
            "t_start": clock,
            "x0": {
                v.name: state[v.name]
                if v.name in linked
                else float(np.mean(span.nodes[0.0][v.name]))
                for v in span.model.x
            },
            "u": {n: Hold(held_from, np.clip(u, *span.boxes[n])) for n, u in controls.items()},
            "p": {v.name: float(x) for v, x in zip(span.model.p, span.p, strict=True)},
            "t_eval": clock + T * np.array(times),
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
        worst = max(worst, _miss(span, {n: run[n] for n in span.nodes[1.0]}, times))
        state, clock = {n: float(run[n][-1]) for n in span.nodes[1.0]}, clock + T
    return worst


def _miss(span: Span, signals: Mapping[str, Array], times: Sequence[float]) -> float:
    nominal = {v.name: v.nominal for v in span.model.x}
    worst = 0.0
    for s, boxes in span.nodes.items():
        for name, (low, high) in boxes.items():
            if s > 0 and isfinite(low) and isfinite(high):
                x = float(signals[name][times.index(s)])
                size = max(float(np.abs(signals[name]).max()), nominal[name])
                worst = max(worst, (low - x) / size, (x - high) / size)
    return worst


# ---- a model predictive controller on plants whose friction differs from its model ----

MPC = "Model predictive controller of a drive"
STEP, HORIZON = 0.01, 20
GOAL = 0.1
"""Distance between the positions of the controller [m]."""
LOOK = 0.75
"""Time [s] at which the distance from the goal is measured; the controller anticipates the return
at 1 s."""
CYCLES = 1000


def _drive(law: Law) -> Model:
    return drive(law, m=1.0, N=1.0)


LEVELS = {"mu_s": 6.0, "mu_d": 4.0}
PLANTS: dict[str, Callable[[], Law]] = {
    "brown_mcphee 1e-2": lambda: BrownMcPhee(v_t=1e-2, **LEVELS),
    "brown_mcphee 1e-4": lambda: BrownMcPhee(v_t=1e-4, **LEVELS),
    "lugre 1e5 N/m": lambda: LuGre(v_s=1e-2, sigma_0=1e5, sigma_1=300.0, sigma_2=0.0, **LEVELS),
    "exact_coulomb": lambda: ExactCoulomb(mu_s=6.0, mu_d=4.0),
}


def receding() -> Problem:
    """Return the problem of a drive that moves to a position and stays, with 20 steps of 10 ms."""
    cost = track("x", "goal", 900.0) + track("v", 0.0, 1.0) + effort("force", 1e-3)
    cost += at_end(lambda s: 100.0 * (s.x - s.goal) ** 2 + s.v**2)
    stage = _drive(guide(1e-2))
    return Problem(
        Phase(stage, T=STEP * HORIZON), cost, bounds={"force": (-20.0, 20.0)}, p={"goal": 0.0}
    )


def controllers(quick: bool) -> Iterator[Found]:
    """Measure a controller that moves each plant between two positions.

    Unreported failures are cycles that report convergence although they did not converge.
    """
    controller = receding().to_mpc(step=STEP)
    cycles = CYCLES // 10 if quick else CYCLES

    def goal(times: Array) -> Array:
        """Return `GOAL` in every other second, and 0 otherwise."""
        return GOAL * (np.floor(times + 1e-9) % 2 == 0)

    for name, law in PLANTS.items():
        found = controller.simulate(_drive(law()), cycles * STEP, {"goal": goal})
        moved = min(int(np.searchsorted(found.t, LOOK)), found.t.size - 1)
        yield MPC, {
            "plant": name, "cycles": found.t.size, "median time per cycle [ms]": 1e3 * found.median,
            "largest time [ms]": 1e3 * found.worst,
            "largest processor time [ms]": 1e3 * found.worst_cpu,
            "most QPs per cycle": int(found.iterations.max()), "failed cycles": found.unconverged,
            "unreported failures": found.unreported,
            "distance from the goal [mm]": 1e3 * abs(float(found["x"][moved]) - GOAL),
            "controller": "C" if find_compiler() else "Python",
        }  # fmt: skip
