"""Velocity of the slider.

Compared: both laws, each with the same machine in the crank's angle, written by hand and solved by
SUNDIALS; and with each other.

Distance: largest difference from that by hand, both laws.

Reproduced: both laws overlap, as the text says, and drift apart after some time, as it observes:
the difference grows over the run.

Undecided: the instant at which they do, which is lost.
"""

from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.self_tuning._runs_crank import apart, distance, picture
from symfric.gallery.signals import largest


def plate(quick: bool = False) -> Plate:
    """0.25 s from 120 rad/s, four turns of the crank."""
    t_end = 0.05 if quick else 0.25
    numbers = {"laws apart [m/s]": largest(apart("slider'", t_end))}
    differences = apart("slider'", t_end)
    half = differences.size // 2
    numbers["laws apart in the first half [m/s]"] = largest(differences[:half])
    numbers["laws apart in the second half [m/s]"] = largest(differences[half:])
    _, early, late = numbers.values()
    claims = {"they drift apart": late > 2 * early}
    figure = picture("slider'", "slider velocity\n[m/s]", t_end, "m")
    far, within = distance("slider'", t_end), 4e-8 if quick else 1.5e-6
    return plate_of(__name__, figure, far, "m/s", numbers, claims, within=within, quick=quick)
