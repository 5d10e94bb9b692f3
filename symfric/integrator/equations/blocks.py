"""Functions from which implicit steps are built, and the update of algebraic unknowns after a jump.

The Functions are inlined in SX expressions and remain calls in MX expressions.

When input data jump, states and time stay constant, and the algebraic unknowns move to the solution
near the previous one. With W = -dg/dz of the algebraic equations 0 = g(y, d), factorised once per
round, the iteration

    W s_1 = g(y),        W s_2 = g(y + s_1),        y <- y + s_1 + s_2

is of order 3. Equations that are linear in their unknowns, such as those of a machine without
friction, need one round. The iteration has converged if

    |W| |s_2| <= DONE |W| |z|

in every equation. A system other than a mechanism may have many solutions, and the iteration has to
stay near the previous one: it continues only while s_2 is at most half of s_1 (Deuflhard's
monotonicity test with frozen derivatives, which is invariant to the units of equations and of
unknowns). The normal forces N = |R(N)| of a mechanism are convex, and Newton's method converges
from far away; the guard rejects invalid solutions. The loops in Python and in C (`follow.c`) make
the same comparisons of the same numbers, so both engines give the same bits. On failure the
unknowns stay unchanged, and the damped search of `symfric.integrator.equations.initial` begins at
the same guess.

Source: Deuflhard, Newton Methods for Nonlinear Problems, 2004, sections 2.1 and 3.3.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from symfric.foundation.numeric import Array, bound, nonzeros, reciprocal
from symfric.integrator.compiled.columns import filled
from symfric.integrator.equations.manifold import PULLING, SHOCK
from symfric.integrator.equations.matrices import Factors, SymbolicLU, factorise
from symfric.integrator.equations.system import System

NONE = ca.SX(0, 1)


class Slopes(NamedTuple):
    """Jacobian of a system, bordered by the derivatives of its inner unknowns l, if any.

        [ f_y  f_l     ]
        [ g_y  g_l - I ]

    Attributes:
        J: bordered Jacobian with a symbol for every entry that is not constant.
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
    """Return the Jacobian of `system`, bordered by the derivatives of its inner unknowns."""
    y, d, inner = system.y, system.d, system.inner
    slope, pivots, hidden = system.J, system.pivots, NONE
    if inner is not None:
        hidden = inner.l
        to_l = ca.vertcat(
            ca.jacobian(inner.f, hidden),
            ca.jacobian(inner.values, hidden) - ca.SX.eye(hidden.numel()),
        )
        slope = ca.horzcat(ca.jacobian(ca.vertcat(inner.f, inner.values), y), to_l)
        place = {s.__hash__(): i for i, s in enumerate(ca.vertsplit(ca.vertcat(y, hidden)))}
        pivots = tuple(tuple(place[s.__hash__()] for s in ca.vertsplit(g)) for g in inner.groups)
    named = ca.SX(slope := ca.sparsify(slope))
    places = [k for k, entry in enumerate(nonzeros(slope)) if not entry.is_constant()]
    entries = ca.SX.sym("J", len(places))
    named.nz[places] = entries
    of_l = ca.Function("slopes", [hidden, y, d], [ca.vec(ca.SX(slope.nz[places]))])
    at = ca.Function("slopes", [y, d], [of_l(_inner(system), y, d)], {"cse": True})
    return Slopes(named, entries, system.in_steps(at), pivots)


def _inner(system: System) -> ca.SX:
    """Return the inner unknowns in terms of y and d."""
    if system.inner is None:
        return NONE
    (values,), _ = ca.substitute_inplace([system.inner.l], [system.inner.values], [NONE])
    return values


class Blocks(NamedTuple):
    """Right-hand side of a system, iteration matrix W = M/(gamma h) - J, and solutions with W.

    Attributes:
        f: (y, d) -> right-hand side.
        slopes: (y, d) -> entries of J.
        pack: (entries of J, h) -> factors of W.
        solve: (factors, right, memory) -> k with W k = right + M memory.
        lu: factors of W as expressions.
        factors: W and the pivot order of its factors.
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


@lru_cache(maxsize=2)
def blocks(system: System, gamma: float) -> Blocks:
    """Return the blocks of a method with the diagonal coefficient `gamma`."""
    h, own = ca.SX.sym("h"), slopes(system)
    right, memory = ca.SX.sym("right", system.n), ca.SX.sym("memory", system.n)
    W = own.matrix(system.mass * reciprocal(gamma * h))
    lu = factorise(W, own.pivots, system.orders.get("step", ()))
    f = ca.Function("f", [system.y, system.d], [system.f], {"cse": True})
    # inner equations have zero right-hand sides
    padded = ca.vertcat(right + system.mass @ memory, ca.SX(W.size1() - system.n, 1))
    return Blocks(
        system.in_steps(f),
        own.values,
        ca.Function("pack", [own.entries, h], [lu.packed], {"cse": True}),
        ca.Function("solve", [lu.symbols, right, memory], [lu.solve(padded)[: system.n]]),
        lu,
        Factors("step", own.values, (own.entries, h), W, lu.order),
    )


@lru_cache(maxsize=2)
def at_rest(system: System) -> tuple[SymbolicLU, Factors]:
    """Return the factors of W for a tiny step as expressions, and the matrix with its pivot order.

    The matrix consists of M and of the derivatives of the rows without rates. It is singular if the
    algebraic equations do not determine their unknowns.
    """
    own, (rows, _) = slopes(system), system.algebraic
    matrix = own.matrix(system.mass, [i for i in range(system.n) if i not in rows])
    lu = factorise(matrix, own.pivots, system.orders.get("tiny", ()))
    return lu, Factors("tiny", own.values, (own.entries, ca.SX.sym("h")), matrix, lu.order)


def _residual(system: System) -> ca.Function:
    """Return (y, d) -> algebraic equations in their rows of y, 0 elsewhere."""
    residual, rows = ca.SX(system.n, 1), system.algebraic[0]
    residual[rows] = system.f[rows]
    return ca.Function("g", [system.y, system.d], [residual], {"cse": True})


Signs = Callable[[Any, Any, Any], tuple[Any, Any, Any]]
"""(y, h, d) -> sign of det W; for a tiny step, sign of det W and pivots of the watched rows."""


def signs(system: System, gamma: float, watched: Sequence[int] = ()) -> Signs:
    """Return the signs of det W for the step and for a tiny step, where only algebraic rows count.

    If they differ, a mode grows faster than exp(t / (gamma h)), and an L-stable method of this step
    wrongly damps it. The pivots of the rows `watched`, which require no further work, show how far
    the determinant for a tiny step is from zero.
    """
    block, (rows, _) = blocks(system, gamma), system.algebraic
    lu, entries = block.lu, block.factors.symbols[0]
    first = lu.order[: len(rows)]
    if system.is_semi_explicit and all({*places} == {*rows} for places in zip(*first, strict=True)):
        tiny = [lu.sign(len(rows)), lu.pivots(watched)]
    else:
        own, factors = at_rest(system)
        entries, tiny = factors.symbols[0], own.inserted(own.sign(), own.pivots(watched))
    every = ca.Function("signs", [lu.symbols, entries], [lu.sign(), *tiny], {"cse": True})

    def at(y: Any, h: Any, d: Any) -> tuple[Any, Any, Any]:
        values = block.slopes(y, d)
        of_step, of_tiny_step, pivots = every(block.pack(values, h), values)
        return of_step, of_tiny_step, pivots

    return at


DONE = 1e-10
"""Largest last correction, relative to the terms of the equations; smaller errors are rounding."""
ROUNDS = 6
"""Largest number of rounds; a solution that takes more is not near."""
FAINT = 1e-3
"""Ratio to the largest terms below which the terms of an equation of a mechanism are rounding.

Such equations, out of the plane of the mechanism or where loads cancel, are solved to the rounding
of the largest terms.
"""
NEARER, ANY = 0.5, 1e10
"""Largest ratio of s_2 to s_1 at which the iteration continues: in general, and for mechanisms."""
INLINE = 7000
"""Number of instructions above which rounds call blocks, which compile much faster."""


class Following(NamedTuple):
    """Update of the algebraic unknowns after a jump.

    Attributes:
        round: (y, d) -> y after one round, and (sizes of s_1 and s_2, guard). A negative guard
            rejects the solution: friction has jammed, or a bearing pulls.
        contraction: largest ratio of s_2 to s_1 at which the iteration continues.
    """

    round: ca.Function
    contraction: float

    def __call__(self, y: Array, d: Array) -> Array | None:
        """Return `y` updated to the run data `d`; None if a full search is needed."""
        now, after, look = y.copy(), np.empty(y.size), np.empty(3)
        data = np.ascontiguousarray(d, dtype=float)
        call = bound(self.round, (now, data), (after, look))
        for _ in range(ROUNDS):
            call()
            first, second, guard = look.tolist()
            if not (second <= DONE or second <= self.contraction * first):
                return None
            now[:] = after
            if second <= DONE:
                return now if guard >= 0 else None
        return None

    @property
    def c_source(self) -> str:
        """C source of the update, `int symfric_follow(double *y, const double *d)`.

        The C function returns 0; on failure it returns 1 and leaves y unchanged. The C source of
        `round` must precede it.
        """
        return filled(
            Path(__file__).with_name("follow.c"), self.round, n=self.round.numel_in(0),
            rounds=ROUNDS, done=DONE, contraction=self.contraction, name=self.round.name(),
        )  # fmt: skip


def following(system: System) -> Following | None:
    """Return the update of the algebraic unknowns of `system` after a jump; None if it has none."""
    if not system.free.any():
        return None
    parts = _parts(system)
    inlined = _round(system, parts, ca.SX)
    large = inlined.n_instructions() > INLINE
    contraction = NEARER if system.manifold is None else ANY
    return Following(_round(system, parts, ca.MX) if large else inlined, contraction)


@lru_cache(maxsize=2)
def corrected(system: System) -> ca.Function:
    """Return the Function (y, d) -> y with its algebraic unknowns after one Newton step.

    A mechanism is first projected onto its constraints, and takes two Newton steps.
    """
    y, d, parts, manifold = system.y, system.d, _parts(system), system.manifold
    end = y if manifold is None else ca.SX(manifold.project(y, d))
    for _ in range(1 if manifold is None else 2):
        _, change = parts.solve(parts.pack(parts.entries(end, d)), parts.residual(end, d))
        end = end + change
    return ca.Function("corrected", [y, d], [end], {"cse": True})


class _Parts(NamedTuple):
    """Functions that make up a round.

    Attributes:
        residual: (y, d) -> g in its rows of y, 0 elsewhere.
        entries: (y, d) -> entries of W.
        pack: entries -> factors.
        solve: (factors, residual) -> s, and the change of y by s.
        sizes: (entries, s_1, s_2, y after the round, inner unknowns) -> sizes of s_1 and s_2.
        guard: (factors, y after the round, d) -> smallest of the values that must not be negative.
    """

    residual: ca.Function
    entries: ca.Function
    pack: ca.Function
    solve: ca.Function
    sizes: ca.Function
    guard: ca.Function


def _round(system: System, parts: _Parts, kind: Any) -> ca.Function:
    """Return the Function of one round; SX inlines everything, MX keeps the parts as calls."""
    y, d = kind.sym("y", system.n), kind.sym("d", system.d.numel())
    inner = ca.Function("inner", [system.y, system.d], [_inner(system)], {"cse": True})
    entries = parts.entries(y, d)
    lu = parts.pack(entries)
    first, change = parts.solve(lu, parts.residual(y, d))
    middle = y + change
    second, change = parts.solve(lu, parts.residual(middle, d))
    after = middle + change
    sizes = parts.sizes(entries, first, second, after, inner(y, d))
    results: Any = [ca.densify(after), ca.densify(ca.vertcat(sizes, parts.guard(lu, after, d)))]
    if kind is ca.SX:
        results = ca.cse(results)
    return ca.Function("symfric_round", [y, d], results, ["y", "d"], ["y_next", "look"])


def _parts(system: System) -> _Parts:
    """Return the Functions of a round."""
    own, n, rows = slopes(system), system.n, system.algebraic[0]
    full = own.matrix(system.mass, [i for i in range(n) if i not in rows])
    order = system.orders.get("tiny", ())
    kept = list(range(full.size1()))
    if system.is_semi_explicit and not order:  # the algebraic equations form a block
        kept = [i for i in kept if i in rows or i >= n]
    place = {row: k for k, row in enumerate(kept)}
    W = ca.sparsify(full[kept, kept])
    lu = factorise(W, [[place[i] for i in group if i in place] for group in own.pivots], order)
    right, change = ca.SX.sym("right", n), ca.SX(n, 1)
    s = lu.solve(ca.densify(ca.vertcat(right, ca.SX(full.size1() - n, 1))[kept]))
    moved = [i for i in kept if i < n]
    change[moved] = s[: len(moved)]
    used = np.flatnonzero(ca.which_depends(ca.vec(ca.SX(W.nz[:])), own.entries, 1, False)).tolist()
    symbols, values = own.entries[used], own.values(system.y, system.d)[used]
    return _Parts(
        _residual(system),
        ca.Function("slopes_g", [system.y, system.d], [values]),
        ca.Function("pack_g", [symbols], [lu.packed], {"cse": True}),
        ca.Function("solve_g", [lu.symbols, right], [s, change]),
        _sizes(system, W, symbols, moved, [place[i] for i in rows]),
        _guard(system, lu, place),
    )


def _sizes(
    system: System, W: ca.SX, symbols: ca.SX, moved: Sequence[int], rows: Sequence[int]
) -> ca.Function:
    """Return the Function for the largest |W| |s| / |W| |z|, of s_1 and of s_2.

    Its arguments are (entries, s_1, s_2, y, inner unknowns).
    """
    count, inner = W.size1(), W.size1() - len(moved)
    first, second = ca.SX.sym("s_1", count), ca.SX.sym("s_2", count)
    y, hidden = ca.SX.sym("y", system.n), ca.SX.sym("l", inner)
    size = ca.fabs(W[list(rows), :])
    unknowns = ca.vertcat(y[list(moved)], hidden + (first + second)[len(moved) :, 0])
    scale = size @ ca.fabs(unknowns)
    # terms out of the plane of a mechanism are rounding errors of terms in the plane
    scale += 1e-300 if system.manifold is None else FAINT * ca.mmax(scale) + 1e-300
    found = [ca.mmax((size @ ca.fabs(s)) / scale) for s in (first, second)]
    arguments = [symbols, first, second, y, hidden]
    return ca.Function("sizes_g", arguments, [ca.vertcat(*found)], {"cse": True})


def _guard(system: System, lu: SymbolicLU, place: dict[int, int]) -> ca.Function:
    """Return (factors, y, d) -> a value that is negative if friction has jammed or a bearing pulls.

    The matrix of the loop from normal forces over friction and reactions back to normal forces is
    I - dN/dN. The sign of its determinant is, up to (-1)^n, that of all pivots together. None of
    the pivots of this matrix may fall below `SHOCK`.
    """
    manifold, conditions = system.manifold, [NONE]
    if manifold is not None:
        conditions.append(manifold.pressing(system.y, system.d) + PULLING)
        if loop := [place[i] for i in system.algebraic[0][manifold.loop :]]:
            conditions += [(-1) ** manifold.n * lu.sign(), lu.pivots(loop) - SHOCK]
    together = ca.vertcat(*conditions)
    least = ca.mmin(together) if together.numel() else ca.SX(1)
    return ca.Function("guard_g", [lu.symbols, system.y, system.d], [least], {"cse": True})
