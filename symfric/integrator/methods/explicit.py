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

from symfric.foundation.checks import listed
from symfric.integrator.equations.matrices import factorise
from symfric.integrator.equations.system import System
from symfric.integrator.methods.method import Array, Method, Trial, Trials, combination


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

    def work(self, system: System) -> tuple[int, int, int]:
        """Return the number of right-hand sides, Jacobians and factorisations of a step."""
        return len(self.A), 0, 0 if system.is_ode else len(self.A)

    def trials(self, system: System) -> Trials:
        """Return its steps on a system.

        Raises:
            ValueError: algebraic unknowns other than those of a mechanism in which they are
                linear, or a mass matrix.
        """
        settle, rates = eliminated(system) or (None, None)
        if rates is None:
            need_ode(system, self.name)
            rates = ca.Function("f", [system.y, system.d], [system.f], {"cse": True})
            rates = system.in_steps(rates)

        def trial(y: Any, h: Any, d: Any) -> Trial:
            k: list[Any] = []
            argument = y
            for row in self.A:
                argument = y + combination(row[: len(k)], k, type(y))
                argument = argument if settle is None else settle(argument, d)
                k.append(h * rates(argument, d))
            return Trial(argument, combination(self.E, k, type(y)), self.bends(k))

        return trial


@lru_cache(maxsize=2)
def eliminated(system: System) -> tuple[ca.Function, ca.Function] | None:
    """Return `system` with its algebraic unknowns solved for.

    A singular G gives numbers that are not finite, and the step is rejected.

    Returns:
        (y, d) -> y with the algebraic unknowns of its states, and (y, d) -> f, zero in the
        algebraic rows; None if it has no such unknowns, or if they are not linear or lack known
        pivots.
    """
    rows, columns = system.algebraic
    groups = [[rows.index(i) for i in group if i in rows] for group in system.pivots]
    known = system.is_semi_explicit and rows == columns and sum(map(len, groups)) == len(rows)
    if system.is_ode or not known:
        return None
    y, d, z = system.y, system.d, system.y[columns]
    G = ca.sparsify(ca.jacobian(system.f[rows], z))
    if ca.depends_on(G, z):
        return None
    lu, right = factorise(G, groups), ca.SX.sym("right", len(rows))
    solve = ca.Function("eliminate", [lu.symbols, right], [lu.solve(right)])
    settled, rates = ca.SX(y), ca.SX(system.f)
    settled[columns] = solve(lu.packed, -ca.substitute(system.f[rows], z, ca.SX.zeros(len(rows))))
    rates[rows] = 0
    settle = ca.Function("settle", [y, d], [settled], {"cse": True})
    return system.in_steps(settle), system.in_steps(
        ca.Function("rates", [y, d], [rates], {"cse": True})
    )


def need_ode(system: System, method: str) -> None:
    """Check that a method without iteration matrix can integrate `system`.

    Raises:
        ValueError: algebraic unknowns, or a mass matrix other than the identity.
    """
    if system.is_ode:
        return
    unknown = listed(system.names[i] for i in system.algebraic[1])
    found = f"the algebraic unknowns {unknown}" if unknown else "a mass matrix"
    raise ValueError(
        f"method {method}: expected an ODE x' = f(x), got {found}; use an implicit method such as "
        "rodas5p, also for mechanisms with friction from reactions"
    )


def shampine(b: Array, D: Array) -> Array:
    """Return the coefficients H of the quartic with the slopes k_1 and k_s at its ends.

    With the increment r = sum_j b_j k_j and the free term q = sum_j D_j k_j it is

        y_0 + theta [r + (1 - theta) (k_1 - r + theta (2 r - k_1 - k_s + (1 - theta) q))]
    """
    first, last = np.eye(b.size)[[0, -1]]
    return np.array([first - b, 2 * b - first - last + D, -D])


SMALL = 1e-2
"""Below this |x| the series replaces the quotient; its next term is 4e-14 of the sum."""


def exp_phi1_phi2(x: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return exp x, phi1 = (exp(x) - 1) / x and phi2 = (phi1 - 1) / x, element by element.

    They are the weights of the rate in the end value and in the mean of a solution of
    dz/dt = a + b z over a step: z(h) = z + h phi1(b h) dz/dt, mean z = z + h phi2(b h) dz/dt.
    One series serves both: phi1 = 1 + x phi2. Values and derivatives are correct at zero, too; exp,
    from the one call of expm1, is 0 far below zero, and its error is one unit in the last place of
    1, not of exp itself.
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
            exp_phi1_phi2(h * slope[i])[1] if slope.sparsity().has_nz(i, 0) else ca.SX(1)
            for i in range(system.n)
        ]
        end = system.y + h * ca.vertcat(*weights) * system.f
        advance = ca.Function("advance", [system.y, h, system.d], [end], {"cse": True})
        return lambda y, h, d: Trial(advance(y, h, d))
