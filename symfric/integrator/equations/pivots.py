"""Are the pivots of symbolic factors sound for the numbers at hand, and which ones would be.

The order of pivots is part of the written-out factors (`factorise`), chosen by fill alone where
nothing is known. Here it is judged by numbers: eliminate in that order, solve, and look what the
solution leaves over,

    omega = max_i |b - A x|_i / (|A| |x| + |b|)_i        (Oettli and Prager, 1964)

which neither units of equations nor of unknowns change. A zero or a tiny pivot shows in it, and so
does growth, where it harms. Where an order fails, threshold pivoting finds one that is good in all
samples of the matrix at once, from any row and column, with least fill (Markowitz).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.integrator.equations.lu import Order
from symfric.integrator.equations.rank import equilibrated

Array = NDArray[np.float64]
SOUND = 1e-9
"""Largest omega of a sound order; steps at the tightest tolerances need no more digits."""
REGULAR = 1e-13
"""Smallest singular value over the largest, of a matrix in its own units, that is regular."""
THRESHOLD = 0.1
"""A pivot is at least this large in its column."""


@final
@dataclass(frozen=True, eq=False)
class Factors:
    """A matrix that a step solves with, and the order of pivots in which its factors are written.

    Attributes:
        name: which of the matrices of a method it is.
        entries: (y, d) -> what it is written in.
        symbols: these and h, as SX.
        matrix: SX, A.
        order: (row, column) of each pivot.
    """

    name: str
    entries: ca.Function
    symbols: tuple[ca.SX, ca.SX]
    matrix: ca.SX
    order: Order

    @cached_property
    def _numbers(self) -> ca.Function:
        return ca.Function("matrix", list(self.symbols), [ca.densify(self.matrix)])

    def at(self, y: Array, h: float, d: Array) -> Array:
        """A as numbers."""
        return ca.DM(self._numbers(self.entries(y, d), h)).full()

    @cached_property
    def pattern(self) -> NDArray[np.bool_]:
        """Where A has entries."""
        return ca.DM(self.matrix.sparsity(), 1).full() != 0


def backward_error(A: Array, order: Order) -> float:
    """Omega of two solutions by elimination in this order, infinite where a pivot is zero.

    Of several matrices (..., n, n) that of the worst.
    """
    n = len(order)
    rows, columns = np.array(order, dtype=np.intp).reshape(n, 2).T
    permuted = A[..., rows[:, None], columns]
    _, unit = equilibrated(permuted)
    signs = np.where(np.arange(n) % 2, -1.0, 1.0)
    right = permuted @ np.stack(np.broadcast_arrays(unit, unit * signs), axis=-1)
    with np.errstate(all="ignore"):
        x = _eliminated(permuted, right)
        over = np.abs(right - permuted @ x)
        scale = np.abs(permuted) @ np.abs(x) + np.abs(right)
        omega = np.max(np.where(over > 0.0, over / scale, over), initial=0.0)
    return float(omega) if np.isfinite(omega) else np.inf


def regular(A: Array) -> bool:
    """Whether A, with rows and columns of one size, can be told from a singular matrix."""
    if not A.size:
        return True
    scaled, _ = equilibrated(A)
    values = np.linalg.svd(scaled, compute_uv=False)
    return bool(values[-1] > REGULAR * values[0])


def best_order(pattern: NDArray[np.bool_], samples: Array) -> Order:
    """The order of threshold pivoting in all samples (s, n, n) at once.

    Each pivot is at least `THRESHOLD` of what is left of its column, in every sample; among those
    the one that fills least; where there is none, the one that is largest in its worst sample.

    Raises:
        ValueError: structurally singular.
    """
    n, left, (A, _) = pattern.shape[0], pattern.copy(), equilibrated(samples)
    rows, columns = np.ones(n, dtype=bool), np.ones(n, dtype=bool)
    order: list[tuple[int, int]] = []
    for _ in range(n):
        size = np.abs(A) * (rows[:, None] & columns[None, :])
        largest = size.max(axis=1, keepdims=True)
        share = np.min(size / np.where(largest > 0.0, largest, 1.0), axis=0)
        here = left & rows[:, None] & columns[None, :]
        if not here.any():
            raise ValueError(
                "best_order: expected a structurally nonsingular matrix, found no pivot for "
                f"equations {np.flatnonzero(rows).tolist()}"
            )
        fill = np.outer(here.sum(axis=1) - 1, here.sum(axis=0) - 1)
        good = here & (share >= min(THRESHOLD, float(share[here].max())))
        row, column = divmod(int(np.argmin(np.where(good, fill, n * n))), n)
        order.append((row, column))
        rows[row] = columns[column] = False
        below = np.flatnonzero(rows & left[:, column])
        across = np.flatnonzero(columns & left[row])
        place = np.ix_(below, across)
        left[place] = True
        pivot = A[:, row, column]
        inverse = np.where(pivot == 0.0, 0.0, 1 / np.where(pivot == 0.0, 1.0, pivot))
        factors = A[:, below, column] * inverse[:, None]
        A[:, place[0], place[1]] -= factors[:, :, None] * A[:, row, across][:, None, :]
    return tuple(order)


def _eliminated(A: Array, right: Array) -> Array:
    """X with A x = right, by elimination down the diagonal."""
    n, left = A.shape[-1], np.concatenate([A, right], axis=-1)
    for k in range(n):
        left[..., k, k + 1 :] /= left[..., k, k, None]
        below = left[..., k + 1 :, k, None] * left[..., k, None, k + 1 :]
        left[..., k + 1 :, k + 1 :] -= below
    x = left[..., n:]
    for k in range(n - 1, 0, -1):
        x[..., :k, :] -= left[..., :k, k, None] * x[..., k, None, :]
    return x
