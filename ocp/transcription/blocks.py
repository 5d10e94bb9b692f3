"""Partially separable program: a few functions of few unknowns, evaluated at many places.

    f(w) = c'w + sum_i q(S_i w, theta_i),    g(w) = A w + rows r(S_i w, theta_i)

A `RowBlock` is r and q with exact derivatives, built once and mapped over its places i. The S_i are
constant and sparse, so the derivatives of the program are sums of derivatives of blocks:

    dg/dw = A + sum_i P_i' (dr/dv) S_i,    H = sum_i S_i' (d^2 (sigma q + lam'r) / dv^2) S_i

Source: Griewank and Toint, Numerische Mathematik 39, 1982, 119-137 (partial separability).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.phase import Array, Join, Row

Indices = NDArray[np.int64]
Symbols = Any
"""SX or MX columns of one type, for which CasADi's stubs have no common type."""

OPTIONS = {"cse": True}


@final
@dataclass(frozen=True, eq=False)
class Entries:
    """Entries of a derivative, divided into varying and constant ones.

    Attributes:
        rows, columns: indices of all structural nonzeros in column-major order, shape (nnz,).
        varying: increasing indices of the entries that the function returns, shape (nv,).
        constant: values of the constant entries, shape (nnz - nv,).
    """

    rows: Indices
    columns: Indices
    varying: Indices
    constant: Array

    @cached_property
    def still(self) -> Indices:
        """Indices of the constant entries, shape (nnz - nv,)."""
        return np.setdiff1d(np.arange(self.rows.size), self.varying)


class RowBlock(NamedTuple):
    """Rows r (m, 1) and a share q of the cost as functions of (v, theta), with derivatives.

    Attributes:
        n, m: numbers of local unknowns v and of rows.
        rows: (v, theta) -> r.
        share: (v, theta) -> q; None if there is none.
        slopes: (v, theta) -> varying nonzeros of dq/dv.
        jacobian: (v, theta) -> r, varying nonzeros of dr/dv.
        hessian: (v, theta, sigma, lam) -> varying nonzeros of the upper triangle of
            d^2 (sigma q + lam'r) / dv^2.
        of_slopes, of_jacobian, of_hessian: places of these nonzeros.
    """

    n: int
    m: int
    rows: ca.Function
    share: ca.Function | None
    slopes: ca.Function
    jacobian: ca.Function
    hessian: ca.Function
    of_slopes: Entries
    of_jacobian: Entries
    of_hessian: Entries


def block(name: str, v: Symbols, theta: Symbols, r: Symbols, q: Symbols | None = None) -> RowBlock:
    """Return the block of rows `r` and a share `q` of the cost, differentiated by `v`."""
    kind = type(v)
    r = ca.densify(r)
    sigma, lam = kind.sym("sigma"), kind.sym("lam", r.numel())
    cost = kind(0) if q is None else q
    J, gradient = ca.jacobian(r, v), ca.jacobian(cost, v)
    H = ca.triu(ca.hessian(sigma * cost + ca.dot(lam, r), v)[0])
    (of_J, nz_J), (of_q, nz_q), (of_H, nz_H) = (_entries(part) for part in (J, gradient, H))
    arguments = [v, theta]

    def function(what: str, inputs: Sequence[Symbols], *outputs: Symbols) -> ca.Function:
        return ca.Function(f"{name}_{what}", list(inputs), list(outputs), OPTIONS)

    return RowBlock(
        n=v.numel(),
        m=r.numel(),
        rows=function("rows", arguments, r),
        share=None if q is None else function("share", arguments, ca.densify(cost)),
        slopes=function("slopes", arguments, nz_q),
        jacobian=function("jacobian", arguments, r, nz_J),
        hessian=function("hessian", [*arguments, sigma, lam], nz_H),
        of_slopes=of_q,
        of_jacobian=of_J,
        of_hessian=of_H,
    )


def _entries(matrix: Symbols) -> tuple[Entries, Symbols]:
    """Return the entries of a matrix, and its varying nonzeros as a column."""
    rows, columns = (np.array(part, dtype=np.int64) for part in matrix.sparsity().get_triplet())
    if isinstance(matrix, ca.MX):
        return Entries(rows, columns, np.arange(rows.size), np.zeros(0)), matrix.nz[:]
    elements: list[Any] = matrix.nonzeros()
    still = np.array([element.is_constant() for element in elements], dtype=bool)
    numbers = [float(e) for e, constant in zip(elements, still, strict=True) if constant]
    varying = np.flatnonzero(~still)
    return (
        Entries(rows, columns, varying, np.array(numbers, dtype=float)),
        ca.vertcat(ca.SX(0, 1), *(elements[i] for i in varying)),
    )


@final
@dataclass(frozen=True, eq=False)
class Selection:
    """Local unknowns v = S_i w as sums of the same number of terms at each place.

    Attributes:
        local: index of the local unknown of each term, increasing, shape (terms,).
        columns: index in w of the unknown of each term, shape (places, terms).
        weights: factor of each term, shape (places, terms).
    """

    local: Indices
    columns: Indices
    weights: Array

    @cached_property
    def plain(self) -> bool:
        """True if each local unknown equals one unknown of w."""
        return bool(
            np.array_equal(self.local, np.arange(self.local.size)) and (self.weights == 1.0).all()
        )


def select(parts: Sequence[Indices | tuple[Indices, Array]], places: int) -> Selection:
    """Return a selection of the local unknowns of consecutive parts.

    Args:
        parts: columns (k, places) of k local unknowns, or columns and weights, both
            (k, terms, places), of k sums.
        places: number of places.
    """
    local, columns = [np.zeros(0, np.int64)], [np.zeros((0, places), np.int64)]
    weights, count = [np.zeros((0, places))], 0
    for part in parts:
        chosen, factors = part if isinstance(part, tuple) else (part[:, None, :], np.ones(1))
        k, terms, _ = chosen.shape
        local.append(count + np.repeat(np.arange(k), terms))
        columns.append(chosen.reshape(k * terms, places))
        weights.append(np.broadcast_to(factors, chosen.shape).reshape(k * terms, places))
        count += k
    return Selection(np.concatenate(local), np.concatenate(columns).T, np.concatenate(weights).T)


class ConstantEntries(NamedTuple):
    """Constant entries of the rows of a `Piece`, by place, row of the place, and column."""

    places: Indices
    rows: Indices
    columns: Indices
    weights: Array

    @staticmethod
    def of(rows: Indices, columns: Indices, weights: Array) -> "ConstantEntries":
        """Return entries in the same `rows` (m,) of each place; others are (m, terms, places)."""
        m, terms, places = columns.shape
        at, factors = np.tile(np.arange(places), m * terms), np.broadcast_to(weights, columns.shape)
        return ConstantEntries(
            at, np.repeat(rows, terms * places), columns.ravel(), factors.ravel()
        )


@final
@dataclass(frozen=True, eq=False)
class Rows:
    """Names, sizes and ranges of m rows.

    Attributes:
        names: name of each row for messages.
        scale: SI value of a row divided by its value in the program, shape (m,).
        lower, upper: bounds in SI units, shape (m,).
    """

    names: tuple[str, ...]
    scale: Array
    lower: Array
    upper: Array

    @staticmethod
    def of(rows: Sequence[Row | Join]) -> "Rows":
        """Return the rows of conditions of a problem."""
        columns = [[r.nominal for r in rows], [r.lower for r in rows], [r.upper for r in rows]]
        return Rows(tuple(row.name for row in rows), *(np.array(c, dtype=float) for c in columns))

    @staticmethod
    def zero(names: Sequence[str], scale: Array) -> "Rows":
        """Return the rows of equations, with zero as both bounds."""
        zeros = np.zeros(len(names))
        return Rows(tuple(names), scale, zeros, zeros)

    def __add__(self, other: "Rows") -> "Rows":
        pairs = ((self.scale, other.scale), (self.lower, other.lower), (self.upper, other.upper))
        return Rows(self.names + other.names, *map(np.concatenate, pairs))


@final
@dataclass(frozen=True, eq=False)
class Piece:
    """Rows and costs of one type at many places.

    Attributes:
        rows: rows of each place.
        order: sort key of the rows of each place among all rows, shape (places,); see `order_of`.
        span: index of the phase.
        interval, offset: index of an interval of the mesh, and fraction of this interval, of each
            place, shape (places,).
        block: nonlinear part; None for linear rows.
        selection: local unknowns of the block.
        theta: parameters of the block, MX (k, places) or (k, 1).
        linear: linear part of the rows.
        slot: index of the cost to which the shares of the block are added.
        at: indices of the rows in the program, shape (m, places); see `numbered`.
    """

    rows: Rows
    order: Indices
    span: int
    interval: Indices
    offset: Array
    block: RowBlock | None = None
    selection: Selection | None = None
    theta: ca.MX = field(default_factory=lambda: ca.MX(0, 1))
    linear: ConstantEntries | None = None
    slot: int = 0
    at: Indices = field(default_factory=lambda: np.zeros((0, 0), np.int64))

    LAST: ClassVar[int] = 63
    """Last number inside an interval; 0 is the gap to the next interval."""

    @staticmethod
    def order_of(span: int, interval: Indices | int, inside: Indices | int) -> Indices:
        """Return the sort key of rows by phase, interval and number inside it, up to `LAST`."""
        return (np.int64(span) << 40) + (np.asarray(interval, np.int64) << 6) + inside

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the rows of a place."""
        return self.rows.names

    @property
    def m(self) -> int:
        """Number of rows per place."""
        return len(self.names)

    @property
    def places(self) -> int:
        """Number of places."""
        return self.order.size


def numbered(pieces: Sequence[Piece]) -> tuple[Piece, ...]:
    """Return the pieces with the indices of their rows, which are sorted by `order`."""
    keys = np.concatenate([np.zeros(0, np.int64), *(np.repeat(p.order, p.m) for p in pieces)])
    numbers = np.empty(keys.size, np.int64)
    numbers[np.argsort(keys, kind="stable")] = np.arange(keys.size)
    parts = np.split(numbers, np.cumsum([p.m * p.places for p in pieces])[:-1])
    pairs = zip(pieces, parts, strict=True)
    return tuple(replace(p, at=part.reshape(p.places, p.m).T) for p, part in pairs)


def linear_piece(rows: Rows, columns: Indices, weights: Array, span: int, order: Indices) -> Piece:
    """Return linear rows at one place: row i is the sum of weights[i, j] w[columns[i, j]]."""
    numbers = np.repeat(np.arange(len(rows.names)), columns.shape[1])
    kept = weights.ravel() != 0.0
    return Piece(
        rows=rows,
        order=np.reshape(order, (1,)),
        span=span,
        interval=np.zeros(1, np.int64),
        offset=np.zeros(1),
        linear=ConstantEntries(
            0 * numbers[kept], numbers[kept], columns.ravel()[kept], weights.ravel()[kept]
        ),
    )
