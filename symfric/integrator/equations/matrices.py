"""Linear algebra of small matrices: symbolic factors, stable pivot orders, rank.

Sparse LU factors are written out as expressions: no pivot search and no index at run time.

The order of pivots is part of the written-out factors (`factorise`), chosen by fill alone if no
numbers are known. Here it is checked with numbers: eliminate in that order, solve, and compute the
backward error

    omega = max_i |b - A x|_i / (|A| |x| + |b|)_i        (Oettli and Prager, 1964)

which is invariant to units of equations and of unknowns. It detects zero and tiny pivots, and
harmful growth. If an order fails, threshold pivoting finds one that is good in all samples of the
matrix at once, from any row and column, with least fill (Markowitz).
"""

from collections.abc import Container, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import reciprocal

Order = tuple[tuple[int, int], ...]
"""(row, column) of each pivot."""


@final
@dataclass(frozen=True, eq=False)
class SymbolicLU:
    """Factors of a sparse matrix in elimination order.

    Attributes:
        packed: all factor entries as a column: for each pivot its inverse, then its row, then the
            multipliers of its column.
        order: (row, column) of each pivot.
        rows: per pivot, the columns of the remaining entries of its row.
        columns: per pivot, the rows that are eliminated with it.
    """

    packed: ca.SX
    order: Order
    rows: tuple[tuple[int, ...], ...]
    columns: tuple[tuple[int, ...], ...]
    packed_symbol: ca.SX

    def sign(self, leading: int | None = None) -> ca.SX:
        """Return the sign of the determinant, in terms of `packed_symbol`.

        Args:
            leading: only of the block that this many first pivots eliminate, whose rows and columns
            are
                the same; all by default.
        """
        order = self.order[:leading]
        sign, at = ca.SX(_parity(dict(order))), 0
        for others, below in zip(self.rows[:leading], self.columns[:leading], strict=True):
            sign = sign * ca.sign(self.packed_symbol[at])
            at += 1 + len(others) + len(below)
        return sign

    def pivots(self, rows: Container[int]) -> ca.SX:
        """Return the pivots of `rows` in elimination order, in terms of `packed_symbol`."""
        found, at = [ca.SX(0, 1)], 0
        for (row, _), others, below in zip(self.order, self.rows, self.columns, strict=True):
            if row in rows:
                found.append(1 / self.packed_symbol[at])
            at += 1 + len(others) + len(below)
        return ca.vertcat(*found)

    def solve(self, right: ca.SX) -> ca.SX:
        """Return x with A x = right, in terms of `packed_symbol` in place of the factors."""
        packed = self.packed_symbol
        b = [right[i] for i in range(len(self.order))]
        rows: list[tuple[ca.SX, list[tuple[int, ca.SX]]]] = []
        at = 0
        for (row, _), others, below in zip(self.order, self.rows, self.columns, strict=True):
            rows.append((packed[at], [(c, packed[at + 1 + i]) for i, c in enumerate(others)]))
            at += 1 + len(others)
            for r in below:
                b[r] = b[r] - packed[at] * b[row]
                at += 1
        x = [ca.SX(0)] * len(b)
        for k in range(len(b) - 1, -1, -1):
            (row, column), (inverse, entries) = self.order[k], rows[k]
            value = b[row]
            for c, entry in entries:
                value = value - entry * x[c]
            x[column] = value * inverse
        return ca.vertcat(ca.SX(0, 1), *x)


def factorise(matrix: ca.SX, groups: Sequence[Sequence[int]] = (), order: Order = ()) -> SymbolicLU:
    """Factorise a structurally nonsingular sparse matrix.

    Pivots are chosen once, at build time: those of `order`, if given. Otherwise the rows of each
    group
    pivot on the diagonal, group by group, within a group by least fill (Markowitz): differential
    equations, whose pivot 1/(gamma h) dominates for small steps; a mass matrix; constraints, whose
    pivot is the definite Schur complement of the mass matrix before. Rows in no group come last and
    pivot anywhere; `symfric.integrator.methods.method` checks numerically if that is stable.

    Raises:
        ValueError: structurally singular.
    """
    n = matrix.size1()
    rows: list[dict[int, ca.SX]] = [{} for _ in range(n)]
    for k, (i, j) in enumerate(zip(*matrix.sparsity().get_triplet(), strict=True)):
        rows[i][j] = matrix.nz[k]
    holders: list[set[int]] = [set() for _ in range(n)]
    for i, row in enumerate(rows):
        for j in row:
            holders[j].add(i)
    grouped = [set(group) for group in groups]
    grouped.append(set(range(n)).difference(*grouped))
    steps: list[tuple[int, int, tuple[int, ...], tuple[int, ...]]] = []
    packed: list[ca.SX] = []
    for k in range(n):
        row, column = order[k] if order else _pivot(rows, holders, grouped)
        holders[column].discard(row)
        inverse = reciprocal(rows[row].pop(column))
        others, below = tuple(rows[row]), tuple(sorted(holders[column]))
        for c in others:
            holders[c].discard(row)
        packed += [inverse, *rows[row].values()]
        for r in below:
            factor = rows[r].pop(column) * inverse
            packed.append(factor)
            for c, value in rows[row].items():
                update = factor * value
                rows[r][c] = rows[r][c] - update if c in rows[r] else -update
                holders[c].add(r)
        steps.append((row, column, others, below))
    return SymbolicLU(
        ca.vertcat(ca.SX(0, 1), *packed),
        tuple((row, column) for row, column, _, _ in steps),
        tuple(others for _, _, others, _ in steps),
        tuple(below for _, _, _, below in steps),
        ca.SX.sym("lu", len(packed)),
    )


def _pivot(
    rows: list[dict[int, ca.SX]], holders: list[set[int]], grouped: list[set[int]]
) -> tuple[int, int]:
    """Return the entry whose elimination causes least fill, in the first group that has one.

    Args:
        rows, holders: remaining entries by row, and rows that hold them, by column.
        grouped: remaining rows; those of the last group may pivot off the diagonal. The row found
            is removed.
    """
    for group in grouped:
        candidates = (
            ((len(rows[r]) - 1) * (len(holders[c]) - 1), r, c)
            for r in group
            for c in (rows[r] if group is grouped[-1] else (r,))
            if c in rows[r]
        )
        best = min(candidates, default=None)
        if best is not None:
            group.discard(best[1])
            return best[1], best[2]
    raise ValueError(
        "factorise: expected a structurally nonsingular matrix, found no pivot for "
        f"equations {sorted(set().union(*grouped))}; an algebraic variable is not determined"
    )


def _parity(columns: dict[int, int]) -> int:
    """Return the sign of the permutation row -> column."""
    sign, left = 1, dict(columns)
    while left:
        start, row = left.popitem()
        while row != start:
            row, sign = left.pop(row), -sign
    return sign


Array = NDArray[np.float64]
VANISHES = 1e-11
"""Remaining size of an entry, with rows and columns scaled near 1, that counts as zero."""
ROUNDS = 4
"""Rounds of scaling rows and columns in turn."""


def echelon(A: Array) -> tuple[list[int], Array]:
    """Return columns that span those of A, and B with A = A[:, columns] B, B[:, columns] = I.

    Uses elimination with complete pivoting of scaled rows and columns.
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
    """Return a basis of the vectors x with A x = 0, as columns; unit vectors if possible."""
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
    """Return matrices (..., m, n) with largest row and column entries near 1, and column scales.

    Each column was multiplied by its scale.
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


SOUND = 1e-9
"""Largest omega of a stable order; steps at the tightest tolerances need no more digits."""
REGULAR = 1e-13
"""Smallest ratio of singular values of a scaled matrix that is regular."""
THRESHOLD = 0.1
"""Least size of a pivot, relative to its column."""


@final
@dataclass(frozen=True, eq=False)
class Factors:
    """Matrix that a step solves with, and the pivot order of its factors.

    Attributes:
        name: of the matrix, among those of a method.
        entries: (y, d) -> values of its symbols.
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
        """Return A as numbers."""
        return ca.DM(self._numbers(self.entries(y, d), h)).full()

    @cached_property
    def pattern(self) -> NDArray[np.bool_]:
        """Mask of the entries of A."""
        return ca.DM(self.matrix.sparsity(), 1).full() != 0


def backward_error(A: Array, order: Order) -> float:
    """Return omega of two solutions by elimination in this order, infinite for a zero pivot.

    For several matrices (..., n, n) it is the largest omega.
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
    """Return True if A, with scaled rows and columns, is numerically nonsingular."""
    if not A.size:
        return True
    scaled, _ = equilibrated(A)
    values = np.linalg.svd(scaled, compute_uv=False)
    return bool(values[-1] > REGULAR * values[0])


def best_order(pattern: NDArray[np.bool_], samples: Array) -> Order:
    """Return the order of threshold pivoting in all samples (s, n, n) at once.

    Each pivot is at least `THRESHOLD` of the rest of its column, in every sample; among those the
    one with least fill; if there is none, the one that is largest in its worst sample.

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
    """Return x with A x = right, by elimination down the diagonal."""
    n, left = A.shape[-1], np.concatenate([A, right], axis=-1)
    for k in range(n):
        left[..., k, k + 1 :] /= left[..., k, k, None]
        below = left[..., k + 1 :, k, None] * left[..., k, None, k + 1 :]
        left[..., k + 1 :, k + 1 :] -= below
    x = left[..., n:]
    for k in range(n - 1, 0, -1):
        x[..., :k, :] -= left[..., :k, k, None] * x[..., k, None, :]
    return x
