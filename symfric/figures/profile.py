"""Force over velocity in steady sliding, around rest."""

import numpy as np

from symfric.figures.data import Curve, FigureData
from symfric.figures.requirements import finite
from symfric.figures.scales import NORMAL_FORCE, Scales, scales
from symfric.laws import AnyLaw, law_name, steady_force, steady_inputs


def profile(law: AnyLaw, N: float = NORMAL_FORCE, given: Scales | None = None) -> FigureData:
    """Force-velocity profile over +-5 Stribeck velocities.

    Columns v [m/s], F [N]. Every law has one. Further inputs of a law, such as the applied force,
    have the values that the title says, with the sign of v.

    Args:
        law: with numbers for parameters.
        N: normal force [N].
        given: magnitudes to take the range from, instead of those of the law.
    """
    V = (given or scales(law, N)).velocity
    fine = np.geomspace(1e-4 * V, 5 * V, 600)
    v = np.concatenate([-fine[::-1], [0.0], fine])
    return FigureData(
        "profile",
        f"force in steady sliding, N = {N:g} N{steady_inputs(law)}",
        {"v": "m/s", "F": "N"},
        (("v", "F"),),
        (Curve(law_name(law), "", {"v": v, "F": finite("profile", law, steady_force(law, v, N))}),),
    )
