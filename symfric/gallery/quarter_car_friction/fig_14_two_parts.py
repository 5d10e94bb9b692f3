"""Damping and Coulomb friction, apart, over the velocity of the body.

Compared: the sum of both parts, by equation 12 from the motion alone, with the force of the law.

Distance: largest difference outside the window in which the body sticks, over break-away.

Reproduced: damping is a curve, the Coulomb part makes all of the hysteresis, as the paper says.

Refuted: the sign of the Coulomb part as printed. It has that of the strut's force, not that of the
velocity, although the text wants it opposite to the velocity; where both differ it drives the body,
here on 7 % of the way with up to a quarter of a watt, and in each of ten readings of the numbers
that the paper leaves open, on 1 ... 50 % of the way.

Undecided: how far damping dominates. Here it takes ten times the work of the Coulomb part.
"""

import casadi as ca
import numpy as np

from symfric import Trajectory
from symfric.foundation.panels import NARROW, panels
from symfric.foundation.style import line
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.quarter_car_friction._by_hand import BREAK_AWAY
from symfric.gallery.quarter_car_friction._readings import as_printed, driven
from symfric.gallery.quarter_car_friction._rig import FRICTION, READINGS, general, read, ride
from symfric.results.quadrature import integral_between


def plate(quick: bool = False) -> Plate:
    """Ride over the road of 50 mm, and take the force apart."""
    run = ride(general(), samples=1201 if quick else 6001)
    v = run["v_b"]
    damping = FRICTION["C_e"] * np.exp(-np.abs(v) / FRICTION["e_1"]) * np.sign(v)
    damping += FRICTION["sigma_v"] * v
    printed = as_printed(run, FRICTION["mu"])
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
    power, share = driven(run, FRICTION["mu"])
    whole, ends = run.work("friction", "v_b"), np.array([v[0], v[-1]])
    rubbed = whole - worked(run)
    numbers = {
        "work of damping friction over the road [J]": whole - rubbed,
        "work of Coulomb friction over the road [J]": rubbed,
        "area enclosed by damping friction [N m/s]": abs(float(np.diff(below(ends))[0])),
        "area enclosed by Coulomb friction [N m/s]": abs(run.area("friction", "v_b")),
        "least power of Coulomb friction as printed [W]": power,
        "share of the motion that it drives [1]": share,
    }
    _, _, curve, loop = [*numbers.values()][:4]
    claims = {
        "damping takes ten times the work": whole > 11 * rubbed > 0,
        "the Coulomb part makes the hysteresis": loop > 100 * curve,
        "as printed it drives the body on 7 % of the way": 0.06 < share < 0.08,
        "with up to a quarter of a watt": -0.26 < power < -0.23,
    }
    if not quick:
        parts = [driven(read(k), reading["mu"])[1] for k, reading in enumerate(READINGS)]
        numbers["the same share, least of ten readings [1]"] = min(parts)
        numbers["the same share, greatest [1]"] = max(parts)
        claims["and in each of ten readings on 1 ... 50 % of it"] = (
            0.01 < min(parts) < max(parts) < 0.5
        )
    return plate_of(__name__, figure, far, "1", numbers, claims, within=4e-5, quick=quick)


def worked(run: Trajectory) -> float:
    """Work of damping friction [J]."""
    v = run.model.expression("v_b")
    damping = FRICTION["C_e"] * ca.exp(-ca.fabs(v) / FRICTION["e_1"]) * ca.fabs(v)
    return integral_between(run, damping + FRICTION["sigma_v"] * v**2, *run.span)


def below(v: np.ndarray) -> np.ndarray:
    """Area below the curve of damping friction from 0 to v [N m/s]."""
    e_1, sigma_v = FRICTION["e_1"], FRICTION["sigma_v"]
    return FRICTION["C_e"] * e_1 * (1 - np.exp(-np.abs(v) / e_1)) + sigma_v * v**2 / 2
