"""Functions that make up an implicit step: inlined with SX, calls with MX."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, final

import casadi as ca

from symfric.foundation.numeric import reciprocal
from symfric.integrator.equations.matrices import Factors, SymbolicLU, factorise
from symfric.integrator.equations.system import System
from symfric.model.holonomic import Inner

NONE = ca.SX(0, 1)


@final
@dataclass(frozen=True, eq=False)
class Slopes:
    """Jacobian of a system, bordered by that of its inner unknowns l if there are any.

        [ f_y  f_l     ]
        [ g_y  g_l - I ]

    Attributes:
        J: with a symbol for every entry that is not a constant.
        entries: these symbols.
        values: (y, d) -> values of these symbols.
        pivots: groups of rows as in `factorise`.
    """

    J: ca.SX
    entries: ca.SX
    values: ca.Function
    pivots: tuple[tuple[int, ...], ...]

    def matrix(self, mass: ca.SX, without: Sequence[int] = ()) -> ca.SX:
        """Return `mass` - J in terms of `entries`, with the rows `without` of J set to zero."""
        kept, inner = ca.SX(self.J), self.J.shape[0] - mass.shape[0]
        kept[list(without), :] = 0
        return ca.sparsify(ca.diagcat(mass, ca.SX(inner, inner)) - kept)


@lru_cache(maxsize=2)
def slopes(system: System) -> Slopes:
    """Return the Jacobian of `system`."""
    y, d, inner = system.y, system.d, system.inner
    slope, pivots, hidden, put = system.J, system.pivots, NONE, NONE
    if inner is not None:
        hidden, pivots = inner.l, _places(y, inner)
        to_l = ca.vertcat(
            ca.jacobian(inner.f, hidden),
            ca.jacobian(inner.values, hidden) - ca.SX.eye(hidden.numel()),
        )
        slope = ca.horzcat(ca.jacobian(ca.vertcat(inner.f, inner.values), y), to_l)
        (put,), _ = ca.substitute_inplace([hidden], [inner.values], [NONE])
    named, entries, values = _named(ca.sparsify(slope))
    of_l = ca.Function("slopes", [hidden, y, d], [values])
    at = ca.Function("slopes", [y, d], [of_l(put, y, d)], {"cse": True})
    return Slopes(named, entries, system.in_steps(at), pivots)


def _named(matrix: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return `matrix` with symbols for its non-constant entries, these symbols, and the entries."""
    named = ca.SX(matrix)
    places = [k for k in range(matrix.nnz()) if not ca.SX(matrix.nz[k]).is_constant()]
    entries = ca.SX.sym("J", len(places))
    for i, k in enumerate(places):
        named.nz[k] = entries[i]
    return named, entries, ca.vec(ca.SX(matrix.nz[places]))


def _places(y: ca.SX, inner: Inner) -> tuple[tuple[int, ...], ...]:
    """Return groups of unknowns as row numbers."""
    unknowns = ca.vertsplit(ca.vertcat(y, inner.l))
    place = {ca.SX(s).__hash__(): i for i, s in enumerate(unknowns)}
    groups = (ca.vertsplit(group) for group in inner.groups)
    return tuple(tuple(place[ca.SX(s).__hash__()] for s in group) for group in groups)


@final
@dataclass(frozen=True, eq=False)
class Blocks:
    """Right-hand side, iteration matrix W = M/(gamma h) - J and solutions with it.

    Attributes:
        f: (y, d) -> right-hand side.
        slopes: (y, d) -> entries of J.
        pack: (entries of J, h) -> factors of W.
        solve: (factors, right, memory) -> k with W k = right + M memory.
        lu: the factors as expressions.
        factors: W, and the order in which it is factorised.
    """

    f: ca.Function
    slopes: ca.Function
    pack: ca.Function
    solve: ca.Function
    lu: SymbolicLU
    factors: Factors

    def factor(self, y: Any, h: Any, d: Any) -> Any:
        """Return the factors of W = M / (gamma h) - J at a point, for `solve`."""
        return self.pack(self.slopes(y, d), h)

    @property
    def instructions(self) -> int:
        """Instructions of the Jacobian and the factorisation."""
        return self.slopes.n_instructions() + self.pack.n_instructions()


@lru_cache(maxsize=2)
def blocks(system: System, gamma: float) -> Blocks:
    """Return the blocks of a method with the diagonal coefficient `gamma`."""
    h, own = ca.SX.sym("h"), slopes(system)
    right, memory = ca.SX.sym("right", system.n), ca.SX.sym("memory", system.n)
    W = own.matrix(system.mass * reciprocal(gamma * h))
    lu = factorise(W, own.pivots, system.orders.get("step", ()))
    f = ca.Function("f", [system.y, system.d], [system.f], {"cse": True})
    return Blocks(
        system.in_steps(f),
        own.values,
        ca.Function("pack", [own.entries, h], [lu.packed], {"cse": True}),
        ca.Function(
            "solve", [lu.packed_symbol, right, memory],
            [_solved(lu, right + system.mass @ memory)],
        ),
        lu,
        Factors("step", own.values, (own.entries, h), W, lu.order),
    )  # fmt: skip


@lru_cache(maxsize=2)
def at_rest(system: System) -> tuple[SymbolicLU, Factors]:
    """Return the factors of W for a tiny step: M, and the derivatives of the rows without rates.

    The matrix is singular if the algebraic equations do not determine their unknowns.
    """
    own, (rows, _) = slopes(system), system.algebraic
    matrix = own.matrix(system.mass, [i for i in range(system.n) if i not in rows])
    lu = factorise(matrix, own.pivots, system.orders.get("tiny", ()))
    return lu, Factors("tiny", own.values, (own.entries, ca.SX.sym("h")), matrix, lu.order)


def _solved(lu: SymbolicLU, right: ca.SX) -> ca.SX:
    """Return the unknowns of a system whose inner equations have zero right-hand sides."""
    n = right.numel()
    return lu.solve(ca.vertcat(right, ca.SX(len(lu.order) - n, 1)))[:n]


@lru_cache(maxsize=2)
def refinement(system: System) -> ca.Function:
    """Return the Function (y, d) -> y of a mechanism on its constraints, algebraic unknowns exact.

    It makes two steps of Newton's method for accelerations, multipliers and normal forces.
    """
    (rows, _), right = system.algebraic, ca.SX.sym("right", system.n)
    lu, factors = at_rest(system)  # use its symbols: the cache of `slopes` may be newer
    pack = ca.Function("pack", [factors.symbols[0]], [lu.packed])
    solve = ca.Function("solve", [lu.packed_symbol, right], [_solved(lu, right)])
    residual = ca.SX(system.n, 1)
    residual[rows] = system.f[rows]
    f = ca.Function("f", [system.y, system.d], [residual])
    y, d = ca.SX(system.y), system.d
    if system.manifold is not None:
        y = ca.SX(system.manifold.project(y, d))
    for _ in range(2):
        y = y + solve(pack(factors.entries(y, d)), f(y, d))
    return ca.Function("refine", [system.y, d], [y], {"cse": True})


Signs = Callable[[Any, Any, Any], tuple[Any, Any, Any]]
"""(y, h, d) -> signs of det W and of det W for a tiny step, pivots of rows in the latter."""


def signs(system: System, gamma: float, watched: Sequence[int] = ()) -> Signs:
    """Return the signs of det W and of the same for a tiny step, which only algebraic rows have.

    Where they differ, a mode grows faster than exp(t / (gamma h)), which an L-stable method of this
    step wrongly damps. The pivots of the rows `watched`, available without further work, show how
    far the latter is from zero.
    """
    block, (rows, _) = blocks(system, gamma), system.algebraic
    entries = block.factors.symbols[0]
    lu, first = block.lu, block.lu.order[: len(rows)]
    if system.is_semi_explicit and all({*places} == {*rows} for places in zip(*first, strict=True)):
        tiny = [lu.sign(len(rows)), lu.pivots(watched)]
    else:
        own_lu, factors = at_rest(system)
        entries = factors.symbols[0]
        in_symbols = [own_lu.sign(), own_lu.pivots(watched)]
        tiny = ca.substitute(in_symbols, [own_lu.packed_symbol], [own_lu.packed])
    symbols = [lu.packed_symbol, entries]
    every = ca.Function("signs", symbols, [lu.sign(), *tiny], {"cse": True})

    def at(y: Any, h: Any, d: Any) -> tuple[Any, Any, Any]:
        values = block.slopes(y, d)
        of_step, of_tiny_step, pivots = every(block.pack(values, h), values)
        return of_step, of_tiny_step, pivots

    return at
