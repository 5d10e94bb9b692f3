"""The Functions an implicit step is made of: with SX they inline, with MX they stay calls."""

from dataclasses import dataclass
from functools import lru_cache
from typing import final

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
    """

    f: ca.Function
    factor: ca.Function
    solve: ca.Function


def blocks(system: System, gamma: float) -> Blocks:
    """The blocks of a method with the diagonal coefficient `gamma`."""
    right, memory = ca.SX.sym("right", system.n), ca.SX.sym("memory", system.n)
    h, lu = _factors(system, gamma)
    return Blocks(
        ca.Function("f", [system.y, system.d], [system.f], {"cse": True}),
        ca.Function("factor", [system.y, h, system.d], [lu.packed], {"cse": True}),
        ca.Function(
            "solve", [lu.packed_symbol, right, memory], [lu.solve(right + system.mass @ memory)]
        ),
    )


def signs(system: System, gamma: float) -> ca.Function:
    """(y, h, d) -> signs of det W and of the same for a tiny step, which only algebraic rows have.

    Where they differ, a mode grows faster than exp(t / (gamma h)), which an L-stable method of this
    step only damps away.
    """
    h, lu = _factors(system, gamma)
    rows = system.algebraic[0]
    if {row for row, _ in lu.order[: len(rows)]} == set(rows):
        tiny = lu.sign(len(rows))
    else:
        matrix = ca.densify(system.mass)
        matrix[rows, :] = -system.J[rows, :]
        tiny = factorise(ca.sparsify(matrix), system.pivots).sign()
    return ca.Function("signs", [system.y, h, system.d], [lu.sign(), tiny], {"cse": True})


@lru_cache(maxsize=2)
def _factors(system: System, gamma: float) -> tuple[ca.SX, SymbolicLU]:
    """Symbol of the step h, and factors of W."""
    h = ca.SX.sym("h")
    W = ca.sparsify(system.mass / (gamma * h) - system.J)
    return h, factorise(W, system.pivots)
