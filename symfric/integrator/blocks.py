"""The Functions an implicit step is made of: with SX they inline, with MX they stay calls."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, final

import casadi as ca

from symfric.integrator.lu import SymbolicLU, factorise
from symfric.integrator.system import System

NONE = ca.SX(0, 1)


@final
@dataclass(frozen=True, eq=False)
class Blocks:
    """Right-hand side, iteration matrix W = M/(gamma h) - J and solutions with it.

    Attributes:
        f: (y, d) -> right-hand side.
        factor: (y, h, d) -> factors of W.
        solve: (factors, right, memory) -> k with W k = right + M memory.
        lu: the factors as expressions.
    """

    f: ca.Function
    factor: ca.Function
    solve: ca.Function
    lu: SymbolicLU


@lru_cache(maxsize=2)
def blocks(system: System, gamma: float) -> Blocks:
    """The blocks of a method with the diagonal coefficient `gamma`."""
    h = ca.SX.sym("h")
    right, memory = ca.SX.sym("right", system.n), ca.SX.sym("memory", system.n)
    lu = _factorised(system, system.mass / (gamma * h), range(system.n))
    packed = with_inner(system, lu.packed, h)
    whole = ca.vertcat(right + system.mass @ memory, ca.SX(len(lu.order) - system.n, 1))
    return Blocks(
        ca.Function("f", [system.y, system.d], [system.f], {"cse": True}),
        ca.Function("factor", [system.y, h, system.d], [packed], {"cse": True}),
        ca.Function("solve", [lu.packed_symbol, right, memory], [lu.solve(whole)[: system.n]]),
        lu,
    )


def _factorised(system: System, mass: ca.SX, rows: Sequence[int]) -> SymbolicLU:
    """Factors of `mass` - J, with J in `rows` alone, and of the equations of inner unknowns."""
    W, inner = ca.SX(mass), system.inner
    if inner is None:
        W[list(rows), :] -= system.J[list(rows), :]
        return factorise(ca.sparsify(W), system.pivots)
    f, k = inner.f, inner.l.numel()
    W[list(rows), :] -= ca.jacobian(f, system.y)[list(rows), :]
    to_l = ca.SX(system.n, k)
    to_l[list(rows), :] = -ca.jacobian(f, inner.l)[list(rows), :]
    own = ca.SX.eye(k) - ca.jacobian(inner.values, inner.l)
    whole = ca.blockcat([[W, to_l], [-ca.jacobian(inner.values, system.y), own]])
    unknowns = ca.vertsplit(ca.vertcat(system.y, inner.l))
    place = {ca.SX(s).__hash__(): i for i, s in enumerate(unknowns)}
    groups = [[place[ca.SX(s).__hash__()] for s in ca.vertsplit(g)] for g in inner.groups]
    return factorise(ca.sparsify(whole), groups)


def with_inner(system: System, expression: ca.SX, h: ca.SX = NONE) -> ca.SX:
    """`expression` with the values of inner unknowns put in."""
    inner = system.inner
    if inner is None:
        return expression
    (values,), _ = ca.substitute_inplace([inner.l], [inner.values], [NONE])
    put = ca.Function("put", [inner.l, system.y, h, system.d], [expression])
    return put(values, system.y, h, system.d)


@lru_cache(maxsize=2)
def refinement(system: System) -> ca.Function:
    """(y, d) -> y of a mechanism on its constraints, with its algebraic unknowns exact.

    Two steps of Newton's method for accelerations, multipliers and normal forces.
    """
    y, d, rows = ca.SX(system.y), system.d, system.algebraic[0]
    lu = _factorised(system, system.mass, rows)
    f = ca.Function("f", [system.y, d], [system.f[rows]])
    factor = ca.Function("factor", [system.y, d], [with_inner(system, lu.packed)])
    right = ca.SX.sym("right", len(rows))
    whole = ca.SX(len(lu.order), 1)
    whole[rows] = right
    solve = ca.Function("solve", [lu.packed_symbol, right], [lu.solve(whole)[: system.n]])
    if system.manifold is not None:
        y = ca.SX(system.manifold.project(y, d))
    for _ in range(2):
        y = y + solve(factor(y, d), f(y, d))
    return ca.Function("refine", [system.y, d], [y], {"cse": True})


Signs = Callable[[Any, Any, Any], tuple[Any, Any]]
"""(y, h, d) -> signs of det W and of det W for a tiny step."""


def signs(system: System, gamma: float) -> Signs:
    """Signs of det W and of the same for a tiny step, which only algebraic rows have.

    Where they differ, a mode grows faster than exp(t / (gamma h)), which an L-stable method of this
    step only damps away.
    """
    block, rows = blocks(system, gamma), system.algebraic[0]
    lu, first = block.lu, {row for row, _ in block.lu.order[: len(rows)]}
    alone = system.is_semi_explicit and first == set(rows)
    tiny = lu.sign(len(rows)) if alone else _tiny(system)
    symbols = [lu.packed_symbol, system.y, system.d]
    both = ca.Function("signs", symbols, [lu.sign(), tiny], {"cse": True})

    def at(y: Any, h: Any, d: Any) -> tuple[Any, Any]:
        of_step, of_tiny_step = both(block.factor(y, h, d), y, d)
        return of_step, of_tiny_step

    return at


def _tiny(system: System) -> ca.SX:
    """Sign of det W for a tiny step."""
    lu = _factorised(system, system.mass, system.algebraic[0])
    packed = with_inner(system, lu.packed)
    return ca.substitute(lu.sign(), lu.packed_symbol, packed)
