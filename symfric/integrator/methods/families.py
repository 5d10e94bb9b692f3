"""Families of methods: Rosenbrock, Radau IIA, backward Euler, explicit Runge-Kutta, exponential.

Rosenbrock methods have linearly implicit stages and one factorisation per step. Radau IIA
collocation is solved by simplified Newton iterations in the eigenbasis of its matrix. Backward
Euler is solved by Newton's method, for plants in fixed steps. The others have no iteration matrix.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar, NamedTuple, final

import casadi as ca
import numpy as np

from symfric.foundation.checks import listed
from symfric.foundation.numeric import reciprocal
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
class Radau(Method):
    """Radau IIA with three stages and a fixed number of Newton iterations.

        M Z_i = h sum_j a_ij f(y_0 + Z_j),      y_1 = y_0 + Z_3

    The polynomial through y_0 and all y_0 + Z_i is the dense output. The error estimate is
    (gamma M / h - J)^-1 [f(y_0) + M sum_j (e_j / h) Z_j].

    Attributes:
        c: nodes, shape (3,).
        E: error weights e_j, shape (3,).
        iterations: simplified Newton iterations per step. Each gains two orders in the states and
            one in the algebraic unknowns; systems with algebraic unknowns get one more.
    """

    c: Array
    E: Array
    iterations: int

    @property
    def A(self) -> Array:
        """Integrals from 0 to each node of the Lagrange polynomials through all nodes."""
        powers = np.arange(1, self.c.size + 1)
        moments: Array = self.c[:, None] ** powers / powers
        vandermonde: Array = np.vander(self.c, increasing=True)
        return moments @ np.linalg.inv(vandermonde)

    @property
    def diagonal(self) -> float:
        """Coefficient gamma of the real block."""
        return 1 / eigenbasis(self.A).gamma

    def work(self, system: System) -> tuple[int, int, int]:
        """Return the numbers of right-hand sides, Jacobians and factorisations per step."""
        return 3 * self._iterations(system) - 2, 1, 2

    def _iterations(self, system: System) -> int:
        return self.iterations + bool(system.algebraic[0])

    def factors(self, system: System) -> tuple[Factors, ...]:
        """Return the factors of the real and the complex W, and of W for a tiny step."""
        basis = eigenbasis(self.A)
        own = blocks(system, self.diagonal).factors, pair(system, basis.alpha, basis.beta).factors
        return *own, at_rest(system)[1]

    def trials(self, system: System) -> Trials:
        """Return the steps of the method on `system`, iterated from 0 with the Jacobian at y_0."""
        basis = eigenbasis(self.A)
        block, other = blocks(system, self.diagonal), pair(system, basis.alpha, basis.beta)
        n, T, inverse = system.n, basis.T, np.linalg.inv(basis.T)
        # residuals of algebraic equations at the start are not errors of the step
        rates = ca.DM([float(i not in system.algebraic[0]) for i in range(n)])

        def trial(y: Any, h: Any, d: Any) -> Trial:
            kind, per_h = type(y), reciprocal(h)
            lu, lu_pair = block.factor(y, h, d), other.factor(y, h, d)
            first = block.f(y, d)
            slopes, corrections = [first] * 3, list[Any]()
            w = z = [kind.zeros(n)] * 3
            for _ in range(self._iterations(system)):
                if corrections:
                    slopes = [block.f(y + stage, d) for stage in z]
                right = [combination(row, slopes, kind) for row in inverse]
                real = block.solve(lu, right[0], (-basis.gamma * per_h) * w[0])
                turned = ca.vertcat(
                    basis.alpha * w[1] + basis.beta * w[2], basis.alpha * w[2] - basis.beta * w[1]
                )
                both = other.solve(lu_pair, ca.vertcat(*right[1:]), -per_h * turned)
                change = [real, both[:n], both[n:]]
                w = [old + new for old, new in zip(w, change, strict=True)]
                z = [combination(row, w, kind) for row in T]
                corrections.append(combination(T[-1], change, kind))
            error = block.solve(lu, rates * first, per_h * combination(self.E, z, kind))
            return Trial(y + z[-1], error, self.bends(z), tuple(corrections[-2:]))

        return trial


class Eigenbasis(NamedTuple):
    """Real block form T^-1 A^-1 T = [[gamma, 0, 0], [0, alpha, beta], [0, -beta, alpha]]."""

    gamma: float
    alpha: float
    beta: float
    T: Array


def eigenbasis(A: Array) -> Eigenbasis:
    """Return the real eigenbasis of the inverse of A, which has one real eigenvalue."""
    values, vectors = np.linalg.eig(np.linalg.inv(A))
    real, upper = int(np.argmin(np.abs(np.imag(values)))), int(np.argmax(np.imag(values)))
    turning = vectors[:, upper]
    return Eigenbasis(
        float(np.real(values[real])),
        float(np.real(values[upper])),
        float(np.imag(values[upper])),
        np.column_stack([np.real(vectors[:, real]), np.real(turning), np.imag(turning)]),
    )


class Pair(NamedTuple):
    """Complex iteration matrix W = (alpha - i beta) M/h - J as a real one of twice the size.

    Attributes:
        factor: (y, h, d) -> factors of W.
        solve: (factors, right, memory) -> k with W k = right + M memory.
        factors: W and the pivot order of its factors.
    """

    factor: ca.Function
    solve: ca.Function
    factors: Factors


@lru_cache(maxsize=2)
def pair(system: System, alpha: float, beta: float) -> Pair:
    """Return the complex iteration matrix of `system`."""
    h, n, J, M = ca.SX.sym("h"), system.n, system.J, system.mass
    entries, per_h = ca.SX.sym("J", J.sparsity()), reciprocal(h)

    def matrix(J: ca.SX) -> ca.SX:
        diagonal, across = alpha * (M * per_h) - J, beta * (M * per_h)
        return ca.SX(ca.sparsify(ca.blockcat([[diagonal, across], [-across, diagonal]])))

    groups = [(*rows, *(n + i for i in rows)) for rows in system.pivots]
    lu = factorise(matrix(J), groups, system.orders.get("pair", ()))
    right, memory = ca.SX.sym("right", 2 * n), ca.SX.sym("memory", 2 * n)
    solution = lu.solve(right + ca.diagcat(M, M) @ memory)
    factor = ca.Function("factor_pair", [system.y, h, system.d], [lu.packed], {"cse": True})
    values = ca.Function("J", [system.y, system.d], [J])
    return Pair(
        system.in_steps(factor),
        ca.Function("solve_pair", [lu.symbols, right, memory], [solution]),
        Factors("pair", values, (entries, h), matrix(entries), lu.order),
    )


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


SMALL = 1e-2
"""Largest |x| at which the series replaces the quotient; its next term is 4e-14 of the sum."""


def exp_phi1_phi2(x: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return exp x, phi1 = (exp(x) - 1) / x and phi2 = (phi1 - 1) / x, element by element.

    They are the weights of the rate in the end value and in the mean of a solution of
    dz/dt = a + b z over a step: z(h) = z + h phi1(b h) dz/dt, mean z = z + h phi2(b h) dz/dt.
    Values and derivatives are also correct at zero. Far below zero, exp is 0; its error is one unit
    in the last place of 1, not of exp itself.
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
