"""Whether the user's model, under the control that was optimised, does what was requested.

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
"""How often the neighbourhood of the worst time is looked at again, and in how many parts."""
PLACES = {0.0: "start", 1.0: "end"}
TOLERANCE = 1e-3
"""Relative miss that is allowed unless somebody says otherwise."""
SMALL = 0.1
"""Where local errors are below this many tolerances and the end is missed, errors have grown."""
MOST_RESTARTS = 60


def at_nodes(run: Run) -> Iterator[Miss]:
    """States and rows at the start, the via points and the end of a span."""
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
    """Rows there; inputs and algebraic variables in them are those of the interval before."""
    rows = run.arc.span.rows_at.get(fraction, ())
    before = time if fraction == 0.0 else max(np.nextafter(time, -np.inf), run.begin)
    values = run.of(stacked(row.expression for row in rows), before)[:, 0]
    for row, value in zip(rows, values.tolist(), strict=True):
        yield _miss(what, row.name, time, value, (row.lower, row.upper), _row_size(row, value))


def against_optimised(run: Run) -> Iterator[Miss]:
    """States at the end of the run against where the optimiser had them, if no value was asked."""
    arc = run.arc
    node = int(np.argmin(np.abs(arc.times - run.end)))
    model = arc.span.model
    asked = arc.span.nodes[1.0] if run.at_end else {}
    values = run.of(model.vector("x"), run.end)[:, 0]
    for v, value, wanted, size in zip(
        model.x, values.tolist(), arc.nodes[:, node].tolist(), arc.sizes.tolist(), strict=True
    ):
        if not fixed(asked.get(v.name, FREE)):
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
    """Bounds and path conditions where the runs of one arc keep them worst, over all steps."""
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
    """In which intervals a bound or path condition is left by more than `tolerance`, (N,)."""
    found = np.zeros(run.arc.intervals, dtype=bool)
    looks = run.looks
    interval = np.searchsorted(run.arc.times, looks, side="right") - 1
    for kept in _kept(run.arc):
        values = run.of(kept.expression, looks)[0]
        outside = _outside(values, kept.box) > tolerance * _magnitude(kept.box, values)
        found[np.minimum(interval[outside], found.size - 1)] = True
    return found


def joined(before: Run, after: Run) -> Iterator[Miss]:
    """Conditions between the end of a span and the start of the next one."""
    if not after.arc.span.joins:
        return
    arguments = [*_signals(before, before.end), *_signals(after, after.begin)]
    for join in after.arc.span.joins:
        value = float(ca.DM(join.function(*arguments)))
        box = (join.lower, join.upper)
        bounds = [abs(b) for b in box if b and isfinite(b)]
        yield _miss("joint", join.name, before.end, value, box, max([*bounds, abs(value)]) or 1.0)


def _signals(run: Run, time: float) -> list[Array]:
    """[t, x, z, u, p] at one time."""
    model = run.arc.span.model
    values = [run.of(model.vector(letter), time)[:, 0] for letter in "xzu"]
    return [np.array([time]), *values, run.arc.p]


def periodic(problem: Problem, first: Run, last: Run) -> Iterator[Miss]:
    """States that end as they start."""
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
    """Something that holds over a whole span."""

    kind: str
    name: str
    expression: ca.SX
    box: Box
    unit: str = ""


def _kept(arc: Arc) -> list[_Kept]:
    """Bounds of states and algebraic variables, and path conditions."""
    span = arc.span
    known = [v for v in (*span.model.x, *span.model.z) if span.box(v.name) != FREE]
    bounds = [_Kept("bound", v.name, v.symbol, span.box(v.name), v.unit) for v in known]
    rows = [_Kept("path", row.name, row.expression, (row.lower, row.upper)) for row in span.path]
    return bounds + rows


def _worst(run: Run, kept: _Kept, looks: Array, values: Array) -> tuple[float, float]:
    """Time and value where a range is left farthest, refined between the `looks`."""
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
    """Of a condition: of its bounds and of its values."""
    bounds = [abs(b) for b in box if isfinite(b)]
    return max([*bounds, float(np.abs(values).max(initial=0.0))])


def _outside(values: Array, box: Box) -> Array:
    """How far values are outside of a range; negative inside; inf for what is no number."""
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
    """When the node at a fraction is [s]."""
    return float(arc.times[int(np.argmin(np.abs(arc.mesh - fraction)))])


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
    """Everything that runs were to do; with `optimised` their ends against those of the solver."""
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
