"""Optimal control from random starts: how often symfric finds the best known solution.

A run counts as verified if the simulation of the model confirms it and, in problems with dry
friction, if the referee of `symfric bench ocp` finds no miss above 1e-4.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from math import inf, isfinite, nan
from statistics import median

import numpy as np

from ocp import Problem, Solution
from ocp.problems import READY, Ready
from ocp.solving.one_solve import starts_around
from ocp.solving.starts import initial_points
from ocp.transcription.schemes import Radau, make_meshes
from ocp.transcription.transcribe import discretise
from symfric.bench.ocp_cases import CASES
from symfric.bench.ocp_contenders import held, solved
from symfric.bench.ocp_referee import judged
from symfric.bench.report import Found, Progress, Report, timed
from symfric.foundation.numeric import Array

STARTS, RANDOM = 12, 50
QUICK = ("out_and_back", "pendulum", "brachistochrone")
NEAR, FAR = 0.1, 0.5
"""Spreads of the starts around the default guess, see `starts_of`."""
WANTED = 1e-4
"""Largest relative miss of a verified motion."""
BEST = 1e-3
"""Largest relative difference from the best cost that counts as equal."""
TITLE = "Optimal control from random starts: medians over the starts"


def bench(quick: bool = False, progress: Progress = None) -> Report:
    """Solve each problem from 12 near starts and, with friction, 50 far ones; hours.

    `quick` solves three problems from 3 near starts.
    """
    tasks: dict[str, Callable[[], Iterator[Found]]] = {
        f"{name}, {kind}": partial(_runs, ready, kind, count, scale)
        for name, ready in READY.items()
        if not quick or name in QUICK
        for kind, count, scale in (("near", 3 if quick else STARTS, NEAR), ("far", RANDOM, FAR))
        if kind == "near" or (ready.friction and not quick)
    }
    return Report().collect(tasks, progress)


def _runs(ready: Ready, kind: str, count: int, scale: float) -> Iterator[Found]:
    problem = ready.make()
    runs = [
        timed(partial(solved, problem, guess=guess)) for guess in starts_of(problem, count, scale)
    ]
    yield row_of(ready, kind, runs)


def row_of(ready: Ready, kind: str, runs: Sequence[tuple[float, Solution]]) -> Found:
    """Return medians over runs (processor time, solution).

    The best cost is the known cost or the best of these runs.
    """
    found = [solution for _, solution in runs]
    misses = [missed(ready.name, solution) for solution in found]
    good = [s.verified and not miss > WANTED for s, miss in zip(found, misses, strict=True)]
    held = [s.cost for s, verified in zip(found, good, strict=True) if verified]
    known = ready.optimum if isfinite(ready.optimum) else min(held, default=nan)
    cost, size = median(s.cost for s in found), abs(known) or 1.0
    share = 100.0 / len(runs)
    return TITLE, {
        "case": ready.name, "starts": f"{len(runs)} {kind}",
        "reported as solved [%]": share * sum(s.status.ok for s in found),
        "verified [%]": share * sum(good),
        "best cost reached [%]": share * sum(c <= known + BEST * size for c in held),
        "cost J": cost, "best known J": ready.optimum,
        "cost above the best [%]": 100.0 * (cost - known) / size,
        "relative miss": median(inf if miss != miss else miss for miss in misses),
        "iterations": median(s.iterations for s in found),
        "processor time [s]": median(seconds for seconds, _ in runs),
    }  # fmt: skip


def missed(name: str, solution: Solution) -> float:
    """Return the relative miss under exact friction; 0 for problems without friction."""
    cases = [case for case in CASES if case.name == name]
    return judged(cases[0], *held(solution)).miss if cases else 0.0


def starts_of(problem: Problem, count: int, scale: float) -> Iterator[dict[str, Array]]:
    """Yield guesses of all states and inputs by name; the first near start is the default one.

    The others deviate from it by the random waves of `starts_around`, with the spread `scale`.
    """
    into, model = discretise(problem, Radau()).on(make_meshes(problem, 50)), problem.spans[0].model
    first = int(scale != NEAR)
    for start in starts_around(into, initial_points(into), range(first, first + count), scale):
        ends = np.cumsum([span.T for span in start.spans])
        parts = [*zip(into.meshes, start.spans, ends, strict=True)]
        at = np.concatenate([end - span.T + span.T * mesh for mesh, span, end in parts])
        rows = np.hstack([np.vstack([s.nodes, np.hstack([s.u, s.u[:, -1:]])]) for s in start.spans])
        times = np.linspace(0.0, at[-1], 201)
        names = (v.name for v in (*model.x, *model.u))
        yield {n: np.interp(times, at, row) for n, row in zip(names, rows, strict=True)}
