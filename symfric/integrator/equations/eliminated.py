"""Algebraic unknowns of a mechanism as functions of its states, where they are linear.

Accelerations and multipliers of a mechanism without friction from its reactions obey

    0 = g(x, z) = G(x) z + g(x, 0),        z = -G(x)^-1 g(x, 0)

so that an explicit method may evaluate x' as if there were none of them.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import final

import casadi as ca

from symfric.integrator.equations.lu import factorise
from symfric.integrator.equations.system import System


@final
@dataclass(frozen=True, eq=False)
class Eliminated:
    """A system with its algebraic unknowns solved for.

    Attributes:
        settle: (y, d) -> y with the algebraic unknowns that belong to its states.
        rates: (y, d) -> f, zero in the algebraic rows.
    """

    settle: ca.Function
    rates: ca.Function


@lru_cache(maxsize=2)
def eliminated(system: System) -> Eliminated | None:
    """`system` without algebraic unknowns; None where they are not linear, or pivots not known.

    A singular G gives numbers that are not finite, which no step accepts.
    """
    rows, columns = system.algebraic
    groups = [[rows.index(i) for i in group if i in rows] for group in system.pivots]
    if not system.is_semi_explicit or rows != columns or sum(map(len, groups)) < len(rows):
        return None
    y, d, z = system.y, system.d, system.y[columns]
    G = ca.sparsify(ca.jacobian(system.f[rows], z))
    if ca.depends_on(G, z):
        return None
    lu, right = factorise(G, groups), ca.SX.sym("right", len(rows))
    solve = ca.Function("eliminate", [lu.packed_symbol, right], [lu.solve(right)])
    settled, rates = ca.SX(y), ca.SX(system.f)
    settled[columns] = solve(lu.packed, -ca.substitute(system.f[rows], z, ca.SX.zeros(len(rows))))
    rates[rows] = 0
    return Eliminated(
        system.in_steps(ca.Function("settle", [y, d], [settled], {"cse": True})),
        system.in_steps(ca.Function("rates", [y, d], [rates], {"cse": True})),
    )
