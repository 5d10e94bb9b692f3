"""A velocity that jumps: the direct effect, and how the contacts age anew."""

import casadi as ca
import numpy as np

from symfric.figures.data import Curve, FigureData
from symfric.figures.dwell import memory
from symfric.figures.motion import UNITS, slides
from symfric.figures.requirements import require
from symfric.figures.scales import NORMAL_FORCE, Scales, scales
from symfric.laws import AnyLaw, law_name

LEG = 20.0
"""Way at each velocity, in ways that renew the contacts."""


def velocity_step(
    law: AnyLaw, N: float = NORMAL_FORCE, given: Scales | None = None, factor: float = 10.0
) -> FigureData:
    """Force along the way while the velocity jumps from V to `factor` V and back.

    V is the Stribeck velocity, that of `RateAndState` its reference velocity. Columns t [s], x [m],
    v [m/s], F [N]. The way at each velocity is 20 times that which renews the contacts, D_c or the
    pre-sliding distance. Rate-and-state friction jumps by a ln(factor) N and falls by
    b ln(factor) N behind it.

    Raises:
        ValueError: a law without frictional lag.
    """
    require("velocity_step", law, "L")
    magnitudes = given or scales(law, N)
    V = magnitudes.velocity
    slow = LEG * memory(law, magnitudes) / V
    ends = np.cumsum([0.5 * slow, slow / factor, slow])

    def velocity(t: ca.SX, pace: ca.SX) -> ca.SX:
        fast = ca.logic_and(t >= ends[0], t < ends[1])
        return pace * V * ca.if_else(fast, factor, 1.0)

    legs = zip((0.0, *ends[:-1]), ends, strict=True)
    times = np.concatenate([a + (b - a) * np.linspace(0.0, 1.0, 301) ** 3 for a, b in legs])
    curve = slides(law, N, velocity)("", np.unique(times), 1.0, jumps=ends[:-1].tolist())
    return FigureData(
        "velocity_step",
        f"v from {V:.3g} to {factor * V:.3g} m/s and back, N = {N:g} N",
        UNITS,
        (("x", "F"),),
        (Curve(law_name(law), "", curve.columns),),
    )
