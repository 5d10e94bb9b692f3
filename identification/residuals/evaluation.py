"""What every kind of residuals looks like to those who minimise, test and draw them."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, final

import numpy as np
from numpy.typing import NDArray

from identification.unknowns.spec import Unknown

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Channel:
    """One signal of one record among the rows, in order of time.

    Attributes:
        record: number of the record.
        signal: name of what is compared, such as "force" or "x".
        unit: its SI unit.
        rows: where its residuals stand.
        t: times of its rows [s]; of points, their velocities or 0, 1, 2 ...
        measured: measured values, shape of `t`.
        regressors: signals that a right model leaves no trace of in the residuals, by name, shape
            of `t` each: inputs, velocity, its sign.
        breaks: first rows, counted inside the channel, of windows after the first: residuals on
            either side are no neighbours.
        ordered: whether neighbours in the rows are neighbours in time.
    """

    record: int
    signal: str
    unit: str
    rows: slice
    t: Array
    measured: Array
    regressors: Mapping[str, Array]
    breaks: tuple[int, ...] = ()
    ordered: bool = True


@final
@dataclass(frozen=True, eq=False)
class Evaluation:
    """Residuals r = predicted - measured in SI units (rows,), and dr/dvalues (rows, values)."""

    r: Array
    J: Array


class Residuals(Protocol):
    """Residuals of one data set as a function of values."""

    @property
    def names(self) -> tuple[str, ...]:
        """Of the values, in the order of the columns of J.

        All free parameters of the model, then the own unknowns (start values, dead times).
        """
        ...

    @property
    def own(self) -> tuple[Unknown, ...]:
        """Unknowns that the data bring with them, such as start values of each record."""
        ...

    @property
    def channels(self) -> Sequence[Channel]:
        """What the rows are; they cover them all."""
        ...

    @abstractmethod
    def at(self, values: Array) -> Evaluation | str:
        """The residuals at `values`; a sentence that says why there are none."""
        ...
