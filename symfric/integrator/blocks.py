"""The Functions an implicit step is made of: with SX they inline, with MX they stay calls."""

from dataclasses import dataclass
from typing import final

import casadi as ca

from symfric.integrator.lu import factorise
from symfric.integrator.system import System


@final
@dataclass(frozen=True, eq=False)
class Blocks:
    """Right-hand side, iteration matrix W = M/(gamma h) - J and solutions with it.

    Attributes:
        f: (y, d) -> right-hand side.
        factor: (y, h, d) -> factors of W.
        solve: (factors, right, memory) -> k with W k = right + M memory.
        orientation: (y, h, d) -> sign of det W relative to that of a tiny step.
    """

    f: ca.Function
    factor: ca.Function
    solve: ca.Function
    orientation: ca.Function


def blocks(system: System, gamma: float) -> Blocks:
    """The blocks of a method with the diagonal coefficient `gamma`."""
    h = ca.SX.sym("h")
    right, memory = ca.SX.sym("right", system.n), ca.SX.sym("memory", system.n)
    J = system.J
    W = ca.sparsify(system.mass / (gamma * h) - J)
    lu = factorise(W, system.pivots)
    tiny, rows = ca.densify(system.mass), system.algebraic[0]
    tiny[rows, :] = -J[rows, :]
    reference = factorise(ca.sparsify(tiny), system.pivots).sign()
    return Blocks(
        ca.Function("f", [system.y, system.d], [system.f], {"cse": True}),
        ca.Function("factor", [system.y, h, system.d], [lu.packed], {"cse": True}),
        ca.Function(
            "solve", [lu.packed_symbol, right, memory], [lu.solve(right + system.mass @ memory)]
        ),
        ca.Function("orientation", [system.y, h, system.d], [lu.sign() * reference], {"cse": True}),
    )
