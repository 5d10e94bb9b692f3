"""Hysteresis in pre-sliding, loops within loops, at several speeds."""

from collections.abc import Sequence

import numpy as np

from symfric.figures.data import FigureData
from symfric.figures.motion import UNITS, slides, through
from symfric.figures.requirements import require
from symfric.figures.scales import NORMAL_FORCE, Scales, scales
from symfric.laws import AnyLaw

ROUTE = (0.0, 2.0, -2.0, 1.0, -1.0, 1.0, -2.0, 2.0)
"""Turning points in pre-sliding distances: a loop from -1 to 1 within one from -2 to 2."""


def hysteresis(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    speeds: Sequence[float] = (1.0, 5.0, 20.0),
    duration: float = 8.0,
    route: Sequence[float] | None = None,
) -> FigureData:
    """Force over position along nested loops at several `speeds` (Lampaert et al. 2003).

    Columns t [s], x [m], v [m/s], F [N]. The loops turn at 1 and 2 pre-sliding distances, or at
    the positions `route` [m], and take `duration` [s] at speed 1. A law with non-local memory
    returns to the force of each turning point it comes back to (the second arrival at 1 and at -2);
    a rate-independent one draws the same curve at every speed.

    Raises:
        ValueError: a law without pre-sliding displacement, or one that needs the applied force.
    """
    require("hysteresis", law, "P")
    if route is None:
        stretch = (given or scales(law, N)).stretch
        route = [point * stretch for point in ROUTE]
    elif len(route) < 2:
        raise ValueError(f"hysteresis: route: expected at least two turning points, got {route!r}")
    leg = duration / (len(route) - 1)
    slide = slides(law, N, through(route, leg))
    curves = [
        slide(f"{speed:g}x", np.linspace(0.0, duration / speed, 1401), speed) for speed in speeds
    ]
    return FigureData(
        "hysteresis",
        f"pre-sliding hysteresis, {duration:g} s at 1x, N = {N:g} N",
        UNITS,
        (("x", "F"),),
        tuple(curves),
    )
