"""Common interface of all residuals for minimisation, tests and plots."""

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
    """A signal of a record among the rows, in order of time.

    Attributes:
        record: number of the record.
        signal: name of the compared signal, such as "force" or "x".
        unit: its SI unit.
        rows: slice of its residuals.
        t: times of its rows [s]; for points, their velocities or 0, 1, 2 ...
        measured: measured values, shape of `t`.
        regressors: signals on which correct residuals do not depend, by name, each of the shape
            of `t`: inputs, velocity, its sign.
        breaks: first rows of the second and later windows, counted in the channel: residuals on
            either side are not neighbours.
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
        """Names of the values, in the order of the columns of J.

        All free parameters of the model, then the own unknowns (start values, dead times).
        """
        ...

    @property
    def own(self) -> tuple[Unknown, ...]:
        """Unknowns of the data set, such as start values of each record."""
        ...

    @property
    def channels(self) -> Sequence[Channel]:
        """Channels that together cover all rows."""
        ...

    @abstractmethod
    def at(self, values: Array) -> Evaluation | str:
        """Return the residuals at `values`, or a message if they cannot be evaluated."""
        ...
