"""The body over time, with friction, and the four places where it rests.

The general law of the paper, with invented C_e, e1, mu and sigma_v, and without friction behind it.
Weak: sigma_v of 80 instead of 1500 N s/m, and a decay of 20 instead of 10 mm/s.

Compared: the run with the paper's equations in small steps, where the body truly sticks.

Distance: largest difference of the body over the amplitude of 50 mm.

Evidence: friction removes the oscillation, as the paper says, if it is viscous enough: with other
numbers that the paper leaves as open, it holds the body back and lets it go, and the overshoot is
larger than without friction. The body rests where the paper says only within break-away over
spring, 6.7 mm: between those it may stick anywhere. The body starts at 0.5 s, as figure 7 of the
paper has it, with X_w - X_b = 7 mm, and at 1.5 s that is down to a fifth. Refuted are table 1 and
what is concluded from it: its residual of X_b, 96 mm, is larger than the 67.5 mm that a constant
leaves at most for a body between 0 and 135 mm, and that of X_w - X_b larger than the signal itself,
so the model fits neither; and the 0.06 and 0.12 % by which Coulomb friction improves them are no
reason for it. Refuted, too, is equation 12 as printed: at rest it holds any force, and the body
never moves.
"""

import numpy as np

from symfric import Viscous
from symfric.foundation.panels import NARROW, panels
from symfric.foundation.style import QUIET
from symfric.gallery.looks import look
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.quarter_car_friction import _by_hand
from symfric.gallery.quarter_car_friction._printed import RANGE, RESIDUAL, residuals, start
from symfric.gallery.quarter_car_friction._rig import FRICTION, STAGES, general, ride

WEAK = {"C_e": 120.0, "e_1": 0.02, "mu": 0.08, "sigma_v": 80.0}
"""Another reading of the numbers that the paper does not give."""


def plate(quick: bool = False) -> Plate:
    """Ride over the road with and without friction."""
    run = ride(general())
    others = {
        "without friction": ride(Viscous(sigma_2=0.0)),
        "weakly viscous friction": ride(general(WEAK)),
    }

    figure, (axis,) = panels(1, NARROW, 3.0)
    axis.plot(run.t, 1e3 * others["without friction"]["X_b"], color=QUIET, label="without friction")
    axis.plot(
        run.t, 1e3 * others["weakly viscous friction"]["X_b"], **look("quarter_car_simple"),
        linewidth=1.0, label="weakly viscous friction",
    )  # fmt: skip
    axis.plot(run.t, 1e3 * run["X_b"], **look("quarter_car_general"), label="friction")
    for stage, (end, height) in STAGES.items():
        label = "rests, in the paper" if stage == "A" else None
        axis.plot(end, 1e3 * height, "k^", markersize=5, label=label)
        axis.annotate(stage, (end, 1e3 * height), (-13, 5), textcoords="offset points")
    axis.set_xlabel("time [s]")
    axis.set_ylabel("displacement of the body [mm]")
    axis.legend(loc="upper left", fontsize="small")

    t, body, _ = _by_hand.with_friction(5e-4 if quick else 2.5e-5, 50, **FRICTION)
    far = float(np.abs(np.interp(run.t, t, body) - run["X_b"]).max())
    numbers: dict[str, float] = {}
    for name, ridden in {"friction": run, **others}.items():
        lowest = float(ridden["X_b"][ridden.t > STAGES["C"][0]].min())
        numbers[f"overshoot after the last ramp, {name} [m]"] = 0.035 - lowest
    for stage, (end, height) in STAGES.items():
        place = float(np.interp(end, run.t, run["X_b"]))
        numbers[f"body at the end of stage {stage}, less {height:g} m of the paper [m]"] = (
            place - height
        )
    numbers |= residuals(run) | start(run)
    printed = ride(general(form="as_printed"))
    numbers["way of the body by equation 12 as printed [m]"] = float(np.ptp(printed["X_b"]))
    return plate_of(__name__, figure, far / 0.05, "1", numbers, said(numbers))


def said(numbers: dict[str, float]) -> dict[str, bool]:
    """What the evidence says."""
    over = [value for name, value in numbers.items() if name.startswith("overshoot")]
    rests = [value for name, value in numbers.items() if "less" in name]
    return {
        "friction halves the overshoot, weakly viscous friction makes it larger": (
            2 * over[0] < over[1] < over[2]
        ),
        "the body rests within break-away over spring": (
            max(map(abs, rests)) < _by_hand.BREAK_AWAY / _by_hand.K_S
        ),
        "it starts at 0.5 s": abs(numbers["the body starts, 0.5 s in figure 7 [s]"] - 0.5) < 0.03,
        "the residual of X_b is larger than any constant leaves": RESIDUAL["X_b"][0] > RANGE / 2,
        "that of X_w - X_b larger than the signal": (
            RESIDUAL["x_rel"][0] > numbers["rms of x_rel itself [m]"]
        ),
        "equation 12 as printed holds the body for ever": (
            numbers["way of the body by equation 12 as printed [m]"] == 0.0
        ),
    }
