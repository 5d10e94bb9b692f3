"""Where a record is cut, so that a simulation starts again from the data."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FEWEST = 8
"""Samples of a window: fewer do not tell its start values."""
MARGIN = 0.25
"""How far a cut may move, over the length of a window."""


def cut(t: Array, length: float | None, speed: Array | None = None) -> tuple[slice, ...]:
    """Samples of consecutive windows of about `length` [s]; None is one window.

    Windows are of one length that divides the record. Where `speed` (n,) is given, each cut moves
    to the fastest sample within a quarter of a window: bristles slide steadily there, and their
    start follows from the velocity.

    Raises:
        ValueError: windows of fewer than eight samples.
    """
    n, span = t.size, float(t[-1] - t[0])
    if length is None or length >= span:
        return (slice(0, n),)
    count = max(1, round(span / length))
    ends = t[0] + span * np.arange(1, count) / count
    cuts = np.searchsorted(t, ends)
    if speed is not None:
        reach = MARGIN * span / count
        cuts = np.array([_fastest(t, speed, float(end), reach) for end in ends], dtype=np.intp)
    edges = [0, *cuts.tolist(), n]
    pieces = tuple(slice(a, b) for a, b in pairwise(edges))
    shortest = min(piece.stop - piece.start for piece in pieces)
    if shortest < FEWEST:
        raise ValueError(
            f"Shooting: windows: expected windows of at least {FEWEST} samples, got one of "
            f"{shortest} with windows={length:g} s"
        )
    return pieces


def _fastest(t: Array, speed: Array, middle: float, reach: float) -> int:
    a, b = np.searchsorted(t, [middle - reach, middle + reach])
    return int(a + np.argmax(np.abs(speed[a : max(b, a + 1)])))


def turnaround(t: Array, y: Array) -> float:
    """How long [s] a signal takes for a turn: the period, where it is a sine.

    That is six times the delay after which it differs by its standard deviation.
    """
    size, lag = float(np.std(y)), 1
    while lag < y.size // 2 and np.sqrt(np.mean((y[lag:] - y[:-lag]) ** 2)) < size:
        lag = max(lag + 1, int(1.2 * lag))
    return 6 * lag * float(t[-1] - t[0]) / (t.size - 1)
