"""Steady LuGre friction for several viscous coefficients.

The values of the figure are not given; these lie between those of the two studies.

Compared: the speed of least force, found by the roots of the derivative, with the curves' minima.

Distance: largest difference, over v_s.

Reproduced: the viscous friction raises the curve. Without it there is no minimum; the larger
sigma_2, the slower and the higher it is. Above a value that follows from the steepest slope of the
Stribeck part the force rises throughout: six times that of the pilot study.
"""

from dataclasses import replace

import numpy as np
from scipy.optimize import root_scalar

from symfric.foundation.panels import NARROW, panels
from symfric.foundation.style import line
from symfric.gallery.laminator_nips._studies import PRINTED, curve
from symfric.gallery.plate import Plate, plate_of

SIGMA_2 = (0.0, 60.0, 120.0, 230.0, 400.0)  # N s/m


def plate(quick: bool = False) -> Plate:
    """Vary sigma_2 of the pilot study."""
    pilot = PRINTED["pilot"]
    v_s, fall = float(pilot.v_s), float(pilot.F_S) - float(pilot.F_C)
    v = np.linspace(1e-6, 500 / 60e3, 400 if quick else 40_000)

    def slope(speed: float, viscous: float = 0.0) -> float:
        """Slope of the curve [N s/m]."""
        falling = 2 * fall * speed / v_s**2 * float(np.exp(-((speed / v_s) ** 2)))
        return viscous - falling

    figure, (axis,) = panels(1, NARROW, 2.8)
    steepest = -slope(v_s / np.sqrt(2))
    numbers = {"sigma_2 beyond which nothing falls [N s/m]": steepest}
    far, lowest = 0.0, list[tuple[float, float]]()
    for k, sigma_2 in enumerate(SIGMA_2):
        force = curve(replace(pilot, sigma_2=sigma_2), v)
        axis.plot(v, force, **line(k), label=f"{sigma_2:g} N s/m")
        if sigma_2 > 0:
            root = root_scalar(slope, args=(sigma_2,), bracket=[v_s / np.sqrt(2), v[-1]])
            least = float(root.root)
            numbers[f"speed of least force, sigma_2 = {sigma_2:g} N s/m [m/s]"] = least
            lowest.append((least, float(force.min())))
            far = max(far, abs(float(v[np.argmin(force)]) - least) / v_s)
    axis.set_xlabel("velocity [m/s]")
    axis.set_ylabel("friction force [N]")
    axis.legend(
        title="viscous friction", loc="upper left", bbox_to_anchor=(0.2, 1), fontsize="small"
    )
    claims = {
        "the larger sigma_2, the slower the minimum": all(np.diff([at for at, _ in lowest]) < 0),
        "and the higher": all(np.diff([force for _, force in lowest]) > 0),
        "nothing falls from six times the sigma_2 of the pilot study on": (
            abs(steepest / (6 * float(pilot.sigma_2)) - 1) < 0.01
        ),
    }
    return plate_of(
        __name__, figure, far, "1", numbers, claims, within=0.01 if quick else 2e-4, quick=quick
    )
