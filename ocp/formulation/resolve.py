"""Resolution of a problem into spans: values of parameters, start values, and contradictions.

The first phase starts at values of the user or the model, or at equations for them. Mechanisms with
loops start at coordinates and rates that satisfy their constraints.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from math import isfinite
from typing import Any

import casadi as ca
import numpy as np

from ocp.formulation import statement
from ocp.formulation.changed_models import states_of, with_constants, with_outputs
from ocp.formulation.evaluate_callbacks import Evaluated, collected, evaluated
from ocp.formulation.phase import FREE, Box, Free, Link, Range, Row, Span, as_box, fixed, meet
from ocp.formulation.statement import Choice, Setting, Statement
from ocp.formulation.validate import input_problems, type_problems
from symfric.foundation.variable import stacked
from symfric.model import Model

ITERATIONS = 50
CLOSED = 1e-11
"""Residual of a constraint that counts as satisfied, in the units of the constraint."""


def resolved(problem: Statement) -> tuple[Span, ...]:
    """Return the spans of `problem`, in the order of scenarios.

    Raises:
        ValueError: wrong types; if there are none, unknown names, invalid ranges and functions;
            if there are none, contradictory values. All problems of a stage are reported at once.
    """
    _refuse(problem, [*type_problems(problem)])
    problems, settings = [*input_problems(problem)], statement.settings_of(problem)
    results = evaluated(problem, settings, problems)
    _refuse(problem, problems)
    chosen = statement.chosen_of(problem, settings)
    bare = list[Span]()
    for setting, result in zip(settings, results, strict=True):
        bare.append(_span(setting, result, chosen, bare[-1] if bare else None))
    spans: list[Span] = []
    for number, (name, values) in enumerate((problem.scenarios or {"": {}}).items()):
        where = f"scenario '{name}': " if name else ""
        for setting, span in zip(settings, bare, strict=True):
            p = dict(setting.p) | dict(values) | {c.name: c.guess for c in chosen}
            with collected(problems, setting.where + where):
                spans.append(_at_numbers(problem, setting, replace(span, scenario=number), p))
    _refuse(problem, problems)
    _refuse(problem, [*_unreachable(spans, settings), *_constant_cost(spans)])
    return tuple(_without_repeats(spans[k - 1], span) for k, span in enumerate(spans))


def _refuse(problem: Statement, messages: Sequence[str]) -> None:
    if texts := [text for text in dict.fromkeys(messages) if text]:
        raise ValueError(f"problem '{problem.name}': " + "; ".join(texts))


def _without_repeats(before: Span, span: Span) -> Span:
    """Return `span` without links of states that are prescribed on both sides."""

    def repeats(link: Link) -> bool:
        sides = before.nodes[1.0].get(link.state, FREE), span.nodes[0.0][link.state]
        return before.same_state(link.expression) == link.state and all(map(fixed, sides))

    return replace(span, links=tuple(link for link in span.links if not repeats(link)))


def _box_of(setting: Setting, model: Model, name: str) -> Box:
    """Return the bounds of a signal in a phase, by default those of the model."""
    if name in setting.bounds:
        return as_box(setting.bounds[name])
    known = {v.name: v for group in (model.x, model.z, model.u) for v in group}
    return (known[name].lower, known[name].upper) if name in known else FREE


def _span(
    setting: Setting, result: Evaluated, chosen: Sequence[Choice], before: Span | None
) -> Span:
    """Return a span with zeros as values of its parameters."""
    phase = setting.phase
    given = {s: dict[str, Range]() for s in map(float, phase.at)}
    given |= {0.0: dict(phase.start), **{float(s): dict(phase.via[s]) for s in phase.via}}
    given |= {1.0: dict(phase.end)}
    given = dict(sorted(given.items()))
    named = (*setting.bounds, *(name for at in given.values() for name in at))
    details = dict.fromkeys(n for n in (*named, *result.details) if n not in setting.model.signals)
    model = with_outputs(setting.model, tuple(details))
    slacks = [*_slacks(result.at)]
    sizes = {peak.name: peak.rows[0].size for peak in result.peaks}
    sizes |= {name: -row.nominal for _, row, names in slacks for name in names}
    model = with_constants(model, sizes)
    at, end = _relaxed(result.at, slacks, model)
    links = result.links
    for peak in result.peaks:
        bound = model.expression(peak.name)
        end += peak.weight * bound
        if before is not None and peak.continued:
            links += (Link(peak.name, before.model.expression(peak.name)),)
    highest = (
        replace(row, expression=row.expression - model.expression(peak.name), linear=peak.weight)
        for peak in result.peaks
        for row in peak.rows
    )
    softened = tuple(row for row in result.path if row.linear or row.quadratic)
    variables = [v.name for group in (model.x, model.z, model.u) for v in group]
    boxes = {name: _box_of(setting, model, name) for name in variables}
    parameters = {v.name for v in model.p}

    def within(at: Mapping[str, Any], group: Any) -> dict[str, Box]:
        return {v.name: meet(boxes[v.name], as_box(at.get(v.name, FREE))) for v in group}

    bounded = (
        Row(f"the bound on {name}", model.expression(name), *as_box(box))
        for name, box in setting.bounds.items()
        if name not in boxes and as_box(box) != FREE
    )
    return Span(
        name=phase.name or f"phase {setting.number + 1}",
        scenario=0,
        phase=setting.number,
        model=model,
        T=phase.T if isinstance(phase.T, Free) else float(phase.T),
        p=np.zeros(len(model.p)),
        chosen=tuple(c.name for c in chosen if c.name in parameters),
        boxes=boxes,
        nodes={s: within(at, model.x) for s, at in given.items()},
        inputs_at={s: within(given[s], model.u) for s in (0.0, 1.0)},
        rows_at={s: (*_rows_at(model, s, values), *at.get(s, ())) for s, values in given.items()},
        path=(*bounded, *(row for row in result.path if row not in softened), *highest),
        running=result.running,
        end=result.end + end,
        squares=result.squares,
        links=links,
        joins=result.joins,
        softened=softened,
        absolutes=result.absolutes,
    )


Slack = tuple[float, Row, dict[str, int]]
"""Fraction of T, soft condition there, and its violations: name -> 1 above, -1 below."""


def _slacks(at: Mapping[float, tuple[Row, ...]]) -> Iterator[Slack]:
    """Yield the soft conditions at fractions of T."""
    for s, rows in at.items():
        place = {0.0: "start", 1.0: "end"}.get(s, f"{s:g}".replace(".", "_"))
        for k, row in enumerate(rows, 1):
            sides = (("above", 1, row.upper), ("below", -1, row.lower))
            names = {f"violation_{place}_{k}_{n}": side for n, side, b in sides if isfinite(b)}
            if row.linear or row.quadratic:
                yield s, row, names


def _relaxed(
    at: Mapping[float, tuple[Row, ...]], slacks: Sequence[Slack], model: Model
) -> tuple[dict[float, list[Row]], ca.SX]:
    """Return conditions at fractions of T, with violations as constant states, and their cost."""
    found, cost = {s: list(rows) for s, rows in at.items()}, ca.SX(0)
    for s, row, names in slacks:
        violations = stacked(model.expression(name) for name in names)
        size, off = ca.sum1(violations), ca.dot(violations, ca.DM(list(names.values())))
        cost += row.linear * size + row.quadratic * size**2
        e = row.expression - off
        found[s][found[s].index(row)] = replace(row, expression=e, parts=(size,))
    return found, cost


def _rows_at(model: Model, fraction: float, given: Mapping[str, Any]) -> tuple[Row, ...]:
    """Return the conditions at a fraction of T on signals other than states and inputs."""
    own = {v.name for group in (model.x, model.u) for v in group}
    place = {0.0: "at the start", 1.0: "at the end"}.get(fraction, f"at {fraction:g} T")
    return tuple(
        Row(f"{name} {place}", model.expression(name), *as_box(value))
        for name, value in given.items()
        if name not in own and as_box(value) != FREE
    )


def _at_numbers(problem: Statement, setting: Setting, span: Span, p: Mapping[str, float]) -> Span:
    """Return `span` with the values of its parameters and the start values that follow."""
    p = {v.name: p[v.name] for v in span.model.p if v.name in p}
    span = replace(span, p=span.model.values("p", p))
    if setting.number > 0:
        return span
    start, rows = _start_of(setting, span, p, problem.periodic)
    return replace(
        span,
        nodes=dict(span.nodes) | {0.0: start},
        rows_at=dict(span.rows_at) | {0.0: (*span.rows_at[0.0], *rows)},
    )


def _unreachable(spans: Sequence[Span], settings: Sequence[Setting]) -> Iterator[str]:
    """Yield messages about empty ranges and about states that cannot be continuous."""
    for span in spans:
        for fraction, boxes in (*span.nodes.items(), *span.inputs_at.items()):
            where = {0.0: "start", 1.0: "end"}.get(fraction, f"via {fraction:g}")
            for name, (low, high) in boxes.items():
                if low > high:
                    least, most = span.boxes[name]
                    yield (
                        f"{settings[span.phase].where}{where}: expected {name} inside its bounds "
                        f"[{least:g}, {most:g}], got {high if least > high else low:g}"
                    )
    for before, span in pairwise(spans):
        for link in span.links if span.phase else ():
            if before.same_state(link.expression) != link.state:
                continue
            end, start = before.nodes[1.0][link.state], span.nodes[0.0][link.state]
            low, high = meet(end, start)
            if low > high:
                yield (
                    f"{settings[span.phase].where}start: expected {link.state} where the previous "
                    f"phase may end, {_text(end)}, got {_text(start)}; "
                    f"link={{'{link.state}': None}} lets it jump"
                )


def _text(box: Box) -> str:
    return f"{box[0]:g}" if fixed(box) else f"[{box[0]:g}, {box[1]:g}]"


def _constant_cost(spans: Sequence[Span]) -> Iterator[str]:
    """Yield a message if the cost is constant."""
    costs, free = ca.SX(0, 1), False
    for span in spans:
        own = ca.vertcat(span.running, span.end, *(row.expression for row in span.absolutes))
        chosen = [v.symbol for v in span.model.p if v.name in span.chosen]
        if ca.depends_on(own, ca.vertcat(*span.symbols[1:4], *chosen)):
            return
        costs, free = ca.vertcat(costs, own), free or isinstance(span.T, Free)
    if not free or costs.is_zero():
        yield (
            "cost: expected one that depends on the motion, got a constant; TIME needs a free "
            "duration, T=Free(lower, upper)"
        )


def _start_of(
    setting: Setting, span: Span, p: Mapping[str, float], periodic: Sequence[str]
) -> tuple[dict[str, Box], tuple[Row, ...]]:
    """Return the range of every state at 0, and equations of starts that depend on unknowns.

    A state that `start` does not name has the start of the model: a number, or an expression in
    chosen parameters. The start of periodic states and of inputs with bounded rate is free. In a
    mechanism with loops, coordinates and rates that are not named follow from the named ones.

    Raises:
        ValueError: a start value that is not finite, or that depends on states in a range.
    """
    model, given = span.model, setting.phase.start
    symbols = {v.name: v.symbol for v in model.x}
    constants = symbols.keys() - {v.name for v in setting.model.x}
    free = {*periodic, *states_of(setting.forms), *constants}
    named = {v.name: as_box(given[v.name]) for v in model.x if v.name in given}
    for v in model.x:
        if v.name not in given and v.name in free:
            named[v.name] = FREE
    ranged = [name for name, box in named.items() if not fixed(box)]
    for v in model.x:
        start = ca.SX(v.start)
        needed = [n for n in symbols if n in ranged and ca.depends_on(start, symbols[n])]
        if v.name not in named and needed:
            raise ValueError(
                f"start: expected a value or range of {v.name}, whose start depends on "
                f"{', '.join(needed)}; name it"
            )
    numbers = {name: box[0] if fixed(box) else 0.0 for name, box in named.items()}
    values = dict(zip(symbols, model.initial_state(numbers, p).tolist(), strict=True))
    dependent = _dependent_starts(span, named)
    if has_loops(model):
        open_states = _open_in_loops(model, {*ranged, *dependent}, values)
        values = values if open_states else _closed(span, values, named)
        named = {name: FREE for name in open_states} | named
    boxes = {
        name: meet(FREE if name in dependent else named.get(name, (value, value)), span.boxes[name])
        for name, value in values.items()
    }
    settled = [name for name in values if name not in dependent]
    known = stacked([*(symbols[name] for name in settled), model.vector("u")])
    there = ca.DM([*(values[name] for name in settled), *model.values("u")])
    rows = [
        Row(f"the start of {name}", symbols[name] - ca.substitute(start, known, there), 0.0, 0.0)
        for name, start in dependent.items()
    ]
    return boxes, tuple(rows)


def _dependent_starts(span: Span, named: Collection[str]) -> dict[str, ca.SX]:
    """Return state -> start for starts that depend on chosen parameters, directly or indirectly."""
    unknown = {v.name: v.symbol for v in span.model.p if v.name in span.chosen}
    starts: dict[str, ca.SX] = {}
    while unknown:
        symbols = stacked(unknown.values())
        new = [
            v
            for v in span.model.x
            if v.name not in {*named, *starts} and ca.depends_on(ca.SX(v.start), symbols)
        ]
        if not new:
            break
        starts |= {v.name: ca.SX(v.start) for v in new}
        unknown |= {v.name: v.symbol for v in new}
    return starts


def has_loops(model: Model) -> bool:
    """Return True if constraints couple the coordinates of the model."""
    return model.holonomic is not None and model.holonomic.phi.numel() > 0


def _open_in_loops(
    model: Model, open_states: Collection[str], values: Mapping[str, float]
) -> tuple[str, ...]:
    """Return coordinates and rates that lose their start values because some start in a range.

    The constraints, which hold at every node, determine them. If only coordinates start in a range
    and all rates are zero, the rates remain zero.
    """
    mechanics = model.holonomic
    n = 0 if mechanics is None else mechanics.n
    q, qd = ([v.name for v in model.x[k : k + n]] for k in (0, n))
    if not {*q, *qd} & set(open_states):
        return ()
    resting = not set(qd) & set(open_states) and not any(values[name] for name in qd)
    timed = mechanics is not None and ca.depends_on(mechanics.phi, model.t)
    return tuple(q) if resting and not timed else (*q, *qd)


def _closed(span: Span, values: Mapping[str, float], named: Collection[str]) -> dict[str, float]:
    """Return `values` of the states with loops closed by the smallest change of unnamed states.

    Newton's method with steps of least norm changes first positions, then rates.

    Raises:
        ValueError: the loops cannot be closed with the named states.
    """
    model = span.model
    mechanics = model.holonomic
    if mechanics is None:
        return dict(values)
    symbols, n, phi = model.vector("x"), mechanics.n, mechanics.phi
    rate = ca.jtimes(phi, symbols[:n], symbols[n : 2 * n]) + ca.jtimes(phi, model.t, ca.SX(1))
    names, x = list(values), np.array(list(values.values()))
    for what, defect, begin in (("positions", phi, 0), ("velocities", rate, n)):
        free = [i for i in range(begin, begin + n) if names[i] not in named]
        f = ca.Function("loops", span.symbols, [defect, ca.jacobian(defect, symbols)[:, free]])
        z, u = np.zeros(len(model.z)), np.zeros(len(model.u))
        met, size = False, np.inf
        for _ in range(ITERATIONS):
            error, slope = (m.full() for m in f.call([0.0, x, z, u, span.p]))
            size = float(np.abs(error).max())
            met = size < CLOSED * max(1.0, float(np.abs(x).max()))
            if met or not free or not np.isfinite(size):
                break
            x[free] -= np.linalg.lstsq(slope, error)[0][:, 0]
        if not met:
            raise ValueError(
                f"start: expected {what} from which all loops can be closed, got some that leave "
                f"{size:.3g} open; name fewer states and let the others follow"
            )
    return dict(zip(names, x.tolist(), strict=True))
