"""What was asked of a motion, looked at on simulated runs: at nodes, and everywhere between."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.checking.arcs import Arc
from ocp.checking.resimulate import Run
from ocp.checking.verification import Miss
from ocp.formulation.bounds import FREE, Box, fixed
from ocp.formulation.phase import Row
from ocp.formulation.problem import Problem
from symfric.foundation.symbols import stacked

Array = NDArray[np.float64]

CLOSER, PARTS = 2, 16
"""How often the neighbourhood of the worst time is looked at again, and in how many parts."""
PLACES = {0.0: "start", 1.0: "end"}


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
        yield _miss(what, row.name, time, value, (row.lower, row.upper), _size(row, value))


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


def _size(row: Row, value: float) -> float:
    return max(row.nominal, abs(value)) if isfinite(value) else row.nominal


def _time(arc: Arc, fraction: float) -> float:
    """When the node at a fraction is [s]."""
    return float(arc.times[int(np.argmin(np.abs(arc.mesh - fraction)))])
