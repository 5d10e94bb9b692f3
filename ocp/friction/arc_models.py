"""Mode models with what the conditions of an arc are about as outputs and states."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import casadi as ca

from ocp.formulation.phase import Span
from ocp.friction.mode_models import mode_model, with_outputs
from ocp.friction.release import SIDES, holding, rubbing
from symfric.foundation.parameters import Variable
from symfric.model import Contact, Model, Output

CATCH = 5.0
"""Margins of the sliding force that catch a contact which has slipped back for an instant, or that
stop one: with none it would only graze rest, and the least deviation lets it slip on."""

FIRST = "_first_"
PULLED = "_pull"
CAUGHT = "_catch"
STOPPED = "_stop"
LEFT = "rest_left"
"""State of an arc at whose end a contact leaves rest: the time that is left of it [s]."""


def breaks_away(span: Span) -> bool:
    """Whether some contact breaks away or is caught at the start of an arc."""
    return any(name.endswith((PULLED, CAUGHT)) for name in span.model.outputs)


def carrier(model: Model, contact: Contact) -> tuple[str, int] | None:
    """The state that is zero when `contact` rests, and the side to which it grows with the slip.

    None where slip is not a multiple of one state.
    """
    x = model.vector("x")
    slope = ca.SX(ca.jacobian(contact.slip, x))
    if slope.nnz() != 1 or not slope.is_constant():
        return None
    factor, index = float(ca.sum1(ca.sum2(ca.DM(slope)))), slope.sparsity().get_crs()[1][0]
    if not ca.is_equal(ca.simplify(contact.slip - factor * x[index]), ca.SX(0), 2):
        return None
    return model.x[index].name, 1 if factor > 0 else -1


def arc_model(
    model: Model,
    modes: Mapping[str, int],
    released: Sequence[str],
    leaving: Mapping[str, int],
    caught: Mapping[str, int],
    stopped: Mapping[str, int],
    sizes: Mapping[str, float],
    margin: tuple[float, float],
) -> Model:
    """The mode model of `modes` with what the conditions of an arc are about as outputs.

    Args:
        model: the user's.
        modes: of all contacts that can rest.
        released: contacts that break away at the start of the arc.
        leaving: contacts that leave rest at its end by a force that cannot jump, and to which side.
        caught: contacts that come to rest at its start under a control that may jump, and to which
            side they slipped until then.
        stopped: the same of all contacts that come to rest.
        sizes: contact -> typical static level [N].
        margin: share of the level that a rest keeps away from it, and how long before the end of
            the arc it begins to give that up where it leaves [s].

    Returns:
        One with "<contact>_slip"; as shares of the level "<contact>_up" and "<contact>_down", the
        room of a rest to both sides, less margin times tanh (time left / that time)^2 where it
        leaves; "<contact>_first_up" and "<contact>_first_down", the same for what states and inputs
        at the start of an interval ask for; "<contact>_pull", excess of what is released; and
        "<contact>_catch", room below the force of sliding back of what is caught, "<contact>_stop"
        below that of sliding on of what is stopped.
    """
    kept: dict[Any, Model] = model.memory.setdefault("ocp arcs", {})
    key = (
        *modes.items(),
        *released,
        *leaving.items(),
        *caught.items(),
        STOPPED,
        *stopped.items(),
        *sizes.items(),
        *margin,
    )
    if key not in kept:
        made = mode_model(model, modes)
        outputs: dict[str, ca.SX] = {}
        fading, catch = ca.SX(0), 1.0 - CATCH * margin[0]
        if leaving:
            made, left = _with_clock(made)
            fading = margin[0] * ca.tanh((left / margin[1]) ** 2)
        for c in rubbing(model):
            outputs[f"{c.name}_slip"] = c.slip
            size, mode = sizes[c.name], modes[c.name]
            if mode and c.name not in released:
                continue
            force, rooms = holding(model, modes, c.name)
            if mode:
                outputs[f"{c.name}{PULLED}"] = -rooms[mode] / size
                continue
            for side, name in SIDES.items():
                less = fading if leaving.get(c.name) == side else 0.0
                outputs[f"{c.name}_{name}"] = made.expression(f"{c.name}_grip_{name}") / size - less
                outputs[f"{c.name}{FIRST}{name}"] = rooms[side] / size
            if side := stopped.get(c.name, 0):
                ahead = side * c.sliding(side)
                outputs[f"{c.name}{STOPPED}"] = (catch * ahead - side * force) / size
            if side := caught.get(c.name, 0):
                back = -side * c.sliding(-side)
                outputs[f"{c.name}{CAUGHT}"] = (side * force + catch * back) / size
        new = {name: Output(expression, "1") for name, expression in outputs.items()}
        kept[key] = with_outputs(made, new)
    return kept[key]


def _with_clock(model: Model) -> tuple[Model, ca.SX]:
    """`model` with the time that is left as a state, and its symbol."""
    left = Variable(LEFT, "s", nominal=0.1)
    rate, changes = ca.SX(-1.0), dict[str, Any](x=(*model.x, left))
    mechanics = model.holonomic
    if mechanics is None:
        rates = ca.SX(0, 1) if model.ode is None else model.ode
        return replace(model, **changes, ode=ca.vertcat(rates, rate)), left.symbol
    inner = mechanics.inner
    if inner is not None:
        inner = replace(inner, groups=(*inner.groups, left.symbol))
    mechanics = replace(mechanics, rates=ca.vertcat(mechanics.rates, rate), inner=inner)
    changes |= {"ode": None, "alg": ca.SX(0, 1)}  # made of `holonomic` once more
    return replace(model, **changes, holonomic=mechanics), left.symbol
