"""Many rows to a few: the triangle R of a QR factorisation, block by block.

    A = Q R,   |A x| = |R x| for every x

Blocks are stacked on the triangle of those before them (a sequential TSQR). They are small enough
that BLAS does not share one among threads, so the bits of the result do not depend on their number.

Source: J. Demmel, L. Grigori, M. Hoemmen, J. Langou, Communication-optimal parallel and sequential
QR and LU factorizations, SIAM J. Sci. Comput. 34, 2012.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ENTRIES = 8192
"""Of a block with its triangle; OpenBLAS takes threads from 9216 on for matrix times vector."""
LEAST = 32
"""Fewest new rows of a block, however many columns there are."""


def triangle(columns: Array) -> Array:
    """R of `columns` (rows, k), shape (k, k), upper triangular with a diagonal >= 0."""
    rows, k = columns.shape
    found = np.zeros((0, k))
    size = max(LEAST, ENTRIES // max(k, 1) - k)
    for first in range(0, rows, size):
        block = np.vstack([found, columns[first : first + size]])
        found = np.asarray(np.linalg.qr(block, mode="r"))
    whole = np.zeros((k, k))
    whole[: found.shape[0]] = found
    sign = np.where(np.diag(whole) < 0, -1.0, 1.0)
    return whole * sign[:, None]


def square(x: Array) -> float:
    """Sum of squares without BLAS, which shares long ones among threads."""
    return float(np.sum(x * x))
