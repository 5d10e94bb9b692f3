"""Velocity and acceleration of a record, and its equations after decimation."""

from dataclasses import dataclass
from functools import cached_property
from math import ceil
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.data.record import Record
from identification.signals.filters import (
    Decimation,
    Filter,
    central_difference,
    choose_filter,
    lowpass,
)

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CERTAIN = 4.0
"""Standard deviations of the velocity's noise within which it may be rest."""


@final
@dataclass(frozen=True, eq=False)
class MotionSignals:
    """A record differentiated without phase shift, its disturbed ends cut off.

    Attributes:
        name: of the record.
        t, x, v, a: time [s], filtered position [m], velocity [m/s], acceleration [m/s^2].
        force: measured force [N], as measured.
        filter: what was used.
        slow: samples at which the direction of motion is not certain.
    """

    name: str
    t: Array
    x: Array
    v: Array
    a: Array
    force: Array
    filter: Filter
    slow: Mask

    @cached_property
    def decimation(self) -> Decimation:
        """The low pass that thins samples to equations."""
        return Decimation(self.t.size, self.filter.decimation)

    @cached_property
    def kept(self) -> NDArray[np.int64]:
        """Rows of the decimation that are used: those without a slow sample in their window."""
        return np.flatnonzero(~self.decimation.touched(self.slow))

    def equations(self, signal: Array) -> Array:
        """`signal` thinned to the equations in use, shape (rows,)."""
        return self.decimation(signal)[self.kept]

    @property
    def times(self) -> Array:
        """Times of the equations [s]."""
        return self.decimation.centres(self.t)[self.kept]


def derivatives(
    x: Array, v: Array | None, step: float, filter: Filter
) -> tuple[Array, Array, Array]:
    """Filtered position, velocity and acceleration, each shape (n,).

    Central differences of the filtered position; the acceleration is its second difference over
    two steps, whose gain falls short of one by (w h)^2 / 12 only. A measured velocity is filtered
    and differentiated once.

    Args:
        x: position, samples.
        v: measured velocity, or None.
        step: sample interval [s].
        filter: cut-off and order.
    """
    x = lowpass(x, filter.cutoff, step, filter.order)
    if v is not None:
        v = lowpass(v, filter.cutoff, step, filter.order)
        return x, v, central_difference(v, step)
    a = np.zeros_like(x)
    a[1:-1] = (x[2:] - 2 * x[1:-1] + x[:-2]) / step**2
    return x, central_difference(x, step), a


def velocity_noise(x: Array, v: Array | None, step: float, filter: Filter) -> float:
    """Standard deviation of the noise of the filtered velocity [m/s], white on x (or v).

    The level on x is that of the upper half of its spectrum, where no motion is.
    """
    measured = x if v is None else v
    rest = measured - np.linspace(measured[0], measured[-1], measured.size)
    power = np.abs(np.fft.rfft(rest * np.hanning(rest.size))) ** 2 / (0.375 * rest.size)
    level = float(np.median(power[power.size // 2 :])) / np.log(2)
    frequency = np.linspace(0.0, 0.5, 1001)[1:-1]
    ratio = np.tan(np.pi * frequency) / np.tan(np.pi * filter.cutoff * step)
    gain = 1 / (1 + ratio ** (2 * filter.order))
    if v is None:
        gain *= np.sin(2 * np.pi * frequency) / step
    return float(np.sqrt(level * np.mean(gain**2)))


def uncertain(v: Array, noise: float, step: float, filter: Filter) -> Mask:
    """Samples at which a static law cannot be asked for its force, shape (n,).

    Those where the velocity changes sign or cannot be told from rest (four standard deviations of
    its `noise`), and those that the low pass mixes with them: one half of 1 / cutoff around. With
    `filter.v_min` given, those slower than that.
    """
    if filter.v_min is not None:
        return np.abs(v) < filter.v_min
    slow = np.abs(v) <= CERTAIN * noise
    turns = np.signbit(v[1:]) != np.signbit(v[:-1])
    slow[1:] |= turns
    slow[:-1] |= turns
    around = ceil(0.5 / (filter.cutoff * step))
    return np.convolve(slow, np.ones(2 * around + 1), mode="same") > 0.5


def filter_of(record: Record, force: str = "force", x: str = "x") -> Filter:
    """The filter chosen from force and position of a record."""
    return choose_filter(record[force], record.uniform().step, [record[x]])


def differentiate(
    record: Record,
    filter: Filter | None = None,
    *,
    force: str = "force",
    x: str = "x",
    v: str | None = None,
) -> MotionSignals:
    """Filtered position, velocity and acceleration of a record of a drive.

    Args:
        record: equally spaced samples.
        filter: cut-off and decimation; `filter_of(record)` if none is given.
        force, x: names of the channels.
        v: channel of a measured velocity; "v" is used where the record has it.

    Raises:
        ValueError: unequal intervals, a cut-off above the Nyquist frequency, too short a record.
    """
    step = record.uniform().step
    chosen = filter or filter_of(record, force, x)
    v = v or ("v" if "v" in record else None)
    measured = record[x], None if v is None else record[v]
    motion = derivatives(*measured, step, chosen)
    slow = uncertain(motion[1], velocity_noise(*measured, step, chosen), step, chosen)
    cut = chosen.trim(step)
    inside = slice(cut, max(cut, record.size - cut))
    x_, v_, a_ = (signal[inside] for signal in motion)
    signals = MotionSignals(
        record.name, record.time[inside], x_, v_, a_, record[force][inside], chosen, slow[inside]
    )
    if signals.decimation.rows == 0 or signals.kept.size < 10:
        limit = "by the data" if chosen.v_min is None else f"{chosen.v_min:g} m/s"
        raise ValueError(
            f"data '{record.name}': expected enough samples for the filter ({chosen.cutoff:g} Hz, "
            f"decimation {chosen.decimation}, v_min {limit}), got {record.size}; "
            "raise the cut-off, lower the decimation or v_min"
        )
    return signals
