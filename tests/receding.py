"""Controllers that tests share."""

from functools import cache
from typing import Any

import casadi as ca

from ocp.formulation.expressions import at_end, effort, track
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.mpc.controller import Controller, controller_of
from symfric import BrownMcPhee, drive
from symfric.foundation.parameters import Variable
from symfric.model import Model

COST = (
    track("x", "goal", 900.0)
    + track("v", 0.0, 1.0)
    + effort("force", 1e-3)
    + at_end(lambda s: 100 * (s.x - s.goal) ** 2 + s.v**2)
)


def rubbing(v_t: float = 1e-2) -> Model:
    return drive(BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=v_t), m=1.0, N=1.0)


def positioning(model: Model | None = None, **more: Any) -> Problem:
    kept = {"bounds": {"force": (-20.0, 20.0)}, "p": {"goal": 0.0}} | more
    return Problem(Phase(rubbing() if model is None else model, T=0.2), COST, **kept)


@cache
def controller() -> Controller:
    return controller_of(positioning(), 0.01)


def linear_model() -> Model:
    """x'' = a + b, two inputs, and an unstable mode."""
    x, v, w = Variable("x", "m"), Variable("v", "m/s"), Variable("w", "1")
    a, b = Variable("a", "m/s^2"), Variable("b", "m/s^2")
    ode = ca.vertcat(v.symbol, a.symbol + b.symbol, 2 * w.symbol + b.symbol - 0.5 * v.symbol)
    return Model(name="pair", x=(x, v, w), u=(a, b), ode=ode)
