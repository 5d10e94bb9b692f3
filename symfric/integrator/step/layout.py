"""Where everything stands in the two columns of an attempt, so that nobody else counts rows.

    S = (t, h, h_old, growth_old, rejected, y)     what an attempt changes
    R = (t_end, rtol, h_max, atol[nx], d)          what it does not
    (t0, t1, y0, y1, D)                            what is kept of an accepted one, `Record`

Columns of many members are the rows of a matrix.
"""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
GROWTH_MEMORY = 2.5
"""Largest growth of the step size that the controller remembers."""


@final
class State:
    """Rows of S: time, step to try, last accepted step, its growth, whether the last one failed."""

    T, H, H_OLD, GROWTH_OLD, REJECTED = range(5)
    MEMORY = 5
    Y = slice(MEMORY, None)

    @staticmethod
    def at(t: float, h: float, y: ArrayLike) -> Array:
        """S at the time `t` with nothing before it, to try the step `h`; y (..., n)."""
        return _joined([t, h, h, GROWTH_MEMORY, 0.0], np.asarray(y, dtype=float))

    @staticmethod
    def begin(S: Array, t: float, h: float, y: Array) -> None:
        """`at`, written into S."""
        S[: State.MEMORY] = (t, h, h, GROWTH_MEMORY, 0.0)
        S[State.Y] = y


@final
class Given:
    """Rows of R: end, relative tolerance, longest step, absolute tolerances, run data."""

    T_END, RTOL, H_MAX = range(3)
    FIXED = 3

    @staticmethod
    def of(t_end: float, rtol: float, h_max: float, atol: ArrayLike, d: ArrayLike) -> Array:
        """R for run data d (..., n_d) and atol (nx,)."""
        return _joined([t_end, rtol, h_max, *np.asarray(atol, dtype=float)], np.asarray(d))

    @staticmethod
    def begin(R: Array, rtol: float, h_max: float, atol: Array, p: Array) -> None:
        """What holds on all intervals, written into R: all but their ends and their data."""
        nx = atol.size
        R[Given.RTOL], R[Given.H_MAX], R[Given.atol(nx)] = rtol, h_max, atol
        if p.size:
            R[Given.FIXED + nx : Given.FIXED + nx + p.size] = p

    @staticmethod
    def atol(nx: int) -> slice:
        """Absolute tolerances of `nx` states."""
        return slice(Given.FIXED, Given.FIXED + nx)

    @staticmethod
    def d(nx: int) -> slice:
        """Run data behind the tolerances of `nx` states."""
        return slice(Given.FIXED + nx, None)


@final
@dataclass(frozen=True)
class Record:
    """Places in the record (t0, t1, y0, y1, D) of an accepted step.

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
        """Unknowns at the start."""
        return slice(2, 2 + self.n)

    @property
    def y1(self) -> slice:
        """Unknowns at the end."""
        return slice(2 + self.n, 2 + 2 * self.n)

    def bend(self, k: int) -> slice:
        """Row `k` of the dense output."""
        return slice(2 + (2 + k) * self.n, 2 + (3 + k) * self.n)


def _joined(common: list[float], own: Array) -> Array:
    """The same first entries before every row of `own`."""
    if own.ndim == 1:
        return np.concatenate([common, own])
    shape = (*own.shape[:-1], len(common))
    return np.concatenate([np.broadcast_to(np.array(common), shape), own], axis=-1)
