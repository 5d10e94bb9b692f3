"""How well a fit determines its parameters: rank, standard errors, correlation."""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.old.data import Array

RANK = 1e-7
"""Smallest singular value of the scaled sensitivities, over the largest, that counts."""
BLOCKS = 24
"""Pieces of the record whose scores are taken as independent."""


@final
@dataclass(frozen=True, eq=False)
class Precision:
    """Linearised uncertainty of n parameters; NaN where the data say nothing.

    Attributes:
        standard_errors: sqrt(diag(s^2 (J'J)^-1)), right if the residuals are white.
        block_errors: from the scatter of the scores J'r over blocks of the record, right also for
            residuals that are correlated inside a block, such as an unmodelled ripple.
        correlation: correlation of the estimates, shape (n, n).
        undetermined: groups of parameter numbers the residuals cannot tell apart; a group of one
            has no influence at all.
    """

    standard_errors: Array
    block_errors: Array
    correlation: Array
    undetermined: tuple[tuple[int, ...], ...]


def precision(J: Array, r: Array, held: NDArray[np.bool_]) -> Precision:
    """Uncertainty of a least-squares fit.

    Args:
        J: sensitivities of the residuals to the parameters, shape (rows, n).
        r: residuals, shape (rows,).
        held: parameters that stand at a bound; they count as known, shape (n,).
    """
    n = held.size
    size = np.linalg.norm(J, axis=0)
    scale = np.where(size > 0, size, 1.0)
    _, s, Vt = np.linalg.svd(J / scale * ~held, full_matrices=False)
    null = Vt[s <= RANK * max(s[0], 1e-300)].T
    shared = np.abs(null @ null.T) * ~held
    lost = np.diag(shared) > 1e-6
    groups = _groups((shared > 1e-6) & lost[:, None] & lost[None, :], lost & ~held)

    kept = ~held & ~lost
    inverse = np.linalg.pinv((J / scale)[:, ~held], rcond=RANK)
    bread = np.zeros((n, r.size))
    bread[~held] = inverse / scale[~held, None]
    freedom = max(1, r.size - int(kept.sum()))
    covariance = bread @ bread.T * float(r @ r) / freedom
    scores = np.stack(
        [b @ e for b, e in zip(_split(bread.T), np.array_split(r, BLOCKS), strict=True)]
    )
    block = np.sqrt((scores**2).sum(axis=0) * BLOCKS / (BLOCKS - 1))
    error = np.sqrt(np.diag(covariance))
    both = np.outer(error, error)
    correlation = np.divide(covariance, both, out=np.full((n, n), np.nan), where=both > 0)
    correlation[~kept, :] = correlation[:, ~kept] = np.nan
    return Precision(
        np.where(kept, error, np.nan), np.where(kept, block, np.nan), correlation, groups
    )


def _split(rows: Array) -> list[Array]:
    return [piece.T for piece in np.array_split(rows, BLOCKS)]


def _groups(linked: NDArray[np.bool_], lost: NDArray[np.bool_]) -> tuple[tuple[int, ...], ...]:
    """Connected sets of the lost parameters."""
    left = set(np.flatnonzero(lost).tolist())
    found: list[tuple[int, ...]] = []
    while left:
        group, edge = set[int](), {min(left)}
        while edge:
            group |= edge
            edge = {j for i in edge for j in np.flatnonzero(linked[i]).tolist()} - group
        found.append(tuple(sorted(group)))
        left -= group
    return tuple(found)
