"""Damping and Coulomb friction, apart, over the velocity of the body.

Compared: the sum of both parts, by equation 12 from the motion alone, with the force of the law.

Distance: largest difference outside the window in which the body sticks, over break-away.

Evidence: damping dominates and is a curve, the Coulomb part makes all of the hysteresis, as the
paper says. Refuted is the sign of the Coulomb part as printed: it has that of the strut's force,
not that of the velocity, although the text wants it opposite to the velocity; where both differ it
drives the body, here on 7 % of the way with up to a quarter of a watt.
"""

import numpy as np

from symfric.foundation.panels import NARROW, panels
from symfric.foundation.style import line
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.quarter_car_friction._by_hand import B_D, BREAK_AWAY, K_S, L_D, THETA
from symfric.gallery.quarter_car_friction._rig import FRICTION, general, ride


def plate(quick: bool = False) -> Plate:
    """Ride over the road of 50 mm, and take the force apart."""
    run = ride(general(), samples=1201 if quick else 6001)
    v, x = run["v_b"], run["x_rel"]
    damping = FRICTION["C_e"] * np.exp(-np.abs(v) / FRICTION["e_1"]) * np.sign(v)
    damping += FRICTION["sigma_v"] * v
    strut = K_S * x + B_D * (run["v_w"] - v)
    lean = np.arcsin(x * np.sin(THETA) / (L_D - x * np.sin(THETA)))
    printed = FRICTION["mu"] * strut / np.tan(THETA - lean)
    coulomb = np.abs(printed) * np.sign(v)

    moves = np.abs(v) > 1e-3
    figure, (axis,) = panels(1, NARROW, 3.0)
    for force, k, name in ((damping, 0, "damping friction"), (coulomb, 1, "Coulomb friction")):
        axis.plot(1e3 * v[moves], force[moves], ".", color=line(k)["color"], markersize=2.5,
                  label=name)  # fmt: skip
    axis.set_xlabel("velocity of the body [mm/s]")
    axis.set_ylabel("friction force [N]")
    axis.legend(markerscale=3)

    far = float(np.abs(damping + coulomb - run["friction"])[moves].max()) / BREAK_AWAY
    power = (printed * v)[moves]
    numbers = {
        "work of damping friction over the road [J]": float(np.trapezoid(damping * v, run.t)),
        "work of Coulomb friction over the road [J]": float(np.trapezoid(coulomb * v, run.t)),
        "area enclosed by damping friction [N m/s]": abs(float(np.trapezoid(damping, v))),
        "area enclosed by Coulomb friction [N m/s]": abs(float(np.trapezoid(coulomb, v))),
        "least power of Coulomb friction as printed [W]": float(power.min()),
        "share of the motion that it drives [1]": float(np.mean(power < 0)),
    }
    worked, rubbed, curve, loop = [*numbers.values()][:4]
    claims = {
        "damping takes ten times the work": worked > 10 * rubbed,
        "the Coulomb part makes the hysteresis": loop > 100 * curve,
        "as printed it drives the body on 7 % of the way": 0.06 < np.mean(power < 0) < 0.08,
        "with up to a quarter of a watt": -0.26 < power.min() < -0.23,
    }
    return plate_of(__name__, figure, far, "1", numbers, claims)
