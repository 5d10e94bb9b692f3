"""Hybrid machines: equations with a mode that events switch."""

from functools import cache

import casadi as ca

from symfric import Event, Model, Variable


@cache
def ball(e: float) -> Model:
    """A ball falls from 1 m and bounces with restitution e."""
    x, v = Variable("x", "m", start=1.0), Variable("v", "m/s")
    bounce = Event("bounce", x.symbol, -1, reset={"x": 0.0, "v": -e * v.symbol})
    return Model("ball", x=(x, v), ode=ca.vertcat(v.symbol, -9.81), events=(bounce,))


@cache
def coulomb_on_a_belt(
    m: float, k: float, v_belt: float, g: float, mu_s: float, mu_d: float
) -> Model:
    """The Rabinowicz block with set-valued Coulomb friction and a static level.

    Mode 0 sticks to the belt, mode -1 slides slower and mode +1 faster than the belt; events
    `turn` and `back` mark the largest and smallest elongation while it slides slower.
    """
    x, v = Variable("x", "m", nominal=0.1), Variable("v", "m/s", nominal=0.1)
    mode = Variable("mode", "1", start=-1.0)
    X, V, slide = x.symbol, v.symbol, mode.symbol
    sticking, spring = slide == 0, k * X
    acceleration = ca.if_else(sticking, 0.0, (-spring - slide * mu_d * m * g) / m)
    hold = {"mode": 0.0, "v": v_belt}
    slow = ca.if_else(slide == -1, 1.0, 0.0)
    return Model(
        "coulomb",
        x=(x, v, mode),
        ode=ca.vertcat(V, acceleration, 0.0),
        events=(
            Event("stick", ca.if_else(slide == -1, V - v_belt, -1.0), 1, reset=hold),
            Event("meet", ca.if_else(slide == 1, v_belt - V, -1.0), 1, reset=hold),
            Event(
                "slip", ca.if_else(sticking, spring - mu_s * m * g, -1.0), 1, reset={"mode": -1.0}
            ),
            Event("turn", slow * V, -1),
            Event("back", slow * V, 1),
        ),
    )
