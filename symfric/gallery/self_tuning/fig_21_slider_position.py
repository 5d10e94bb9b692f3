"""Position of the slider.

Compared: both laws, each with the same machine in the crank's angle, written by hand and solved by
SUNDIALS; and with each other.

Distance: largest difference from that by hand, both laws.

Reproduced: both laws overlap. The position itself checks little: it follows from the crank's angle
by the lengths alone, and no law can move it out of its stroke.
"""

import numpy as np

from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.self_tuning._runs_crank import apart, distance, picture, run
from symfric.gallery.signals import largest


def plate(quick: bool = False) -> Plate:
    """0.25 s from 120 rad/s, four turns of the crank."""
    t_end = 0.05 if quick else 0.25
    numbers = {"laws apart [m]": largest(apart("slider", t_end))}
    one = run("Brown-McPhee", t_end)
    y, z = 0.1 - 0.08 * np.sin(one["crank"]), 0.1 + 0.08 * np.cos(one["crank"])
    x = np.sqrt(0.3**2 - y**2 - z**2)
    numbers["largest violation of the closed form by the angle [m]"] = largest(one["slider"] - x)
    numbers["stroke [m]"] = float(np.ptp(one["slider"]))
    claims = {
        "the position follows from the angle by the lengths": largest(one["slider"] - x) < 1e-12,
        "the laws overlap within 0.1 % of the stroke": (
            numbers["laws apart [m]"] < 1e-3 * numbers["stroke [m]"]
        ),
    }
    figure = picture("slider", "slider position\n[m]", t_end, "µ")
    far, within = distance("slider", t_end), 4e-10 if quick else 1.2e-8
    return plate_of(__name__, figure, far, "m", numbers, claims, within=within, quick=quick)
