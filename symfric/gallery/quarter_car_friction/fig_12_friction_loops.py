"""Friction of the general law over the velocity of the body.

Roads of 30, 50 and 70 mm; the paper shows 50 mm.

Compared: the force with that of the paper's equations in small steps, where the body truly sticks.

Distance: largest difference while the body moves faster than 5 mm/s, over break-away.

Evidence: force over velocity makes loops, the gentle first ramp the smallest, the fall of twice the
rise the largest, as the paper says, on a road whose first ramp is the gentlest. Refuted is that
they are memory of the contact: the law has none; the loops are the Coulomb part, whose load follows
the strut, and without it they close (figure 13). Refuted by itself is the static level: 0.0069 m of
the spring are not its 193.8 N, and at the largest displacement there is no velocity to make up.
"""

from itertools import pairwise

import numpy as np

from symfric.foundation.panels import panels
from symfric.foundation.style import QUIET, line
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.quarter_car_friction import _by_hand
from symfric.gallery.quarter_car_friction._rig import FRICTION, STAGES, general, ride

BREAK_AWAY, DEFLECTION = 193.8, 0.0069  # N, m


def plate(quick: bool = False) -> Plate:
    """Ride over three roads."""
    runs = {mm: ride(general(), mm) for mm in ((50,) if quick else (30, 70, 50))}
    run, ends = runs[50], [end for end, _ in STAGES.values()]
    ramps = {
        name: (run.t >= begin) & (run.t <= end)
        for name, (begin, end) in zip(("first", "second", "third"), pairwise(ends), strict=True)
    }

    figure, (axis,) = panels(1, height=4.0)
    for other in [*runs.values()][:-1]:
        axis.plot(1e3 * other["v_b"], other["friction"], color=QUIET, linewidth=0.7)
    for k, (name, inside) in enumerate(ramps.items()):
        v, force = run["v_b"][inside], run["friction"][inside]
        axis.plot(1e3 * v, force, **line(k), linewidth=1.2, label=f"{name} ramp")
    axis.plot([], [], color=QUIET, label="roads of 30 and 70 mm")
    axis.set_xlabel("velocity of the body [mm/s]")
    axis.set_ylabel("friction force [N]")
    axis.legend(loc="upper left")

    t, _, friction = _by_hand.with_friction(5e-4 if quick else 2.5e-5, 50, **FRICTION)
    moves = np.abs(run["v_b"]) > 5e-3
    far = np.abs(np.interp(run.t, t, friction) - run["friction"])[moves].max() / BREAK_AWAY
    numbers = {
        "largest force at rest, 193.8 N in the paper [N]": float(run["friction"][~moves].max()),
        "spring force at the largest displacement of the paper [N]": _by_hand.K_S * DEFLECTION,
        "velocity of the damper that it takes to be 193.8 N [m/s]": (
            BREAK_AWAY - _by_hand.K_S * DEFLECTION
        )
        / _by_hand.B_D,
    }
    for name, inside in ramps.items():
        v, force = run["v_b"][inside], run["friction"][inside]
        numbers[f"area of the loop of the {name} ramp [N m/s]"] = abs(float(np.trapezoid(force, v)))
        numbers[f"largest speed on the {name} ramp [m/s]"] = float(np.abs(v).max())
    return plate_of(__name__, figure, far, "1", numbers)
