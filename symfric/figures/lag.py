"""Frictional lag: the force follows the Stribeck curve late."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from symfric.figures.data import Curve, FigureData
from symfric.figures.motion import UNITS, slides
from symfric.figures.requirements import require
from symfric.figures.scales import NORMAL_FORCE, Scales, scales
from symfric.laws import AnyLaw, law_name, steady_force


def lag(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    frequencies: Sequence[float] = (2.0, 5.0, 10.0),
    periods: int = 3,
) -> FigureData:
    """Force over a velocity that rises and falls without reversal (Lampaert et al. 2003, fig. 6).

        v = V [2.5 + 2 sin(2 pi f t)],   V the Stribeck velocity

    Columns t [s], x [m], v [m/s], F [N] of the last of `periods`, for each f of `frequencies` [Hz];
    the curve "steady" is F in steady sliding. With lag the force is higher while v rises than
    while it falls. A memory much longer than the periods has not settled by then: rate-and-state
    renews its contacts over D_c, here within seconds, and shows its direct effect; give it a
    larger velocity by `given`.

    Raises:
        ValueError: a law without frictional lag.
    """
    require("lag", law, "L")
    V = (given or scales(law, N)).velocity

    def velocity(t: ca.SX, pace: ca.SX) -> ca.SX:
        return V * (2.5 + 2 * ca.sin(2 * ca.pi * pace * t))

    slide = slides(law, N, velocity)
    curves = [
        slide(f"{f:g} Hz", np.linspace((periods - 1) / f, periods / f, 401), f) for f in frequencies
    ]
    v = V * np.linspace(0.5, 4.5, 401)
    steady = Curve(law_name(law), "steady", {"v": v, "F": steady_force(law, v, N)}, reference=True)
    return FigureData(
        "lag",
        f"frictional lag, v = {V:.3g} m/s (2.5 + 2 sin(2πft)), N = {N:g} N",
        UNITS,
        (("v", "F"),),
        (*curves, steady),
    )
