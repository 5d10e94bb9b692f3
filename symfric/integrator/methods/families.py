"""Families of methods: Rosenbrock, backward Euler, explicit Runge-Kutta, exponential.

Rosenbrock methods have linearly implicit stages and one factorisation per step. Backward Euler is
solved by Newton's method, for plants in fixed steps. The others have no iteration matrix. Radau IIA
is in `tableaux.py`.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar, final

import casadi as ca

from symfric.foundation.checks import listed
from symfric.foundation.numeric import exp_phi1_phi2, reciprocal
from symfric.integrator.equations.blocks import at_rest, blocks
from symfric.integrator.equations.matrices import Factors, factorise
from symfric.integrator.equations.system import System
from symfric.integrator.methods.method import Array, Method, Trial, Trials, combination


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Rosenbrock(Method):
    """Stiffly accurate Rosenbrock method in the transformed form of Hairer and Wanner (IV.7).

    With W = M / (gamma h) - J at the start of the step,

        W k_i = f(y_0 + sum_j a_ij k_j) + M sum_j (c_ij / h) k_j,      i = 1 ... s

    y_1 is the argument of the last stage plus k_s, and k_s is the error estimate.

    Attributes:
        gamma: diagonal coefficient of all stages.
        A, C: strictly lower triangular, shape (s, s).
    """

    gamma: float
    A: Array
    C: Array

    @property
    def diagonal(self) -> float:
        """Coefficient gamma."""
        return self.gamma

    def work(self, system: System) -> tuple[int, int, int]:
        """Return the numbers of right-hand sides, Jacobians and factorisations per step."""
        return len(self.A), 1, 1

    def factors(self, system: System) -> tuple[Factors, ...]:
        """Return the factors of the iteration matrix W, and of W for a tiny step."""
        return blocks(system, self.gamma).factors, at_rest(system)[1]

    def trials(self, system: System) -> Trials:
        """Return the steps of the method on `system`."""
        block, A, C = blocks(system, self.gamma), self.A, self.C

        def trial(y: Any, h: Any, d: Any) -> Trial:
            lu, per_h = block.factor(y, h, d), reciprocal(h)
            k: list[Any] = []
            argument = y
            for i in range(len(A)):
                argument, memory = y, type(y).zeros(y.numel())
                for j in range(i):
                    if A[i, j] != 0:
                        argument = argument + A[i, j] * k[j]
                    if C[i, j] != 0:
                        memory = memory + C[i, j] * k[j]
                k.append(block.solve(lu, block.f(argument, d), memory * per_h))
            return Trial(argument + k[-1], k[-1], self.bends(k))

        return trial


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class BackwardEuler(Method):
    """Backward Euler, M (y_1 - y_0) = h f(y_1), by a fixed number of Newton iterations from y_0.

    Every iteration evaluates the Jacobian anew: if a contact changes between sticking and sliding,
    the Jacobian at the start of the step does not describe the end.
    """

    iterations: int

    def work(self, system: System) -> tuple[int, int, int]:
        """Return the numbers of right-hand sides, Jacobians and factorisations per step."""
        return self.iterations, self.iterations, self.iterations

    def factors(self, system: System) -> tuple[Factors, ...]:
        """Return the factors of the iteration matrix M / h - J."""
        return (blocks(system, 1.0).factors,)

    def trials(self, system: System) -> Trials:
        """Return the steps of the method on `system`."""
        block = blocks(system, 1.0)

        def trial(y: Any, h: Any, d: Any) -> Trial:
            end, per_h = y, 1 / h
            for _ in range(self.iterations):
                lu = block.factor(end, h, d)
                end = end + block.solve(lu, block.f(end, d), (y - end) * per_h)
            return Trial(end)

        return trial


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Explicit(Method):
    """Explicit Runge-Kutta pair.

        k_i = h f(y_0 + sum_j a_ij k_j),      i = 1 ... s

    y_1 is the argument of the last stage, and sum_j e_j k_j is the error estimate. Accelerations
    and multipliers are solved for at each stage if the equations are linear in them (`eliminated`).
    They have no error estimate, and are interpolated linearly between steps.

    Attributes:
        A: strictly lower triangular, shape (s, s).
        E: error weights e_j, shape (s,).
    """

    A: Array
    E: Array
    dae: ClassVar[bool] = False

    def work(self, system: System) -> tuple[int, int, int]:
        """Return the numbers of right-hand sides, Jacobians and factorisations per step."""
        return len(self.A), 0, 0 if system.is_ode else len(self.A)

    def trials(self, system: System) -> Trials:
        """Return the steps of the method on `system`.

        Raises:
            ValueError: a mass matrix, or algebraic unknowns other than linear ones of a mechanism.
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
    """Return (y, d) -> y with the algebraic unknowns of its states, and (y, d) -> f, zero there.

    The result is None without algebraic unknowns, or if they are not linear or lack known pivots.
    Accelerations and multipliers of a mechanism without friction from its reactions satisfy

        0 = g(x, z) = G(x) z + g(x, 0),        z = -G(x)^-1 g(x, 0)

    A singular G gives numbers that are not finite, and the step is rejected.
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
    lu = factorise(G, groups)
    solve = lu.solver("eliminate")
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
        ValueError: the system has algebraic unknowns, or a mass matrix other than the identity.
    """
    if system.is_ode:
        return
    unknown = listed(system.names[i] for i in system.algebraic[1])
    found = f"the algebraic unknowns {unknown}" if unknown else "a mass matrix"
    raise ValueError(
        f"method {method}: expected an ODE x' = f(x), got {found}; use an implicit method such as "
        "rodas5p, also for mechanisms with friction from reactions"
    )


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Exponential(Method):
    """Exponential Euler, with each equation linearised in its own unknown.

        y_i+ = y_i + h phi1(h df_i/dy_i) f_i(y)

    The method is exact if an equation is linear in its unknown and nothing else changes, however
    fast the equation is (the bristles of LuGre at a given velocity). The coupling of unknowns is
    explicit.
    """

    dae: ClassVar[bool] = False

    def work(self, system: System) -> tuple[int, int, int]:
        """Return the numbers of right-hand sides, Jacobians and factorisations per step."""
        return 1, 1, 0

    def trials(self, system: System) -> Trials:
        """Return the steps of the method on `system`.

        Raises:
            ValueError: the system has algebraic unknowns, or a mass matrix other than the identity.
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
