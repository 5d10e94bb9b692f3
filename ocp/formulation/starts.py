"""Where the first phase starts: values given, values of the model, or equations for them."""

from collections.abc import Collection, Mapping, Sequence

import casadi as ca

from ocp.formulation.bounds import FREE, Box, as_box, fixed, meet
from ocp.formulation.loops import closed, following_loops, has_loops
from ocp.formulation.rates import rate_name
from ocp.formulation.settings import Setting
from ocp.formulation.span import Row, Span
from symfric.foundation.symbols import stacked
from symfric.model import Model


def start_of(
    setting: Setting, span: Span, p: Mapping[str, float], periodic: Sequence[str]
) -> tuple[dict[str, Box], tuple[Row, ...]]:
    """Range of every state at 0, and equations of those whose start follows from unknowns.

    A state that is not named starts where the model says: at a number, or, where that depends on
    parameters that are chosen, at an expression in these. Periodic states and inputs with bounded
    rate start anywhere. In a mechanism with loops, coordinates and rates that are not named follow
    from those that are.

    Raises:
        ValueError: a start value that is not finite, or that depends on states in a range.
    """
    model, given = span.model, setting.phase.start
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
    values = dict(zip(named_of(model), model.initial_state(numbers, p).tolist(), strict=True))
    following = _following(span, named)
    if has_loops(model):
        moving = following_loops(model, {*loose, *following}, values)
        values = closed(span, values, named) if not moving else values
        named = {name: FREE for name in moving} | named
    boxes: dict[str, Box] = {}
    for name, value in values.items():
        wanted = FREE if name in following else named.get(name, (value, value))
        boxes[name] = meet(wanted, span.box(name))
    symbols = {v.name: v.symbol for v in model.x}
    settled = [name for name in values if name not in following]
    known = stacked([*(symbols[name] for name in settled), model.vector("u")])
    there = ca.DM([*(values[name] for name in settled), *model.values("u")])
    rows = [
        Row(f"the start of {name}", symbols[name] - ca.substitute(start, known, there), 0.0, 0.0)
        for name, start in following.items()
    ]
    return boxes, tuple(rows)


def named_of(model: Model) -> list[str]:
    """Names of the states."""
    return [v.name for v in model.x]


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
