"""Accelerations of a model: rates of the states that are rates of others."""

from typing import TYPE_CHECKING

import casadi as ca

from symfric.model.parts import Output

if TYPE_CHECKING:
    from symfric.model.model import Model

PER_SECOND = {"m/s": "m/s^2", "rad/s": "rad/s^2", "1/s": "1/s^2"}


def accelerations(model: "Model") -> dict[str, Output]:
    """`<q>_acc` for every state q whose rate is a state r: the rate of r, as an expression.

    None for implicit models, whose rates are no expressions.
    """
    if model.ode is None:
        return {}
    by_symbol = {v.symbol.__hash__(): (v, i) for i, v in enumerate(model.x)}
    found: dict[str, Output] = {}
    for v, rate in zip(model.x, ca.vertsplit(ca.densify(model.ode)), strict=True):
        # a symbol is told by its node, which it shares with what it was taken from
        known = by_symbol.get(rate.__hash__()) if rate.is_symbolic() else None
        if known is not None:
            r, i = known
            unit = PER_SECOND.get(r.unit, f"{r.unit}/s" if r.unit else "")
            found[f"{v.name}_acc"] = Output(model.ode[i], unit, f"acceleration of {v.name}")
    return found
