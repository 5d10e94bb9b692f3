"""Resolve a problem into spans: numbers, start values, and what cannot be met.

The first phase starts at values that are given, those of the model, or equations for them;
mechanisms with loops at coordinates and rates that close these.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from ocp.formulation.evaluate_callbacks import Written, gathered, written
from ocp.formulation.phase import FREE, Array, Box, Free, Link, Row, Span, as_box, fixed, meet
from ocp.formulation.statement import (
    Choice,
    Setting,
    Statement,
    chosen_of,
    rate_name,
    settings_of,
    with_outputs,
)
from symfric.foundation.variable import stacked
from symfric.model import Model

ROUNDS = 50
CLOSED = 1e-11
"""Residual of a constraint that counts as met, in the units of the constraint."""


def function_problems(problem: Statement) -> list[str]:
    """Messages about costs, conditions and links that are wrong for all ranges and numbers."""
    tell: list[str] = []
    written(problem, settings_of(problem), tell)
    return tell


def resolved(problem: Statement) -> tuple[tuple[Span, ...], list[str]]:
    """The spans of `problem`, and what is wrong with them; with that they are not complete."""
    tell: list[str] = []
    settings = settings_of(problem)
    chosen = chosen_of(problem, settings)
    pairs = zip(settings, written(problem, settings, tell), strict=True)
    spans = [_span(setting, text, chosen) for setting, text in pairs]
    every: list[Span] = []
    for number, (name, values) in enumerate((problem.scenarios or {"": {}}).items()):
        where = f"scenario '{name}': " if name else ""
        for setting, span in zip(settings, spans, strict=True):
            with gathered(tell, setting.where + where):
                given = {c.name: c.guess for c in chosen}
                given = dict(setting.p) | dict(values) | given
                every.append(_at_numbers(problem, setting, replace(span, scenario=number), given))
    if not tell:
        tell += _unreachable(every, settings)
        tell += _constant_cost(every)
        every = [_without_repeats(every, k) for k in range(len(every))]
    return tuple(every), tell


def _without_repeats(spans: Sequence[Span], k: int) -> Span:
    """Span k without links between values that are given on both sides: they say nothing new."""
    span, before = spans[k], spans[k - 1]

    def repeats(link: Link) -> bool:
        sides = (before.nodes[1.0].get(link.state, FREE), span.nodes[0.0][link.state])
        return _goes_on(before, link) and all(map(fixed, sides))

    return replace(span, links=tuple(link for link in span.links if not repeats(link)))


def _goes_on(before: Span, link: Link) -> bool:
    """True if a state is continuous, as it is by default."""
    symbols = {v.name: v.symbol for v in before.model.x}
    return link.state in symbols and ca.is_equal(link.expression, symbols[link.state])


def box_of(setting: Setting, name: str) -> Box:
    """Bounds of a signal in a phase: those given, else those of the model."""
    if name in setting.bounds:
        return as_box(setting.bounds[name])
    model = setting.model
    known = {v.name: v for group in (model.x, model.z, model.u) for v in group}
    return (known[name].lower, known[name].upper) if name in known else FREE


def _span(setting: Setting, text: Written, chosen: Sequence[Choice]) -> Span:
    """All of a span but what depends on numbers of parameters."""
    phase = setting.phase
    given = {0.0: phase.start, **{float(s): phase.via[s] for s in phase.via}, 1.0: phase.end}
    given = dict(sorted(given.items()))
    named = (*setting.bounds, *(name for at in given.values() for name in at))
    model = with_outputs(setting.model, (*named, *text.details))
    boxes = {
        v.name: box_of(setting, v.name) for group in (model.x, model.z, model.u) for v in group
    }
    parameters = {v.name for v in model.p}
    return Span(
        name=phase.name or f"phase {setting.number + 1}",
        scenario=0,
        phase=setting.number,
        model=model,
        T=phase.T if isinstance(phase.T, Free) else float(phase.T),
        p=np.zeros(len(model.p)),
        chosen=tuple(c.name for c in chosen if c.name in parameters),
        boxes=boxes,
        nodes={s: _met(boxes, at, model.x) for s, at in given.items()},
        inputs_at={s: _met(boxes, given[s], model.u) for s in (0.0, 1.0)},
        rows_at={s: _rows_at(model, s, at) for s, at in given.items()},
        path=(*_bounded(setting), *text.path),
        running=text.running,
        end=text.end,
        squares=text.squares,
        links=text.links,
        joins=text.joins,
    )


def _met(boxes: Mapping[str, Box], given: Mapping[str, Any], group: Any) -> dict[str, Box]:
    """Range of every variable of a group: its bounds, and what is given here."""
    return {v.name: meet(boxes[v.name], as_box(given.get(v.name, FREE))) for v in group}


def _rows_at(model: Model, fraction: float, given: Mapping[str, Any]) -> tuple[Row, ...]:
    """Conditions there on signals that are no states or inputs."""
    own = {v.name for group in (model.x, model.u) for v in group}
    place = {0.0: "at the start", 1.0: "at the end"}.get(fraction, f"at {fraction:g} T")
    return tuple(
        Row(f"{name} {place}", model.expression(name), *as_box(value))
        for name, value in given.items()
        if name not in own and as_box(value) != FREE
    )


def _bounded(setting: Setting) -> Iterator[Row]:
    """Bounds on outputs and details: conditions on the path."""
    model = setting.model
    own = {v.name for group in (model.x, model.z, model.u) for v in group}
    for name in setting.bounds:
        if name not in own and box_of(setting, name) != FREE:
            yield Row(f"the bound on {name}", model.expression(name), *box_of(setting, name))


def _at_numbers(
    problem: Statement, setting: Setting, span: Span, given: Mapping[str, float]
) -> Span:
    """`span` with the numbers of its parameters, and the start values that follow from them."""
    known = {v.name for v in span.model.p}
    given = {name: value for name, value in given.items() if name in known}
    span = replace(span, p=span.model.values("p", given))
    if setting.number > 0:
        return span
    start, rows = start_of(setting, span, given, problem.periodic)
    return replace(
        span,
        nodes=dict(span.nodes) | {0.0: start},
        rows_at=dict(span.rows_at) | {0.0: (*span.rows_at[0.0], *rows)},
    )


def _unreachable(spans: Sequence[Span], settings: Sequence[Setting]) -> Iterator[str]:
    """Messages about empty ranges."""
    for span in spans:
        setting = settings[span.phase]
        for fraction, boxes in (*span.nodes.items(), *span.inputs_at.items()):
            where = {0.0: "start", 1.0: "end"}.get(fraction, f"via {fraction:g}")
            for name, (low, high) in boxes.items():
                if low > high:
                    bounds = span.box(name)
                    yield (
                        f"{setting.where}{where}: expected {name} inside its bounds "
                        f"[{bounds[0]:g}, {bounds[1]:g}], got {high if bounds[0] > high else low:g}"
                    )
    for before, span in pairwise(spans):
        for link in span.links if span.phase else ():
            yield from _apart(before, span, link, settings[span.phase].where)


def _apart(before: Span, span: Span, link: Link, where: str) -> Iterator[str]:
    """A state that is continuous by default, where it cannot be."""
    if not _goes_on(before, link):
        return
    ends = before.nodes[1.0]
    low, high = meet(ends[link.state], span.nodes[0.0][link.state])
    if low > high:
        yield (
            f"{where}start: expected {link.state} where the phase before may end, "
            f"{_words(ends[link.state])}, got {_words(span.nodes[0.0][link.state])}; "
            f"link={{'{link.state}': None}} lets it jump"
        )


def _words(box: Box) -> str:
    return f"{box[0]:g}" if fixed(box) else f"[{box[0]:g}, {box[1]:g}]"


def _constant_cost(spans: Sequence[Span]) -> Iterator[str]:
    """A cost that nothing changes."""
    costs, free = ca.SX(0, 1), False
    for span in spans:
        own = ca.vertcat(span.running, span.end)
        picked = [v.symbol for v in span.model.p if v.name in span.chosen]
        changed = ca.vertcat(*(span.model.vector(letter) for letter in "xzu"), *picked)
        if ca.depends_on(own, changed):
            return
        costs, free = ca.vertcat(costs, own), free or isinstance(span.T, Free)
    if not free or costs.is_zero():
        yield (
            "cost: expected one that depends on the motion, got a constant; TIME needs a free "
            "duration, T=Free(lower, upper)"
        )


def start_of(
    setting: Setting, span: Span, p: Mapping[str, float], periodic: Sequence[str]
) -> tuple[dict[str, Box], tuple[Row, ...]]:
    """Range of every state at 0, and equations of those whose start follows from unknowns.

    A state that is not named has the start of the model: at a number, or, where that depends on
    parameters that are chosen, at an expression in these. Periodic states and inputs with bounded
    rate start anywhere. In a mechanism with loops, coordinates and rates that are not named follow
    from those that are.

    Raises:
        ValueError: a start value that is not finite, or that depends on states in a range.
    """
    model, given = span.model, setting.phase.start
    symbols = {v.name: v.symbol for v in model.x}
    inputs = {v.name for v in model.u}
    named = {v.name: as_box(given[v.name]) for v in model.x if v.name in given}
    named |= {
        v.name: FREE
        for v in model.x
        if v.name not in given and (v.name in periodic or rate_name(v.name) in inputs)
    }
    loose = [name for name, box in named.items() if not fixed(box)]
    _check_settled(model, named, loose)
    numbers = {name: box[0] if fixed(box) else 0.0 for name, box in named.items()}
    values = dict(zip(symbols, model.initial_state(numbers, p).tolist(), strict=True))
    following = _following(span, named)
    if has_loops(model):
        moving = following_loops(model, {*loose, *following}, values)
        values = closed(span, values, named) if not moving else values
        named = {name: FREE for name in moving} | named
    boxes: dict[str, Box] = {}
    for name, value in values.items():
        wanted = FREE if name in following else named.get(name, (value, value))
        boxes[name] = meet(wanted, span.box(name))
    settled = [name for name in values if name not in following]
    known = stacked([*(symbols[name] for name in settled), model.vector("u")])
    there = ca.DM([*(values[name] for name in settled), *model.values("u")])
    rows = [
        Row(f"the start of {name}", symbols[name] - ca.substitute(start, known, there), 0.0, 0.0)
        for name, start in following.items()
    ]
    return boxes, tuple(rows)


def _check_settled(model: Model, named: Collection[str], loose: Collection[str]) -> None:
    """A start value that is an expression needs numbers for all states it depends on."""
    for v in model.x:
        needed = [
            o.name for o in model.x if o.name in loose and ca.depends_on(ca.SX(v.start), o.symbol)
        ]
        if v.name not in named and needed:
            raise ValueError(
                f"start: expected a value or range of {v.name}, whose start depends on "
                f"{', '.join(needed)}; name it"
            )


def _following(span: Span, named: Collection[str]) -> dict[str, ca.SX]:
    """State -> start that depends on chosen parameters, directly or by way of another state."""
    unknown = {v.name: v.symbol for v in span.model.p if v.name in span.chosen}
    found: dict[str, ca.SX] = {}
    while True:
        symbols = stacked(unknown.values())
        new = [
            v
            for v in span.model.x
            if v.name not in named
            and v.name not in found
            and ca.depends_on(ca.SX(v.start), symbols)
        ]
        if not new or not unknown:
            return found
        found |= {v.name: ca.SX(v.start) for v in new}
        unknown |= {v.name: v.symbol for v in new}


def has_loops(model: Model) -> bool:
    """True if constraints bind the coordinates of the model."""
    return model.holonomic is not None and model.holonomic.phi.numel() > 0


def following_loops(
    model: Model, open_states: Collection[str], values: Mapping[str, float]
) -> tuple[str, ...]:
    """Coordinates and rates that are open at the start, as some of them start in a range.

    The constraints, which hold at every node, say where. Where only coordinates start in a range
    and all rates are zero, these stay zero.
    """
    mechanics = model.holonomic
    n = 0 if mechanics is None else mechanics.n
    q, qd = ([v.name for v in model.x[k : k + n]] for k in (0, n))
    if not {*q, *qd} & set(open_states):
        return ()
    resting = not set(qd) & set(open_states) and not any(values[name] for name in qd)
    timed = mechanics is not None and ca.depends_on(mechanics.phi, model.t)
    return tuple(q) if resting and not timed else (*q, *qd)


def _defects(model: Model) -> tuple[ca.SX, ca.SX]:
    mechanics = model.holonomic
    if mechanics is None:
        return ca.SX(0, 1), ca.SX(0, 1)
    x, n, phi = model.vector("x"), mechanics.n, mechanics.phi
    q, qd = x[:n], x[n : 2 * n]
    return phi, ca.jtimes(phi, q, qd) + ca.jtimes(phi, model.t, ca.SX(1))


def closed(span: Span, values: Mapping[str, float], given: Collection[str]) -> dict[str, float]:
    """`values` of the states with loops closed by the smallest change of those not `given`.

    Positions first, then rates, by Newton's method with least norm.

    Raises:
        ValueError: what is given leaves no way to close them.
    """
    model = span.model
    mechanics = model.holonomic
    if mechanics is None or not has_loops(model):
        return dict(values)
    names = [v.name for v in model.x]
    x = np.array([values[name] for name in names])
    phi, phi_dot = _defects(model)
    n = mechanics.n
    symbols = model.vector("x")
    for what, defect, begin in (("positions", phi, 0), ("velocities", phi_dot, n)):
        free = [i for i in range(begin, begin + n) if names[i] not in given]
        slope = ca.jacobian(defect, symbols)[:, free]
        f = ca.Function("loops", span.symbols, [defect, slope])
        x = _solved(span, f, x, free, what)
    return dict(zip(names, x.tolist(), strict=True))


def _solved(span: Span, f: ca.Function, x: Array, free: list[int], what: str) -> Array:
    x, zeros = x.copy(), [np.zeros(s.numel()) for s in span.symbols]
    size = np.inf
    for _ in range(ROUNDS):
        defect, slope = (m.full() for m in f.call([0.0, x, zeros[2], zeros[3], span.p]))
        size = float(np.abs(defect).max())
        if size < CLOSED * max(1.0, float(np.abs(x).max())):
            return x
        if not free or not np.isfinite(size):
            break
        x[free] -= np.linalg.lstsq(slope, defect)[0][:, 0]
    raise ValueError(
        f"start: expected {what} from which all loops can be closed, got some that leave "
        f"{size:.3g} open; name fewer states and let the others follow"
    )
