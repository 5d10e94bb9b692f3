"""Sparse LU factors written out as expressions: no pivot search and no index at run time."""

from dataclasses import dataclass
from typing import final

import casadi as ca
import numpy as np


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
    order: tuple[tuple[int, int], ...]
    rows: tuple[tuple[int, ...], ...]
    columns: tuple[tuple[int, ...], ...]
    packed_symbol: ca.SX

    @property
    def sign(self) -> ca.SX:
        """Sign of the determinant, in terms of `packed`."""
        places = np.array([row for row, _ in self.order])[np.argsort([c for _, c in self.order])]
        sign, at = ca.SX(round(np.linalg.det(np.eye(places.size)[places]))), 0
        for others, below in zip(self.rows, self.columns, strict=True):
            sign = sign * ca.sign(self.packed[at])
            at += 1 + len(others) + len(below)
        return sign

    def solve(self, right: ca.SX) -> ca.SX:
        """X with A x = right, in terms of `packed_symbol` in place of the factors."""
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


def factorise(matrix: ca.SX, safe: tuple[int, ...], then: tuple[int, ...] = ()) -> SymbolicLU:
    """Factorise a structurally nonsingular sparse matrix.

    Pivots are chosen once, at build time, by least fill (Markowitz). Diagonal entries of the rows
    in `safe` (differential equations, whose pivot 1/(gamma h) dominates for small steps) come
    first, then those of the rows in `then` (constraints, whose pivot is the definite Schur
    complement of the rows before); other algebraic rows may pivot anywhere.

    Raises:
        ValueError: structurally singular.
    """
    n = matrix.size1()
    rows: list[dict[int, ca.SX]] = [{} for _ in range(n)]
    triplets = zip(*matrix.sparsity().get_triplet(), strict=True)
    for k, (i, j) in enumerate(triplets):
        rows[i][j] = matrix.nz[k]
    active_rows, active_columns = set(range(n)), set(range(n))
    order: list[tuple[int, int]] = []
    kept: list[tuple[int, ...]] = []
    eliminated: list[tuple[int, ...]] = []
    packed: list[ca.SX] = []
    rank = dict.fromkeys(then, 1) | dict.fromkeys(safe, 0)
    while active_rows:
        row, column = _pivot(rows, active_rows, active_columns, rank)
        active_rows.discard(row)
        active_columns.discard(column)
        inverse = 1 / rows[row][column]
        others = tuple(c for c in rows[row] if c in active_columns)
        below = tuple(r for r in sorted(active_rows) if column in rows[r])
        packed += [inverse, *(rows[row][c] for c in others)]
        for r in below:
            factor = rows[r].pop(column) * inverse
            packed.append(factor)
            for c in others:
                update = factor * rows[row][c]
                rows[r][c] = rows[r][c] - update if c in rows[r] else -update
        order.append((row, column))
        kept.append(others)
        eliminated.append(below)
    return SymbolicLU(
        ca.vertcat(ca.SX(0, 1), *packed),
        tuple(order),
        tuple(kept),
        tuple(eliminated),
        ca.SX.sym("lu", len(packed)),
    )


def _pivot(
    rows: list[dict[int, ca.SX]],
    active_rows: set[int],
    active_columns: set[int],
    rank: dict[int, int],
) -> tuple[int, int]:
    """The entry whose elimination fills least; diagonals of ranked rows first, rank by rank."""
    in_column = {c: sum(c in rows[r] for r in active_rows) for c in active_columns}
    candidates = [
        (
            rank.get(r, 2),
            (sum(j in active_columns for j in rows[r]) - 1) * (in_column[c] - 1),
            r,
            c,
        )
        for r in active_rows
        for c in rows[r]
        if c in active_columns and (r == c or r not in rank)
    ]
    if not candidates:
        raise ValueError(
            "factorise: expected a structurally nonsingular matrix, found no pivot for "
            f"equations {sorted(active_rows)}; an algebraic variable is not determined"
        )
    _, _, row, column = min(candidates)
    return row, column
