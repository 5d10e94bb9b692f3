"""Assembly of pieces into the functions of a program with exact sparse derivatives.

Mapped Functions return the values of each block at all places as columns. Constant sparse matrices,
computed with NumPy, distribute these values to the rows, the gradient, the Jacobian and the
Hessian. No further differentiation is necessary, and the graph does not grow with the mesh.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import final

import casadi as ca
import numpy as np

from ocp.transcription.blocks import Array, Entries, Indices, Piece, RowBlock, Selection

Slot = tuple[float, int]
"""Target of the shares of one cost: its weight in the objective and -1, or, if a row bounds the
cost, 0 and the index of the piece with this row."""


def assemble(
    w: ca.MX, p: ca.MX, pieces: Sequence[Piece], slots: Sequence[Slot], c: Array
) -> tuple[ca.MX, ca.MX, ca.Function, ca.Function, ca.Function]:
    """Return f, g, gradient, jacobian and hessian of a program (see `Program`) from its pieces.

    Args:
        w, p: unknowns and parameters of the program; `theta` of each piece depends on p.
        pieces: numbered rows and costs.
        slots: targets of the shares of each cost.
        c: linear part of the objective, shape (n,).
    """
    n, m = w.numel(), sum(piece.at.size for piece in pieces)
    targets = [(weight, -1 if k < 0 else int(pieces[k].at[0, 0])) for weight, k in slots]
    parts = [
        _PlacedPiece(piece, piece.block, piece.selection, *targets[piece.slot], w)
        for piece in pieces
        if piece.block is not None and piece.selection is not None
    ]
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", m)
    linear = [
        (piece.at[A.rows, A.places], A.columns, A.weights)
        for piece in pieces
        if (A := piece.linear) is not None
    ]
    constant = _joined(linear)
    f = ca.mtimes(ca.DM(c).T, w)
    for part in parts:
        if part.block.share is not None and part.weight:
            f += part.weight * ca.sum2(part.mapped(part.block.share)[0])
    g = _rows(parts, [part.rows_alone() for part in parts], constant, w, m)
    gradient, jacobian, hessian = _Sum((1, n)), _Sum((m, n)), _Sum((n, n))
    gradient.constant(np.zeros(n, np.int64), np.arange(n), c)
    jacobian.constant(*constant)
    rows: list[ca.MX] = []
    for part in parts:
        if part.block.share is not None:
            part.add_slopes(gradient, jacobian)
        rows.append(part.add_jacobian(jacobian))
        part.add_hessian(hessian, lam_f, lam_g)
    J, H = jacobian.matrix(), hessian.matrix()
    both = [_rows(parts, rows, constant, w, m), J]
    slope = ca.densify(gradient.matrix()).T
    multipliers = ["x", "p", "lam_f", "lam_g"]
    return (
        f,
        g,
        ca.Function("nlp_grad_f", [w, p], [f, slope], ["x", "p"], ["f", "grad_f_x"]),
        ca.Function("nlp_jac_g", [w, p], both, ["x", "p"], ["g", "jac_g_x"]),
        ca.Function("nlp_hess_l", [w, p, lam_f, lam_g], [H], multipliers, ["triu_hess_gamma_x_x"]),
    )


Triplets = tuple[Indices, Indices, Array]
"""Rows, columns and values."""
EMPTY: Triplets = np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0)


def _joined(triplets: Sequence[Triplets]) -> Triplets:
    rows, columns, values = map(np.concatenate, zip(EMPTY, *triplets, strict=True))
    return rows, columns, values


@final
@dataclass(frozen=True, eq=False)
class _PlacedPiece:
    """Piece with a block.

    The share of the cost is added to the objective with the factor `weight`, and to row `bounded`
    of the program unless `bounded` is -1.
    """

    piece: Piece
    block: RowBlock
    selection: Selection
    weight: float
    bounded: int
    w: ca.MX

    @cached_property
    def arguments(self) -> list[ca.MX]:
        """Local unknowns and parameters at all places."""
        places, theta = self.piece.places, self.piece.theta
        if theta.shape[1] != places:
            theta = ca.repmat(theta, 1, places)
        return [self.local, theta]

    @property
    def local(self) -> ca.MX:
        """Local unknowns at all places, MX (n, places)."""
        s, places = self.selection, self.piece.places
        if s.plain:
            return ca.reshape(self.w[s.columns.ravel().tolist()], self.block.n, places)
        rows = (s.local + self.block.n * np.arange(places)[:, None]).ravel()
        shape = (self.block.n * places, self.w.numel())
        S = _constant((rows, s.columns.ravel(), s.weights.ravel()), shape)
        return ca.reshape(ca.densify(ca.mtimes(S, self.w)), self.block.n, places)

    def mapped(self, function: ca.Function, *more: ca.MX) -> list[ca.MX]:
        """Return the outputs of `function` at all places."""
        return function.map(self.piece.places).call([*self.arguments, *more])

    def rows_alone(self) -> ca.MX:
        """Return the rows at all places and the cost that a row bounds, MX (k, 1)."""
        found = ca.vec(self.mapped(self.block.rows)[0])
        return ca.vertcat(found, self.bounded_cost())

    def bounded_cost(self) -> ca.MX:
        """Return the share of the cost that a row bounds, MX (1, 1), or (0, 1) if there is none."""
        if self.bounded < 0 or self.block.share is None:
            return ca.MX(0, 1)
        return ca.sum2(self.mapped(self.block.share)[0])

    @property
    def numbers(self) -> Indices:
        """Indices in the program of the rows of `rows_alone`."""
        cost = self.bounded >= 0 and self.block.share is not None
        return np.append(self.piece.at.ravel(order="F"), np.full(int(cost), self.bounded))

    def add_slopes(self, gradient: "_Sum", jacobian: "_Sum") -> None:
        """Add the derivative of the share of the cost."""
        (slopes,) = self.mapped(self.block.slopes)
        bounded = float(self.bounded >= 0)
        for matrix, row, weight in ((gradient, 0, self.weight), (jacobian, self.bounded, bounded)):
            if weight:
                rows = np.full((1, self.piece.places), row)
                matrix.add(self.block.of_slopes, rows, self.selection, slopes, weight)

    def add_jacobian(self, jacobian: "_Sum") -> ca.MX:
        """Add the derivative of the rows, and return the values of `rows_alone`."""
        rows, entries = self.mapped(self.block.jacobian)
        jacobian.add(self.block.of_jacobian, self.piece.at, self.selection, entries)
        return ca.vertcat(ca.vec(rows), self.bounded_cost())

    def add_hessian(self, hessian: "_Sum", lam_f: ca.MX, lam_g: ca.MX) -> None:
        """Add the second derivative of the Lagrangian."""
        places, m = self.piece.places, self.block.m
        sigma = self.weight * lam_f + (lam_g[self.bounded] if self.bounded >= 0 else 0)
        lam = ca.reshape(lam_g[self.piece.at.ravel(order="F").tolist()], m, places)
        (entries,) = self.mapped(self.block.hessian, ca.repmat(sigma, 1, places), lam)
        hessian.symmetric(self.block.of_hessian, self.selection, entries)


def _rows(
    parts: Sequence[_PlacedPiece], values: Sequence[ca.MX], constant: Triplets, w: ca.MX, m: int
) -> ca.MX:
    """Return g = A w plus the values of the blocks."""
    A = _constant(constant, (m, w.numel()))
    g = ca.densify(ca.mtimes(A, w))
    if not values:
        return g
    numbers = np.concatenate([part.numbers for part in parts])
    every = np.arange(numbers.size)
    if np.array_equal(np.sort(numbers), every) and numbers.size == m:
        return g + ca.vertcat(*values)[np.argsort(numbers).tolist()]
    P = _constant((numbers, every, np.ones(every.size)), (m, every.size))
    return g + ca.densify(ca.mtimes(P, ca.vertcat(*values)))


@final
@dataclass(eq=False)
class _Sum:
    """Sparse matrix whose entries are constants plus weighted sums of values of blocks."""

    shape: tuple[int, int]
    varying: list[Triplets] = field(default_factory=list[Triplets])
    sources: list[Indices] = field(default_factory=list[Indices])
    values: list[ca.MX] = field(default_factory=list[ca.MX])
    count: int = 0
    fixed: list[Triplets] = field(default_factory=list[Triplets])

    def constant(self, rows: Indices, columns: Indices, values: Array) -> None:
        """Add constant entries."""
        kept = values != 0.0
        self.fixed.append((rows[kept], columns[kept], values[kept]))

    def add(
        self,
        entries: Entries,
        rows: Indices,
        selection: Selection,
        values: ca.MX,
        weight: float = 1,
    ) -> None:
        """Add a derivative by v with `values` (nv, places) to `rows` (m, places) of the matrix."""
        source, columns, weights = _terms(selection, entries.columns)
        at = rows[entries.rows[source]].T
        self._put(entries, source, at, columns, weight * weights, values)

    def symmetric(self, entries: Entries, selection: Selection, values: ca.MX) -> None:
        """Add the upper triangle of S' H S; `entries` belong to the upper triangle of H."""
        first, left, by_left = _terms(selection, entries.rows)
        second, right, by_right = _terms(selection, entries.columns)
        a, b = _pairs(first, second, entries.rows.size)
        source, left, right = first[a], left[:, a], right[:, b]
        weights = by_left[:, a] * by_right[:, b]
        off = (entries.rows != entries.columns)[source]
        # An off-diagonal entry of H stands for two, which coincide on the diagonal of S' H S.
        weights = weights * np.where(off & (left == right), 2.0, 1.0)
        weights = weights * (off | (left <= right))
        upper = np.minimum(left, right), np.maximum(left, right)
        self._put(entries, source, *upper, weights, values)

    def _put(
        self,
        entries: Entries,
        source: Indices,
        rows: Indices,
        columns: Indices,
        weights: Array,
        values: ca.MX,
    ) -> None:
        """Store the terms (places, terms) of the entries `source` (terms,) of a block."""
        places, nv = weights.shape[0], entries.varying.size
        position = np.full(entries.rows.size, -1)
        position[entries.varying] = np.arange(nv)
        number = np.zeros(entries.rows.size)
        number[entries.still] = entries.constant
        still = position[source] < 0
        for part in (still, ~still):
            kept = (weights != 0.0) & part
            at, term = np.nonzero(kept)
            if part is still:
                constants = weights[kept] * number[source[term]]
                self.fixed.append((rows[kept], columns[kept], constants))
            else:
                self.varying.append((rows[kept], columns[kept], weights[kept]))
                self.sources.append(self.count + nv * at + position[source[term]])
        self.values.append(ca.vec(values))
        self.count += nv * places

    def matrix(self) -> ca.MX:
        """Return the matrix with its structural nonzeros."""
        rows, columns, numbers = _joined(self.fixed)
        count, (more, right, weights) = rows.size, _joined(self.varying)
        rows, columns = np.concatenate([rows, more]), np.concatenate([columns, right])
        keys, number = np.unique(columns * self.shape[0] + rows, return_inverse=True)
        pattern = _sparsity(keys % self.shape[0], keys // self.shape[0], self.shape)
        start = np.asarray(np.bincount(number[:count], numbers, keys.size), dtype=float)
        if not weights.size:
            return ca.MX(ca.DM(pattern, start))
        sources, values = np.concatenate(self.sources), ca.vertcat(*self.values)
        return ca.MX(pattern, _gathered(values, (number[count:], sources, weights), start))


def _gathered(values: ca.MX, sums: Triplets, start: Array) -> ca.MX:
    """Return the entries start[i] plus weighted sums of `values` as a column.

    Most entries are a single value or a constant and are selected; only the others are summed.
    """
    to, sources, weights = sums
    terms = np.bincount(to, minlength=start.size)
    plain = (terms == 1) & (start == 0.0)
    plain[to[weights != 1.0]] = False
    constants, which = np.unique(start, return_inverse=True)
    index = np.asarray(which, dtype=np.int64).ravel()
    one = plain[to]
    index[to[one]] = constants.size + sources[one]
    added = np.flatnonzero((terms > 0) & ~plain)
    parts = [ca.MX(ca.DM(constants)), values]
    if added.size:
        index[added] = constants.size + values.numel() + np.arange(added.size)
        row = np.zeros(start.size, np.int64)
        row[added] = np.arange(added.size)
        kept = ~one
        triplets = row[to[kept]], sources[kept], weights[kept]
        S = _constant(triplets, (added.size, values.numel()))
        parts.append(ca.DM(start[added]) + ca.densify(ca.mtimes(S, values)))
    return ca.vertcat(*parts)[index.tolist()]


def _terms(selection: Selection, unknowns: Indices) -> tuple[Indices, Indices, Array]:
    """Return the entry, columns and weights of each term of the local `unknowns`."""
    first = np.searchsorted(selection.local, unknowns, side="left")
    count = np.searchsorted(selection.local, unknowns, side="right") - first
    entry = np.repeat(np.arange(unknowns.size), count)
    inside = np.arange(entry.size) - np.repeat(np.cumsum(count) - count, count)
    term = first[entry] + inside
    return entry, selection.columns[:, term], selection.weights[:, term]


def _pairs(first: Indices, second: Indices, entries: int) -> tuple[Indices, Indices]:
    """Return all pairs of terms of `first` and `second` that belong to the same entry."""
    counts = np.bincount(second, minlength=entries)
    starts = np.cumsum(counts) - counts
    a = np.repeat(np.arange(first.size), counts[first])
    inside = np.arange(a.size) - np.repeat(np.cumsum(counts[first]) - counts[first], counts[first])
    return a, starts[first[a]] + inside


def _constant(triplets: Triplets, shape: tuple[int, int]) -> ca.DM:
    """Return the sparse matrix of `triplets`, with duplicate entries summed."""
    rows, columns, values = triplets
    keys, number = np.unique(columns * shape[0] + rows, return_inverse=True)
    pattern = _sparsity(keys % shape[0], keys // shape[0], shape)
    return ca.DM(pattern, np.bincount(number, values, keys.size))


def _sparsity(rows: Indices, columns: Indices, shape: tuple[int, int]) -> ca.Sparsity:
    """Return the sparsity of entries in column-major order."""
    starts = np.concatenate([[0], np.cumsum(np.bincount(columns, minlength=shape[1]))])
    return ca.Sparsity(*shape, starts.tolist(), rows.tolist())
