"""Points of a friction curve from a record with stretches of constant velocity."""

from math import ceil

import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.record import Record
from identification.signals.filters import central_difference, lowpass
from symfric.foundation import checks

Array = NDArray[np.float64]

SMOOTHINGS = 2.0
"""Cut-off of the velocity that is looked at, over 1 / (shortest plateau)."""
REST = 1e-3
"""Speed over the largest one below which a stretch is rest and no point of a curve."""


def plateaus(
    data: Dataset,
    *,
    force: str = "force",
    v: str | None = None,
    x: str = "x",
    shortest: float = 0.2,
    change: float = 0.05,
    settle: float = 0.2,
) -> Dataset:
    """Means of velocity and force over stretches of constant velocity, as points for `Points`.

    A staircase of speeds, a triangle of positions: wherever the smoothed velocity changes by less
    than the share `change` in the time `shortest`, for at least that time, is a plateau. Its first
    part, of the share `settle`, is left out. Rest is none. There the acceleration is nothing, so
    that the mean force is friction and what is constant, such as weight.

    Args:
        data: equally spaced records; each gives a record of points.
        force: channel of the driving force or torque.
        v: channel of the velocity; None: "v" where there is one, else the slope of `x`.
        x: channel of the position.
        shortest: duration [s].
        change: largest relative change of velocity.
        settle: share of a plateau, 0 <= settle < 1.

    Returns:
        Channels v, F, `n` (samples behind a mean, for `Points(weight="n")`) and `spread` (standard
        deviation of the force there); mean times as `t_mean`.

    Raises:
        ValueError: no record has a plateau; unequal intervals; arguments out of range.
    """
    shortest = checks.number("plateaus: shortest", shortest, unit="s", above=0.0)
    change = checks.number("plateaus: change", change, above=0.0)
    settle = checks.number("plateaus: settle", settle, lower=0.0, upper=0.9)
    found: list[Record] = []
    for record in data:
        speed = v or ("v" if "v" in record else None)
        name = x if speed is None else speed
        velocity = record[name] if speed is not None else _slope(record, x)
        begins = _stretches(velocity, record.uniform().step, shortest, change)
        cut = [slice(b + ceil(settle * (e - b)), e) for b, e in begins]
        if not cut:
            continue
        rotary = record.unit(name).startswith("rad")
        units = {"v": "rad/s" if rotary else "m/s", "F": record.unit(force) or "N"}
        columns = {
            "v": [velocity[s].mean() for s in cut],
            "F": [record[force][s].mean() for s in cut],
            "n": [float(s.stop - s.start) for s in cut],
            "spread": [record[force][s].std() for s in cut],
            "t_mean": [record.time[s].mean() for s in cut],
        }
        units |= {"n": "1", "spread": units["F"], "t_mean": "s"}
        signals = {key: np.array(values, float) for key, values in columns.items()}
        if len(cut) > 1:
            found.append(Record(f"plateaus of {record.name}", None, signals, units))
    if not found:
        raise ValueError(
            f"data '{data.name}': plateaus: expected at least two stretches of {shortest:g} s with "
            f"a velocity constant to {change:.0%}, got none; lower shortest= or raise change="
        )
    return Dataset(tuple(found), f"plateaus of {data.name}")


def _slope(record: Record, x: str) -> Array:
    return central_difference(record[x], record.uniform().step)


def _stretches(v: Array, step: float, shortest: float, change: float) -> list[tuple[int, int]]:
    """Begin and end of each plateau."""
    cutoff = min(SMOOTHINGS / shortest, 0.45 / step)
    smooth = lowpass(v, cutoff, step)
    steady = np.abs(central_difference(smooth, step)) * shortest < change * np.abs(smooth)
    steady &= np.abs(smooth) > REST * np.abs(smooth).max()
    edges = np.flatnonzero(np.diff(np.concatenate([[False], steady, [False]]).astype(int)))
    runs = zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    return [(b, e) for b, e in runs if (e - b) * step >= shortest]
