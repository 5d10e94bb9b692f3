"""Accelerations of a model: rates of the states that are rates of others."""

from typing import TYPE_CHECKING

import casadi as ca

from symfric.model.parts import Output

if TYPE_CHECKING:
    from symfric.model.model import Model

PER_SECOND = {"m/s": "m/s^2", "rad/s": "rad/s^2", "1/s": "1/s^2"}


def accelerations(model: "Model") -> dict[str, Output]:
    """`<q>_acc` for every state q whose rate is a state r: the rate of r, as an expression.

    A speed that is the rate of no state, as where angles do not matter, has `<speed>_acc`; states
    of friction laws have none, and neither have implicit models, whose rates are no expressions.
    """
    if model.ode is None:
        return {}
    places = {v.symbol.__hash__(): i for i, v in enumerate(model.x)}
    of_laws = {v.name for contact in model.contacts for v in contact.states}
    found: dict[str, Output] = {}
    rates = ca.vertsplit(ca.densify(model.ode))
    # a symbol is told by its node, which it shares with what it was taken from
    pairs = [(v, places.get(r.__hash__()) if r.is_symbolic() else None)
             for v, r in zip(model.x, rates, strict=True)]  # fmt: skip
    taken = {i for _, i in pairs if i is not None}
    for k, (v, i) in enumerate(pairs):
        alone = k not in taken and v.unit in ("m/s", "rad/s") and v.name not in of_laws
        if i is None and not alone:
            continue
        r = k if i is None else i
        unit = model.x[r].unit
        unit = PER_SECOND.get(unit, f"{unit}/s" if unit else "")
        found[f"{v.name}_acc"] = Output(model.ode[r], unit, f"acceleration of {v.name}")
    return found
