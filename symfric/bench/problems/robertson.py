"""Robertson's autocatalytic reactions, over eleven decades of time."""

import casadi as ca

from symfric.bench.problems.problem import Problem, numbered, unknowns
from symfric.model import Model


def model() -> Model:
    """Two of the three concentrations end at 2e-8 and 8e-14: that is what is small for them."""
    x = unknowns([1, 0, 0], [1e-8, 1e-13, 1])
    y1, y2, y3 = (v.symbol for v in x)
    slow, fast = -0.04 * y1 + 1e4 * y2 * y3, 3e7 * y2**2
    return Model("robertson", x=x, ode=ca.vertcat(slow, -slow - fast, fast))


PROBLEM = Problem(
    "Robertson",
    model,
    1e11,
    numbered([0.2083340149701255e-7, 0.8333360770334713e-13, 0.9999999791665050]),
)
