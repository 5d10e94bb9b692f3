"""The functions of exponential integrators, and the simplest method made of them."""

from dataclasses import dataclass
from typing import Any, ClassVar, final

import casadi as ca

from symfric.integrator.equations.system import System
from symfric.integrator.methods.method import Method, Trial, Trials, need_ode

SMALL = 1e-2
"""Below this |x| the series replaces the quotient; its next term is 4e-14 of the sum."""


def phi1_phi2(x: ca.SX) -> tuple[ca.SX, ca.SX]:
    """phi1 = (exp(x) - 1) / x and phi2 = (phi1 - 1) / x, element by element.

    Value and derivatives are right at zero, too.

    They are the weights of rate and of its effect in the end value and in the mean of a solution of
    dz/dt = a + b z over a step: z(h) = z + h phi1(b h) dz/dt, mean z = z + h phi2(b h) dz/dt.
    One series serves both: phi1 = 1 + x phi2.
    """
    _, phi1, phi2 = exp_phi1_phi2(x)
    return phi1, phi2


def exp_phi1_phi2(x: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Exp and the functions of `phi1_phi2` with one call for all; exp is 0 far below zero.

    Its error is one unit in the last place of 1, not of itself.
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

    Exact where an equation is linear in its unknown and nothing else changes, however fast it is
    (the bristles of LuGre at a given velocity); what couples the unknowns is explicit.
    """

    dae: ClassVar[bool] = False

    @property
    def diagonal(self) -> None:
        """No gamma: the exponential of h J takes the place of W."""

    def work(self, system: System) -> tuple[int, int, int]:
        """Right-hand sides, Jacobians (their diagonals) and factorisations of a step."""
        return 1, 1, 0

    def trials(self, system: System) -> Trials:
        """Its steps on a system.

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
