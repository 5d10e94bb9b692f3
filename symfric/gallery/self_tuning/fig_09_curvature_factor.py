"""Influence of the curvature factor E on the friction force.

With y = B v, left with E inside the arctangent, as Pacejka has it and as our law does, right with E
outside: sin(C atan(y) - E (y - atan(y))). B = 1 s/mm and C = 1.41; the paper's numbers are lost.

Compared: curves for E = 0 ... 2 in both readings with what the text says of them: as expected below
0.5, sinusoidal above. As expected is: one peak and no change of sign for v > 0.

Distance: how many of the two statements do not hold for our law.

Reproduced: both statements, by E outside the arctangent in a figure that ends at 5 mm/s: friction
reverses from E = C atan(y) / (y - atan(y)) on, 0.53 there, 0.24 at 10 mm/s. That form feeds energy
in where its sign is wrong, so the law keeps Pacejka's bracket with E < 1, and 0 as default, where
both readings are one.

Undecided: where the paper has its E. Inside the arctangent nothing changes its sign up to E = 1,
whatever B, C up to 2 and the range of the figure; beyond there is one change of sign.
"""

import numpy as np

from symfric.foundation.panels import grid
from symfric.gallery.drawing import shade
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.self_tuning._formula import force

C = 2 - 2 / np.pi * np.arcsin(0.8)
FACTORS = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0)


def plate(quick: bool = False) -> Plate:
    """Sweep E with both readings of the bracket."""
    v = np.linspace(-5.0, 5.0, 401 if quick else 4001)  # mm/s
    readings = {
        "E inside the arctangent: our law": {E: force(v, B=1.0, C=C, E=E) for E in FACTORS},
        "E outside of it": {E: outside(v, E) for E in FACTORS},
    }
    figure, [axes] = grid(1, 2, height=3.6, sharey=True)
    for axis, (title, curves) in zip(axes, readings.items(), strict=True):
        for k, (E, F) in enumerate(curves.items()):
            label = f"{E:g}" if axis is axes[0] else None
            axis.plot(v, -F, label=label, color=shade(k / 6), linewidth=1.5)
        axis.set_title(title, fontsize="medium")
        axis.set_xlabel("sliding velocity [mm/s]")
    axes[0].set_ylabel("friction on the body / $\\mu_s N$ [1]")
    figure.legend(loc="outside right center", title="E [1]", frameon=False)

    numbers: dict[str, float] = {}
    claims: dict[str, bool] = {}
    wrong: dict[str, int] = {}
    for title, curves in readings.items():
        changes = {E: crossings(F[v > 0]) for E, F in curves.items()}
        wrong[title] = sum(
            (any(changes[E] for E in FACTORS if E < 0.5), not all(changes[E] for E in (0.75, 1.0)))
        )
        numbers[f"statements that do not hold, {title} [1]"] = wrong[title]
        for at in (0.25, 0.75, 1.0, 2.0):
            numbers[f"changes of sign, E = {at:g}, {title.partition(' the')[0]} [1]"] = changes[at]
    for y in (5.0, 10.0):
        threshold = C * np.arctan(y) / (y - np.arctan(y))
        numbers[f"E outside that reverses friction at {y:g} mm/s [1]"] = threshold
        turned = [outside(np.array([y]), E)[0] for E in (0.98 * threshold, 1.02 * threshold)]
        claims[f"E = {threshold:.2f} outside reverses friction at {y:g} mm/s"] = (
            turned[0] > 0 > turned[1]
        )
    far_out = np.geomspace(1e-3, 1e3, 601)
    claims["inside nothing changes its sign up to E = 1, for any C and B v"] = not any(
        crossings(force(far_out, B=1.0, C=one, E=E))
        for one in (1.0, 1.2, C, 1.6, 1.8, 1.99)
        for E in (0.0, 0.5, 0.9, 1.0)
    )
    inside, outer = wrong.values()
    claims["the text holds with E outside, not inside, of the arctangent"] = inside > outer == 0
    unit = "of 2 statements"
    return plate_of(__name__, figure, inside, unit, numbers, claims, within=1, quick=quick)


def outside(v: np.ndarray, E: float) -> np.ndarray:
    """F / (mu_s N) with the term of E outside the arctangent; B = 1 s/mm, v in mm/s."""
    return np.sin(C * np.arctan(v) - E * (v - np.arctan(v)))


def crossings(F: np.ndarray) -> int:
    """How often a curve changes its sign."""
    return int(np.count_nonzero(np.diff(np.sign(F[np.abs(F) > 1e-12]))))
