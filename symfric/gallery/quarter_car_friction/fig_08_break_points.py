"""The conventional friction models: Tustin's, and with break points.

The figure has no numbers. Here a Stribeck curve of 1.5 F_C at rest, with a viscous part of 2 % of
F_C per Stribeck velocity, is approximated up to ten of those by Coulomb and viscous friction, which
is what the paper calls Tustin's model, and by straight pieces between break points.

Compared: the largest error of four pieces on a curve of exponent 1 with that of chords of an
exponential in closed form.

Distance: of the two, relative.

Reproduced: the Stribeck effect with one or more break points gives a better approximation at low
velocities. One break point leaves less than half the error of Tustin's model, two leave less, and
each further one less again; so for static levels of 1.2 to 3 F_C and exponents of 1 and 2.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.panels import NARROW, panels
from symfric.foundation.style import QUIET, line
from symfric.gallery.plate import Plate, plate_of

Array = NDArray[np.float64]
END, VISCOUS = 10.0, 0.02
"""Of the curve, in Stribeck velocities, and its slope there, in F_C."""


def plate(quick: bool = False) -> Plate:
    """Approximate a Stribeck curve."""
    v = np.linspace(0.0, END, 20_001 if quick else 200_001)
    figure, (axis,) = panels(1, NARROW, 2.8)
    axis.plot(v, stribeck(v, 1.5, 2.0), color=QUIET, linewidth=3.0, label="Stribeck curve")
    axis.plot(v, 1 + VISCOUS * v, **line(1), label="Coulomb and viscous")
    for k, points in enumerate((1, 3), start=2):
        at = knots(v, points + 1, 1.5, 2.0)
        axis.plot(
            at, stribeck(at, 1.5, 2.0), marker=".", **line(k), label=f"break points: {points}"
        )
    axis.set_xlabel("velocity / Stribeck velocity [1]")
    axis.set_ylabel("friction / F_C [1]")
    axis.legend(fontsize="small")

    numbers, better = dict[str, float](), list[bool]()
    for level in (1.2, 1.5, 3.0):
        for delta in (1.0, 2.0):
            left = [level - 1, *(error(v, n, level, delta) for n in (2, 3, 5, 9))]
            better.append(left[1] < 0.5 * left[0] and all(np.diff(left) < 0))
            if (level, delta) == (1.5, 2.0):
                numbers |= {
                    f"largest error over F_C, break points: {n} [1]": e
                    for n, e in zip((0, 1, 2, 4, 8), left, strict=True)
                }
    exact = 0.5 * max(chord(a, b) for a, b in pairwise(knots(v, 4, 1.5, 1.0).tolist()))
    numbers["largest error of four pieces, exponent of 1, over F_C [1]"] = error(v, 4, 1.5, 1.0)
    claims = {"each break point makes it better, the first by half": all(better)}
    far = abs(error(v, 4, 1.5, 1.0) / exact - 1)
    return plate_of(__name__, figure, far, "1", numbers, claims, within=1e-6, quick=quick)


def stribeck(v: Array, level: float, delta: float) -> Array:
    """Friction over F_C at velocities over that of Stribeck, `level` at rest."""
    return 1 + (level - 1) * np.exp(-(v**delta)) + VISCOUS * v


def curvature(v: Array, level: float, delta: float) -> Array:
    """Second derivative of the curve, for exponents of 1 and 2."""
    inner = 4 * v**2 - 2 if delta == 2.0 else 1.0
    return (level - 1) * inner * np.exp(-(v**delta))


def knots(v: Array, pieces: int, level: float, delta: float) -> Array:
    """Ends of pieces with equal shares of int sqrt|F''| dv, which makes their errors equal."""
    density = np.sqrt(np.abs(curvature(v, level, delta)))
    share = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2)])
    return np.interp(np.linspace(0.0, share[-1], pieces + 1), share, v)


def error(v: Array, pieces: int, level: float, delta: float) -> float:
    """Largest distance of straight pieces on the curve from it."""
    at, F = knots(v, pieces, level, delta), stribeck(v, level, delta)
    return float(np.abs(np.interp(v, at, stribeck(at, level, delta)) - F).max())


def chord(a: float, b: float) -> float:
    """Largest distance of exp(-v) from its chord between a and b."""
    slope = (np.exp(-a) - np.exp(-b)) / (b - a)
    v = -np.log(slope)
    return float(np.exp(-a) - slope * (v - a) - np.exp(-v))
