"""Influence of the shape factor C on the friction force.

F = -mu_s N sin(C atan(B v)) on the body, with B = 1 s/mm and E = 0: the paper gives neither, nor
the unit of its velocities; in mm/s its statements about figures 7 and 8 hold.

Compared: curves for C = 0 ... 2 with what the text says of them: flat at C = 0, like -tanh up to C
= 1, with a peak above, sharper beyond 1.4. Where a law exists (C from 1), also with `SelfTuning`.

Distance: how many of these statements do not hold.

Reproduced: all four statements. C is the key to the magnitude as the paper says, and more: it alone
is mu_d / mu_s = sin(pi C / 2), so the paper's iterative correction has a closed form.
"""

import numpy as np

from symfric import SelfTuning
from symfric.foundation.panels import panels
from symfric.gallery.drawing import shade
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.self_tuning._formula import force


def plate(quick: bool = False) -> Plate:
    """Sweep C over the range of the paper, 0 to 2."""
    v = np.linspace(-10.0, 10.0, 201 if quick else 2001)  # mm/s
    curves = {C: force(v, B=1.0, C=C, E=0.0) for C in np.linspace(0.0, 2.0, 11)}

    figure, (axis,) = panels(1, height=3.6)
    for C, F in curves.items():
        axis.plot(v, -F, label=f"{C:.1f}", color=shade(C / 2), linewidth=1.8)
    axis.set_xlabel("sliding velocity [mm/s]")
    axis.set_ylabel("friction on the body / $\\mu_s N$ [1]")
    figure.legend(loc="outside right center", title="C [1]", frameon=False)

    right = v > 0
    rises = {C: bool(np.all(np.diff(F[right]) >= 0)) for C, F in curves.items()}
    sharpness = {C: _sharpness(C) for C in (1.2, 1.4, 1.6, 1.8, 2.0)}
    holds = {
        "flat at C = 0": not curves[0.0].any(),
        "like -tanh up to C = 1": all(rises[C] for C in curves if C <= 1),
        "a peak above C = 1": not any(rises[C] for C in curves if C > 1.1),
        "sharper beyond C = 1.4": bool(np.all(np.diff([*sharpness.values()]) > 0)),
    }
    numbers = {f"curvature at the peak, C = {C} [s^2/mm^2]": s for C, s in sharpness.items()}
    numbers["largest difference from SelfTuning, in mu_s N [1]"] = max(
        float(np.abs(_law(C, v) - F).max()) for C, F in curves.items() if 1 <= C < 2
    )
    wrong = len(holds) - sum(holds.values())
    claims = {
        "none of the paper's statements is refuted": wrong == 0,
        "C alone is mu_d / mu_s": (
            numbers["largest difference from SelfTuning, in mu_s N [1]"] < 1e-12
        ),
    }
    unit = f"of {len(holds)} statements"
    return plate_of(__name__, figure, wrong, unit, numbers, claims, within=0, quick=quick)


def _law(C: float, v: np.ndarray) -> np.ndarray:
    """The law of the catalogue with that C, in mm/s and in units of mu_s N."""
    law = SelfTuning(mu_s=1.0, mu_d=float(np.sin(np.pi * C / 2)), B=1e3)
    return np.array([float(law.force(one, 1.0)) for one in 1e-3 * v])


def _sharpness(C: float) -> float:
    """Curvature of the curve at its peak, by differences."""
    peak, h = np.tan(np.pi / (2 * C)), 1e-3
    left, middle, right = force(peak + h * np.array([-1.0, 0.0, 1.0]), B=1.0, C=C, E=0.0)
    return float(2 * middle - left - right) / h**2
