"""Friction of the simple form, without the Coulomb part, over the velocity of the body.

Compared: the force along the run with equation 21, its exponent falling.

Distance: largest difference beyond 1 mm/s, as the law is smooth over 0.01 mm/s, over C_e.

Reproduced: there is no hysteresis, as the paper says: the law is a curve.

Refuted: the sign of its exponent. As printed it grows, beyond all bounds at the speeds of the
figure, where the text says that the force quickly dips; it falls for e1 < 0.
"""

import numpy as np

from symfric import QuarterCarSimple
from symfric.foundation.panels import NARROW, panels
from symfric.gallery.looks import look
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.quarter_car_friction._rig import FRICTION, ride


def plate(quick: bool = False) -> Plate:
    """Ride over the road of 50 mm."""
    C_e, e_1, sigma_v = (FRICTION[name] for name in ("C_e", "e_1", "sigma_v"))
    law = QuarterCarSimple(C_e=C_e, e_1=e_1, sigma_v=sigma_v, v_eps=1e-5)
    run = ride(law, samples=601 if quick else 6001)
    v, force = run["v_b"], run["friction"]

    figure, (axis,) = panels(1, NARROW, 3.0)
    axis.plot(1e3 * v, force, color=look("quarter_car_simple")["color"], marker=".", markersize=2,
              linewidth=0.6)  # fmt: skip
    axis.set_xlabel("velocity of the body [mm/s]")
    axis.set_ylabel("damping friction [N]")

    exact = C_e * np.exp(-np.abs(v) / e_1) * np.sign(v) + sigma_v * v
    moves = np.abs(v) > 1e-3
    fastest = float(np.abs(v).max())
    numbers = {
        "largest speed [m/s]": fastest,
        "transition friction there, falling [N]": C_e * np.exp(-fastest / e_1),
        "transition friction there, as printed [N]": C_e * np.exp(fastest / e_1),
    }
    far = float(np.abs(exact - force)[moves].max()) / C_e
    claims = {
        "the law is a curve": far < 2e-3,
        "with the printed sign its force is beyond all bounds": C_e * np.exp(fastest / e_1) > 1e8,
    }
    return plate_of(__name__, figure, far, "1", numbers, claims, within=1e-3, quick=quick)
