"""Rank of constant matrices: which rows follow from others, and what a matrix maps to zero."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
VANISHES = 1e-11
"""What is left of an entry, with rows and columns near 1, that counts as zero."""
ROUNDS = 4
"""Of scaling rows and columns in turn."""


def echelon(A: Array) -> tuple[list[int], Array]:
    """Columns that span those of A, and B with A = A[:, columns] B, so that B[:, columns] = I.

    By elimination with complete pivoting, rows and columns in units of their own.
    """
    left, unit = equilibrated(A)
    pivots: list[int] = []
    done: list[int] = []
    for _ in range(min(A.shape)):
        open_rows = [i for i in range(A.shape[0]) if i not in done]
        row, column = np.unravel_index(np.argmax(np.abs(left[open_rows])), left[open_rows].shape)
        row, column = open_rows[int(row)], int(column)
        if abs(left[row, column]) <= VANISHES:
            break
        left[row] /= left[row, column]
        others = np.arange(A.shape[0]) != row
        left[others] -= np.outer(left[others, column], left[row])
        left[others, column] = 0.0
        pivots.append(column)
        done.append(row)
    B = left[done] / unit * unit[pivots, None]
    B[np.abs(left[done]) <= VANISHES] = 0.0
    B[:, pivots] = np.eye(len(pivots))
    order = np.argsort(pivots)
    return [pivots[k] for k in order], B[order]


def null_space(A: Array) -> Array:
    """A basis of the vectors x with A x = 0, a column each; unit vectors where A allows it."""
    n = A.shape[1]
    entries = A != 0.0
    if (entries.sum(axis=0) <= 1).all() and (entries.sum(axis=1) <= 1).all():
        return np.eye(n)[:, ~entries.any(axis=0)]
    pivots, B = echelon(A)
    free = [i for i in range(n) if i not in pivots]
    basis = np.zeros((n, len(free)))
    basis[free, range(len(free))] = 1.0
    basis[pivots] = -B[:, free]
    return basis


def equilibrated(A: Array) -> tuple[Array, Array]:
    """Matrices (..., m, n) with largest entries of rows and columns near 1, and units of columns.

    The unit of a column is what it was multiplied with.
    """
    scaled, unit = A.copy(), np.ones(A.shape[-1])
    for _ in range(ROUNDS):
        for axis in (-1, -2):
            size = np.abs(scaled).max(axis=axis, keepdims=True, initial=0.0)
            size[size == 0.0] = 1.0
            scaled /= size
            if axis == -2:
                unit = unit / size[..., 0, :]
    return scaled, unit
