"""Velocity of the crank.

Compared: both laws, each with the same machine in the crank's angle, written by hand and solved by
SUNDIALS; and with each other.

Distance: largest difference from that by hand, both laws.

Reproduced: both laws overlap. In sliding both are mu_d N but for their tails, so they do at any
velocity of the peak; this machine says nothing of the transition to rest.
"""

from symfric import BrownMcPhee
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.self_tuning._runs_crank import (
    LAWS,
    MU,
    V_T,
    apart,
    distance,
    picture,
    run,
)
from symfric.gallery.signals import largest
from symfric.scenes.slider_crank import BEARING


def plate(quick: bool = False) -> Plate:
    """0.25 s from 120 rad/s, four turns of the crank."""
    t_end = 0.05 if quick else 0.25
    numbers = {"laws apart [rad/s]": largest(apart("crank'", t_end))}
    for law in LAWS:
        one = run(law, t_end)
        numbers[f"velocity at the end, {law} [rad/s]"] = float(one["crank'"][-1])
        numbers[f"energy lost, {law} [J]"] = float(one["energy"][0] - one["energy"][-1])
    lost = [value for name, value in numbers.items() if name.startswith("energy")]
    claims = {
        "the bearing has the data of Haug's example": (
            {**BEARING.common, **BEARING.laws[BrownMcPhee]} == {**MU, "v_t": V_T}
        ),
        "the laws overlap within 0.02 %": largest(apart("crank'", t_end)) < 2e-4 * 120,
        "they take the same energy within 0.1 %": abs(lost[0] / lost[1] - 1) < 1e-3,
    }
    figure = picture("crank'", "crank velocity\n[rad/s]", t_end, "m")
    far, within = distance("crank'", t_end), 3e-7 if quick else 4e-6
    return plate_of(__name__, figure, far, "rad/s", numbers, claims, within=within, quick=quick)
