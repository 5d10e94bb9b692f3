"""The Functions an implicit step is made of: with SX they inline, with MX they stay calls."""

from collections.abc import Callable
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


Signs = Callable[[Any, Any, Any], tuple[Any, Any]]
"""(y, h, d) -> signs of det W and of det W for a tiny step."""


def signs(system: System, gamma: float) -> Signs:
    """Signs of det W and of the same for a tiny step, which only algebraic rows have.

    Where they differ, a mode grows faster than exp(t / (gamma h)), which an L-stable method of this
    step only damps away.
    """
    block, rows = blocks(system, gamma), system.algebraic[0]
    y, d, lu = system.y, system.d, block.lu
    sign = ca.Function("sign", [lu.packed_symbol], [lu.sign(), lu.sign(len(rows))])
    if system.is_semi_explicit and {row for row, _ in lu.order[: len(rows)]} == set(rows):
        return lambda y, h, d: sign(block.factor(y, h, d))
    matrix = ca.densify(system.mass)
    matrix[rows, :] = -system.J[rows, :]
    first = factorise(ca.sparsify(matrix), system.pivots)
    tiny = ca.Function(
        "tiny", [y, d], [ca.substitute(first.sign(), first.packed_symbol, first.packed)],
        {"cse": True},
    )  # fmt: skip
    return lambda y, h, d: (sign(block.factor(y, h, d))[0], tiny(y, d))
