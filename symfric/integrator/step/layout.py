"""Layout of the two columns of an attempt, defined once for all users.

    S = (t, h, h_old, growth_old, rejected, y)     changed by an attempt
    R = (t_end, rtol, h_max, atol[nx], d)          not changed
    (t0, t1, y0, y1, D)                            record of an accepted one, `Record`

Columns of many members are the rows of a matrix.
"""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
GROWTH_MEMORY = 2.5
"""Largest growth of the step size that the controller stores."""


@final
class State:
    """Rows of S: time, step to try, last accepted step, its growth, 1 if the last one was
    rejected.
    """

    T, H, H_OLD, GROWTH_OLD, REJECTED = range(5)
    MEMORY = 5
    Y = slice(MEMORY, None)

    @staticmethod
    def at(t: float, h: float, y: ArrayLike) -> Array:
        """Return S at the time `t` without history, to try the step `h`; y (..., n)."""
        return _joined([t, h, h, GROWTH_MEMORY, 0.0], np.asarray(y, dtype=float))

    @staticmethod
    def begin(S: Array, t: float, h: float, y: Array) -> None:
        """Write `at` into S."""
        S[: State.MEMORY] = (t, h, h, GROWTH_MEMORY, 0.0)
        S[State.Y] = y


@final
class Given:
    """Rows of R: end, relative tolerance, longest step, absolute tolerances, run data."""

    T_END, RTOL, H_MAX = range(3)
    FIXED = 3

    @staticmethod
    def of(t_end: float, rtol: float, h_max: float, atol: ArrayLike, d: ArrayLike) -> Array:
        """Return R for run data d (..., n_d) and atol (nx,)."""
        return _joined([t_end, rtol, h_max, *np.asarray(atol, dtype=float)], np.asarray(d))

    @staticmethod
    def begin(R: Array, rtol: float, h_max: float, atol: Array, p: Array) -> None:
        """Write the entries of R that hold on all intervals, all but their ends and their data."""
        nx = atol.size
        R[Given.RTOL], R[Given.H_MAX], R[Given.atol(nx)] = rtol, h_max, atol
        if p.size:
            R[Given.FIXED + nx : Given.FIXED + nx + p.size] = p

    @staticmethod
    def atol(nx: int) -> slice:
        """Return the slice of the absolute tolerances of `nx` states."""
        return slice(Given.FIXED, Given.FIXED + nx)

    @staticmethod
    def d(nx: int) -> slice:
        """Return the slice of the run data after the tolerances of `nx` states."""
        return slice(Given.FIXED + nx, None)


@final
@dataclass(frozen=True)
class Record:
    """Layout of the record (t0, t1, y0, y1, D) of an accepted step.

    Attributes:
        n: number of unknowns.
        rows: of the dense output D, each of length n.
    """

    n: int
    rows: int
    T0: ClassVar[int] = 0
    T1: ClassVar[int] = 1

    @property
    def width(self) -> int:
        """Length of a record."""
        return 2 + (2 + self.rows) * self.n

    @property
    def y0(self) -> slice:
        """Slice of the unknowns at the start."""
        return slice(2, 2 + self.n)

    @property
    def y1(self) -> slice:
        """Slice of the unknowns at the end."""
        return slice(2 + self.n, 2 + 2 * self.n)

    def bend(self, k: int) -> slice:
        """Return the slice of row `k` of the dense output."""
        return slice(2 + (2 + k) * self.n, 2 + (3 + k) * self.n)


def _joined(common: list[float], own: Array) -> Array:
    """Prepend the same first entries to every row of `own`."""
    if own.ndim == 1:
        return np.concatenate([common, own])
    shape = (*own.shape[:-1], len(common))
    return np.concatenate([np.broadcast_to(np.array(common), shape), own], axis=-1)
