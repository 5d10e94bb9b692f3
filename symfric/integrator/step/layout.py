"""Layout of the two columns of an attempt, defined once for all users.

    S = (t, h, h_old, growth_old, rejected, y)     changed by an attempt
    R = (t_end, rtol, h_max, atol[nx], d)          not changed
    (t0, t1, y0, y1, D)                            record of an accepted one, `Record`

Columns of many members are the rows of a matrix.
"""

from typing import NamedTuple, final

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
    def atol(nx: int) -> slice:
        """Return the slice of the absolute tolerances of `nx` states."""
        return slice(Given.FIXED, Given.FIXED + nx)

    @staticmethod
    def d(nx: int) -> slice:
        """Return the slice of the run data after the tolerances of `nx` states."""
        return slice(Given.FIXED + nx, None)


def _joined(common: list[float], own: Array) -> Array:
    """Prepend the same first entries to every row of `own`."""
    first = np.broadcast_to(np.array(common), (*own.shape[:-1], len(common)))
    return np.concatenate([first, own], axis=-1)


class Record(NamedTuple):
    """Layout of the record (t0, t1, y0, y1, D) of an accepted step.

    Attributes:
        n: number of unknowns.
        rows: of the dense output D, each of length n.
    """

    n: int
    rows: int
    T0 = 0
    T1 = 1

    @property
    def width(self) -> int:
        """Length of a record."""
        return 2 + (2 + self.rows) * self.n

    @property
    def y0(self) -> slice:
        """Slice of the unknowns at the start."""
        return self.bend(-2)

    @property
    def y1(self) -> slice:
        """Slice of the unknowns at the end."""
        return self.bend(-1)

    def bend(self, k: int) -> slice:
        """Return the slice of row `k` of the dense output."""
        return slice(2 + (2 + k) * self.n, 2 + (3 + k) * self.n)
