"""The Functions an implicit step is made of: with SX they inline, with MX they stay calls."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, final

import casadi as ca

from symfric.integrator.lu import SymbolicLU, factorise
from symfric.integrator.system import System


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
    lu = factorise(ca.sparsify(system.mass / (gamma * h) - system.J), system.pivots)
    return Blocks(
        ca.Function("f", [system.y, system.d], [system.f], {"cse": True}),
        ca.Function("factor", [system.y, h, system.d], [lu.packed], {"cse": True}),
        ca.Function(
            "solve", [lu.packed_symbol, right, memory], [lu.solve(right + system.mass @ memory)]
        ),
        lu,
    )


Signs = Callable[[Any, Any, Any], tuple[Any, Any, Any]]
"""(y, h, d) -> signs of det W and of det W for a tiny step, pivots of rows in the latter."""


def signs(system: System, gamma: float, watched: Sequence[int] = ()) -> Signs:
    """Signs of det W and of the same for a tiny step, which only algebraic rows have.

    Where they differ, a mode grows faster than exp(t / (gamma h)), which an L-stable method of this
    step only damps away. The pivots of the rows `watched`, which are there anyway, say how far the
    latter is from zero.
    """
    block, rows = blocks(system, gamma), system.algebraic[0]
    lu, first = block.lu, {row for row, _ in block.lu.order[: len(rows)]}
    alone = system.is_semi_explicit and first == set(rows)
    tiny = (lu.sign(len(rows)), lu.pivots(watched)) if alone else _tiny(system, watched)
    symbols = [lu.packed_symbol, system.y, system.d]
    every = ca.Function("signs", symbols, [lu.sign(), *tiny], {"cse": True})

    def at(y: Any, h: Any, d: Any) -> tuple[Any, Any, Any]:
        of_step, of_tiny_step, pivots = every(block.factor(y, h, d), y, d)
        return of_step, of_tiny_step, pivots

    return at


def _tiny(system: System, watched: Sequence[int]) -> list[ca.SX]:
    """Sign of det W for a tiny step, and pivots of the rows `watched` in it."""
    matrix, rows = ca.densify(system.mass), system.algebraic[0]
    matrix[rows, :] = -system.J[rows, :]
    lu = factorise(ca.sparsify(matrix), system.pivots)
    both = [lu.sign(), lu.pivots(watched)]
    return ca.substitute(both, [lu.packed_symbol], [lu.packed])
