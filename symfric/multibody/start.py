"""Numerical computation of consistent start values and independent constraints."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Array

Position = Callable[[Array], tuple[Array, Array, Array]]
"""Function q -> (phi, phi_q, phi_t) at time 0, shapes (m,), (m, n), (m,)."""
FITS = 1e-8
"""Largest accepted violation of a constraint at the start [m, m/s]."""
FASTEST = 1e4
"""Largest ratio of dependent to independent rates; larger ratios occur only at a dead centre."""
RANK = 1e-9
"""Fraction of the largest singular value below which singular values count as zero."""
SINGULAR = 1e-12
"""Value below which eigenvalues of a mass matrix with unit diagonal count as zero."""


class Rank(NamedTuple):
    """Independent and redundant constraints.

    Attributes:
        kept: indices of independent constraints, which determine the motion.
        redundant: indices of all other constraints.
        undetermined: combinations of multipliers without effect on the motion, shape (m, k).
        singular: True if the rank at the start is lower than near it.
    """

    kept: tuple[int, ...]
    redundant: tuple[int, ...]
    undetermined: Array
    singular: bool


def rank(at: Position, q: Array, first: Sequence[int]) -> Rank:
    """Return the independent constraints near q, by Gram-Schmidt with pivoting.

    Args:
        at: function q -> (phi, phi_q, phi_t).
        q: start position, shape (n,).
        first: indices of constraints that are always kept; they must be independent.
    """
    here = at(q)[1]
    near = here
    rng = np.random.default_rng(0)
    for size in (1e-3, 1e-2):
        guess = project(at, q + size * rng.standard_normal(q.size))
        if guess is not None:
            other = at(guess)[1]
            near = other if _rank(other) > _rank(near) else near
    u, s, _ = np.linalg.svd(near)
    r = int((s > RANK * max(1.0, s[0])).sum()) if s.size else 0
    kept = tuple(sorted(_independent(near, r, first)))
    redundant = tuple(i for i in range(near.shape[0]) if i not in kept)
    return Rank(kept, redundant, u[:, r:], _rank(here) < r)


def _rank(A: Array) -> int:
    return int(np.linalg.matrix_rank(A, tol=RANK * max(1.0, float(np.abs(A).max(initial=0.0)))))


def _independent(A: Array, r: int, first: Sequence[int]) -> list[int]:
    """Return the indices of r independent rows, beginning with `first`, by Gram-Schmidt.

    The next row is the first whose remainder is more than half the largest, so that the constraints
    of the joints that were added first are kept.
    """
    left, chosen = A.copy(), list[int]()
    for k in range(r):
        size = np.linalg.norm(left, axis=1)
        i = first[k] if k < len(first) else int(np.argmax(size > 0.5 * size.max()))
        chosen.append(i)
        direction = left[i] / size[i]
        left -= np.outer(left @ direction, direction)
    return chosen


def weightless(M: Array) -> NDArray[np.bool_]:
    """Return a mask of the coordinates in which the mass matrix M (n, n) is not positive definite.

    M is scaled to unit diagonal, so that the result does not depend on units.
    """
    own = np.diag(M)
    if not (own > 0).all():
        return own <= 0
    least, along = np.linalg.eigh((M + M.T) / 2 / np.sqrt(np.outer(own, own)))
    return (least[0] < SINGULAR) & (np.abs(along[:, 0]) > 0.1)


def following(J: Array, wanted: Array, phi_t: Array) -> Array:
    """Return rates near `wanted` that satisfy J rates + phi_t = 0.

    Nonzero rates are kept if changes of the zero rates can satisfy the equations; otherwise the
    nearest rates in the sense of least squares are returned.
    """
    if not J.size:
        return wanted
    miss, rest = J @ wanted + phi_t, wanted == 0.0
    step = np.zeros_like(wanted)
    step[rest] = np.linalg.lstsq(J[:, rest], miss, rcond=1e-10)[0]
    fits = np.abs(J @ step - miss).max() <= FITS * (1.0 + np.abs(miss).max())
    near_a_dead_centre = np.abs(step).max() > FASTEST * max(1.0, np.abs(wanted).max())
    if not fits or near_a_dead_centre:
        step = np.linalg.lstsq(J, miss, rcond=None)[0]
    return wanted - step


def project(at: Position, q: Array, iterations: int = 30) -> Array | None:
    """Return q near the given one that satisfies the constraints; None if Gauss-Newton fails."""
    for _ in range(iterations):
        phi, J, _ = at(q)
        if not phi.size or np.abs(phi).max() < 1e-13:
            return q
        step = np.linalg.lstsq(J, phi, rcond=1e-10)[0]
        if not np.isfinite(step).all():
            return None
        q = q - step
    return q if np.abs(at(q)[0]).max() < FITS else None
