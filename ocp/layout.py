"""Where every unknown of the nonlinear program stands: named points to a vector and back."""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Points:
    """Values of everything that is chosen.

    Attributes:
        T: duration, shape (1,), or (0,) where it is fixed.
        x: states at 0 and at all collocation points, shape (nx, N d + 1).
        z: algebraic variables at the collocation points, shape (nz, N d).
        u: inputs, constant on each interval, shape (nu, N).
    """

    T: Array
    x: Array
    z: Array
    u: Array


@final
@dataclass(frozen=True)
class Layout:
    """The order of the unknowns, which is that of time; one bracket an interval.

        w = x_0, (u_1, x_11, z_11, ..., x_1d, z_1d), (u_2, x_21, ...), ..., [T]

    Attributes:
        nx, nz, nu: sizes of the groups of the model.
        degree: collocation points d of an interval.
        intervals: their number N.
        free_time: whether T is the last unknown.
    """

    nx: int
    nz: int
    nu: int
    degree: int
    intervals: int
    free_time: bool

    @property
    def block(self) -> int:
        """Unknowns of one interval."""
        return self.nu + self.degree * (self.nx + self.nz)

    @property
    def size(self) -> int:
        """Number of unknowns of the nonlinear program."""
        return self.nx + self.intervals * self.block + self.free_time

    def stack(self, points: Points) -> Array:
        """The vector of `points`, shape (size,)."""
        xz = np.vstack([points.x[:, 1:], points.z]).T.reshape(self.intervals, -1)
        return np.concatenate([points.x[:, 0], np.hstack([points.u.T, xz]).ravel(), points.T])

    def unstack(self, w: ArrayLike) -> Points:
        """The points in the vector `w`."""
        start, blocks, T = np.split(
            np.asarray(w, dtype=float).ravel(), [self.nx, self.size - self.free_time]
        )
        rows = blocks.reshape(self.intervals, self.block)
        x, z = np.split(rows[:, self.nu :].reshape(-1, self.nx + self.nz).T, [self.nx])
        return Points(T, np.column_stack([start, x]), z, rows[:, : self.nu].T)

    def spread(self, T: float, x: ArrayLike, z: ArrayLike, u: ArrayLike) -> Points:
        """The same values of each group at all its points."""
        n = self.intervals * self.degree
        columns = [
            np.tile(np.asarray(values, dtype=float)[:, None], (1, count))
            for values, count in ((x, n + 1), (z, n), (u, self.intervals))
        ]
        return Points(np.full(int(self.free_time), T), *columns)
