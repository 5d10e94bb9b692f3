"""Acceleration of the crank.

Compared: both laws, each with the same machine in the crank's angle, written by hand and solved by
SUNDIALS; and with each other.

Distance: largest difference from that by hand, both laws.

Reproduced: the profiles are smooth, overlap within 0.2 % of the greatest acceleration, and the
joints are not violated. That no jitter is seen here follows from figure 13: the bearing slides at 8
m/s and more, eight hundred times the velocity of the peak, where both laws are flat.

Undecided: the data of the machine, which are Haug's here.
"""

from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.self_tuning._runs_crank import LAWS, V_T, apart, distance, picture, run
from symfric.gallery.signals import largest


def plate(quick: bool = False) -> Plate:
    """0.25 s from 120 rad/s, four turns of the crank."""
    t_end = 0.05 if quick else 0.25
    numbers = {"laws apart [rad/s^2]": largest(apart("crank''", t_end))}
    slowest = min(float(run(law, t_end)["crank'"].min()) for law in LAWS)
    numbers["slowest slip in the bearing / velocity of the peak [1]"] = 0.1 * slowest / V_T
    numbers["largest norm of the constraints [m]"] = max(
        largest(run(law, t_end)["constraint"]) for law in LAWS
    )
    greatest = largest(run("Brown-McPhee", t_end)["crank''"])
    numbers["greatest acceleration [rad/s^2]"] = greatest
    claims = {
        "the bearing slides at 800 times the velocity of the peak": 0.1 * slowest > 800 * V_T,
        "the laws overlap within 0.2 %": largest(apart("crank''", t_end)) < 2e-3 * greatest,
        "constraints hold": numbers["largest norm of the constraints [m]"] < 1e-7,
    }
    figure = picture("crank''", "crank acceleration\n[rad/s²]", t_end)
    far, within = distance("crank''", t_end), 6e-6 if quick else 1.5e-4
    return plate_of(__name__, figure, far, "rad/s^2", numbers, claims, within=within, quick=quick)
