"""The end of a fit as arrays, and the order in time of the rows of a channel."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.residuals.evaluation import Array, Channel
from identification.solving.task import Point, Task, influence
from identification.unknowns.spec import Unknown

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


@final
@dataclass(frozen=True, eq=False)
class Minimum:
    """A minimum of weighted least squares over n coordinates w, with k values that depend on them.

    Attributes:
        channels: what the rows are.
        unknowns: what has a coordinate, shape (n,).
        names, values: of what the residuals take, shape (k,).
        slope: dvalues/dw, shape (k, n).
        held: coordinates at a bound, shape (n,).
        r: weighted residuals, with a robust loss its influence function of them, shape (rows,).
        J: dr/dw of the weighted residuals before the loss, shape (rows, n).
        gain: derivative of the influence function; one for squares, shape (rows,).
        raw: predicted - measured in SI units, shape (rows,).
        noise: standard deviation of the noise of signals for which it is known.
    """

    channels: Sequence[Channel]
    unknowns: tuple[Unknown, ...]
    names: tuple[str, ...]
    values: Array
    slope: Array
    held: NDArray[np.bool_]
    r: Array
    J: Array
    gain: Array
    raw: Array
    noise: Mapping[str, float]

    def label(self, channel: Channel) -> str:
        """Name of a channel for a sentence."""
        records = {c.record for c in self.channels}
        return channel.signal if len(records) == 1 else f"{channel.signal}[{channel.record}]"


def minimum(task: Task, point: Point) -> Minimum:
    """The arrays of a solved task.

    The derivative of the influence function psi = rho' r is taken as its mean over a channel
    (Huber and Ronchetti, Robust Statistics, 2009, section 7.6), which is never negative in effect.
    """
    gain = np.ones(point.r.size)
    if point.loss != "squares":
        h = 1e-4
        above, below = (influence(r, point.loss) * r for r in (point.r + h, point.r - h))
        for channel in task.channels:
            rows = channel.rows
            gain[rows] = max(float(np.mean(above[rows] - below[rows])) / (2 * h), 0.05)
    known = {s: sigma for s, sigma in task.noise.items() if s not in task.estimated}
    return Minimum(
        channels=task.channels,
        unknowns=task.unknowns.unknowns,
        names=task.unknowns.names,
        values=point.values,
        slope=point.slope,
        held=task.unknowns.at_bound(point.w),
        r=point.weights * point.r,
        J=point.J,
        gain=gain,
        raw=point.evaluation.r,
        noise=known,
    )


def trace(task: Task, found: Minimum) -> Callable[[Array], float]:
    """How much weighted residuals change with the values: root of the sum of squares."""
    sigma = task.sigma

    def change(values: Array) -> float:
        there = task.residuals.at(values)
        if isinstance(there, str):
            return float("inf")
        return float(np.linalg.norm((there.r - found.raw) / sigma))

    return change
