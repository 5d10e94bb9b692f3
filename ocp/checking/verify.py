"""Verification of the user's model under the optimised control.

All conditions are evaluated on simulated runs, at the nodes of the mesh and between them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby, pairwise
from math import isfinite, prod
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.checking.interval_errors import local_errors
from ocp.checking.resimulate import RTOL, Arc, SimulatedArc, arcs_of, resimulated, run_from
from ocp.formulation.phase import FREE, Array, Box, Row, fixed, size_of
from ocp.formulation.problem import Problem
from ocp.solving.solution import Solution
from ocp.solving.verification import Miss, Verification
from symfric.foundation import checks
from symfric.foundation.status import Status
from symfric.foundation.variable import stacked

CLOSER, PARTS = 2, 16
"""Number of refinements of the worst time, and of parts of its neighbourhood in each."""
TOLERANCE = 1e-3
"""Default value of the largest permitted relative miss."""
SMALL = 0.1
"""Local error, in tolerances, below which a missed end indicates error growth."""
MOST_RESTARTS = 60


def _miss(
    what: str, name: str, time: float, value: float, box: Box, size: float, unit: str = ""
) -> Miss:
    """Return a condition whose `wanted` value is the nearest one in its range."""
    wanted = min(max(value, box[0]), box[1]) if value == value else box[0]
    return Miss(what, name, float(time), float(value), float(wanted), float(size), unit)


def _at_nodes(run: SimulatedArc) -> Iterator[Miss]:
    """Yield the misses of states and rows at the start, the via points and the end of a phase.

    Inputs and algebraic variables in rows are those of the preceding interval.
    """
    arc, span = run.arc, run.arc.span
    for fraction, boxes in span.nodes.items():
        time = float(arc.times[int(np.argmin(np.abs(arc.mesh - fraction)))])
        if not run.begin <= time <= run.end:
            continue
        what = {0.0: "start", 1.0: "end"}.get(fraction, "via")
        values = run.of(span.model.vector("x"), time)[:, 0]
        for v, value, size in zip(span.model.x, values, arc.sizes, strict=True):
            if boxes[v.name] != span.boxes[v.name]:
                yield _miss(what, v.name, time, value, boxes[v.name], size, v.unit)
        rows = span.rows_at.get(fraction, ())
        before = time if fraction == 0.0 else max(np.nextafter(time, -np.inf), run.begin)
        values = run.of(stacked(row.expression for row in rows), before)[:, 0]
        for row, value in zip(rows, values, strict=True):
            size = max(row.nominal, abs(value)) if isfinite(value) else row.nominal
            yield _miss(what, row.name, time, value, (row.lower, row.upper), size)


def _against_optimised(run: SimulatedArc) -> Iterator[Miss]:
    """Yield the differences of states that are not prescribed from their optimised end values."""
    arc, model = run.arc, run.arc.span.model
    node = int(np.argmin(np.abs(arc.times - run.end)))
    prescribed = arc.span.nodes[1.0] if run.at_end else {}
    values = run.of(model.vector("x"), run.end)[:, 0]
    for v, value, wanted, size in zip(model.x, values, arc.nodes[:, node], arc.sizes, strict=True):
        if not fixed(prescribed.get(v.name, FREE)):
            yield _miss("motion", v.name, run.end, value, (wanted, wanted), size, v.unit)


class _Kept(NamedTuple):
    """Condition that holds over a whole phase."""

    kind: str
    name: str
    expression: ca.SX
    box: Box
    unit: str = ""
    parts: tuple[ca.SX, ...] = ()
    least: float = 0.0

    @staticmethod
    def of(row: Row) -> "_Kept":
        """Return a path condition."""
        return _Kept("path", row.name, row.expression, (row.lower, row.upper), parts=row.parts)

    def outside(self, values: Array) -> Array:
        """Return the distance of values from the range: negative inside, inf for NaN."""
        outside = np.maximum(values - self.box[1], self.box[0] - values)
        return np.where(np.isnan(outside), np.inf, outside)

    def magnitude(self, run: SimulatedArc, times: Array) -> float:
        """Return the largest magnitude of the bounds and of the values at `times`, or `least`.

        The magnitude of a product is that of its factors.
        """
        bounds = [abs(b) for b in self.box if isfinite(b)]
        sizes = (float(np.abs(run.of(e, times)).max()) for e in self.parts or [self.expression])
        return max([*bounds, prod(sizes), self.least])


def _kept(arc: Arc, *, peaks: bool) -> list[_Kept]:
    """Return the bounds of states and algebraic variables, and the path conditions.

    Conditions that define costs of largest values are included if `peaks`.
    """
    span = arc.span
    sizes = dict(zip((v.name for v in span.model.x), arc.sizes.tolist(), strict=True))
    bounds = [
        _Kept("bound", v.name, v.symbol, box, v.unit, least=sizes.get(v.name, 0.0))
        for v in (*span.model.x, *span.model.z)
        if (box := span.boxes[v.name]) != FREE
    ]
    return bounds + [_Kept.of(row) for row in span.path if peaks or not row.is_peak]


def _between_nodes(runs: Sequence[SimulatedArc]) -> Iterator[Miss]:
    """Yield the worst violation of each bound and path condition in the runs of one arc."""
    for kept in _kept(runs[0].arc, peaks=False):
        size = max(kept.magnitude(run, run.looks) for run in runs)
        worst = max((_worst(run, kept) for run in runs), key=lambda at: at[0])
        yield _miss(kept.kind, kept.name, *worst[1:], kept.box, size, kept.unit)


def _worst(run: SimulatedArc, kept: _Kept) -> tuple[float, float, float]:
    """Return the worst violation of a range, its time and its value, refined between steps."""
    looks = run.looks
    values = run.of(kept.expression, looks)[0]
    outside = kept.outside(values)
    j = int(np.argmax(outside))
    best = (float(outside[j]), float(looks[j]), float(values[j]))
    low, high = looks[max(j - 1, 0)], looks[min(j + 1, looks.size - 1)]
    for _ in range(CLOSER):
        at = np.linspace(low, high, PARTS + 1)
        near = run.of(kept.expression, at)[0]
        outside = kept.outside(near)
        k = int(np.argmax(outside))
        low, high = at[max(k - 1, 0)], at[min(k + 1, PARTS)]
        best = max(best, (float(outside[k]), float(at[k]), float(near[k])), key=lambda x: x[0])
    return best


def left_between(runs: Sequence[SimulatedArc], tolerance: float) -> NDArray[np.bool_]:
    """Return a mask (N,) of intervals that violate a bound or path condition by > `tolerance`.

    The tolerance is relative to the largest magnitude of the condition in all `runs` of the arc.
    """
    arc = runs[0].arc
    mask = np.zeros(arc.intervals, dtype=bool)
    for kept in _kept(arc, peaks=True):
        size = max(kept.magnitude(run, run.looks) for run in runs)
        for run in runs:
            outside = kept.outside(run.of(kept.expression, run.looks)[0]) > tolerance * size
            interval = np.searchsorted(arc.times, run.looks[outside], side="right") - 1
            mask[np.minimum(interval, mask.size - 1)] = True
    return mask


def _joined(before: SimulatedArc, after: SimulatedArc) -> Iterator[Miss]:
    """Yield the misses of joins between the end of a phase and the start of the next one."""
    for join in after.arc.span.joins:
        value = float(
            ca.DM(join.function(*before.signals(before.end), *after.signals(after.begin)))
        )
        box = (join.lower, join.upper)
        size = max(size_of(box, 0.0), abs(value)) or 1.0
        yield _miss("joint", join.name, before.end, value, box, size)


def _periodic(problem: Problem, first: SimulatedArc, last: SimulatedArc) -> Iterator[Miss]:
    """Yield the differences of periodic states between the end and the start."""
    model = first.arc.span.model
    for v, size in zip(model.x, first.arc.sizes, strict=True):
        if v.name in problem.periodic:
            start = first.of(v.symbol, first.begin)[0, 0]
            end = last.of(last.arc.span.model.expression(v.name), last.end)[0, 0]
            yield _miss("period", v.name, last.end, end, (start, start), size, v.unit)


def verify(solution: Solution, tolerance: float = TOLERANCE, rtol: float = RTOL) -> Verification:
    """Simulate the user's model under the control of `solution`, and check all conditions.

    The simulation runs from the start through all phases, joined by their links. Inputs are
    constant on each interval; for an input with bounded rate, its rate is constant. The function
    checks the conditions at the start, via points and the end, joints and periodicity; bounds and
    path conditions at all steps of the simulation, not only at points of the mesh; states at the
    end of each phase against their optimised values; the cost by quadrature over the simulated
    motion; and the local error of each interval. Local errors are the changes of the distance
    between both motions if this distance remains small; otherwise each interval is simulated from
    its first node.

    The simulation of an unstable motion fails over times much longer than the inverse of the growth
    rate, because rounding errors grow until they dominate. If the local errors are small but the
    end is missed, the simulation is repeated with restarts at the nodes where it has departed; the
    result is `restarted`. The solution is not verified in this case, because the control alone does
    not satisfy the conditions.

    Args:
        solution: solution by any method.
        tolerance: largest miss, relative to the largest magnitude of a state in its phase (at least
            a thousandth of its nominal value), or of the bounds and values of a condition.
        rtol: relative tolerance of the simulation.

    Raises:
        ValueError: not a solution, or a tolerance that is not positive.
    """
    checks.kind("verify", solution, Solution, "a solution, such as solve(...)")
    tolerance = checks.number("verify: tolerance", tolerance, above=0.0)
    arcs = arcs_of(solution.problem, solution.meshes, solution.points)
    return verified_arcs(solution.problem, arcs, solution.cost, tolerance, rtol)


def verified(solution: Solution, tolerance: float = TOLERANCE) -> Solution:
    """Return `solution` with its verification, and with its status if the verification fails."""
    verification = verify(solution, tolerance)
    checked = replace(solution, verification=verification)
    if verification.ok or not solution.status.ok:
        return checked
    message = f"ocp '{solution.problem.name}': {verification.sentence}"
    return replace(checked, status=verification.status, message=message)


def confirmed(solution: Solution) -> bool:
    """Return True if the simulation confirms the motion, even if its solve was stopped."""
    return solution.verification is not None and solution.verification.ok


def verified_arcs(
    problem: Problem, arcs: Sequence[Arc], cost: float, tolerance: float = TOLERANCE,
    rtol: float = RTOL,
) -> Verification:  # fmt: skip
    """Verify optimised arcs whose optimised cost is `cost`; see `verify`."""

    def judged(runs: Sequence[SimulatedArc], errors: tuple[Array, ...]) -> Verification:
        """Return the verification of the arcs by `runs`, which are in the order of time."""
        bad = next((run.trajectory for run in runs if not run.ok), None)
        checked, value = [*misses_of(problem, runs)], float("nan")
        for arc, error in zip(arcs, errors, strict=True):
            k = int(np.argmax(error))
            at = float(arc.times[k]), float(error[k])
            checked.append(Miss("local error", arc.span.name, *at, 0.0, 1.0))
        if bad is None:
            value = cost_of(problem, runs)
            sizes = (abs(run.integral(run.arc.span.running)) for run in runs)
            size = max([abs(value), *sizes]) or 1.0
            checked.append(Miss("cost", "the cost", runs[-1].end, value, cost, size))
        failed = ("", Status.SUCCESS) if bad is None else (bad.message, bad.status)
        motions = tuple(run.trajectory for run in runs)
        worst_first = tuple(sorted(checked, key=lambda miss: -miss.relative))
        return Verification(tolerance, rtol, worst_first, errors, motions, value, *failed)

    runs = resimulated(arcs, rtol)
    drifts = _drifts(runs)
    if len(drifts) == len(arcs) and (found := judged(runs, drifts)).ok:
        return found
    errors = local_errors(arcs, min(1e-6, 1e-2 * tolerance))
    found = judged(runs, errors)
    local = max((float(e.max()) for e in errors), default=0.0)
    if found.ok or not local <= SMALL * tolerance:
        return found
    runs, restarts = restarted(arcs, tolerance, rtol)
    if not restarts:
        return found
    off = max(m.relative for m in found.checked if m.what in ("end", "motion", "local error"))
    growth = off / max(local, rtol)
    return replace(found, restarted=judged(runs, errors), restarts=restarts, growth=growth)


def _drifts(runs: Sequence[SimulatedArc]) -> tuple[Array, ...]:
    """Return the relative change of the distance from the optimised motion over each interval.

    It is the local error up to the growth of errors over one interval, and requires no simulation
    of single intervals. Failed runs are omitted.
    """
    found: list[Array] = []
    for run in filter(lambda run: run.ok, runs):
        x = run.of(run.arc.span.model.vector("x"), run.arc.times)
        off = np.diff(x - run.arc.nodes, axis=1) / run.arc.sizes[:, None]
        found.append(np.max(np.abs(off), axis=0, initial=0.0))
    return tuple(found)


def misses_of(
    problem: Problem, runs: Sequence[SimulatedArc], *, optimised: bool = True
) -> Iterator[Miss]:
    """Yield the misses of all conditions, and of optimised end values if `optimised`."""
    for _, of_arc in groupby(runs, lambda run: run.arc.number):
        yield from _between_nodes(list(of_arc))
    for run in runs:
        if run.trajectory.span[1] >= run.end:
            yield from _at_nodes(run)
            yield from _against_optimised(run) if optimised else ()
    for before, after in pairwise(runs):
        if before.ok and after.ok and after.arc.number == before.arc.number + 1:
            yield from _joined(before, after) if after.arc.span.phase else ()
    phases = len(problem.chain)
    for first in (run for run in runs if run.arc.span.phase == 0 and run.at_start):
        last = [r for r in runs if r.arc.number == first.arc.number + phases - 1 and r.at_end]
        if problem.periodic and last and last[-1].ok:
            yield from _periodic(problem, first, last[-1])


def cost_of(problem: Problem, runs: Sequence[SimulatedArc]) -> float:
    """Return J of the simulated motion: sum, or mean or largest value of the scenarios."""
    shares: dict[int, float] = {}
    for run in runs:
        span = run.arc.span
        share = run.integral(span.running)
        for row in span.penalised:
            kinks = [row.expression - b for b in {row.lower, row.upper} if isfinite(b)]
            share += run.integral(row.penalty, kinks)
        if run.at_end and not span.end.is_zero():
            share += float(run.of(span.end, run.end)[0, 0])
        shares[span.scenario] = shares.get(span.scenario, 0.0) + share
    for scenario, above in _above_largest(runs):
        shares[scenario] += above
    values = list(shares.values())
    if problem.kind == "worst":
        return max(values)
    return sum(values) / (len(values) if problem.kind == "mean" else 1)


def _above_largest(runs: Sequence[SimulatedArc]) -> Iterator[tuple[int, float]]:
    """Yield (scenario, difference of a cost `largest` from the state that bounds its values)."""
    values: dict[tuple[int, str], list[float]] = {}
    weights: dict[tuple[int, str], float] = {}
    for run in runs:
        span = run.arc.span
        for row in span.path:
            if row.is_peak:
                key = span.scenario, row.name
                values.setdefault(key, []).append(_worst(run, _Kept.of(row))[2])
                weights[key] = row.linear  # that of the last phase
    for key, found in values.items():
        yield key[0], weights[key] * max(found)


def restarted(
    arcs: Sequence[Arc], tolerance: float, rtol: float = RTOL
) -> tuple[tuple[SimulatedArc, ...], tuple[float, ...]]:
    """Simulate with restarts at optimised nodes where the motion departs from the optimised one.

    Returns:
        The runs and the times of restarts; both are empty if single intervals do not agree.
    """
    runs: list[SimulatedArc] = []
    restarts: list[float] = []
    for arc in arcs:
        node = 0
        while node < arc.intervals:
            run = run_from(arc, node, arc.state(node), rtol)
            last = _departs(run, node, tolerance / 10)
            if last == node or len(restarts) >= MOST_RESTARTS:
                return (), ()
            runs.append(run._replace(end=float(arc.times[last])))
            if last < arc.intervals:
                restarts.append(float(arc.times[last]))
            node = last
    return tuple(runs), tuple(restarts)


def _departs(run: SimulatedArc, node: int, tolerance: float) -> int:
    """Return the last node up to which the run is near the optimised states."""
    arc = run.arc
    times = arc.times[node:][arc.times[node:] <= run.trajectory.span[1]]
    x = run.of(arc.span.model.vector("x"), times)
    off = np.abs(x - arc.nodes[:, node : node + times.size]) / arc.sizes[:, None]
    near = (off <= tolerance).all(axis=0)
    return node + (times.size if near.all() else int(np.argmin(near))) - 1
