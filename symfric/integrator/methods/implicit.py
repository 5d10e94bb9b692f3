"""Methods with an iteration matrix: Rosenbrock, Radau IIA, backward Euler.

Rosenbrock methods have linearly implicit stages with one factorisation a step; Radau IIA
collocation is solved by simplified Newton iterations in the eigenbasis of its matrix; backward
Euler, by Newton's method, is for plants in fixed steps.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np

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

    y_1 is the last stage's argument plus k_s, and k_s is the error estimate.

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
        """Return the number of right-hand sides, Jacobians and factorisations of a step."""
        return len(self.A), 1, 1

    def factors(self, system: System) -> tuple[Factors, ...]:
        """Return the factors of the iteration matrix, and for a tiny step."""
        return blocks(system, self.gamma).factors, at_rest(system)[1]

    def trials(self, system: System) -> Trials:
        """Return its steps on a system."""
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
        E: error weights, shape (3,).
        iterations: simplified Newton iterations a step. Each gains two orders in the states and one
            in the algebraic unknowns, so these get one more.
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
        """Coefficient gamma of its real block."""
        return 1 / eigenbasis(self.A).gamma

    def work(self, system: System) -> tuple[int, int, int]:
        """Return the number of right-hand sides, Jacobians and factorisations (real, complex)
        of a step.
        """
        return 3 * self._iterations(system) - 2, 1, 2

    def _iterations(self, system: System) -> int:
        return self.iterations + bool(system.algebraic[0])

    def factors(self, system: System) -> tuple[Factors, ...]:
        """Return the factors of the real and the complex iteration matrix, and for a tiny step."""
        basis = eigenbasis(self.A)
        own = blocks(system, self.diagonal).factors, pair(system, basis.alpha, basis.beta).factors
        return *own, at_rest(system)[1]

    def trials(self, system: System) -> Trials:
        """Return its steps on a system.

        The increments z = T w are iterated from 0 with the Jacobian at y_0; for a linear system the
        first iteration is the solution.
        """
        basis = eigenbasis(self.A)
        block, other = blocks(system, self.diagonal), pair(system, basis.alpha, basis.beta)
        n, T, inverse = system.n, basis.T, np.linalg.inv(basis.T)
        # the residual of algebraic equations at the start of a step is not an error of the step
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
    """Complex iteration matrix (alpha - i beta) M/h - J as a real one of twice the size.

    Attributes:
        factor: (y, h, d) -> its factors.
        solve: (factors, right, memory) -> k with W k = right + M memory.
        factors: W, and the order in which it is factorised.
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


def through(c: Array) -> Array:
    """Return coefficients H of the cubic through 0 and the increments at the nodes, the last
    one 1.
    """
    inner, rows = c[:-1], np.eye(c.size)
    values = (rows[:-1] - inner[:, None] * rows[-1]) / (inner * (1 - inner))[:, None]
    vandermonde: Array = np.vander(inner, increasing=True)
    return np.linalg.solve(vandermonde, values)


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class BackwardEuler(Method):
    """Backward Euler, M (y_1 - y_0) = h f(y_1), by a fixed number of Newton iterations from y_0.

    The Jacobian is new in every iteration: if a contact changes between sticking and sliding, the
    Jacobian at the start does not describe the end.
    """

    iterations: int

    def work(self, system: System) -> tuple[int, int, int]:
        """Return the number of right-hand sides, Jacobians and factorisations of a step."""
        return self.iterations, self.iterations, self.iterations

    def factors(self, system: System) -> tuple[Factors, ...]:
        """Return the factors of the iteration matrix M / h - J."""
        return (blocks(system, 1.0).factors,)

    def trials(self, system: System) -> Trials:
        """Return its steps on a system."""
        block = blocks(system, 1.0)

        def trial(y: Any, h: Any, d: Any) -> Trial:
            end, per_h = y, 1 / h
            for _ in range(self.iterations):
                lu = block.factor(end, h, d)
                end = end + block.solve(lu, block.f(end, d), (y - end) * per_h)
            return Trial(end)

        return trial
