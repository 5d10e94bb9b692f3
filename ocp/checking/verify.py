"""Whether the user's model, under the control that was optimised, does what was asked for."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby, pairwise

import numpy as np
from numpy.typing import NDArray

from ocp.checking.arcs import Arc, arcs_of
from ocp.checking.conditions import against_optimised, at_nodes, between_nodes, joined, periodic
from ocp.checking.local_errors import local_errors
from ocp.checking.resimulate import RTOL, Run, resimulated, run_from
from ocp.checking.verification import Miss, Verification
from ocp.formulation.problem import Problem
from ocp.result.solution import Solution
from symfric.foundation import checks
from symfric.foundation.status import Status

Array = NDArray[np.float64]

TOLERANCE = 1e-3
"""Relative miss that is allowed unless somebody says otherwise."""
SMALL = 0.1
"""Where local errors are below this many tolerances and the end is missed, errors have grown."""
MOST_RESTARTS = 60


def verify(solution: Solution, tolerance: float = TOLERANCE, rtol: float = RTOL) -> Verification:
    """Simulate the user's model under the control of `solution`, and look at all it was to do.

    One run from the start through all phases, joined by their links, with the inputs held on each
    interval (of an input with bounded rate, the rate is held). Looked at are the start, via points
    and the end, joints and periodicity, bounds and path conditions over all steps of the simulation
    and not only at points of the mesh, states at the end of each phase against their optimised
    values, the cost by quadrature of the simulated motion, and the local error of each interval.

    A motion that is unstable by itself cannot be simulated from its start over many times the
    inverse of its rate of growth, in any arithmetic: errors of 1e-16 grow to be all there is. Where
    the intervals by themselves are right and the end is missed all the same, the simulation is
    started again at the nodes where it has departed, and what it says is told beside, under
    `restarted`; but the control alone does not do what was asked for, so that it is not verified.

    Args:
        solution: of any solver.
        tolerance: relative to the largest magnitude of a state on its way (at least a thousandth
            of its nominal value), of a condition to that of its bounds and its values.
        rtol: of the simulation.

    Raises:
        ValueError: no solution, or a tolerance that is not above zero.
    """
    checks.kind("verify", solution, Solution, "a solution, such as solve(...)")
    tolerance = checks.number("verify: tolerance", tolerance, above=0.0)
    arcs = arcs_of(solution.problem, solution.meshes, solution.points)
    return verified_arcs(solution.problem, arcs, solution.cost, tolerance, rtol)


def verified(solution: Solution, tolerance: float = TOLERANCE) -> Solution:
    """`solution` with its verification; one that misses is no success, whatever the solver says."""
    verification = verify(solution, tolerance)
    checked = replace(solution, verification=verification)
    if verification.ok or not solution.status.ok:
        return checked
    return replace(
        checked,
        status=verification.status,
        message=f"ocp '{solution.problem.name}': {verification.sentence}",
    )


def verified_arcs(
    problem: Problem,
    arcs: Sequence[Arc],
    cost: float,
    tolerance: float = TOLERANCE,
    rtol: float = RTOL,
) -> Verification:
    """The verification of arcs that were optimised at `cost`."""
    errors = local_errors(arcs, min(1e-6, 1e-2 * tolerance))
    found = _judged(problem, arcs, resimulated(arcs, rtol), errors, cost, tolerance, rtol)
    local = max((float(e.max()) for e in errors), default=0.0)
    if found.ok or not local <= SMALL * tolerance:
        return found
    runs, restarts = _restarted(arcs, tolerance, rtol)
    if not restarts:
        return found
    again = _judged(problem, arcs, runs, errors, cost, tolerance, rtol)
    off = max(m.relative for m in found.checked if m.what in ("end", "motion", "local error"))
    return replace(found, restarted=again, restarts=restarts, growth=off / max(local, rtol))


def _judged(
    problem: Problem,
    arcs: Sequence[Arc],
    runs: Sequence[Run],
    errors: Sequence[Array],
    cost: float,
    tolerance: float,
    rtol: float,
) -> Verification:
    """What runs of the arcs, in the order of time, say."""
    bad = next((run for run in runs if not run.ok), None)
    value = float("nan") if bad else cost_of(problem, runs)
    checked = [*_looked(problem, runs), *map(_local, arcs, errors)]
    if bad is None:
        checked.append(Miss("cost", "the cost", runs[-1].end, value, cost, _size(runs, value)))
    return Verification(
        tolerance=tolerance,
        rtol=rtol,
        checked=tuple(sorted(checked, key=lambda miss: -miss.relative)),
        local_errors=tuple(errors),
        trajectories=tuple(run.trajectory for run in runs),
        cost=value,
        failed="" if bad is None else bad.trajectory.message,
        failure=Status.SUCCESS if bad is None else bad.trajectory.status,
    )


def _looked(problem: Problem, runs: Sequence[Run]) -> Iterator[Miss]:
    """Everything that runs were to do."""
    for _, of_arc in groupby(runs, lambda run: run.arc.number):
        yield from between_nodes(list(of_arc))
    for run in runs:
        if run.trajectory.span[1] < run.end:
            continue
        yield from at_nodes(run)
        yield from against_optimised(run)
    for before, after in pairwise(runs):
        if before.ok and after.ok and after.arc.number == before.arc.number + 1:
            yield from joined(before, after) if after.arc.span.phase else ()
    if problem.periodic:
        phases = len(problem.chain)
        for first in (run for run in runs if run.arc.span.phase == 0 and run.at_start):
            last = [r for r in runs if r.arc.number == first.arc.number + phases - 1 and r.at_end]
            yield from periodic(problem, first, last[-1]) if last and last[-1].ok else ()


def _local(arc: Arc, errors: Array) -> Miss:
    """The interval with the largest local error."""
    k = int(np.argmax(errors))
    name = arc.span.name
    return Miss("local error", name, float(arc.times[k]), float(errors[k]), 0.0, 1.0)


def cost_of(problem: Problem, runs: Sequence[Run]) -> float:
    """J of the simulated motion: of its scenarios the mean, the sum or the worst."""
    shares: dict[int, float] = {}
    for run in runs:
        span = run.arc.span
        share = run.integral(span.running)
        if run.at_end and not span.end.is_zero():
            share += float(run.of(span.end, run.end)[0, 0])
        shares[span.scenario] = shares.get(span.scenario, 0.0) + share
    values = list(shares.values())
    if problem.kind == "worst":
        return max(values)
    return sum(values) / (len(values) if problem.kind == "mean" else 1)


def _size(runs: Sequence[Run], cost: float) -> float:
    """What a difference of the cost is relative to: J, or what it is the difference of."""
    parts = [abs(cost)]
    for run in runs:
        running = run.arc.span.running
        parts.append(abs(run.integral(running)))
    return max(parts) or 1.0


def near_runs(arcs: Sequence[Arc], tolerance: float) -> tuple[Run, ...]:
    """Runs from optimised nodes that stay near the optimised motion; none where that fails."""
    return _restarted(arcs, tolerance, RTOL)[0]


def _restarted(
    arcs: Sequence[Arc], tolerance: float, rtol: float
) -> tuple[tuple[Run, ...], tuple[float, ...]]:
    """Runs that start again at the optimised nodes wherever they have departed from them.

    Returns:
        The runs and the times of restarts; no restarts where not even single intervals agree.
    """
    runs: list[Run] = []
    restarts: list[float] = []
    for arc in arcs:
        node = 0
        while node < arc.intervals:
            run = run_from(arc, node, arc.state(node), rtol)
            last = _departs(run, node, tolerance / 10)
            if last == node or len(restarts) >= MOST_RESTARTS:
                return (), ()
            runs.append(replace(run, end=float(arc.times[last])))
            if last < arc.intervals:
                restarts.append(float(arc.times[last]))
            node = last
    return tuple(runs), tuple(restarts)


def _departs(run: Run, node: int, tolerance: float) -> int:
    """The last node up to which the run is near all optimised ones."""
    arc = run.arc
    reached = arc.times[node:] <= run.trajectory.span[1]
    times = arc.times[node:][reached]
    x = run.of(arc.span.model.vector("x"), times)
    off = np.abs(x - arc.nodes[:, node : node + times.size]) / arc.sizes[:, None]
    near = (off <= tolerance).all(axis=0)
    return node + (times.size if near.all() else int(np.argmin(near))) - 1
