"""The Oregonator: Field and Noyes' model of the Belousov-Zhabotinskii reaction."""

import casadi as ca

from symfric.bench.problems.problem import Problem, numbered, unknowns
from symfric.model import Model


def model() -> Model:
    """Concentrations run over five decades within a period."""
    x = unknowns([1, 2, 3], [1, 1, 1])
    y1, y2, y3 = (v.symbol for v in x)
    ode = ca.vertcat(
        77.27 * (y2 + y1 * (1 - 8.375e-6 * y1 - y2)),
        (y3 - (1 + y1) * y2) / 77.27,
        0.161 * (y1 - y3),
    )
    return Model("oregonator", x=x, ode=ode)


PROBLEM = Problem(
    "Oregonator",
    model,
    360.0,
    numbered([0.1000814870318523e1, 0.1228178521549917e4, 0.1320554942846706e3]),
)
