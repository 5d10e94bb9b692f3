"""The main study: mean forces and identified curves, and what they say beyond the data.

Compared: curves identified from points with noise, 100 to 500 mm/min, with the printed one that
made them; thin, the same with other noise of that size.

Distance: rms difference of the first curve from the printed one, over the mean force.

Reproduced: the curves fit the points.

Refuted: that the main study tells five parameters. Up to 500 mm/min the force only falls, so the
points know neither sigma_2 nor how low F_c is: a bound of statistics, not of the method (standard
errors below, for noise of 1 %). At 650 mm/min, where the machine runs, the curves of 60 noises lie
between 2.3 and 3.7 N. A plateau at 6 mm/s is not in the printed law, either: there it is still
falling.
"""

import numpy as np

from identification.starts.six_steps import standard_errors
from identification.starts.stribeck import StribeckCurve
from symfric.foundation.panels import NARROW, panels
from symfric.gallery.laminator_nips import _studies as studies
from symfric.gallery.looks import look
from symfric.gallery.plate import Plate, plate_of

MACHINE = 650 / 60e3
"""Fastest slip of the machine [m/s]."""


def plate(quick: bool = False) -> Plate:
    """Identify the main study again, with several noises."""
    printed = studies.PRINTED["main"]
    v, force = studies.measured("main")
    found = studies.found("main", count=2 if quick else studies.NOISES)

    figure, (axis,) = panels(1, NARROW, 3.2)
    far_out = np.linspace(v[0], MACHINE, 300)
    for k, law in enumerate(found[1:12]):
        label = None if k else "found with other noises"
        axis.plot(
            far_out, studies.curve(law, far_out), **look("lugre"), lw=0.7, alpha=0.5, label=label
        )
    laws = {"printed": printed, "all at once": found[0]}
    studies.draw_curves(axis, v, force, laws, MACHINE)
    axis.legend(loc="lower left", fontsize="small")
    axis.axvline(v[-1], color="k", linewidth=0.8)
    axis.annotate(" 500 mm/min", (v[-1], force.max()))
    axis.set_xlabel("velocity [m/s]")

    beyond = [float(studies.curve(law, np.array([MACHINE]))[0]) for law in found]
    plateau, least = studies.curve(printed, np.array([6e-3, 532 / 60e3])).tolist()
    numbers = {
        "force at 650 mm/min, printed [N]": float(studies.curve(printed, np.array([MACHINE]))[0]),
        "the same, lowest of the curves found [N]": min(beyond),
        "the same, highest [N]": max(beyond),
        "force at 6 mm/s, where the thesis sees a plateau [N]": plateau,
        "least force of the printed curve [N]": least,
    }
    values = {name: float(getattr(printed, name)) for name in studies.NAMES}
    exact = StribeckCurve(
        values["F_S"], values["F_C"], values["v_s"], values["delta"], values["sigma_2"], 0.0, 0.0
    )
    noise = 0.01 * float(studies.curve(printed, v).mean())
    shares = standard_errors(exact, v, noise)
    for name, share in shares.items():
        numbers[f"least standard error of {name}, noise of the means 1 % [%]"] = 100 * share
    far = np.sqrt(np.mean((studies.curve(found[0], v) - studies.curve(printed, v)) ** 2))
    claims = {
        "the points do not know sigma_2": shares["sigma_2"] > 1,
        "nor how low F_C is": shares["F_C"] > 0.1,
        "at 6 mm/s the printed curve is still falling": plateau > 1.05 * least,
        "where the machine runs the curves spread": max(beyond) - min(beyond) > 0.1,
    }
    if not quick:
        claims["at 650 mm/min the curves of 60 noises lie between 2.3 and 3.7 N"] = (
            2.3 < min(beyond) < 2.5 < 3.5 < max(beyond) < 3.7
        )
    far = float(far / force.mean())
    return plate_of(__name__, figure, far, "1", numbers, claims, within=0.012, quick=quick)
