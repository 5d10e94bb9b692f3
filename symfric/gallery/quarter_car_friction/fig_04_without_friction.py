"""Road, wheel and body without friction: the body oscillates.

The rig of section 3 on the road of 50 mm.

Compared: displacements of wheel and body with the exponential of the matrix of equations 1 and 2.

Distance: largest difference of either.

Evidence: nothing is refuted. The wheel follows the road and the body oscillates, as the paper says,
with the period and the decay of its mass, spring and damper. Its pure delay between wheel and body
is none of the rig without friction: the body lags by its oscillation alone.
"""

import numpy as np

from symfric import Viscous
from symfric.foundation.panels import panels
from symfric.foundation.style import QUIET, line
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.quarter_car_friction import _by_hand
from symfric.gallery.quarter_car_friction._rig import STAGES, ride


def plate(quick: bool = False) -> Plate:
    """Ride over the road without friction."""
    run = ride(Viscous(sigma_2=0.0), samples=301 if quick else 2401)

    figure, (axis,) = panels(1, height=3.4)
    axis.plot(run.t, 1e3 * run["X_r"], color=QUIET, linewidth=4.0, label="road")
    axis.plot(run.t, 1e3 * run["X_w"], **line(1), label="wheel")
    axis.plot(run.t, 1e3 * run["X_b"], **line(0), label="body")
    axis.set_xlabel("time [s]")
    axis.set_ylabel("displacement [mm]")
    axis.legend()

    exact = _by_hand.without_friction(run.t)
    far = max(np.abs(exact[0] - run["X_b"]).max(), np.abs(exact[1] - run["X_w"]).max())
    turns = peaks(run.t, run["X_b"])
    stiffness = _by_hand.K_S * _by_hand.K_T / (_by_hand.K_S + _by_hand.K_T)
    numbers = {
        "period of the body after the second ramp [s]": float(np.mean(np.diff(turns))),
        "2 pi sqrt(M_b / k), springs in series [s]": 2 * np.pi * np.sqrt(_by_hand.M_B / stiffness),
    }
    for stage, (end, height) in STAGES.items():
        numbers[f"body at the end of stage {stage}, {height:g} m in the paper [m]"] = float(
            np.interp(end, run.t, run["X_b"])
        )
    return plate_of(__name__, figure, far, "m", numbers)


def peaks(t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Times of the maxima between the second ramp and the third [s]."""
    inner = (x[1:-1] > x[:-2]) & (x[1:-1] > x[2:]) & (t[1:-1] > 5.75) & (t[1:-1] < STAGES["C"][0])
    return t[1:-1][inner]
