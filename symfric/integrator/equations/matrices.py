"""Linear algebra of small matrices: symbolic factors, stable pivot orders, rank.

Sparse LU factors are written out as expressions: at run time there is neither a pivot search nor an
index. The order of the pivots is therefore part of the expressions (`factorise`). It is chosen by
fill alone if no numbers are known. To check an order with numbers, `backward_error` eliminates in
this order, solves, and computes the backward error

    omega = max_i |b - A x|_i / (|A| |x| + |b|)_i        (Oettli and Prager, 1964)

which is invariant to the units of equations and of unknowns. It detects zero and tiny pivots, and
harmful growth. If an order fails, `best_order` finds one by threshold pivoting that is good in all
samples of the matrix at once. Its pivots may be in any row and column, and cause least fill
(Markowitz).
"""

from collections.abc import Container, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Array, nonzeros

Order = tuple[tuple[int, int], ...]
"""(row, column) of each pivot, in the order of elimination."""
times, minus = (partial(ca.SX.binary, operation) for operation in (ca.OP_MUL, ca.OP_SUB))
"""Operations on SX, seven times faster than operators, which also accept other types."""


class Pivot(NamedTuple):
    """Elimination of one column.

    Attributes:
        row, column: position of the pivot.
        others: columns of the remaining entries of its row.
        below: rows from which the column is eliminated.
        at: index of the inverse pivot in the packed factors. The entries of its row follow, then
            the multipliers of its column.
    """

    row: int
    column: int
    others: tuple[int, ...]
    below: tuple[int, ...]
    at: int


class SymbolicLU(NamedTuple):
    """Factors of a sparse matrix A in elimination order.

    Attributes:
        packed: all factor entries as a column.
        symbols: symbols for these entries; the methods return expressions in them.
        eliminations: one `Pivot` for each column.
    """

    packed: ca.SX
    symbols: ca.SX
    eliminations: tuple[Pivot, ...]

    @property
    def order(self) -> Order:
        """(row, column) of each pivot."""
        return tuple((pivot.row, pivot.column) for pivot in self.eliminations)

    def sign(self, leading: int | None = None) -> ca.SX:
        """Return the sign of the determinant.

        Args:
            leading: number of leading pivots; the result is the sign of the block that they
                eliminate, whose rows and columns are the same. All pivots by default.
        """
        pivots = self.eliminations[:leading]
        rows, columns = (np.argsort([pivot[i] for pivot in pivots]).tolist() for i in (0, 1))
        sign = ca.SX(_parity(rows) * _parity(columns))
        for pivot in pivots:
            sign = times(sign, ca.SX.unary(ca.OP_SIGN, self.symbols[pivot.at]))
        return sign

    def pivots(self, rows: Container[int]) -> ca.SX:
        """Return the pivots of `rows` in elimination order."""
        found = (1 / self.symbols[p.at] for p in self.eliminations if p.row in rows)
        return ca.vertcat(ca.SX(0, 1), *found)

    def solve(self, right: ca.SX) -> ca.SX:
        """Return x with A x = right."""
        packed, b = ca.vertsplit(self.symbols), ca.vertsplit(right)
        for row, _, others, below, at in self.eliminations:
            for k, r in enumerate(below, start=at + 1 + len(others)):
                b[r] = minus(b[r], times(packed[k], b[row]))
        x = [ca.SX(0)] * len(b)
        for row, column, others, _, at in reversed(self.eliminations):
            value = b[row]
            for k, c in enumerate(others, start=at + 1):
                value = minus(value, times(packed[k], x[c]))
            x[column] = times(value, packed[at])
        return ca.vertcat(ca.SX(0, 1), *x)

    def solver(self, name: str) -> ca.Function:
        """Return the Function (factors, right) -> x."""
        right = ca.SX.sym("right", len(self.eliminations))
        return ca.Function(name, [self.symbols, right], [self.solve(right)])

    def inserted(self, *expressions: ca.SX) -> list[ca.SX]:
        """Return expressions of the factors with `packed` inserted for the symbols."""
        return ca.substitute(list(expressions), [self.symbols], [self.packed])


def _parity(order: Sequence[int]) -> int:
    """Return the sign of a permutation of 0, 1, ..., from the number of its cycles."""
    left, parity = set(range(len(order))), 1
    while left:
        k = left.pop()
        while (k := order[k]) in left:
            left.remove(k)
            parity = -parity
    return parity


def factorise(matrix: ca.SX, groups: Sequence[Sequence[int]] = (), order: Order = ()) -> SymbolicLU:
    """Factorise a structurally nonsingular sparse matrix.

    Pivots are chosen once, at build time; `order` is used if it is given. Otherwise the rows of
    each group pivot on the diagonal, group by group, and within a group by least fill (Markowitz).
    Groups are, for example, differential equations, whose pivot 1/(gamma h) dominates for small
    steps; a mass matrix; constraints, whose pivot is the definite Schur complement of the mass
    matrix before them. Rows in no group come last and pivot anywhere;
    `symfric.integrator.methods.method` checks numerically if that is stable.

    Raises:
        ValueError: the matrix is structurally singular.
    """
    n = matrix.size1()
    rows: list[dict[int, ca.SX]] = [{} for _ in range(n)]
    holders: list[set[int]] = [set() for _ in range(n)]
    entries = zip(*matrix.sparsity().get_triplet(), nonzeros(matrix), strict=True)
    for i, j, entry in entries:
        rows[i][j] = entry
        holders[j].add(i)
    grouped = [set(group) for group in groups]
    grouped.append(set(range(n)).difference(*grouped))
    eliminations, packed = list[Pivot](), list[ca.SX]()
    for k in range(n):
        row, column = order[k] if order else _pivot(rows, holders, grouped)
        holders[column].discard(row)
        inverse = times(2, ca.SX.binary(ca.OP_DIV, 0.5, rows[row].pop(column)))  # `reciprocal`
        others, below = tuple(rows[row]), tuple(sorted(holders[column]))
        eliminations.append(Pivot(row, column, others, below, len(packed)))
        for c in others:
            holders[c].discard(row)
        packed += [inverse, *rows[row].values()]
        for r in below:
            factor = times(rows[r].pop(column), inverse)
            packed.append(factor)
            for c, value in rows[row].items():
                update = times(factor, value)
                rows[r][c] = minus(rows[r][c], update) if c in rows[r] else -update
                holders[c].add(r)
    column = ca.vertcat(ca.SX(0, 1), *packed)
    return SymbolicLU(column, ca.SX.sym("lu", len(packed)), tuple(eliminations))


def _pivot(
    rows: list[dict[int, ca.SX]], holders: list[set[int]], grouped: list[set[int]]
) -> tuple[int, int]:
    """Return the entry whose elimination causes least fill, in the first group that has a pivot.

    Args:
        rows, holders: remaining entries by row, and the rows with an entry, by column.
        grouped: remaining rows; those of the last group may pivot off the diagonal. The row of the
            result is removed.
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


VANISHES = 1e-11
"""Size of a remaining entry that counts as zero, with rows and columns scaled near 1."""
ROUNDS = 4
"""Number of times that rows and columns are scaled in turn."""


def echelon(A: Array) -> tuple[list[int], Array]:
    """Return indices of columns that span the columns of A, and B with A = A[:, columns] B.

    B[:, columns] is the identity. The elimination uses complete pivoting of scaled rows and
    columns.
    """
    left, unit = equilibrated(A)
    pivots, done = list[int](), list[int]()
    for _ in range(min(A.shape)):
        size = np.abs(left)
        size[done] = -1.0
        row, column = (int(i) for i in np.unravel_index(np.argmax(size), size.shape))
        if size[row, column] <= VANISHES:
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
    free = np.delete(np.arange(n), pivots)
    basis = np.eye(n)[:, free]
    basis[pivots] = -B[:, free]
    return basis


def equilibrated(A: Array) -> tuple[Array, Array]:
    """Return matrices (..., m, n) with largest row and column entries near 1, and column scales.

    Each column of the result was multiplied by its column scale.
    """
    scaled, unit = A.copy(), np.ones(A.shape[-1])
    for _ in range(ROUNDS):
        for axis in (-1, -2):
            size = np.abs(scaled).max(axis=axis, keepdims=True, initial=0.0)
            size[size == 0.0] = 1.0
            scaled /= size
        unit = unit / size[..., 0, :]
    return scaled, unit


SOUND = 1e-9
"""Largest omega of a stable order; steps at the tightest tolerances need no higher accuracy."""
REGULAR = 1e-13
"""Smallest ratio of smallest to largest singular value of a scaled matrix that is regular."""
THRESHOLD = 0.1
"""Smallest size of a pivot, relative to its column."""


@final
@dataclass(frozen=True, eq=False)
class Factors:
    """Matrix A of the linear systems of a step, and the pivot order of its factors.

    Attributes:
        name: name of the matrix among those of a method.
        entries: (y, d) -> values of the symbols of A.
        symbols: these symbols and h, as SX.
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
        """Mask of the structural nonzeros of A."""
        return ca.DM(self.matrix.sparsity(), 1).full() != 0


def backward_error(A: Array, order: Order) -> float:
    """Return omega of two solutions by elimination in this order; infinite for a zero pivot.

    For several matrices (..., n, n) the result is the largest omega.
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


def regular(A: Array) -> bool:
    """Return True if A is numerically nonsingular after its rows and columns are scaled."""
    if not A.size:
        return True
    values = np.linalg.svd(equilibrated(A)[0], compute_uv=False)
    return bool(values[-1] > REGULAR * values[0])


def best_order(pattern: NDArray[np.bool_], samples: Array) -> Order:
    """Return the pivot order found by threshold pivoting in all samples (s, n, n) at once.

    In every sample, each pivot is at least `THRESHOLD` times the largest remaining entry of its
    column. Among such entries, the one with least fill is chosen; if there is none, the entry that
    is largest in its worst sample.

    Raises:
        ValueError: the matrix is structurally singular.
    """
    n, left, (A, _) = pattern.shape[0], pattern.copy(), equilibrated(samples)
    rows, columns = np.ones(n, dtype=bool), np.ones(n, dtype=bool)
    order: list[tuple[int, int]] = []
    for _ in range(n):
        here = left & rows[:, None] & columns
        if not here.any():
            raise ValueError(
                "best_order: expected a structurally nonsingular matrix, found no pivot for "
                f"equations {np.flatnonzero(rows).tolist()}"
            )
        size = np.abs(A) * (rows[:, None] & columns)
        largest = size.max(axis=1, keepdims=True)
        share = np.min(size / np.where(largest > 0.0, largest, 1.0), axis=0)
        fill = np.outer(here.sum(axis=1) - 1, here.sum(axis=0) - 1)
        good = here & (share >= min(THRESHOLD, float(share[here].max())))
        row, column = divmod(int(np.argmin(np.where(good, fill, n * n))), n)
        order.append((row, column))
        rows[row] = columns[column] = False
        below, across = np.flatnonzero(rows & left[:, column]), np.flatnonzero(columns & left[row])
        left[np.ix_(below, across)] = True
        pivot = A[:, row, column, None]
        inverse = np.divide(1.0, pivot, out=np.zeros_like(pivot), where=pivot != 0.0)
        factors = A[:, below, column] * inverse
        A[:, below[:, None], across] -= factors[:, :, None] * A[:, row, across][:, None, :]
    return tuple(order)
