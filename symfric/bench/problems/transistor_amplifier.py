"""A transistor amplifier: M y' = f(y, t) with a singular M, capacitors between nodes; index 1."""

import casadi as ca
import numpy as np

from symfric.bench.problems.problem import Problem, numbered, unknowns
from symfric.model import Model

SUPPLY, THERMAL, ALPHA, BETA, R0, R = 6.0, 0.026, 0.99, 1e-6, 1e3, 9e3
CAPACITIES = tuple(k * 1e-6 for k in range(1, 6))


def model() -> Model:
    """Node voltages; currents at each node sum to zero. Given as it stands, no M is inverted."""
    x = unknowns([0, 3, 3, 6, 3, 3, 6, 0], [1] * 8, "V")
    y1, y2, y3, y4, y5, y6, y7, y8 = (v.symbol for v in x)
    t, rates = ca.SX.sym("t"), ca.SX.sym("rates", 8)
    signal = 0.1 * ca.sin(200 * np.pi * t)
    first, second = (BETA * (ca.exp(u / THERMAL) - 1) for u in (y2 - y3, y5 - y6))
    currents = ca.vertcat(
        (y1 - signal) / R0,
        (2 * y2 - SUPPLY) / R + (1 - ALPHA) * first,
        y3 / R - first,
        (y4 - SUPPLY) / R + ALPHA * first,
        (2 * y5 - SUPPLY) / R + (1 - ALPHA) * second,
        y6 / R - second,
        (y7 - SUPPLY) / R + ALPHA * second,
        y8 / R,
    )
    return Model("transistor_amplifier", x=x, xdot=rates, residual=mass() @ rates - currents, t=t)


def mass() -> ca.DM:
    """Capacitors C1, C3, C5 between two nodes each, C2 and C4 to ground."""
    C1, C2, C3, C4, C5 = CAPACITIES
    M = np.diag([-C1, -C1, -C2, -C3, -C3, -C4, -C5, -C5])
    for i, C in ((0, C1), (3, C3), (6, C5)):
        M[i, i + 1] = M[i + 1, i] = C
    return ca.DM(M)


PROBLEM = Problem(
    "transistor amplifier",
    model,
    0.2,
    numbered(
        [
            -0.5562145012262709e-2,
            0.3006522471903042e1,
            0.2849958788608128e1,
            0.2926422536206241e1,
            0.2704617865010554e1,
            0.2761837778393145e1,
            0.4770927631616772e1,
            0.1236995868091548e1,
        ]
    ),
)
