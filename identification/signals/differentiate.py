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
from identification.signals.velocity import Velocity
from symfric.foundation.brief import brief

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

    __repr__ = brief

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
    x: Array | None, v: Array | None, step: float, filter: Filter, told: Velocity
) -> tuple[Array, Array, Array]:
    """Filtered position, velocity and acceleration, each shape (n,).

    Central differences of the filtered position; the acceleration is its second difference over
    two steps, whose gain falls short of one by (w h)^2 / 12 only. A measured velocity is filtered
    and differentiated once. Of two, velocity and acceleration are mixed as `told` says.

    Args:
        x: position, samples; None: it is not measured (zeros are returned).
        v: measured velocity, or None.
        step: sample interval [s].
        filter: cut-off and order.
        told: `Velocity.of(x, v, step)`.
    """
    one: list[Array] = []
    other: list[Array] = []
    if x is not None:
        x = lowpass(x, filter.cutoff, step, filter.order)
        a = np.empty_like(x)
        a[1:-1] = (x[2:] - 2 * x[1:-1] + x[:-2]) / step**2
        a[0], a[-1] = a[1], a[-2]
        one = [central_difference(x, step), a]
    if v is not None:
        v = lowpass(v, filter.cutoff, step, filter.order)
        other = [v, central_difference(v, step)]
    if one and other:
        one = [told.mixed(by_x, by_v) for by_x, by_v in zip(one, other, strict=True)]
    velocity, acceleration = one or other
    return np.zeros_like(velocity) if x is None else x, velocity, acceleration


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


def filter_of(record: Record, force: str = "force", x: str = "x", v: str | None = None) -> Filter:
    """The filter chosen from force, position and velocity of a record; see `differentiate`."""
    step, (position, velocity) = record.uniform().step, _measured(record, x, v)
    told = Velocity.of(position, velocity, step)
    return choose_filter(record[force], step, [told.band(position, velocity, step)])


def _measured(record: Record, x: str, v: str | None) -> tuple[Array, Array | None]:
    v = v or ("v" if "v" in record else None)
    return record[x], None if v is None else record[v]


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
        v: channel of a measured velocity, mixed with that of the position as `Velocity` says;
            None: "v" where the record has it.

    Raises:
        ValueError: unequal intervals, a cut-off above the Nyquist frequency, too short a record.
    """
    step = record.uniform().step
    chosen = filter or filter_of(record, force, x, v)
    measured = _measured(record, x, v)
    told = Velocity.of(*measured, step)
    motion = derivatives(*measured, step, chosen, told)
    slow = uncertain(motion[1], told.deviation(chosen, step), step, chosen)
    cut = chosen.trim(step)
    inside = slice(cut, max(cut, record.size - cut))
    x_, v_, a_ = (signal[inside] for signal in motion)
    signals = MotionSignals(
        name=record.name,
        t=record.time[inside],
        x=x_,
        v=v_,
        a=a_,
        force=record[force][inside],
        filter=chosen,
        slow=slow[inside],
    )
    if signals.decimation.rows == 0 or signals.kept.size < 10:
        limit = "by the data" if chosen.v_min is None else f"{chosen.v_min:g} m/s"
        raise ValueError(
            f"data '{record.name}': expected enough samples for the filter ({chosen.cutoff:g} Hz, "
            f"decimation {chosen.decimation}, v_min {limit}), got {record.size}; "
            "raise the cut-off, lower the decimation or v_min"
        )
    return signals
