"""Fast update of algebraic unknowns after a jump of inputs: two corrections per round.

When input data jump, states and time stay, and algebraic unknowns move to the solution near the
previous one. With W = -dg/dz of the algebraic equations 0 = g(y, d), factorised once a round,

    W s_1 = g(y),        W s_2 = g(y + s_1),        y <- y + s_1 + s_2

is of order 3; equations that are linear in their unknowns, such as those of a machine without
friction, need one round. The iteration has converged if

    |W| |s_2| <= DONE |W| |z|

in every equation. Without a mechanism there may be many solutions, and the iteration has to stay
near
the previous one: it continues only while s_2 is at most half of s_1 (Deuflhard's monotonicity test
with frozen derivatives, which is invariant to units of equations and of unknowns). Normal forces
N = |R(N)| of a mechanism are convex and Newton's method converges from far away; the guard rejects
invalid solutions. The two loops, in Python and in C (`C_FOLLOW`), make the same comparisons of the
same numbers, so that engines agree bit for bit. On failure the unknowns stay unchanged, and the
damped
search of `symfric.integrator.equations.initial` begins at the same guess.

Source: Deuflhard, Newton Methods for Nonlinear Problems, 2004, sections 2.1 and 3.3.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from string import Template
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import bound
from symfric.integrator.equations.blocks import Slopes, slopes
from symfric.integrator.equations.manifold import PULLING, SHOCK
from symfric.integrator.equations.matrices import SymbolicLU, factorise
from symfric.integrator.equations.system import System

Array = NDArray[np.float64]
DONE = 1e-10
"""Largest last correction, relative to the terms of the equations; beyond it is rounding."""
ROUNDS = 6
"""Most rounds; a solution that takes more is not near."""
FAINT = 1e-3
"""Equations of a mechanism with terms this small compared with the largest are solved to the
rounding
of the largest: out of its plane, or where loads cancel, all terms are rounding.
"""
NEARER, ANY = 0.5, 1e10
"""Largest s_2 over s_1 to continue with: for general systems, and for mechanisms."""
INLINE = 7000
"""Rounds with more instructions are calls of blocks, which compile much faster."""


@final
@dataclass(frozen=True, eq=False)
class Following:
    """Update of the unknowns after a jump.

    Attributes:
        round: (y, d) -> y after one round, and (sizes of s_1 and s_2, guard). A negative guard
            rejects the solution: friction has jammed, or a bearing pulls.
        contraction: largest s_2 over s_1 to continue with.
    """

    round: ca.Function
    contraction: float

    def __call__(self, y: Array, d: Array) -> Array | None:
        """Return `y` with its algebraic unknowns at run data `d`; None if a full search is
        needed.
        """
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
        """C of the update, `int symfric_follow(double *y, const double *d)`.

        It returns 0, or 1 and leaves y unchanged. The C of `round` must precede it.
        """
        function = self.round
        return Template(C_FOLLOW).substitute(
            n=function.numel_in(0), rounds=ROUNDS, done=repr(DONE),
            contraction=repr(self.contraction), name=function.name(),
            arg=function.sz_arg(), res=function.sz_res(),
            iw=max(1, function.sz_iw()), w=max(1, function.sz_w()),
        )  # fmt: skip


C_FOLLOW = """
/* Updates algebraic unknowns of y after a jump of d; returns 1, y unchanged, if that fails. */
int symfric_follow(double *y, const double *d)
{
  enum { N = $n };
  double now[N], after[N], look[3], w[$w];
  casadi_int iw[$iw];
  const double *arg[$arg];
  double *res[$res];
  int i, k;
  for (i = 0; i < N; ++i) now[i] = y[i];
  for (k = 0; k < $rounds; ++k) {
    arg[0] = now;
    arg[1] = d;
    res[0] = after;
    res[1] = look;
    $name(arg, res, iw, w, 0);
    if (!(look[1] <= $done || look[1] <= $contraction * look[0])) return 1;
    for (i = 0; i < N; ++i) now[i] = after[i];
    if (look[1] <= $done) {
      if (!(look[2] >= 0)) return 1;
      for (i = 0; i < N; ++i) y[i] = now[i];
      return 0;
    }
  }
  return 1;
}
"""


def following(system: System) -> Following | None:
    """Return the update of the algebraic unknowns of `system` after a jump; None if it has none."""
    if not system.free.any():
        return None
    blocks = _blocks(system)
    inlined = _round(system, blocks, ca.SX)
    large = inlined.n_instructions() > INLINE
    contraction = NEARER if system.manifold is None else ANY
    return Following(_round(system, blocks, ca.MX) if large else inlined, contraction)


def corrected(system: System) -> ca.Function:
    """Return (y, d) -> y with its algebraic unknowns after the first correction of a round, in
    SX.
    """
    y, d = ca.SX.sym("y", system.n), ca.SX.sym("d", system.d.numel())
    blocks = _blocks(system)
    _, change = blocks.solve(blocks.pack(blocks.entries(y, d)), blocks.residual(y, d))
    return ca.Function("corrected", [y, d], [y + change], {"cse": True})


@final
@dataclass(frozen=True, eq=False)
class _Blocks:
    """Functions of a round.

    Attributes:
        residual: (y, d) -> g in its rows of y, 0 elsewhere.
        entries: (y, d) -> entries of W.
        inner: (y, d) -> inner unknowns.
        pack: entries -> factors.
        solve: (factors, residual) -> s, and its part in y.
        sizes: (entries, s_1, s_2, y after, inner unknowns) -> their sizes.
        guard: (factors, y after, d) -> least value that must not be negative; None if there is
        none.
    """

    residual: ca.Function
    entries: ca.Function
    inner: ca.Function
    pack: ca.Function
    solve: ca.Function
    sizes: ca.Function
    guard: ca.Function | None


def _round(system: System, blocks: _Blocks, kind: Any) -> ca.Function:
    """Return one round; SX inlines everything, MX keeps the blocks as calls."""
    y, d = kind.sym("y", system.n), kind.sym("d", system.d.numel())
    entries = blocks.entries(y, d)
    lu = blocks.pack(entries)
    first, change = blocks.solve(lu, blocks.residual(y, d))
    middle = y + change
    second, change = blocks.solve(lu, blocks.residual(middle, d))
    after = middle + change
    sizes = blocks.sizes(entries, first, second, after, blocks.inner(y, d))
    guard = kind(1) if blocks.guard is None else blocks.guard(lu, after, d)
    results: Any = [ca.densify(after), ca.densify(ca.vertcat(sizes, guard))]
    if kind is ca.SX:
        results = ca.cse(results)
    return ca.Function("symfric_round", [y, d], results, ["y", "d"], ["y_next", "look"])


def _blocks(system: System) -> _Blocks:
    """Return the blocks of a system."""
    own, n, rows = slopes(system), system.n, system.algebraic[0]
    full = own.matrix(system.mass, [i for i in range(n) if i not in rows])
    order = system.orders.get("tiny", ())
    kept = list(range(full.size1()))
    if system.is_semi_explicit and not order:  # the algebraic equations form a block
        kept = [i for i in kept if i in rows or i >= n]
    place = {row: k for k, row in enumerate(kept)}
    W = ca.sparsify(full[kept, kept])
    groups = [[place[i] for i in group if i in place] for group in own.pivots]
    lu = factorise(W, groups, order)
    residual, right = ca.SX(n, 1), ca.SX.sym("right", n)
    residual[rows] = system.f[rows]
    whole, change = ca.SX(own.J.size1(), 1), ca.SX(n, 1)
    whole[:n] = right
    s = lu.solve(ca.densify(whole[kept]))
    moved = [i for i in kept if i < n]
    change[moved] = s[: len(moved)]
    symbols, entries = _used(W, own)
    return _Blocks(
        ca.Function("g", [system.y, system.d], [residual], {"cse": True}),
        ca.Function("slopes_g", [system.y, system.d], [entries], {"cse": True}),
        _inner(system),
        ca.Function("pack_g", [symbols], [lu.packed], {"cse": True}),
        ca.Function("solve_g", [lu.packed_symbol, right], [s, change]),
        _sizes(system, W, symbols, moved, [place[i] for i in rows]),
        _guard(system, lu, place),
    )


def _used(W: ca.SX, own: Slopes) -> tuple[ca.SX, ca.SX]:
    """Return the symbols that W contains, and their values in terms of y and d."""
    used = {s.__hash__() for s in ca.symvar(W)}
    every = range(own.entries.numel())
    kept = [k for k in every if ca.SX(own.entries[k]).__hash__() in used]
    values = own.values(*own.values.sx_in())
    return own.entries[kept], ca.SX(values)[kept]


def _inner(system: System) -> ca.Function:
    """Return inner unknowns as a Function (y, d)."""
    inner = system.inner
    if inner is None:
        return ca.Function("inner", [system.y, system.d], [ca.SX(0, 1)])
    (values,), _ = ca.substitute_inplace([inner.l], [inner.values], [ca.SX(0, 1)])
    return ca.Function("inner", [system.y, system.d], [values], {"cse": True})


def _sizes(
    system: System, W: ca.SX, symbols: ca.SX, moved: Sequence[int], rows: Sequence[int]
) -> ca.Function:
    """Return (entries, s_1, s_2, y, inner unknowns) -> largest |W| |s| / |W| |z|, for s_1 and
    s_2.
    """
    count, inner = W.size1(), W.size1() - len(moved)
    first, second = ca.SX.sym("s_1", count), ca.SX.sym("s_2", count)
    y, hidden = ca.SX.sym("y", system.n), ca.SX.sym("l", inner)
    size = ca.fabs(W[list(rows), :])
    unknowns = ca.vertcat(y[list(moved)], hidden + (first + second)[len(moved) :, 0])
    scale = size @ ca.fabs(unknowns)
    # in a mechanism, values that are zero (out of its plane) are rounding of the others
    scale += 1e-300 if system.manifold is None else FAINT * ca.mmax(scale) + 1e-300
    found = [ca.mmax((size @ ca.fabs(s)) / scale) for s in (first, second)]
    arguments = [symbols, first, second, y, hidden]
    return ca.Function("sizes_g", arguments, [ca.vertcat(*found)], {"cse": True})


def _guard(system: System, lu: SymbolicLU, place: dict[int, int]) -> ca.Function | None:
    """Return (factors, y, d) -> a value, negative if friction has jammed or a bearing pulls.

    The loop from normal forces over friction and reactions back to them is I - dN/dN: its
    determinant has the sign of all others together, and no pivot of it may fall below `SHOCK`.
    """
    manifold = system.manifold
    if manifold is None:
        return None
    loop = [place[i] for i in system.algebraic[0][manifold.loop :]]
    conditions = [manifold.pressing(system.y, system.d) + PULLING]
    if loop:
        conditions += [(-1) ** manifold.n * lu.sign(), lu.pivots(loop) - SHOCK]
    together = ca.vertcat(*conditions)
    if not together.numel():
        return None
    arguments = [lu.packed_symbol, system.y, system.d]
    return ca.Function("guard_g", arguments, [ca.mmin(together)], {"cse": True})
