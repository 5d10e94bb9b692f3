"""How fine a measured signal is: below that, residuals say nothing of a model."""

import numpy as np

from identification.residuals.evaluation import Array

ROUNDING = 1e-6
"""Share of the range of a signal that simulations and interpolation may be off."""
BALANCE = 1e-3
"""The same of a force: filtered and differentiated motions give none that is more exact."""
FORCES = ("N", "N m")


def resolution(measured: Array, unit: str) -> float:
    """Root mean square of the errors of rounding and of simulation, in the unit of the signal.

    A signal is rounded if its values are multiples of the smallest step between two of them.
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
