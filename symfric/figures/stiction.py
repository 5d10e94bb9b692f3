"""Stiction: friction follows the force that pulls, up to the static level."""

import casadi as ca
import numpy as np

from symfric.figures.data import Curve, FigureData
from symfric.figures.motion import fine, pushed
from symfric.figures.requirements import require
from symfric.figures.scales import NORMAL_FORCE, Scales, scales
from symfric.laws import AnyLaw, law_name


def stiction(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    excess: float = 1.3,
    period: float = 1.0,
) -> FigureData:
    """Friction of a block under F_e = excess F_S sin(2 pi t/period), and its velocity.

    F_S is the static level; the block has 0.8 kg, or 1 kg per 1.5 N of F_S where that is more.
    Columns t [s], F_e, F [N], v [m/s] of one and a half periods from rest. At rest friction equals
    F_e, the diagonal of the first panel; while the block slides it is the kinetic force with the
    sign of the velocity.

    Raises:
        ValueError: a law with neither dynamic nor static friction.
    """
    require("stiction", law, "D", "S")
    magnitudes = given or scales(law, N)

    def force(t: ca.SX) -> ca.SX:
        return excess * magnitudes.static * ca.sin(2 * ca.pi / period * t)

    run = pushed(law, N, magnitudes.mass, force, 1.5 * period)
    found = run.at(t := np.union1d(fine(run), np.linspace(0.0, 1.5 * period, 601)))
    columns = {"t": t, "F_e": found["force"], "F": found["friction"], "v": found["v"]}
    return FigureData(
        "stiction",
        f"pulled by F_e = {excess:g} F_S sin(2πt/{period:g} s), N = {N:g} N",
        {"t": "s", "F_e": "N", "F": "N", "v": "m/s"},
        (("F_e", "F"), ("t", "v")),
        (Curve(law_name(law), "", columns),),
    )
