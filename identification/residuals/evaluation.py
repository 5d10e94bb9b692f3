"""Common interface of all residuals, used by minimisation, tests and plots; robust losses.

A loss C^2 rho((r/C)^2) equals e^2 with e = C sign(r) sqrt(rho((r/C)^2)). C is the residual, in
standard deviations, above which an outlier costs less. e is smooth, so the problem remains one of
least squares, with exact derivatives e' = rho' r / e.

Sources: P. J. Huber, E. M. Ronchetti, Robust Statistics, 2nd ed., 2009; B. Triggs et al., Bundle
Adjustment, 2000, section 3.
"""

from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol, final

import numpy as np
from numpy.typing import NDArray

from identification.unknowns.spec import Unknown

Array = NDArray[np.float64]

DEAD_TIME = "dead_time"
"""Name of the unknown dead time, in inverse dynamics followed by the index of the record."""


@final
@dataclass(frozen=True, eq=False)
class Channel:
    """Rows of one signal of one record, in order of time.

    Attributes:
        record: index of the record.
        signal: name of the compared signal, such as "force" or "x".
        unit: SI unit of the signal.
        rows: slice of the rows among all residuals.
        t: times of the rows [s]; for points, their velocities or 0, 1, 2 ...
        measured: measured values, shape of `t`.
        regressors: name -> signal of which correct residuals are independent, such as inputs, the
            velocity and its sign, shape of `t`.
        breaks: first rows of the second and later windows, counted in the channel; residuals on
            either side are not neighbours.
        ordered: True if neighbouring rows are neighbours in time.
        motion_noise: rms [unit] of the residuals by the noise of the regressors, at the minimum.
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
    motion_noise: float = 0.0


class Bias(NamedTuple):
    """Squares of the residuals of each channel by the noise of their regressors.

    Attributes:
        squares: expected sum of squares, shape (channels,).
        slopes: half its derivatives by the first values, shape (channels, k).
        usual: the squares at the start of a fit, shape (channels,).
    """

    squares: Array
    slopes: Array
    usual: Array


class Evaluation(NamedTuple):
    """Residuals r = predicted - measured in SI units (rows,), and dr/dvalues J (rows, values).

    The cost of a row is r^2 + excess.
    """

    r: Array
    J: Array
    excess: Array | float = 0.0

    def corrected(self, channels: Sequence[Channel], bias: Bias) -> "Evaluation":
        """Return residuals r - d with d = J (J'J)^-1 c for the slopes c of the bias B.

        Their cost |r|^2 - B has the gradient 2 J'(r - d). The usual B is added, so that the cost
        is positive.
        """
        d, excess = np.zeros_like(self.r), np.zeros_like(self.r)
        for k, channel in enumerate(channels):
            rows, c = channel.rows, np.zeros(self.J.shape[1])
            c[: bias.slopes.shape[1]] = bias.slopes[k]
            d[rows] = shifted_by(self.J[rows], c)
            excess[rows.start] = bias.usual[k] - bias.squares[k]
        return Evaluation(self.r - d, self.J, excess + d * (2 * self.r - d))


RANK = 1e-9
"""Smallest nonzero singular value of scaled sensitivities, relative to the largest."""


def shifted_by(J: Array, c: Array) -> Array:
    """Return J (J'J)^-1 c, by which residuals change if J'r changes by c, shape (rows,)."""
    size = np.sqrt(np.sum(J * J, axis=0))
    size[size == 0.0] = 1.0
    _, s, Vt = np.linalg.svd(np.linalg.qr(J / size, mode="r"))
    axes = Vt[s > RANK * s.max(initial=1e-300)]
    return J @ (axes.T @ (axes @ (c / size) / s[: len(axes)] ** 2) / size)


def unbiased(residuals: Any, values: Array) -> Evaluation | str:
    """Return the residuals at `values` without their bias, or a message on failure."""
    found: Evaluation | str = residuals.at(values)
    if isinstance(found, str) or not hasattr(residuals, "bias"):
        return found
    bias = residuals.bias(values)
    return found if bias is None else found.corrected(residuals.channels, bias)


class Residuals(Protocol):
    """Residuals of one data set as a function of the values to be fitted."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the values, in the order of the columns of J.

        Free parameters of the model precede the own unknowns (start values, dead times).
        """
        ...

    @property
    def own(self) -> tuple[Unknown, ...]:
        """Unknowns of the data set, such as the start values of each record."""
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
    """Residuals computed in blocks of consecutive rows.

    Attributes:
        parameters: free parameters of the model.
        own: unknowns of the data set.
        channels: channels of all rows.
    """

    parameters: tuple[str, ...]
    own: tuple[Unknown, ...]
    channels: tuple[Channel, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the values: parameters first, then own unknowns."""
        return (*self.parameters, *(unknown.name for unknown in self.own))

    @property
    def linear(self) -> bool:
        """True if the residuals are linear in the values; they are then evaluated once."""
        return False

    @property
    def part(self) -> "Blocks | None":
        """Residuals of evenly spaced blocks of long records; None for short ones and with states.

        A fit searches there first.
        """
        return None

    def bias(self, values: Array) -> Bias | None:
        """Return the squares of the residuals by the noise of the measured motion."""
        del values
        return None

    @abstractmethod
    def blocks(self, p: Array, own: Array) -> Iterator[tuple[Array, Array] | str]:
        """Yield residuals and their derivatives by all values for each block, or a message.

        Args:
            p: values of the parameters.
            own: values of the own unknowns.
        """
        ...

    def at(self, values: Array) -> Evaluation | str:
        """Return residuals and derivatives, or a message if they cannot be evaluated."""
        values = np.asarray(values, float)
        if not self.linear:
            return self._whole(values)
        if not self._known:
            found = self._whole(values)
            if isinstance(found, str):
                return found
            self._known.append((values, found))
        there, (r, J, _) = self._known[0]
        return Evaluation(r + np.einsum("ij,j->i", J, values - there), J)

    @cached_property
    def _known(self) -> list[tuple[Array, Evaluation]]:
        """First values, and residuals and derivatives there."""
        return []

    def _whole(self, values: Array) -> Evaluation | str:
        count, found = len(self.parameters), list[tuple[Array, Array]]()
        for block in self.blocks(values[:count], values[count:]):
            if isinstance(block, str):
                return block
            found.append(block)
        r, J = zip(*found, strict=True)
        return Evaluation(np.concatenate(r), np.vstack(J))


@final
@dataclass(frozen=True, eq=False)
class Extended:
    """Residuals with additional terms that are linear in further unknowns, r(p) + C q + shift.

    Attributes:
        residuals: r.
        more: the unknowns q.
        columns: C, shape (rows, unknowns).
        shift: change of the data, shape (rows,); 0: none.
    """

    residuals: Any
    more: tuple[Unknown, ...]
    columns: Array
    shift: Array | float = 0.0

    @property
    def own(self) -> tuple[Unknown, ...]:
        """Unknowns of the data set."""
        return (*self.residuals.own, *self.more)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the values."""
        return (*self.residuals.names, *(unknown.name for unknown in self.more))

    @property
    def channels(self) -> Sequence[Channel]:
        """Channels of all rows."""
        return self.residuals.channels

    @property
    def linear(self) -> bool:
        """True if the residuals are linear in all values."""
        return getattr(self.residuals, "linear", False)

    def bias(self, values: Array) -> Bias | None:
        """Return the squares of the residuals by the noise of the measured motion."""
        return self.residuals.bias(values[: len(self.residuals.names)])

    def at(self, values: Array) -> Evaluation | str:
        """Return residuals and derivatives, or a message."""
        count = len(self.residuals.names)
        found = self.residuals.at(values[:count])
        if isinstance(found, str):
            return found
        r = found.r + self.shift + np.einsum("ij,j->i", self.columns, values[count:])
        return Evaluation(r, np.hstack([found.J, self.columns]))


THRESHOLD = {"squares": np.inf, "huber": 1.345, "soft_l1": 1.0, "cauchy": 2.385, "arctan": 3.0}
"""Loss -> C. huber and cauchy have 95 % efficiency for normal noise."""


def shaped(r: Array, loss: str) -> tuple[Array, Array]:
    """Return e and de/dr of residuals r in standard deviations, both of the shape of r."""
    C = THRESHOLD[loss]
    if loss == "squares":
        return r, np.ones_like(r)
    z = (r / C) ** 2
    rho, slope = _rho(z, loss)
    small = z < 1e-12
    e = np.where(small, np.abs(r), C * np.sqrt(np.where(small, 1.0, rho)))
    de = np.where(small, 1.0, slope * np.abs(r) / np.where(small, 1.0, e))
    return np.sign(r) * e, de


def influence(r: Array, loss: str) -> Array:
    """Return the weight rho' of each residual in the normal equations, 1 for small residuals."""
    if loss == "squares":
        return np.ones_like(r)
    return _rho((r / THRESHOLD[loss]) ** 2, loss)[1]


def _rho(z: Array, loss: str) -> tuple[Array, Array]:
    """Return rho(z) and its derivative, rho(z) = z + O(z^2)."""
    if loss == "huber":
        root = np.sqrt(np.maximum(z, 1.0))
        return np.where(z <= 1, z, 2 * root - 1), 1 / root
    if loss == "soft_l1":
        root = np.sqrt(1 + z)
        return 2 * (root - 1), 1 / root
    if loss == "cauchy":
        return np.log1p(z), 1 / (1 + z)
    return np.arctan(z), 1 / (1 + z**2)
