"""The pilot study: mean forces, the identified curve, and its errors.

Compared: the curve that is identified from points with noise, all at once and by the six steps of
the thesis, with the printed one that made them.

Distance: rms difference of the curve found at once from the printed one, over the mean force.

Reproduced: the curve comes back, and its error is of the size of the thesis's 8 %: 6 % in the
median of 60 noises like it.

Refuted: that its five digits mean anything. Over these noises the parameters scatter by the shares
given beside, 7 to 110 % at once. The six steps, which read two levels off single points, leave 1.3
to 2.4 times the error, 1.7 in the median. F_s and v_s rest on speeds that the thesis itself calls
unstable: without them F_s is anything from half its value to any size. And 50 speeds of nine tests
are 450 tests, not 150.

Undecided: the noise of the points, which are not printed; ours has the size of its errors.
"""

import numpy as np

from symfric.foundation.panels import panels
from symfric.gallery.laminator_nips import _studies as studies
from symfric.gallery.plate import Plate, plate_of


def plate(quick: bool = False) -> Plate:
    """Identify the pilot study again, with one noise and with sixty."""
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
    claims = {"50 speeds of nine tests are 450": v.size * 9 == 450}
    if not quick:
        spread = studies.scatter("pilot")
        lowest, highest = (alone := studies.without_unstable("pilot")).values()
        numbers |= spread | alone
        shares = [spread[f"{name}, spread, all at once [%]"] for name in studies.NAMES]
        low, middle, high = [*spread.values()][-2], [*spread.values()][-3], [*spread.values()][-1]
        median = spread["error of the curve, all at once, median of 60 noises [%]"]
        claims |= {
            "the error is 6 % in the median of 60 noises": 5.5 < median < 7,
            "parameters scatter by 7 to 110 %": 6 < min(shares) < 8 < 100 < max(shares) < 120,
            "the six steps leave 1.3 to 2.4 times the error, 1.7 in the median": np.allclose(
                [low, middle, high], [1.3, 1.7, 2.4], atol=0.1
            ),
            "without unstable speeds F_s is anything from half its value up": (
                lowest < 0.5 * float(printed.F_S) and highest > 100 * float(printed.F_S)
            ),
        }
    far = np.sqrt(np.mean((studies.curve(once, v) - studies.curve(printed, v)) ** 2))
    far = float(far / force.mean())
    return plate_of(__name__, figure, far, "1", numbers, claims, within=0.04, quick=quick)
