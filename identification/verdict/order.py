"""The order of a channel's rows in time: which rows are neighbours, and how far apart two are."""

import numpy as np
from numpy.typing import NDArray

from identification.residuals.evaluation import Array, Channel

Count = NDArray[np.int64]

JITTER = 0.5
"""Deviation from the usual step, over it, from which on the next row is no neighbour."""


def positions(channel: Channel, *, across_windows: bool = False) -> Count:
    """How many neighbours in time stand right before each row, shape (n,).

    0 starts a run: at the first row, at a break, where time jumps or stands still, and everywhere
    if the channel has no order. `across_windows` lets a run go on over the breaks of windows
    where time goes on: the noise of a sensor knows nothing of windows.
    """
    n = channel.t.size
    if not channel.ordered:
        return np.zeros(n, dtype=np.int64)
    starts = np.zeros(n, dtype=bool)
    starts[:1] = True
    starts[1:] = ~(np.abs(np.diff(channel.t) / _step(channel.t) - 1) < JITTER)
    if not across_windows:
        starts[[b for b in channel.breaks if 0 < b < n]] = True
    here = np.arange(n, dtype=np.int64)
    return here - np.maximum.accumulate(np.where(starts, here, 0))


def places(channel: Channel) -> Count:
    """Number of each row on the grid of the usual step, shape (n,); rows of one time share it.

    Where the times are on no grid the rows are counted, with a place left out at every gap.
    """
    n = channel.t.size
    if not channel.ordered or n < 2:
        return np.arange(n, dtype=np.int64)
    steps = (channel.t - channel.t[0]) / _step(channel.t)
    grid = np.rint(steps)
    if np.abs(steps - grid).max() < 0.2 and steps.min() >= 0 and grid.max() < 20 * n:
        return grid.astype(np.int64)
    return np.cumsum(1 + (positions(channel, across_windows=True) == 0)).astype(np.int64) - 2


def lagged(signal: Array, position: Count, lag: int) -> Array:
    """`signal` so many rows earlier; before the start of a run, the value at its start."""
    back = np.minimum(position, lag)
    return signal[np.arange(signal.shape[0]) - back]


def _step(t: Array) -> float:
    """The usual distance of two rows."""
    steps = np.diff(t)
    steps = steps[steps > 0]
    return float(np.median(steps)) if steps.size else 1.0
