"""Dense output: the continuous solution between accepted steps, and at the times of the result."""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Dense:
    """Piecewise polynomial solution, one piece an accepted step.

    With theta = (t - t0) / (t1 - t0) and d(theta) = d_1 + theta (d_2 + theta d_3):

        y(theta) = (1 - theta) y0 + theta [y1 + (1 - theta) d(theta)]

    Attributes:
        t0, t1: start and end of each piece, shape (k,).
        y0, y1: values there, shape (k, n); y0 differs from the y1 before it after an event.
        D: coefficients, shape (k, r, n).
    """

    t0: Array
    t1: Array
    y0: Array
    y1: Array
    D: Array

    @property
    def nbytes(self) -> int:
        """Memory that it takes."""
        return sum(a.nbytes for a in (self.t0, self.t1, self.y0, self.y1, self.D))

    def __call__(self, times: Array) -> Array:
        """Values at `times`, shape (n, m); at an event the value after it."""
        k = np.searchsorted(self.t0[1:], times, side="right")
        return self.piece(k, (times - self.t0[k]) / (self.t1[k] - self.t0[k])).T

    def piece(self, k: NDArray[np.intp], theta: Array) -> Array:
        """Values of the pieces `k` at `theta`, shape (m, n)."""
        s = theta[:, None]
        bend = np.zeros_like(self.y0[k])
        for row in range(self.D.shape[1] - 1, -1, -1):
            bend = self.D[k, row] + s * bend
        return (1 - s) * self.y0[k] + s * (self.y1[k] + (1 - s) * bend)

    def rates(self, k: NDArray[np.intp], theta: Array) -> Array:
        """Rates of the pieces `k` at `theta`, shape (m, n)."""
        s = theta[:, None]
        bend, slope = np.zeros_like(self.y0[k]), np.zeros_like(self.y0[k])
        for row in range(self.D.shape[1] - 1, -1, -1):
            slope = bend + s * slope
            bend = self.D[k, row] + s * bend
        rise = self.y1[k] - self.y0[k] + (1 - 2 * s) * bend + s * (1 - s) * slope
        return rise / (self.t1 - self.t0)[k, None]


def hermite(t: Array, y: Array, slope: Array) -> Dense:
    """Cubic Hermite interpolation through y (n, m) with slopes (n, m) at times t (m,)."""
    h = np.diff(t)[None, :]
    rise = np.diff(y, axis=1)
    first = h * slope[:, :-1] - rise
    second = rise - h * slope[:, 1:] - first
    D = np.stack([first.T, second.T], axis=1)
    return Dense(t[:-1], t[1:], y[:, :-1].T, y[:, 1:].T, D)


def pieces_of(records: Array, n: int) -> Dense:
    """Pieces as views of the rows (t0, t1, y0, y1, D) that a step engine writes."""
    k, rows = records.shape[0], (records.shape[1] - 2) // n - 2
    return Dense(
        records[:, 0],
        records[:, 1],
        records[:, 2 : 2 + n],
        records[:, 2 + n : 2 + 2 * n],
        records[:, 2 + 2 * n :].reshape(k, rows, n),
    )


def join(pieces: list[Dense]) -> Dense:
    """Pieces of several runs, in order."""
    if len(pieces) == 1:
        return pieces[0]
    return Dense(
        np.concatenate([p.t0 for p in pieces]),
        np.concatenate([p.t1 for p in pieces]),
        np.concatenate([p.y0 for p in pieces]),
        np.concatenate([p.y1 for p in pieces]),
        np.concatenate([p.D for p in pieces]),
    )


@final
@dataclass(eq=False)
class Outputs:
    """Unknowns at increasing times; mutable, filled from the start on.

    The compiled loop does what `fill` does, operation by operation (`loop.OUTPUTS`).

    Attributes:
        times: of the result [s], shape (m,).
        values: unknowns there, shape (n, m), known for the first `found` times.
        found: how many times were reached.
    """

    times: Array
    values: Array
    found: int = 0

    @classmethod
    def at(cls, times: Array, n: int) -> "Outputs":
        """Nothing yet of `n` unknowns at `times`."""
        times = np.ascontiguousarray(times)
        return cls(times, np.empty((n, times.size)))

    def fill(self, piece: Dense, last: bool = False) -> None:
        """Values at the times within `piece`.

        A time at its very end belongs to what follows, which an event or a break may have changed;
        unless the run ends there, with this `last` piece.
        """
        end = int(np.searchsorted(self.times, piece.t1[-1], side="right" if last else "left"))
        if end > self.found:
            self.values[:, self.found : end] = piece(self.times[self.found : end])
            self.found = end

    def stand(self, t: float, y: Array) -> None:
        """Values at the times up to `t` [s] that are left: a run stands there with `y`."""
        end = int(np.searchsorted(self.times, t, side="right"))
        self.values[:, self.found : end] = y[:, None]
        self.found = max(self.found, end)

    def back_to(self, t: float) -> None:
        """Forget what lies behind `t` [s]: steps that were interrupted before they were kept."""
        self.found = min(self.found, int(np.searchsorted(self.times, t, side="right")))

    @property
    def reached(self) -> Array:
        """Unknowns at the times that were reached, shape (n, found)."""
        return self.values[:, : self.found]
