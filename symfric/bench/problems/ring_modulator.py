"""The ring modulator: mixes a low and a high frequency; parasitic capacities of 2 pF."""

import casadi as ca
import numpy as np

from symfric.bench.problems.problem import Problem, numbered, unknowns
from symfric.model import Model

C, CS, CP, R, RP = 1.6e-8, 2e-12, 1e-8, 25e3, 50.0
LH, LS1, LS2, LS3 = 4.45, 2e-3, 5e-4, 5e-4
RG1, RG2, RG3, RI, RC = 36.3, 17.3, 17.3, 50.0, 600.0
GAMMA, DELTA = 40.67286402e-9, 17.7493332


def model() -> Model:
    """Seven voltages and eight currents; highly oscillatory, and stiff by the small CS."""
    x = unknowns([0] * 15, [0.1] * 7 + [1e-7] * 2 + [1e-4] * 6)
    y1, y2, y3, y4, y5, y6, y7, y8, y9, y10, y11, y12, y13, y14, y15 = (v.symbol for v in x)
    t = ca.SX.sym("t")
    low, high = 0.5 * ca.sin(2e3 * np.pi * t), 2 * ca.sin(2e4 * np.pi * t)
    q1, q2, q3, q4 = (
        GAMMA * (ca.exp(DELTA * u) - 1)
        for u in (
            y3 - y5 - y7 - high, -y4 + y6 - y7 - high, y4 + y5 + y7 + high, -y3 - y6 + y7 + high
        )
    )  # fmt: skip
    ode = ca.vertcat(
        (y8 - 0.5 * y10 + 0.5 * y11 + y14 - y1 / R) / C,
        (y9 - 0.5 * y12 + 0.5 * y13 + y15 - y2 / R) / C,
        (y10 - q1 + q4) / CS,
        (-y11 + q2 - q3) / CS,
        (y12 + q1 - q3) / CS,
        (-y13 - q2 + q4) / CS,
        (-y7 / RP + q1 + q2 - q3 - q4) / CP,
        -y1 / LH,
        -y2 / LH,
        (0.5 * y1 - y3 - RG2 * y10) / LS2,
        (-0.5 * y1 + y4 - RG3 * y11) / LS3,
        (0.5 * y2 - y5 - RG2 * y12) / LS2,
        (-0.5 * y2 + y6 - RG3 * y13) / LS3,
        (-y1 + low - (RI + RG1) * y14) / LS1,
        (-y2 - (RC + RG1) * y15) / LS1,
    )
    return Model("ring_modulator", x=x, ode=ode, t=t)


PROBLEM = Problem(
    "ring modulator",
    model,
    1e-3,
    numbered(
        [
            -0.2339057358486745e-1,
            -0.7367485485540825e-2,
            0.2582956709291169,
            -0.4064465721283450,
            -0.4039455665149794,
            0.2607966765422943,
            0.1106761861269975,
            0.2939904342435596e-6,
            -0.2840029933642329e-7,
            0.7267198267264553e-3,
            0.7929487196960840e-3,
            -0.7255283495698965e-3,
            -0.7941401968526521e-3,
            0.7088495416976114e-4,
            0.2390059075236570e-4,
        ]
    ),
    laborious=("radau5",),
)
