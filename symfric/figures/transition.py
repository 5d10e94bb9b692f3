"""Between pre-sliding and sliding: a velocity that reverses."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from symfric.figures.data import FigureData
from symfric.figures.motion import UNITS, slides
from symfric.figures.requirements import require
from symfric.figures.scales import NORMAL_FORCE, Scales, scales
from symfric.laws import AnyLaw


def transition(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    frequencies: Sequence[float] = (2.0, 10.0),
    periods: int = 2,
) -> FigureData:
    """Force over a sinusoidal velocity of 5 Stribeck velocities (Lampaert et al. 2003).

    Columns t [s], x [m], v [m/s], F [N] of the last of `periods`, for each of `frequencies` [Hz].
    The contact goes from pre-sliding to sliding and back twice a period.

    Raises:
        ValueError: a law without pre-sliding displacement, or one that needs the applied force.
    """
    require("transition", law, "P")
    V = 5 * (given or scales(law, N)).velocity

    def velocity(t: ca.SX, pace: ca.SX) -> ca.SX:
        return V * ca.sin(2 * ca.pi * pace * t)

    slide = slides(law, N, velocity)
    curves = [
        slide(f"{f:g} Hz", np.linspace((periods - 1) / f, periods / f, 1201), f)
        for f in frequencies
    ]
    return FigureData(
        "transition",
        f"from pre-sliding to sliding, v = {V:.3g} m/s sin(2πft), N = {N:g} N",
        UNITS,
        (("v", "F"), ("x", "F")),
        tuple(curves),
    )
