"""Sparse LU factors written out as expressions: no pivot search and no index at run time."""

from collections.abc import Container, Sequence
from dataclasses import dataclass
from typing import final

import casadi as ca

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
        """Sign of the determinant, in terms of `packed_symbol`.

        Args:
            leading: only of the block that the first pivots eliminate, whose rows and columns are
                the same; all by default.
        """
        order = self.order[:leading]
        sign, at = ca.SX(_parity(dict(order))), 0
        for others, below in zip(self.rows[:leading], self.columns[:leading], strict=True):
            sign = sign * ca.sign(self.packed_symbol[at])
            at += 1 + len(others) + len(below)
        return sign

    def pivots(self, rows: Container[int]) -> ca.SX:
        """Pivots of `rows` in elimination order, in terms of `packed_symbol`."""
        found, at = [ca.SX(0, 1)], 0
        for (row, _), others, below in zip(self.order, self.rows, self.columns, strict=True):
            if row in rows:
                found.append(1 / self.packed_symbol[at])
            at += 1 + len(others) + len(below)
        return ca.vertcat(*found)

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


def factorise(matrix: ca.SX, groups: Sequence[Sequence[int]] = (), order: Order = ()) -> SymbolicLU:
    """Factorise a structurally nonsingular sparse matrix.

    Pivots are chosen once, at build time: those of `order`, where it is given. Else the rows of
    each group pivot on the diagonal, group by group, those of a group by least fill (Markowitz):
    differential equations, whose pivot 1/(gamma h) dominates for small steps; a mass matrix;
    constraints, whose pivot is the definite Schur complement of the mass matrix before. Rows in no
    group come last and pivot anywhere; whether that is sound, numbers say
    (`symfric.integrator.methods.suited`).

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
    """The entry whose elimination fills least, in the first group that has one.

    Args:
        rows, holders: entries that are left, by row, and rows that hold them, by column.
        grouped: rows that are left; those of the last group may pivot off the diagonal. The row
            found is taken out.
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
    """Sign of the permutation row -> column."""
    sign, left = 1, dict(columns)
    while left:
        start, row = left.popitem()
        while row != start:
            row, sign = left.pop(row), -sign
    return sign
