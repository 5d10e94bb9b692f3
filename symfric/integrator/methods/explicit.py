"""Methods without an iteration matrix: explicit Runge-Kutta pairs, and exponential Euler.

Accelerations and multipliers of a mechanism without friction from its reactions satisfy

    0 = g(x, z) = G(x) z + g(x, 0),        z = -G(x)^-1 g(x, 0)

so an explicit method can eliminate them and evaluate x' directly.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar, final

import casadi as ca
import numpy as np

from symfric.integrator.equations.matrices import factorise
from symfric.integrator.equations.system import System
from symfric.integrator.methods.method import Array, Method, Trial, Trials, combination, need_ode


@final
@dataclass(frozen=True, eq=False)
class Eliminated:
    """System with its algebraic unknowns solved for.

    Attributes:
        settle: (y, d) -> y with the algebraic unknowns of its states.
        rates: (y, d) -> f, zero in the algebraic rows.
    """

    settle: ca.Function
    rates: ca.Function


@lru_cache(maxsize=2)
def eliminated(system: System) -> Eliminated | None:
    """Return `system` without algebraic unknowns; None if they are not linear or lack known pivots.

    A singular G gives numbers that are not finite, and the step is rejected.
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


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Explicit(Method):
    """Explicit Runge-Kutta pair.

        k_i = h f(y_0 + sum_j a_ij k_j),      i = 1 ... s

    y_1 is the last stage's argument, sum_j e_j k_j the error estimate. Accelerations and
    multipliers of mechanisms without friction from reactions are solved for at each stage
    (`eliminated`): they have no error estimate, and are interpolated linearly between steps.

    Attributes:
        A: strictly lower triangular, shape (s, s).
        E: error weights, shape (s,).
    """

    A: Array
    E: Array
    dae: ClassVar[bool] = False

    @property
    def stages(self) -> int:
        """Number of stages s."""
        return self.A.shape[0]

    @property
    def diagonal(self) -> None:
        """Always None: an explicit method has no iteration matrix."""

    def work(self, system: System) -> tuple[int, int, int]:
        """Return the number of right-hand sides, Jacobians and factorisations of a step."""
        return self.stages, 0, 0 if system.is_ode else self.stages

    def trials(self, system: System) -> Trials:
        """Return its steps on a system.

        Raises:
            ValueError: algebraic unknowns other than those of a mechanism in which they are
                linear, or a mass matrix.
        """
        linear = None if system.is_ode else eliminated(system)
        if linear is not None:
            return self._eliminating(linear)
        need_ode(system, self.name)
        f = system.in_steps(ca.Function("f", [system.y, system.d], [system.f], {"cse": True}))

        def trial(y: Any, h: Any, d: Any) -> Trial:
            k: list[Any] = []
            argument = y
            for i in range(self.stages):
                argument = y + combination(self.A[i, :i], k, type(y))
                k.append(h * f(argument, d))
            dense = tuple(combination(row, k, type(y)) for row in self.H)
            return Trial(argument, combination(self.E, k, type(y)), dense)

        return trial

    def _eliminating(self, linear: Eliminated) -> Trials:
        """Return its steps on states, with algebraic unknowns solved for at each stage."""

        def trial(y: Any, h: Any, d: Any) -> Trial:
            k: list[Any] = []
            argument = y
            for i in range(self.stages):
                argument = linear.settle(y + combination(self.A[i, :i], k, type(y)), d)
                k.append(h * linear.rates(argument, d))
            dense = tuple(combination(row, k, type(y)) for row in self.H)
            return Trial(argument, combination(self.E, k, type(y)), dense)

        return trial


def shampine(b: Array, D: Array) -> Array:
    """Return the coefficients H of the quartic with the slopes k_1 and k_s at its ends.

    With the increment r = sum_j b_j k_j and the free term q = sum_j D_j k_j it is

        y_0 + theta [r + (1 - theta) (k_1 - r + theta (2 r - k_1 - k_s + (1 - theta) q))]
    """
    first, last = np.eye(b.size)[[0, -1]]
    return np.array([first - b, 2 * b - first - last + D, -D])


SMALL = 1e-2
"""Below this |x| the series replaces the quotient; its next term is 4e-14 of the sum."""


def phi1_phi2(x: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return phi1 = (exp(x) - 1) / x and phi2 = (phi1 - 1) / x, element by element.

    Value and derivatives are correct at zero, too.

    They are the weights of the rate in the end value and in the mean of a solution of
    dz/dt = a + b z over a step: z(h) = z + h phi1(b h) dz/dt, mean z = z + h phi2(b h) dz/dt.
    One series serves both: phi1 = 1 + x phi2.
    """
    _, phi1, phi2 = exp_phi1_phi2(x)
    return phi1, phi2


def exp_phi1_phi2(x: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return exp and the functions of `phi1_phi2` with one call of expm1; exp is 0 far below zero.

    The error of exp is one unit in the last place of 1, not of exp itself.
    """
    near = ca.fabs(x) < SMALL
    divisor, beyond = ca.if_else(near, 1.0, x), ca.expm1(x)
    quotient = beyond / divisor
    series = 1 / 2 + x * (1 / 6 + x * (1 / 24 + x * (1 / 120 + x * (1 / 720))))
    phi2 = ca.if_else(near, series, (quotient - 1) / divisor)
    phi1 = ca.if_else(near, 1 + x * phi2, quotient)
    return ca.if_else(near, 1 + x * phi1, 1 + beyond), phi1, phi2


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Exponential(Method):
    """Exponential Euler, each equation linearised in its own unknown.

        y_i+ = y_i + h phi1(h df_i/dy_i) f_i(y)

    It is exact if an equation is linear in its unknown and nothing else changes, however fast it is
    (the bristles of LuGre at a given velocity); the coupling of unknowns is explicit.
    """

    dae: ClassVar[bool] = False

    @property
    def diagonal(self) -> None:
        """Always None: the exponential of h J takes the place of W."""

    def work(self, system: System) -> tuple[int, int, int]:
        """Return the number of right-hand sides, Jacobians (their diagonals) and factorisations
        of a step.
        """
        return 1, 1, 0

    def trials(self, system: System) -> Trials:
        """Return its steps on a system.

        Raises:
            ValueError: algebraic unknowns, or a mass matrix other than the identity.
        """
        need_ode(system, self.name)
        h = ca.SX.sym("h")
        slope = ca.diag(ca.jacobian(system.f, system.y))
        weights = [
            phi1_phi2(h * slope[i])[0] if slope.sparsity().has_nz(i, 0) else ca.SX(1)
            for i in range(system.n)
        ]
        end = system.y + h * ca.vertcat(*weights) * system.f
        advance = ca.Function("advance", [system.y, h, system.d], [end], {"cse": True})

        def trial(y: Any, h: Any, d: Any) -> Trial:
            return Trial(advance(y, h, d))

        return trial
