"""Acceleration of the slider.

Compared: both laws, each with the same machine in the crank's angle, written by hand and solved by
SUNDIALS; and with each other.

Distance: largest difference from that by hand, both laws.

Reproduced: both laws overlap, as the text says, within 0.2 % of the greatest acceleration.
"""

from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.self_tuning._runs_crank import apart, distance, picture, run
from symfric.gallery.signals import largest


def plate(quick: bool = False) -> Plate:
    """0.25 s from 120 rad/s, four turns of the crank."""
    t_end = 0.05 if quick else 0.25
    numbers = {"laws apart [m/s^2]": largest(apart("slider''", t_end))}
    numbers["largest acceleration [m/s^2]"] = largest(run("Brown-McPhee", t_end)["slider''"])
    apart_by, greatest = numbers.values()
    claims = {"the laws overlap within 0.2 %": apart_by < 2e-3 * greatest}
    figure = picture("slider''", "slider acceleration\n[m/s²]", t_end)
    far, within = distance("slider''", t_end), 4e-6 if quick else 1e-4
    return plate_of(__name__, figure, far, "m/s^2", numbers, claims, within=within, quick=quick)
