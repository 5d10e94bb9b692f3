"""Road, wheel and body without friction: the body oscillates.

The rig of section 3 on the road of 50 mm.

Compared: displacements of wheel and body with the exponential of the matrix of equations 1 and 2.

Distance: largest difference of either.

Reproduced: the wheel follows the road and the body oscillates, as the paper says, with the period
and the decay that the eigenvalue of its equations has.

Refuted: that the body follows the wheel with a pure delay. The rig without friction has none: the
body lags by its oscillation alone.
"""

import numpy as np

from symfric import Viscous
from symfric.foundation.panels import NARROW, panels
from symfric.foundation.style import QUIET, line
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.quarter_car_friction import _by_hand
from symfric.gallery.quarter_car_friction._rig import STAGES, ride


def plate(quick: bool = False) -> Plate:
    """Ride over the road without friction."""
    run = ride(Viscous(sigma_2=0.0), samples=301 if quick else 2401)

    figure, (axis,) = panels(1, NARROW, 2.7)
    axis.plot(run.t, 1e3 * run["X_r"], color=QUIET, linewidth=4.0, label="road")
    axis.plot(run.t, 1e3 * run["X_w"], **line(1), label="wheel")
    axis.plot(run.t, 1e3 * run["X_b"], **line(0), label="body")
    axis.set_xlabel("time [s]")
    axis.set_ylabel("displacement [mm]")
    axis.legend()

    exact = _by_hand.without_friction(run.t)
    far = max(np.abs(exact[0] - run["X_b"]).max(), np.abs(exact[1] - run["X_w"]).max())
    turns = peaks(run.t, run["X_b"])
    swings = np.interp(turns, run.t, run["X_b"]) - STAGES["C"][1]
    slow = min(np.linalg.eigvals(_by_hand.matrix()[:4, :4]), key=abs)
    period, time = float(np.mean(np.diff(turns))), float(turns[-1] - turns[0])
    decay = float(np.log(swings[0] / swings[-1])) / time
    numbers = {
        "period of the body after the second ramp [s]": period,
        "the same by the eigenvalue [s]": float(2 * np.pi / abs(slow.imag)),
        "decay of the body after the second ramp [1/s]": decay,
        "the same by the eigenvalue [1/s]": float(-slow.real),
    }
    claims = {
        "the body has the period of the eigenvalue": abs(period * abs(slow.imag) / 6.2832 - 1)
        < 0.02,
        "and its decay": abs(decay / -slow.real - 1) < 0.05,
        "the wheel follows the road": np.abs(run["X_w"] - run["X_r"]).max() < 2e-3,
    }
    for stage, (end, height) in STAGES.items():
        numbers[f"body at the end of stage {stage}, {height:g} m in the paper [m]"] = float(
            np.interp(end, run.t, run["X_b"])
        )
    return plate_of(__name__, figure, far, "m", numbers, claims, within=2e-9, quick=quick)


def peaks(t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Times of the maxima between the second ramp and the third [s]."""
    inner = (x[1:-1] > x[:-2]) & (x[1:-1] > x[2:]) & (t[1:-1] > 5.75) & (t[1:-1] < STAGES["C"][0])
    return t[1:-1][inner]
