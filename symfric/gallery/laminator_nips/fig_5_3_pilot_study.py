"""The pilot study: mean forces, the identified curve, and its errors.

Compared: the curve that is identified from points with noise, all at once and by the six steps of
the thesis, with the printed one that made them.

Distance: rms difference of the curve found at once from the printed one, over the mean force.

Evidence: the curve comes back, with an error of 5 %, of the size of the thesis's 8 %. Refuted is
that its five digits mean anything: with other noise of that size the parameters scatter by the
shares given beside, 6 to 120 % at once, and the six steps, which read two levels off single points,
leave three times the error. F_s and v_s rest on speeds that the thesis itself calls unstable:
without them F_s is anything from half its value to any size. And 50 speeds of nine tests are 450
tests, not 150.
"""

import numpy as np

from symfric.foundation.panels import panels
from symfric.gallery.laminator_nips import _studies as studies
from symfric.gallery.plate import Plate, plate_of


def plate(quick: bool = False) -> Plate:
    """Identify the pilot study again, with one noise and with many."""
    printed = studies.PRINTED["pilot"]
    v, force = studies.measured("pilot")
    once, half = studies.at_once(v, force)
    laws = {"printed": printed, "all at once": once}
    steps = studies.in_steps(v, force)
    if steps is not None:
        laws["six steps"] = steps

    figure, (above, *below) = panels(3, height=1.7)
    studies.draw_curves(above, v, force, laws)
    studies.draw_errors(below, v, force, once)

    numbers = {
        f"error of the curve, {way}, 8 % in the thesis [%]": 100 * studies.error(law, v, force)
        for way, law in laws.items()
    } | studies.told(laws, half)
    claims = {
        "the error is of the size of the thesis's 8 %": 0.04 < studies.error(once, v, force) < 0.1,
        "50 speeds of nine tests are 450": v.size * 9 == 450,
        "the six steps leave three times the error": steps is None
        or 2.5 < studies.error(steps, v, force) / studies.error(once, v, force) < 3.5,
    }
    if not quick:
        spread = studies.scatter("pilot", 20)
        lowest, highest = (alone := studies.without_unstable("pilot", 20)).values()
        numbers |= spread | alone
        shares = [spread[f"{name}, spread, all at once [%]"] for name in studies.NAMES]
        claims |= {
            "parameters scatter by 6 to 120 %": 5 < min(shares) < max(shares) < 150,
            "without unstable speeds F_s is anything from half its value up": (
                lowest < 0.5 * float(printed.F_S) and highest > 100 * float(printed.F_S)
            ),
        }
    far = np.sqrt(np.mean((studies.curve(once, v) - studies.curve(printed, v)) ** 2))
    return plate_of(__name__, figure, float(far / force.mean()), "1", numbers, claims)
