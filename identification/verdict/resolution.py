"""Accuracy of a measured signal and of its simulation, below which residuals have no meaning."""

import numpy as np

from identification.residuals.evaluation import Array

ROUNDING = 1e-6
"""Error of simulation and interpolation, relative to the range of a signal."""
BALANCE = 2e-4
"""The same error for a force, limited by filtering and differentiation of the motion."""
FORCES = ("N", "N m")


def resolution(measured: Array, unit: str) -> float:
    """Return the rms error of rounding and simulation, in the unit of the signal.

    A signal is rounded if its values are multiples of the smallest step between them.
    """
    values = np.unique(measured)
    reach = float(values[-1] - values[0])
    floor = (BALANCE if unit in FORCES else ROUNDING) * max(
        reach, 1e-3 * float(np.abs(values).max())
    )
    steps = np.diff(values)
    steps = steps[steps > 1e-9 * reach]
    if not steps.size:
        return floor
    count = (values - values[0]) / float(steps.min())
    rounded = np.abs(count - np.rint(count)).max() < 0.1 and values.size < 0.9 * measured.size
    return max(floor, float(steps.min()) / np.sqrt(12)) if rounded else floor


def rms(r: Array) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(r**2)))
