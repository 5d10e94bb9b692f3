"""The main study above 140 mm/min: mean forces, the identified curve, and its errors.

Compared: the curve that is identified from the stable speeds alone with the printed one.

Distance: rms difference of the two, over the mean force.

Evidence: in this region the error is that of the noise, as the thesis shows. Refuted is that the
region tells the law: here F_c comes out as nothing, sigma_2 fifty times too large and the exponent
half as large, and the curve is the same. Small errors of a curve are no evidence for its
parameters.
"""

import numpy as np

from symfric.foundation.panels import panels
from symfric.gallery.laminator_nips import _studies as studies
from symfric.gallery.plate import Plate, plate_of


def plate(quick: bool = False) -> Plate:
    """Identify what is left of the main study."""
    printed = studies.PRINTED["main"]
    v, force = studies.measured("main")
    v, force = v[v > studies.UNSTABLE], force[v > studies.UNSTABLE]
    found, half = studies.at_once(v, force)
    laws = {"printed": printed, "all at once": found}

    figure, (above, *below) = panels(3, height=1.7)
    studies.draw_curves(above, v, force, laws)
    studies.draw_errors(below, v, force, found)

    left = np.abs(force - studies.curve(found, v)) / force
    numbers = {
        "error of the curve [%]": 100 * studies.error(found, v, force),
        "largest error [%]": 100 * float(left.max()),
    } | studies.told(laws, half)
    far = np.sqrt(np.mean((studies.curve(found, v) - studies.curve(printed, v)) ** 2))
    ratio = {n: float(getattr(found, n)) / float(getattr(printed, n)) for n in studies.NAMES}
    claims = {
        "the error is that of the noise, 3 %": 0.02 < studies.error(found, v, force) < 0.04,
        "F_C is nothing, sigma_2 fifty times too large, the exponent half": (
            ratio["F_C"] < 0.01 and 40 < ratio["sigma_2"] < 60 and 0.4 < ratio["delta"] < 0.6
        ),
        "the curve is the same within 2 %": far < 0.02 * force.mean(),
    }
    return plate_of(__name__, figure, float(far / force.mean()), "1", numbers, claims)
