"""Signals that residuals may depend on: inputs, and how the model says that it moved.

The measured motion has the same noise as the residuals and would depend on them; the predicted one
has not.
"""

import numpy as np

from identification.residuals.evaluation import Array, Channel
from identification.verdict.features import Clue, Kind
from identification.verdict.minimum import Minimum
from identification.verdict.order import Count, positions

POSITIONS, VELOCITIES = ("m", "rad"), ("m/s", "rad/s")


def clues_of(found: Minimum, channel: Channel) -> list[Clue]:
    """The regressors of a channel, and the motion that was simulated for its record."""
    clues = {n: Clue(n, s, _kind(n)) for n, s in channel.regressors.items()}
    for other in found.channels:
        if other.record != channel.record or not _same_times(other, channel):
            continue
        predicted = other.measured + found.raw[other.rows]
        if other.unit in VELOCITIES:
            clues.setdefault(other.signal, Clue(other.signal, predicted, "velocity"))
        elif other.unit in POSITIONS and other.ordered:
            clues.setdefault(other.signal, Clue(other.signal, predicted, "position"))
            rate = "v" if other.signal == "x" else f"the rate of {other.signal}"
            speed = _rate(predicted, other.t, positions(other))
            clues.setdefault(rate, Clue(rate, speed, "velocity"))
    return list(clues.values())


def _kind(name: str) -> Kind:
    """What a regressor is by its name."""
    stem = name.replace(".", "_").replace("[", "_").split("_")[0]
    kinds: dict[str, Kind] = {"x": "position", "v": "velocity", "a": "acceleration"}
    return kinds.get(stem, "")


def _same_times(one: Channel, other: Channel) -> bool:
    return one.t.size == other.t.size and bool(np.array_equal(one.t, other.t))


def _rate(x: Array, t: Array, position: Count) -> Array:
    """Slope of x over time, inside each run."""
    slope = np.zeros_like(x)
    starts = np.flatnonzero(position == 0)
    for first, last in zip(starts, [*starts[1:], x.size], strict=True):
        if last - first > 1:
            slope[first:last] = np.gradient(x[first:last], t[first:last])
    return slope
