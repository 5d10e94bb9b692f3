"""Van der Pol's oscillator, with relaxations a million times faster than its period."""

import casadi as ca

from symfric.bench.problems.problem import Problem, numbered, unknowns
from symfric.model import Model

EPSILON = 1e-6


def model() -> Model:
    """Scaled to a period of order 1."""
    x = unknowns([2, 0], [2, 2])
    y1, y2 = (v.symbol for v in x)
    return Model("van_der_pol", x=x, ode=ca.vertcat(y2, ((1 - y1**2) * y2 - y1) / EPSILON))


PROBLEM = Problem("van der Pol", model, 2.0, numbered([0.1706167732170483e1, -0.8928097010247975]))
