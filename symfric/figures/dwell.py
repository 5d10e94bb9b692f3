"""Dwell: static friction grows with the time at rest."""

from collections.abc import Sequence
from math import isfinite

import casadi as ca
import numpy as np

from symfric.figures.data import Curve, FigureData
from symfric.figures.motion import slides
from symfric.figures.requirements import require
from symfric.figures.scales import NORMAL_FORCE, Scales, scales
from symfric.foundation.parameters import parameters
from symfric.laws import AnyLaw, law_name


def dwell(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    holds: Sequence[float] = (0.01, 0.1, 1.0, 10.0, 100.0, 1000.0),
) -> FigureData:
    """Peak of the force when sliding starts again after a time at rest (slide, hold, slide).

    The contact slides at the Stribeck velocity until it is steady, rests for each of `holds` [s],
    and slides again. Columns hold [s], F [N], the greatest force from then on.

    Raises:
        ValueError: a law whose static friction does not depend on the dwell time.
    """
    require("dwell", law, "T")
    magnitudes = given or scales(law, N)
    V, way = magnitudes.velocity, 20 * memory(law, magnitudes)
    slide_for = max(1.0, way / V)

    def velocity(t: ca.SX, hold: ca.SX) -> ca.SX:
        resting = ca.logic_and(t >= slide_for, t < slide_for + hold)
        return ca.if_else(resting, 0.0, V)

    slide = slides(law, N, velocity)
    again = np.concatenate([[0.0], slide_for * np.geomspace(1e-5, 1.0, 801)])
    peaks = [
        slide("", slide_for + hold + again, hold, jumps=(slide_for, slide_for + hold))["F"].max()
        for hold in holds
    ]
    return FigureData(
        "dwell",
        f"slide, hold, slide at {V:.3g} m/s, N = {N:g} N",
        {"hold": "s", "F": "N"},
        (("hold", "F"),),
        (Curve(law_name(law), "", {"hold": np.array(holds), "F": np.array(peaks)}),),
        log=("hold",),
        dots=True,
    )


def memory(law: AnyLaw, magnitudes: Scales) -> float:
    """The way that renews the contacts [m]: D_c, else the pre-sliding distance, else 1e-5."""
    known = parameters(law)
    if "D_c" in known:
        return float(known["D_c"].value)
    return magnitudes.stretch if isfinite(magnitudes.stretch) else 1e-5
