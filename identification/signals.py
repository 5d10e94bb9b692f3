"""Velocity and acceleration of a record, and its equations after decimation."""

from dataclasses import dataclass
from functools import cached_property
from typing import final

from identification.data import Array, Dataset
from identification.filters import Decimation, Filter, central_difference, choose_filter, lowpass


@final
@dataclass(frozen=True, eq=False)
class Signals:
    """A record differentiated without phase shift, its disturbed ends cut off.

    Attributes:
        name: of the record.
        t, x, v, a: time [s], filtered position [m], velocity [m/s], acceleration [m/s^2].
        force: measured force [N], as measured.
        decimation: turns any of these into equations.
        filter: what was used.
    """

    name: str
    t: Array
    x: Array
    v: Array
    a: Array
    force: Array
    decimation: Decimation
    filter: Filter

    @cached_property
    def decimated(self) -> "dict[str, Array]":
        """Times and thinned v, a, force of the equations."""
        signals = {"v": self.v, "a": self.a, "force": self.force}
        thinned = {name: self.decimation(values) for name, values in signals.items()}
        return {"t": self.decimation.centres(self.t), **thinned}


def filter_of(data: Dataset) -> Filter:
    """The filter chosen from the force of `data`."""
    return choose_filter(data.force, data.uniform().step)


def differentiate(data: Dataset, filter: Filter | None = None) -> Signals:
    """Filtered position, velocity and acceleration of `data`.

    The position (and the velocity, where it is measured) passes the zero-phase Butterworth filter;
    central differences give the rest.

    Args:
        data: equally spaced samples.
        filter: cut-off and decimation; chosen from the data if none is given.

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
    inside = slice(cut, data.t.size - cut)
    decimation = Decimation(max(0, data.t.size - 2 * cut), chosen.decimation)
    if decimation.rows < 10:
        raise ValueError(
            f"data '{data.name}': expected enough samples for the filter ({chosen.cutoff:g} Hz, "
            f"decimation {chosen.decimation}), got {data.t.size} samples for {decimation.rows} "
            "equations; raise the cut-off or lower the decimation"
        )
    columns = (data.t, x, v, a, data.force)
    return Signals(data.name, *(c[inside] for c in columns), decimation, chosen)
