"""Common interface of all residuals for minimisation, tests and plots."""

from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, final

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


class Evaluation(NamedTuple):
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

    def at(self, values: Array) -> Evaluation | str:
        """Return the residuals at `values`, or a message if they cannot be evaluated."""
        ...


@dataclass(frozen=True, eq=False)
class Blocks:
    """Residuals in blocks of rows, one below the other.

    Attributes:
        parameters: free parameters of the model.
        own: unknowns of the data set.
        channels: of all rows.
    """

    parameters: tuple[str, ...]
    own: tuple[Unknown, ...]
    channels: tuple[Channel, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the values: parameters, then own unknowns."""
        return (*self.parameters, *(unknown.name for unknown in self.own))

    @abstractmethod
    def blocks(self, p: Array, own: Array) -> Iterator[tuple[Array, Array] | str]:
        """Yield residuals and derivatives by all values of each block, or a message.

        Args:
            p: values of the parameters.
            own: values of the own unknowns.
        """
        ...

    def at(self, values: Array) -> Evaluation | str:
        """Return residuals and derivatives, or a message if they cannot be evaluated."""
        values = np.asarray(values, float)
        count, found = len(self.parameters), list[tuple[Array, Array]]()
        for block in self.blocks(values[:count], values[count:]):
            if isinstance(block, str):
                return block
            found.append(block)
        r, J = zip(*found, strict=True)
        return Evaluation(np.concatenate(r), np.vstack(J))
