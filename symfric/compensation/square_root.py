"""Covariances as P = W W', with W upper triangular, in SX.

The factor keeps P positive for any rounding, and its elements are at most 1 if P is relative to
the variances at the start.
Sources: Carlson, AIAA Journal 11, 1973 (measurement); Gram-Schmidt for the step as in Bierman,
Factorization Methods for Discrete Sequential Estimation, 1977.
"""

from typing import NamedTuple

import casadi as ca

from symfric.foundation.parameters import Variable
from symfric.foundation.variable import symbols_of
from symfric.laws.base import smooth
from symfric.model import Variables

LEAST = 1e-10
"""Smallest diagonal element, relative to the deviation at the start."""


class Measured(NamedTuple):
    """Factor after a measurement, its gain (n, 1), and the variance of its residual."""

    W: ca.SX
    gain: ca.SX
    variance: ca.SX


def factor(n: int) -> tuple[Variables, ca.SX]:
    """Return states of a block for the factor of n variables, and the factor within its bounds."""
    rows = [(i, j) for i in range(n) for j in range(i, n)]
    states = tuple(
        Variable(f"W_{i + 1}{j + 1}", "1", start=float(i == j), doc="factor of the covariance")
        for i, j in rows
    )
    return states, unpacked(symbols_of(states), n)


def packed(W: ca.SX) -> ca.SX:
    """Return the rows of a factor from the diagonal on, one below the other."""
    n = W.shape[0]
    return ca.vertcat(*(W[i, j] for i in range(n) for j in range(i, n)))


def unpacked(column: ca.SX, n: int) -> ca.SX:
    """Return the factor whose rows are in `column`, with elements within -1 and 1.

    These bounds hold for every P whose diagonal is at most 1, so that they only change numbers from
    a damaged memory, and variances above those at the start.
    """
    W, elements = ca.SX(n, n), iter(ca.vertsplit(column))
    for i in range(n):
        for j in range(i, n):
            W[i, j] = smooth.clip(next(elements), LEAST if i == j else -1.0, 1.0)
    return W


def variances(W: ca.SX) -> ca.SX:
    """Return the diagonal of P, (n, 1)."""
    return ca.SX(ca.sum2(W * W))


def measured(W: ca.SX, row: ca.SX, variance: ca.SX | float) -> Measured:
    """Return the update by one measurement `row` x + noise.

    Args:
        row: row or column of n coefficients.
        variance: variance of the noise, above 0.
    """
    n, after = W.shape[0], ca.SX(W)
    f, gain, total = W.T @ ca.vec(row), ca.SX.zeros(W.shape[0]), ca.SX(variance)
    for j in range(n):
        before, total = total, total + f[j] * f[j]
        keep = ca.sqrt(before / total)
        share = f[j] * keep / before
        for i in range(j + 1):
            after[i, j] = keep * W[i, j] - share * gain[i]
            gain[i] += f[j] * W[i, j]
    return Measured(after, gain / total, total)


def moved(W: ca.SX, A: ca.SX, noise: ca.SX) -> ca.SX:
    """Return the factor of A P A' + diag(noise^2)."""
    n = W.shape[0]
    rows, after = ca.vertsplit(ca.horzcat(A @ W, ca.diag(noise))), ca.SX(n, n)
    for j in reversed(range(n)):
        after[j, j] = ca.fmax(ca.norm_2(rows[j]), LEAST)
        unit = rows[j] / after[j, j]
        for i in range(j):
            after[i, j] = ca.dot(rows[i], unit)
            rows[i] = rows[i] - after[i, j] * unit
    return after
