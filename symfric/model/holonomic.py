"""Structure of a mechanical model beyond its equations."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, final

import casadi as ca

from symfric.foundation.packed import state_of


@final
@dataclass(frozen=True, eq=False)
class Inner:
    """Equations with inner unknowns l, so that each equation depends on few unknowns.

        0 = f(y, l),   l_k = g_k(y, l_1 ... l_{k-1})

    Attributes:
        l: SX symbols (k, 1) of the inner unknowns.
        values: SX (k, 1), the expressions g.
        f: SX, the residual f in terms of l.
        groups: symbols of all unknowns, including l, in the best order of elimination.
    """

    l: ca.SX  # noqa: E741
    values: ca.SX
    f: ca.SX
    groups: tuple[ca.SX, ...]


@final
@dataclass(frozen=True, eq=False)
class Solving:
    """Solution M^-1 r, SX (n, 1), as an expression in the symbols r, SX (n, 1)."""

    r: ca.SX
    result: ca.SX

    def __call__(self, r: ca.SX) -> ca.SX:
        """Return M^-1 r."""
        return ca.substitute(self.result, self.r, ca.densify(r))


@final
@dataclass(frozen=True, eq=False)
class Holonomic:
    """Structure of a mechanical model beyond its equations: constraints on its coordinates.

    The states of the model begin with the coordinates q and their rates q', and the algebraic
    variables with the multipliers lam of the constraints phi(q, t) = 0. The accelerations a are
    symbols, so that the mass matrix need not be inverted:

        M a + phi_q' lam = Q,   d^2 phi / dt^2 = phi_q a + ... = 0,   further algebraic equations

    `ode` and `alg` of the model are derived from these equations by elimination of a.

    Attributes:
        n: number of coordinates.
        phi: SX (m, 1), the constraints; without rows for a tree.
        a: SX symbols (n, 1) of the accelerations.
        implicit: SX (n + nz, 1), the equations above in q, q', the other states, a, z, u, p, t;
            the first n are affine in a.
        rates: SX (nx - 2 n, 1), rates of the other states.
        solve: function that applies M^-1 to a column, if this costs less than factorising M.
        norms: number of multipliers, the last ones, that belong to norms of Euler parameters; they
            carry no load, and error control ignores them.
        index: 0 for integration in the tangent space of the constraints, with as many unknowns as
            degrees of freedom; 1 for integration of all coordinates, which are projected onto the
            constraints at the end of each step. Both solutions agree within the tolerance.
        inner: the same equations with inner unknowns for long chains, which make the derivatives
            sparse; None for all other mechanisms.
        pressing: SX (k, 1), normal forces divided by their typical magnitude, which must not be
            negative.
        pressed: names of these normal forces.
        advice: hint that is shown if friction and reactions have no solution; may be empty.
        applied: number of algebraic variables that are forces in stick. They follow the
            multipliers, and their equations follow the constraints.
    """

    n: int
    phi: ca.SX
    a: ca.SX
    implicit: ca.SX
    rates: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    solve: Callable[[ca.SX], ca.SX] | None = None
    norms: int = 0
    index: int = 1
    inner: Inner | None = None
    pressing: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    pressed: tuple[str, ...] = ()
    advice: str = ""
    applied: int = 0

    def to_pack(self) -> dict[str, Any]:
        """Return the fields and derived expressions, with `solve` converted to an expression."""
        state = state_of(self)
        if self.solve is not None:
            right = ca.SX.sym("right", self.n)
            state["solve"] = Solving(right, self.solve(right))
        return state | {"explicit": self.explicit}

    @cached_property
    def explicit(self) -> tuple[ca.SX, ca.SX]:
        """Accelerations (n, 1) and algebraic equations (nz, 1) without the symbols a."""
        balance, others = self.implicit[: self.n, 0], self.implicit[self.n :, 0]
        right = -ca.substitute(balance, self.a, ca.SX.zeros(self.n))
        if self.solve is None:
            D, L, order = ca.ldl(ca.jacobian(balance, self.a))
            acceleration = ca.ldl_solve(ca.densify(right), D, L, order)
        else:
            acceleration = self.solve(right)
        return acceleration, ca.substitute(others, self.a, acceleration)
