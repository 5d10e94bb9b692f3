"""Verification of the user's model under the optimised control.

Conditions are evaluated on simulated runs: at nodes, and everywhere between.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, pairwise
from math import isfinite
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.checking.interval_errors import local_errors
from ocp.checking.resimulate import RTOL, Arc, Run, arcs_of, resimulated, run_from
from ocp.checking.verification import Miss, Verification
from ocp.formulation.phase import FREE, Box, Row, fixed
from ocp.formulation.problem import Problem
from ocp.solving.solution import Solution
from symfric.foundation import checks
from symfric.foundation.status import Status
from symfric.foundation.variable import stacked

Array = NDArray[np.float64]
CLOSER, PARTS = 2, 16
"""Refinements of the worst time, and parts of its neighbourhood in each."""
PLACES = {0.0: "start", 1.0: "end"}
TOLERANCE = 1e-3
"""Default of the largest permitted relative miss."""
SMALL = 0.1
"""Local errors below this many tolerances indicate error growth if the end is missed."""
MOST_RESTARTS = 60


def at_nodes(run: Run) -> Iterator[Miss]:
    """Yield the misses of states and rows at the start, the via points and the end of a phase."""
    arc, span = run.arc, run.arc.span
    for fraction, boxes in span.nodes.items():
        time = _time(arc, fraction)
        if not run.begin <= time <= run.end:
            continue
        what = PLACES.get(fraction, "via")
        values = run.of(span.model.vector("x"), time)[:, 0]
        for v, value, size in zip(span.model.x, values.tolist(), arc.sizes.tolist(), strict=True):
            if boxes[v.name] != span.box(v.name):
                yield _miss(what, v.name, time, value, boxes[v.name], size, v.unit)
        yield from _rows_at(run, what, fraction, time)


def _rows_at(run: Run, what: str, fraction: float, time: float) -> Iterator[Miss]:
    """Yield the misses of rows; inputs and algebraic variables are from the interval before."""
    rows = run.arc.span.rows_at.get(fraction, ())
    before = time if fraction == 0.0 else max(np.nextafter(time, -np.inf), run.begin)
    values = run.of(stacked(row.expression for row in rows), before)[:, 0]
    for row, value in zip(rows, values.tolist(), strict=True):
        yield _miss(what, row.name, time, value, (row.lower, row.upper), _row_size(row, value))


def against_optimised(run: Run) -> Iterator[Miss]:
    """Yield the misses of states at the end against their optimised values, if not prescribed."""
    arc = run.arc
    node = int(np.argmin(np.abs(arc.times - run.end)))
    model = arc.span.model
    prescribed = arc.span.nodes[1.0] if run.at_end else {}
    values = run.of(model.vector("x"), run.end)[:, 0]
    for v, value, wanted, size in zip(
        model.x, values.tolist(), arc.nodes[:, node].tolist(), arc.sizes.tolist(), strict=True
    ):
        if not fixed(prescribed.get(v.name, FREE)):
            yield Miss(
                what="motion",
                name=v.name,
                time=run.end,
                value=value,
                wanted=wanted,
                size=size,
                unit=v.unit,
            )


def between_nodes(runs: Sequence[Run]) -> Iterator[Miss]:
    """Yield the worst violations of bounds and path conditions by the runs of one arc."""
    for kept in _kept(runs[0].arc):
        size, worst = _magnitude(kept.box, np.zeros(0)), (-np.inf, 0.0, 0.0)
        for run in runs:
            looks = run.looks
            values = run.of(kept.expression, looks)[0]
            size = max(size, _magnitude(kept.box, values))
            time, value = _worst(run, kept, looks, values)
            outside = float(_outside(np.array([value]), kept.box)[0])
            worst = max(worst, (outside, time, value), key=lambda at: at[0])
        yield _miss(kept.kind, kept.name, *worst[1:], kept.box, size, kept.unit)


def left_between(run: Run, tolerance: float) -> NDArray[np.bool_]:
    """Return a mask of intervals with a bound or path violation above `tolerance`, (N,)."""
    found = np.zeros(run.arc.intervals, dtype=bool)
    looks = run.looks
    interval = np.searchsorted(run.arc.times, looks, side="right") - 1
    for kept in _kept(run.arc):
        values = run.of(kept.expression, looks)[0]
        outside = _outside(values, kept.box) > tolerance * _magnitude(kept.box, values)
        found[np.minimum(interval[outside], found.size - 1)] = True
    return found


def joined(before: Run, after: Run) -> Iterator[Miss]:
    """Yield the misses of conditions between the end of a phase and the start of the next one."""
    if not after.arc.span.joins:
        return
    arguments = [*_signals(before, before.end), *_signals(after, after.begin)]
    for join in after.arc.span.joins:
        value = float(ca.DM(join.function(*arguments)))
        box = (join.lower, join.upper)
        bounds = [abs(b) for b in box if b and isfinite(b)]
        yield _miss("joint", join.name, before.end, value, box, max([*bounds, abs(value)]) or 1.0)


def _signals(run: Run, time: float) -> list[Array]:
    """Return [t, x, z, u, p] at one time."""
    model = run.arc.span.model
    values = [run.of(model.vector(letter), time)[:, 0] for letter in "xzu"]
    return [np.array([time]), *values, run.arc.p]


def periodic(problem: Problem, first: Run, last: Run) -> Iterator[Miss]:
    """Yield the misses of periodic states."""
    for name in problem.periodic:
        model = first.arc.span.model
        v = next(v for v in model.x if v.name == name)
        start = first.of(v.symbol, first.begin)[0, 0]
        end = last.of(last.arc.span.model.expression(name), last.end)[0, 0]
        size = first.arc.sizes[[x.name for x in model.x].index(name)]
        yield Miss(
            what="period",
            name=name,
            time=last.end,
            value=float(end),
            wanted=float(start),
            size=float(size),
            unit=v.unit,
        )


@final
@dataclass(frozen=True, eq=False)
class _Kept:
    """A condition over a whole phase."""

    kind: str
    name: str
    expression: ca.SX
    box: Box
    unit: str = ""


def _kept(arc: Arc) -> list[_Kept]:
    """Return bounds of states and algebraic variables, and path conditions."""
    span = arc.span
    known = [v for v in (*span.model.x, *span.model.z) if span.box(v.name) != FREE]
    bounds = [_Kept("bound", v.name, v.symbol, span.box(v.name), v.unit) for v in known]
    rows = [_Kept("path", row.name, row.expression, (row.lower, row.upper)) for row in span.path]
    return bounds + rows


def _worst(run: Run, kept: _Kept, looks: Array, values: Array) -> tuple[float, float]:
    """Return time and value of the worst violation of a range, refined between the `looks`."""
    j = int(np.argmax(_outside(values, kept.box)))
    best = (float(_outside(values[j : j + 1], kept.box)[0]), float(looks[j]), float(values[j]))
    low, high = looks[max(j - 1, 0)], looks[min(j + 1, looks.size - 1)]
    for _ in range(CLOSER):
        at = np.linspace(low, high, PARTS + 1)
        near = run.of(kept.expression, at)[0]
        outside = _outside(near, kept.box)
        k = int(np.argmax(outside))
        low, high = at[max(k - 1, 0)], at[min(k + 1, PARTS)]
        best = max(best, (float(outside[k]), float(at[k]), float(near[k])), key=lambda x: x[0])
    return best[1:]


def _magnitude(box: Box, values: Array) -> float:
    """Return the magnitude of a condition, from its bounds and values."""
    bounds = [abs(b) for b in box if isfinite(b)]
    return max([*bounds, float(np.abs(values).max(initial=0.0))])


def _outside(values: Array, box: Box) -> Array:
    """Return the distance of values from a range; negative inside; inf for NaN."""
    outside = np.maximum(values - box[1], box[0] - values)
    return np.where(np.isnan(outside), np.inf, outside)


def _miss(
    what: str, name: str, time: float, value: float, box: Box, size: float, unit: str = ""
) -> Miss:
    wanted = min(max(value, box[0]), box[1]) if value == value else box[0]
    return Miss(what=what, name=name, time=time, value=value, wanted=wanted, size=size, unit=unit)


def _row_size(row: Row, value: float) -> float:
    return max(row.nominal, abs(value)) if isfinite(value) else row.nominal


def _time(arc: Arc, fraction: float) -> float:
    """Return the time of the node at a fraction [s]."""
    return float(arc.times[int(np.argmin(np.abs(arc.mesh - fraction)))])


def verify(solution: Solution, tolerance: float = TOLERANCE, rtol: float = RTOL) -> Verification:
    """Simulate the user's model under the control of `solution`, and check all conditions.

    One run from the start through all phases, joined by their links, with the inputs held on each
    interval (for an input with bounded rate, the rate is held). Checked are the start, via points
    and the end, joints and periodicity, bounds and path conditions over all steps of the simulation
    and not only at points of the mesh, states at the end of each phase against their optimised
    values, the cost by quadrature of the simulated motion, and the local error of each interval.

    An unstable motion cannot be simulated from its start over many times the inverse of its growth
    rate, in any arithmetic: errors of 1e-16 grow until they dominate. If the single intervals are
    accurate but the end is missed, the simulation is restarted at the nodes where it has departed,
    and its result is added as `restarted`; but the control alone does not meet the conditions, so
    the solution is not verified.

    Args:
        solution: of any solver.
        tolerance: relative to the largest magnitude of a state in its phase (at least a thousandth
            of its nominal value), or of the bounds and values of a condition.
        rtol: of the simulation.

    Raises:
        ValueError: not a solution, or a tolerance that is not above zero.
    """
    checks.kind("verify", solution, Solution, "a solution, such as solve(...)")
    tolerance = checks.number("verify: tolerance", tolerance, above=0.0)
    arcs = arcs_of(solution.problem, solution.meshes, solution.points)
    return verified_arcs(solution.problem, arcs, solution.cost, tolerance, rtol)


def verified(solution: Solution, tolerance: float = TOLERANCE) -> Solution:
    """Return `solution` with its verification, whose status replaces a success if it fails."""
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
    """Verify arcs that were optimised at `cost`."""
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
    """Return the verification from runs of the arcs, in the order of time."""
    bad = next((run for run in runs if not run.ok), None)
    value = float("nan") if bad else cost_of(problem, runs)
    checked = [*looked(problem, runs), *map(_local, arcs, errors)]
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


def looked(problem: Problem, runs: Sequence[Run], *, optimised: bool = True) -> Iterator[Miss]:
    """Yield the misses of all conditions; with `optimised` also of the optimised ends."""
    for _, of_arc in groupby(runs, lambda run: run.arc.number):
        yield from between_nodes(list(of_arc))
    for run in runs:
        if run.trajectory.span[1] < run.end:
            continue
        yield from at_nodes(run)
        yield from against_optimised(run) if optimised else ()
    for before, after in pairwise(runs):
        if before.ok and after.ok and after.arc.number == before.arc.number + 1:
            yield from joined(before, after) if after.arc.span.phase else ()
    if problem.periodic:
        phases = len(problem.chain)
        for first in (run for run in runs if run.arc.span.phase == 0 and run.at_start):
            last = [r for r in runs if r.arc.number == first.arc.number + phases - 1 and r.at_end]
            yield from periodic(problem, first, last[-1]) if last and last[-1].ok else ()


def _local(arc: Arc, errors: Array) -> Miss:
    """Return the interval with the largest local error as a miss."""
    k = int(np.argmax(errors))
    name = arc.span.name
    return Miss("local error", name, float(arc.times[k]), float(errors[k]), 0.0, 1.0)


def cost_of(problem: Problem, runs: Sequence[Run]) -> float:
    """Return J of the simulated motion: the mean, the sum or the largest of its scenarios."""
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
    """Return the reference magnitude of the cost: J, or its largest part."""
    parts = [abs(cost)]
    for run in runs:
        running = run.arc.span.running
        parts.append(abs(run.integral(running)))
    return max(parts) or 1.0


def near_runs(arcs: Sequence[Arc], tolerance: float) -> tuple[Run, ...]:
    """Return runs from optimised nodes that stay near the optimised motion; empty on failure."""
    return _restarted(arcs, tolerance, RTOL)[0]


def _restarted(
    arcs: Sequence[Arc], tolerance: float, rtol: float
) -> tuple[tuple[Run, ...], tuple[float, ...]]:
    """Simulate with restarts at the optimised nodes wherever the motion has departed.

    Returns:
        The runs and the times of restarts; both empty if not even single intervals agree.
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
    """Return the last node up to which the run is near all optimised ones."""
    arc = run.arc
    reached = arc.times[node:] <= run.trajectory.span[1]
    times = arc.times[node:][reached]
    x = run.of(arc.span.model.vector("x"), times)
    off = np.abs(x - arc.nodes[:, node : node + times.size]) / arc.sizes[:, None]
    near = (off <= tolerance).all(axis=0)
    return node + (times.size if near.all() else int(np.argmin(near))) - 1
