"""Chemical Akzo Nobel: two species mixed while carbon dioxide is added; index 1."""

import casadi as ca

from symfric.bench.problems.problem import Problem, numbered, unknowns
from symfric.foundation.parameters import Variable
from symfric.model import Model

START = (0.444, 0.00123, 0.0, 0.007, 0.0)


def model() -> Model:
    """The sixth concentration follows from an equilibrium."""
    k1, k2, k3, k4, K = 18.7, 0.58, 0.09, 0.42, 34.4
    klA, pCO2, H, Ks = 3.3, 0.9, 737.0, 115.83
    x = unknowns(START, [0.1, 1e-3, 0.1, 1e-3, 1e-2], "mol/L")
    z = Variable("y6", "mol/L", start=Ks * START[0] * START[3], nominal=0.1)
    (y1, y2, y3, y4, y5), y6 = (v.symbol for v in x), z.symbol
    r1, r2, r3 = k1 * y1**4 * ca.sqrt(y2), k2 * y3 * y4, k2 / K * y1 * y5
    r4, r5 = k3 * y1 * y4**2, k4 * y6**2 * ca.sqrt(y2)
    inflow = klA * (pCO2 / H - y2)
    ode = ca.vertcat(
        -2 * r1 + r2 - r3 - r4,
        -0.5 * r1 - r4 - 0.5 * r5 + inflow,
        r1 - r2 + r3,
        -r2 + r3 - 2 * r4,
        r2 - r3 + r5,
    )
    return Model("akzo_nobel", x=x, z=(z,), ode=ode, alg=Ks * y1 * y4 - y6)


PROBLEM = Problem(
    "Chemical Akzo Nobel",
    model,
    180.0,
    numbered(
        [
            0.1150794920661702,
            0.1203831471567715e-2,
            0.1611562887407974,
            0.3656156421249283e-3,
            0.1708010885264404e-1,
            0.4873531310307455e-2,
        ]
    ),
)
