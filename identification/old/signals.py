"""Velocity and acceleration of a record, and its equations after decimation."""

from dataclasses import dataclass
from functools import cached_property
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.old.data import Array, Dataset
from identification.old.filters import (
    Decimation,
    Filter,
    central_difference,
    choose_filter,
    lowpass,
)


@final
@dataclass(frozen=True, eq=False)
class MotionSignals:
    """A record differentiated without phase shift, its disturbed ends cut off.

    Attributes:
        name: of the record.
        t, x, v, a: time [s], filtered position [m], velocity [m/s], acceleration [m/s^2].
        force: measured force [N], as measured.
        filter: what was used.
    """

    name: str
    t: Array
    x: Array
    v: Array
    a: Array
    force: Array
    filter: Filter

    @cached_property
    def decimation(self) -> Decimation:
        """The low pass that thins samples to equations."""
        return Decimation(self.t.size, self.filter.decimation)

    @cached_property
    def kept(self) -> NDArray[np.int64]:
        """Rows of the decimation that are used: those two rows or more away from |v| < v_min."""
        slow = (np.abs(self.v) < self.filter.v_min).astype(float)
        reach = np.ones(4 * self.filter.decimation + 1)
        touched = np.convolve(slow, reach, mode="same") > 0.5
        return np.flatnonzero(~self.decimation.centres(touched))

    def equations(self, signal: Array) -> Array:
        """`signal` thinned to the equations in use, shape (rows,)."""
        return self.decimation(signal)[self.kept]

    @cached_property
    def matrix(self) -> ca.DM:
        """The same as a sparse matrix, shape (rows, samples)."""
        return self.decimation.matrix[self.kept.tolist(), :]

    @property
    def times(self) -> Array:
        """Times of the equations [s]."""
        return self.decimation.centres(self.t)[self.kept]


def filter_of(data: Dataset) -> Filter:
    """The filter `data` comes with, or the one chosen from its force."""
    return data.filter or choose_filter(data.force, data.uniform().step)


def differentiate(data: Dataset, filter: Filter | None = None) -> MotionSignals:
    """Filtered position, velocity and acceleration of `data`.

    The position (and the velocity, where it is measured) passes the zero-phase Butterworth filter;
    central differences give the rest.

    Args:
        data: equally spaced samples.
        filter: cut-off and decimation; `filter_of(data)` if none is given.

    Raises:
        ValueError: unequal intervals, a cut-off above the Nyquist frequency, too short a record.
    """
    step = data.uniform().step
    chosen = filter or filter_of(data)
    x = lowpass(data.x, chosen.cutoff, step, chosen.order)
    v = (
        central_difference(x, step)
        if data.v is None
        else lowpass(data.v, chosen.cutoff, step, chosen.order)
    )
    a = central_difference(v, step)
    cut = chosen.trim(step)
    inside = slice(cut, max(cut, data.t.size - cut))
    signals = MotionSignals(
        data.name, data.t[inside], x[inside], v[inside], a[inside], data.force[inside], chosen
    )
    if signals.decimation.rows == 0 or signals.kept.size < 10:
        raise ValueError(
            f"data '{data.name}': expected enough samples for the filter ({chosen.cutoff:g} Hz, "
            f"decimation {chosen.decimation}, v_min {chosen.v_min:g} m/s), got {data.t.size}; "
            "raise the cut-off, lower the decimation or v_min"
        )
    return signals
