"""Active conditions of a solution with their multipliers, its condition, and its derivatives."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from ocp.formulation.phase import Array, Box, Span
from ocp.solving.optimum import STATIONARY, Optimum
from ocp.transcription.program import Place

WEAK, SMALL, TINY, ROUNDING = 0.1, 1e-2, 1e-8, 1e-10
"""Ratio of distance and multiplier, both scaled and at most `SMALL`, above which it is not certain
whether a condition is active; `TINY` is the error of both, `ROUNDING` that of distances alone."""
EQUATIONS = ("the equation of", "the algebraic equation", "the continuity of", "the largest cost",
             "the loop", "the rate of loop")  # fmt: skip
"""Rows of the equations of motion, whose multipliers are costates, and rows and unknowns that make
up costs of absolute values, maxima and violations."""
SAME_TIME = 1e-9
SHOWN = 3
"""Largest number of conditions in a line."""


@final
@dataclass(frozen=True)
class Active:
    """Condition that holds with equality, from `begin` to `end`.

    Attributes:
        name: such as "x at the end", "the bound on force", "path condition 1", "the duration".
        side: "=" for a prescribed value, otherwise "lower" or "upper".
        value: the prescribed value or the bound.
        begin, end: first and last time at which the condition is active [s].
        multiplier: derivative of the optimal cost J* by `value` at all these times together.
        unit: unit of the multiplier, such as "cost/N".
        weak: True if distance and multiplier are too small to decide whether the condition is
            active; then J* may have different derivatives in both directions.
        scenario: name of its scenario; empty for a problem without scenarios.
    """

    name: str
    side: str
    value: float
    begin: float
    end: float
    multiplier: float
    unit: str
    weak: bool = False
    scenario: str = ""

    @property
    def when(self) -> str:
        """Time or interval of time as text."""
        alone = self.end - self.begin <= SAME_TIME
        return f"{self.begin:.4g} s" if alone else f"{self.begin:.4g} ... {self.end:.4g} s"

    def __str__(self) -> str:
        sign = {"=": "=", "lower": ">=", "upper": "<="}[self.side]
        doubt = ", weakly active" if self.weak else ""
        name = self.name.removeprefix("the bound on ")
        return f"{name} {sign} {self.value:.4g} ({self.when}{doubt})"


@final
class ActiveConditions(tuple[Active, ...]):
    """Active conditions in the order of time; as text, a table."""

    __slots__ = ()

    def __str__(self) -> str:
        head = f"{'condition':<34}{'side':<7}{'value':>12}  {'t':<22}{'dJ/dvalue':>13}"
        rows = [
            f"{a.name:<34}{a.side:<7}{a.value:>12.6g}  {a.when:<22}{a.multiplier:>13.6g} {a.unit}"
            f"{'  (weakly active)' * a.weak}{f'  ({a.scenario})' * bool(a.scenario)}"
            for a in self
        ]
        return "\n".join([head, *rows])

    __repr__ = __str__


class BoundStatus(NamedTuple):
    """Unknowns, followed by rows, at their bounds.

    Attributes:
        active: mask of those that are active.
        upper: mask of those nearer to, or pressing on, their upper bound.
        weak: mask of those for which this is uncertain.
        fixed: mask of equal bounds.
        ratio: ratio of multiplier and distance, above 1 where a condition is active.
    """

    active: NDArray[np.bool_]
    upper: NDArray[np.bool_]
    weak: NDArray[np.bool_]
    fixed: NDArray[np.bool_]
    ratio: Array


def status_of(optimum: Optimum) -> BoundStatus:
    """Return which unknowns and rows are at a bound, where the multiplier exceeds the distance.

    Distances are relative to the range between the bounds. An interior-point method ends with a
    small product of multiplier and distance, so both are small only where this is uncertain.
    """
    lower, upper = optimum.transcription.program.bounds
    values = np.concatenate([optimum.iterate.w, optimum.rows[0]])
    strength = optimum.iterate.multipliers / optimum.size
    fixed, span = lower == upper, upper - lower
    below, above = values - lower, upper - values
    size = np.maximum(np.where(np.isfinite(span), span, np.abs(values)), 1.0)
    high = above < below
    pressure, distance = np.where(high, strength, -strength), np.minimum(below, above) / size
    distance = np.where(np.abs(distance) < ROUNDING, 0.0, distance)
    larger = np.fmax(np.abs(pressure), np.abs(distance))
    smaller = np.fmin(np.abs(pressure), np.abs(distance))
    weak = ~fixed & (larger < SMALL) & (smaller >= WEAK * larger - TINY)
    ratio = pressure / np.maximum(distance, TINY)
    return BoundStatus(fixed | (pressure > distance), high, weak, fixed, ratio)


class Entry(NamedTuple):
    """Named scaled unknown or row that a condition restricts.

    Attributes:
        name: name of the condition.
        place: place of the unknown or row.
        number: its index; that of a row follows those of the unknowns.
        end: end of its interval as a fraction of T.
        unit: unit of its value.
    """

    name: str
    place: Place
    number: int
    end: float
    unit: str


def entries(optimum: Optimum) -> Iterator[Entry]:
    """Yield the restricted unknowns and rows, without the equations of motion."""
    made = optimum.transcription
    program, spans = made.program, made.problem.spans
    limited = np.isfinite(program.lower_w) | np.isfinite(program.upper_w)
    nodes = np.concatenate([own.nodes.ravel() for own in made.layout.spans])
    inputs = np.concatenate([own.u.ravel() for own in made.layout.spans])
    is_node, is_input = np.zeros(limited.size, bool), np.zeros(limited.size, bool)
    is_node[nodes], is_input[inputs] = True, True
    for k in np.flatnonzero(limited).tolist():
        place = program.unknowns[k]
        if place.name.startswith(EQUATIONS):
            continue
        span, end, name = spans[place.span], place.fraction, place.name
        units = _units(span)
        if is_input[k]:
            mesh = made.meshes[place.span]
            end = float(mesh[np.searchsorted(mesh, place.fraction) + 1])
            ends = {0.0: place.fraction == 0.0, 1.0: end == 1.0}
            boxes = {s: span.inputs_at[s] for s, at in ends.items() if at}
            text = _condition(name, boxes, span)
        elif is_node[k]:
            near = {s: box for s, box in span.nodes.items() if abs(s - end) < SAME_TIME}
            text = _condition(name, near, span)
        elif not np.isfinite(place.fraction) and name == "T":
            text, units = "the bound on the duration", {"T": "s"}
        else:
            text = f"the bound on {name}"
        yield Entry(text, place, k, end, units.get(name, ""))
    for k, place in enumerate(program.rows):
        if place.name.startswith(EQUATIONS):
            continue
        subject = place.name
        for prefix in ("the bound on ", "the start of ", "the period of ", "the start in all "):
            subject = subject.removeprefix(prefix)
        unit = "s" if subject.startswith("the duration") else ""
        unit = _units(spans[place.span]).get(subject.partition(" at ")[0], unit)
        yield Entry(place.name, place, limited.size + k, place.fraction, unit)


def _units(span: Span) -> dict[str, str]:
    """Return the units of all signals and parameters of a phase."""
    return {v.name: v.unit for v in span.model.p} | dict(span.model.signals)


def _condition(name: str, boxes: Mapping[float, Mapping[str, Box]], span: Span) -> str:
    """Return the name of a condition on a state or an input at a node."""
    for s, box in boxes.items():
        if box[name] != span.boxes[name]:
            place = {0.0: "at the start", 1.0: "at the end"}.get(s, f"at {s:g} T")
            return f"{name} {place}"
    return f"the bound on {name}"


def per_unit(unit: str) -> str:
    """Return the unit of a derivative of the cost."""
    if unit in ("", "1"):
        return "cost"
    return f"cost/({unit})" if " " in unit or "/" in unit else f"cost/{unit}"


def active_conditions(optimum: Optimum, status: BoundStatus) -> ActiveConditions:
    """Return the active conditions in the order of time; consecutive times are joined."""
    groups: dict[tuple[str, int], list[Entry]] = {}
    for entry in entries(optimum):
        groups.setdefault((entry.name, entry.place.span), []).append(entry)
    found: list[Active] = []
    for own in groups.values():
        own.sort(key=lambda e: e.place.fraction)
        near = status.active | status.weak
        sides = [bool(status.upper[e.number]) if near[e.number] else None for e in own]
        for side, run in groupby(zip(sides, own, strict=True), key=lambda pair: pair[0]):
            kept = [entry for _, entry in run] if side is not None else []
            sure = [k for k, e in enumerate(kept) if status.active[e.number]]
            if kept:  # conditions that are weakly active at the limits of the interval are omitted
                kept = kept[sure[0] : sure[-1] + 1] if sure else kept
                found.append(_active(optimum, status, kept))
    return ActiveConditions(_merged(sorted(found, key=lambda a: (a.begin, a.name))))


def in_words(optimum: Optimum, signals: Collection[str]) -> list[str]:
    """Return a line with the active bounds on `signals` and path conditions if they are few."""
    if not optimum.residual <= STATIONARY:
        return []
    found = [
        one
        for one in active_conditions(optimum, status_of(optimum))
        if one.side != "=" and not one.weak
    ]
    named = [one for one in found if one.name.removeprefix("the bound on ") in signals]
    named += [one for one in found if one.name.startswith("path condition")]
    return [f"active: {'; '.join(map(str, named))}"] if 0 < len(named) <= SHOWN else []


def _active(optimum: Optimum, status: BoundStatus, run: Sequence[Entry]) -> Active:
    """Return the condition on the entries of a run, which are all active on the same side."""
    points, lam = optimum.points.spans, optimum.iterate.multipliers
    (name, place, first, _, unit), last = run[0], run[-1]
    numbers = [entry.number for entry in run]
    upper = bool(status.upper[first])
    bound = optimum.transcription.program.bounds[upper][first]
    problem = optimum.transcription.problem
    span = problem.spans[place.span]
    first_span = place.span - span.phase
    start, length = sum(s.T for s in points[first_span : place.span]), points[place.span].T
    whole = not np.isfinite(place.fraction)
    if name.startswith("the duration"):  # of several phases
        start, whole = 0.0, True
        length = sum(s.T for s in points[: len(problem.chain)])
    return Active(
        name=name,
        side="=" if status.fixed[first] else ("lower", "upper")[upper],
        value=float(bound * place.scale),
        begin=start + length * (0.0 if whole else place.fraction),
        end=start + length * (1.0 if whole else last.end),
        multiplier=-float(sum(lam[entry.number] / entry.place.scale for entry in run)),
        unit=per_unit(unit),
        weak=bool(status.weak[numbers].all()),
        scenario=next(iter(problem.scenario_names[span.scenario :]), ""),
    )


def _merged(found: Sequence[Active]) -> list[Active]:
    """Return `found` with bounds joined that are active in consecutive phases."""
    merged: list[Active] = []
    for one in found:
        for number, other in enumerate(merged):
            keys = ("name", "side", "value", "scenario")
            same = one.side != "=" and all(getattr(one, k) == getattr(other, k) for k in keys)
            if same and abs(one.begin - other.end) < SAME_TIME:
                total, weak = other.multiplier + one.multiplier, other.weak and one.weak
                merged[number] = replace(other, end=one.end, multiplier=total, weak=weak)
                break
        else:
            merged.append(one)
    return merged


@final
@dataclass(frozen=True)
class Condition:
    """Condition of an optimum.

    Attributes:
        unknowns, active: numbers of unknowns, and of active conditions including equations.
        degrees_of_freedom: number of unknowns minus number of active conditions; some more if the
            conditions depend on each other.
        residual: relative residual of stationarity.
        number: estimated condition number of the equilibrated optimality conditions; inf if they
            are singular.
        sufficient: True if the Hessian is positive definite on the active conditions, so the
            optimum is a strict local minimum.
        weak: names of conditions that may or may not be active.
    """

    unknowns: int
    active: int
    degrees_of_freedom: int
    residual: float
    number: float
    sufficient: bool
    weak: tuple[str, ...] = ()

    def __str__(self) -> str:
        order = "strict local minimum" if self.sufficient else "second-order conditions not met"
        weak = f"; weakly active: {', '.join(self.weak)}" if self.weak else ""
        return (
            f"{self.unknowns} unknowns, {self.active} active conditions, "
            f"{self.degrees_of_freedom} degrees of freedom; {order}; condition number "
            f"{self.number:.1e}{weak}"
        )


@final
@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Derivatives of an optimum by one number p.

    Attributes:
        name: name of p.
        unit: unit of p.
        cost: dJ*/dp.
        T: derivative of the total duration [s/unit].
        chosen: derivatives of the chosen parameters.
        t: derivatives of the times of the signals [s/unit], which include switching times.
        signals: derivatives of states, algebraic variables and inputs at the points of the mesh,
            which move with `t`; at fixed times the derivative of a state x is signals["x"] - x' t.
        doubts: reasons why the derivatives may be wrong: conditions that may or may not be active,
            so derivatives in both directions differ; a motion or multipliers that are not unique.
            If the derivatives of the motion are not unique they are NaN; `cost` remains valid.
    """

    name: str
    unit: str
    cost: float
    T: float
    chosen: Mapping[str, float]
    t: Array
    signals: Mapping[str, Array]
    doubts: tuple[str, ...] = ()

    def __repr__(self) -> str:
        rates = f"dJ = {self.cost:.6g}, dT = {self.T:.6g} s"
        return f"<Sensitivity by {self.name}: {'; '.join([rates, *self.doubts])}>"
