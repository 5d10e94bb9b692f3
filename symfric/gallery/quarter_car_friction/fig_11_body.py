"""The body over time, with friction, and the four places where it rests.

The general law of the paper, with invented C_e, e1, mu and sigma_v, and without friction behind it.
Weak: sigma_v of 80 instead of 1500 N s/m, and a decay of 20 instead of 10 mm/s.

Compared: the run with the paper's equations in small steps, where the body truly sticks.

Distance: largest difference of the body over the amplitude of 50 mm.

Reproduced: friction removes the oscillation, if it is viscous enough: half the overshoot or less
from sigma_v = 1500 N s/m on. The body starts at 0.5 s, as figure 7 of the paper has it, with X_w -
X_b = 7 mm, and rests where the paper says within break-away over both springs, 6.9 mm; between
those it may stick anywhere. These hold for ten readings of the numbers that the paper leaves open.

Refuted: table 1 and what is concluded from it. Its residual of X_b, 96 mm, is larger than the 67.5
mm that a constant leaves at most for a body between 0 and 135 mm, so the model does not fit it; and
the 0.06 and 0.12 % by which Coulomb friction improves both residuals are no reason for it. Equation
12 as printed: at rest it holds any force, and the body never moves.

Undecided: the numbers of the friction. Weakly viscous it holds the body back and lets it go, and
the overshoot is larger than without friction; at 1.5 s X_w - X_b is anything from -4 to 5 mm, where
the paper has zero or near zero.
"""

import numpy as np

from symfric import Viscous
from symfric.foundation.panels import NARROW, panels
from symfric.foundation.style import QUIET
from symfric.gallery.looks import look
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.quarter_car_friction import _by_hand
from symfric.gallery.quarter_car_friction._printed import RANGE, RESIDUAL, residuals, start
from symfric.gallery.quarter_car_friction._readings import bodies, overshoot
from symfric.gallery.quarter_car_friction._rig import FRICTION, STAGES, WEAK, general, ride


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
        numbers[f"overshoot after the last ramp, {name} [m]"] = overshoot(ridden)
    for stage, (end, height) in STAGES.items():
        place = float(np.interp(end, run.t, run["X_b"]))
        numbers[f"body at the end of stage {stage}, less {height:g} m of the paper [m]"] = (
            place - height
        )
    numbers |= residuals(run) | start(run)
    printed = ride(general(form="as_printed"))
    numbers["way of the body by equation 12 as printed [m]"] = float(np.ptp(printed["X_b"]))
    claims = said(numbers) | ({} if quick else bodies(numbers))
    return plate_of(__name__, figure, far / 0.05, "1", numbers, claims, within=2e-3, quick=quick)


def said(numbers: dict[str, float]) -> dict[str, bool]:
    """What the run, and the numbers of the paper by themselves, say."""
    over = [value for name, value in numbers.items() if name.startswith("overshoot")]
    return {
        "friction halves the overshoot, weakly viscous friction makes it larger": (
            2 * over[0] < over[1] < over[2]
        ),
        "the residual of X_b is larger than any constant leaves": RESIDUAL["X_b"][0] > RANGE / 2,
        "Coulomb friction improves the residuals by 0.06 and 0.12 %": np.allclose(
            [100 * (1 - residual / without) for residual, without in RESIDUAL.values()],
            [0.0628, 0.1235],
            atol=1e-4,
        ),
        "the rests are where and until when the road is level": (
            np.allclose([z for _, z in STAGES.values()], _by_hand.heights(50)[1::2])
            and np.allclose([end for end, _ in STAGES.values()][:3], _by_hand.CORNERS[1:6:2])
            and max(_by_hand.heights(50)) == RANGE
        ),
        "equation 12 as printed holds the body for ever": (
            numbers["way of the body by equation 12 as printed [m]"] == 0.0
        ),
    }
