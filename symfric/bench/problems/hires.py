"""HIRES: high irradiance responses of photomorphogenesis, eight reactions of phytochrome."""

import casadi as ca

from symfric.bench.problems.problem import Problem, numbered, unknowns
from symfric.model import Model


def model() -> Model:
    """Stiff, eight concentrations."""
    x = unknowns([1, 0, 0, 0, 0, 0, 0, 0.0057], [1, 0.1, 0.1, 0.1, 0.1, 0.5, 0.005, 0.005])
    y1, y2, y3, y4, y5, y6, y7, y8 = (v.symbol for v in x)
    ode = ca.vertcat(
        -1.71 * y1 + 0.43 * y2 + 8.32 * y3 + 0.0007,
        1.71 * y1 - 8.75 * y2,
        -10.03 * y3 + 0.43 * y4 + 0.035 * y5,
        8.32 * y2 + 1.71 * y3 - 1.12 * y4,
        -1.745 * y5 + 0.43 * y6 + 0.43 * y7,
        -280 * y6 * y8 + 0.69 * y4 + 1.71 * y5 - 0.43 * y6 + 0.69 * y7,
        280 * y6 * y8 - 1.81 * y7,
        -280 * y6 * y8 + 1.81 * y7,
    )
    return Model("hires", x=x, ode=ode)


PROBLEM = Problem(
    "HIRES",
    model,
    321.8122,
    numbered(
        [
            0.7371312573325668e-3,
            0.1442485726316185e-3,
            0.5888729740967575e-4,
            0.1175651343283149e-2,
            0.2386356198831331e-2,
            0.6238968252742796e-2,
            0.2849998395185769e-2,
            0.2850001604814231e-2,
        ]
    ),
)
