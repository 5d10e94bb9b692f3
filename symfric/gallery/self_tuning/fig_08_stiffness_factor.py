"""Influence of the stiffness factor B on the friction force.

F = -mu_s N sin(C atan(B v)) on the body, with C = 1.41, which belongs to mu_d = 0.8 mu_s, the ratio
of the slider-crank, and E = 0. The unit of B is lost; s/mm is the one in which the text holds.

Compared: curves for B = 0 ... 1 s/mm with what the text says of them: flat at B = 0, next to no
curvature at 0.1, the same profile with a growing slope at zero beyond 0.3.

Distance: how many of these statements do not hold.

Reproduced: all four statements, in s/mm: the peak enters a window of 10 mm/s between B = 0.2 and
0.3, where the text sees the profile settle. In s/m it lies at 2 ... 20 m/s.

Undecided: the unit itself and the window of the figure, which are lost.
"""

import numpy as np

from symfric.foundation.panels import panels
from symfric.gallery.drawing import shade
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.self_tuning._formula import force
from symfric.gallery.signals import largest

C = 2 - 2 / np.pi * np.arcsin(0.8)


def plate(quick: bool = False) -> Plate:
    """Sweep B over the range of the paper, 0 to 1."""
    v = np.linspace(-10.0, 10.0, 201 if quick else 2001)  # mm/s
    factors = (0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0)
    curves = {B: force(v, B=B, C=C, E=0.0) for B in factors}

    figure, (axis,) = panels(1, height=3.6)
    for k, (B, F) in enumerate(curves.items()):
        axis.plot(v, -F, label=f"{B:g}", color=shade(k / 7), linewidth=1.8)
    axis.set_xlabel("sliding velocity [mm/s]")
    axis.set_ylabel("friction on the body / $\\mu_s N$ [1]")
    figure.legend(loc="outside right center", title="B [s/mm]", frameon=False)

    peaks = {B: np.tan(np.pi / (2 * C)) / B for B in factors[1:]}
    slopes = {B: largest(np.gradient(F, v)) for B, F in curves.items()}
    beyond = [F[-1] for B, F in curves.items() if B >= 0.3]
    holds = {
        "flat at B = 0": not curves[0.0].any(),
        "no peak in the window up to 0.2": all(peaks[B] > 10 for B in (0.1, 0.2)),
        "the same profile beyond 0.3": max(beyond) - min(beyond) < 0.15,
        "a growing slope at zero": bool(np.all(np.diff([*slopes.values()]) > 0)),
    }
    wrong = len(holds) - sum(holds.values())
    numbers = {f"velocity of the peak, B = {B:g} s/mm [mm/s]": p for B, p in peaks.items()}
    numbers["spread of F(10 mm/s) / mu_s N for B from 0.3 on [1]"] = max(beyond) - min(beyond)
    claims = {
        "none of the paper's statements is refuted": wrong == 0,
        "the peak enters 10 mm/s between B = 0.2 and 0.3": peaks[0.3] < 10 < peaks[0.2],
    }
    unit = f"of {len(holds)} statements"
    return plate_of(__name__, figure, wrong, unit, numbers, claims, within=0, quick=quick)
