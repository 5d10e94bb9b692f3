"""Radau IIA collocation by simplified Newton iterations in the eigenbasis of its matrix."""

from dataclasses import dataclass
from functools import cached_property, lru_cache
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
class Radau(Method):
    """Radau IIA with an odd number s of stages and a fixed number of Newton iterations.

        M Z_i = h sum_j a_ij f(y_0 + Z_j),      y_1 = y_0 + Z_s

    The polynomial through y_0 and all y_0 + Z_i is the dense output. The error estimate is
    (gamma M / h - J)^-1 [f(y_0) + M sum_j (e_j / h) Z_j].

    Attributes:
        A: integrals from 0 to each node of the Lagrange polynomials through all nodes, (s, s).
        E: error weights e_j, shape (s,).
        iterations: simplified Newton iterations per step. Each gains two orders in the states and
            one in the algebraic unknowns.
        more: additional iterations of systems with algebraic unknowns.
    """

    A: Array
    E: Array
    iterations: int
    more: int

    @cached_property
    def basis(self) -> "Eigenbasis":
        """Real eigenbasis of the inverse of A."""
        return eigenbasis(self.A)

    @property
    def diagonal(self) -> float:
        """Coefficient gamma of the real block."""
        return 1 / self.basis.gamma

    def work(self, system: System) -> tuple[int, int, int]:
        """Return the numbers of right-hand sides, Jacobians and factorisations per step."""
        s = len(self.A)
        return s * (self._iterations(system) - 1) + 1, 1, (s + 1) // 2

    def _iterations(self, system: System) -> int:
        return self.iterations + self.more * bool(system.algebraic[0])

    def factors(self, system: System) -> tuple[Factors, ...]:
        """Return the factors of the real and the complex W, and of W for a tiny step."""
        others = (other.factors for other in self._pairs(system))
        return blocks(system, self.diagonal).factors, *others, at_rest(system)[1]

    def _pairs(self, system: System) -> list["Pair"]:
        """Return the complex iteration matrices."""
        basis = self.basis
        numbered = enumerate(zip(basis.alpha, basis.beta, strict=True))
        return [pair(system, alpha, beta, f"pair{k or ''}") for k, (alpha, beta) in numbered]

    def trials(self, system: System) -> Trials:
        """Return the steps of the method on `system`, iterated from 0 with the Jacobian at y_0."""
        basis, s = self.basis, len(self.A)
        block, others = blocks(system, self.diagonal), self._pairs(system)
        n, T, inverse = system.n, basis.T, np.linalg.inv(basis.T)
        # residuals of algebraic equations at the start are not errors of the step
        rates = ca.DM([float(i not in system.algebraic[0]) for i in range(n)])

        def trial(y: Any, h: Any, d: Any) -> Trial:
            kind, per_h = type(y), reciprocal(h)
            lu, lu_pairs = block.factor(y, h, d), [other.factor(y, h, d) for other in others]
            first = block.f(y, d)
            slopes, corrections = [first] * s, list[Any]()
            w = z = [kind.zeros(n)] * s
            for _ in range(self._iterations(system)):
                if corrections:
                    slopes = [block.f(y + stage, d) for stage in z]
                right = [combination(row, slopes, kind) for row in inverse]
                change = [block.solve(lu, right[0], (-basis.gamma * per_h) * w[0])]
                for k, (other, factors) in enumerate(zip(others, lu_pairs, strict=True)):
                    alpha, beta, i = basis.alpha[k], basis.beta[k], 2 * k + 1
                    turned = ca.vertcat(
                        alpha * w[i] + beta * w[i + 1], alpha * w[i + 1] - beta * w[i]
                    )
                    both = other.solve(factors, ca.vertcat(*right[i : i + 2]), -per_h * turned)
                    change += [both[:n], both[n:]]
                w = [old + new for old, new in zip(w, change, strict=True)]
                z = [combination(row, w, kind) for row in T]
                corrections.append(combination(T[-1], change, kind))
            error = block.solve(lu, rates * first, per_h * combination(self.E, z, kind))
            return Trial(y + z[-1], error, self.bends(z), tuple(corrections[-2:]))

        return trial


class Eigenbasis(NamedTuple):
    """Real block form of T^-1 A^-1 T: gamma, then [[alpha_k, beta_k], [-beta_k, alpha_k]]."""

    gamma: float
    alpha: tuple[float, ...]
    beta: tuple[float, ...]
    T: Array


def eigenbasis(A: Array) -> Eigenbasis:
    """Return the real eigenbasis of the inverse of A, which has one real eigenvalue."""
    values, vectors = np.linalg.eig(np.linalg.inv(A))
    real, order = int(np.argmin(np.abs(np.imag(values)))), np.argsort(-np.imag(values))
    upper = [int(k) for k in order[: len(A) // 2]]
    columns = [np.real(vectors[:, real])]
    for k in upper:
        columns += [np.real(vectors[:, k]), np.imag(vectors[:, k])]
    return Eigenbasis(
        float(np.real(values[real])),
        tuple(float(np.real(values[k])) for k in upper),
        tuple(float(np.imag(values[k])) for k in upper),
        np.column_stack(columns),
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


@lru_cache(maxsize=6)
def pair(system: System, alpha: float, beta: float, name: str) -> Pair:
    """Return the complex iteration matrix of `system`; `name` is that of its pivot order."""
    h, n, J, M = ca.SX.sym("h"), system.n, system.J, system.mass
    entries, per_h = ca.SX.sym("J", J.sparsity()), reciprocal(h)

    def matrix(J: ca.SX) -> ca.SX:
        diagonal, across = alpha * (M * per_h) - J, beta * (M * per_h)
        return ca.SX(ca.sparsify(ca.blockcat([[diagonal, across], [-across, diagonal]])))

    groups = [(*rows, *(n + i for i in rows)) for rows in system.pivots]
    lu = factorise(matrix(J), groups, system.orders.get(name, ()))
    right, memory = ca.SX.sym("right", 2 * n), ca.SX.sym("memory", 2 * n)
    solution = lu.solve(right + ca.diagcat(M, M) @ memory)
    factor = ca.Function("factor_pair", [system.y, h, system.d], [lu.packed], {"cse": True})
    values = ca.Function("J", [system.y, system.d], [J])
    return Pair(
        system.in_steps(factor),
        ca.Function("solve_pair", [lu.symbols, right, memory], [solution]),
        Factors(name, values, (entries, h), matrix(entries), lu.order),
    )


def nodes(s: int) -> Array:
    """Return the Radau nodes in (0, 1]: zeros of P_s - P_{s-1}, Legendre polynomials on [0, 1]."""
    difference = np.polynomial.Legendre([0.0] * (s - 1) + [-1.0, 1.0])
    slope, zeros = difference.deriv(), np.sort(np.real(difference.roots()))
    for _ in range(2):
        zeros = zeros - difference(zeros) / slope(zeros)
    return np.append((1 + zeros[:-1]) / 2, 1.0)


def collocation(c: Array) -> Array:
    """Return the integrals from 0 to each node c of the Lagrange polynomials through all nodes.

    Gauss quadrature with as many points as nodes is exact.
    """
    points, weights = np.polynomial.legendre.leggauss(c.size)
    at = c[:, None] * (1 + points) / 2
    columns: list[Array] = []
    for j, node in enumerate(c):
        others = np.delete(c, j)
        basis = np.prod((at[:, :, None] - others) / (node - others), axis=2)
        columns.append(c / 2 * (basis @ weights))
    return np.column_stack(columns)


def error_weights(c: Array, A: Array) -> Array:
    """Return the error weights e of Hairer and Wanner, IV.8.

    The quadrature with the weight gamma_0, the real eigenvalue of A, at 0 and weights b at the
    nodes has order s. With the increments Z = h A f, its difference from y_1, divided by
    gamma_0 h, is f(y_0) + sum_j (e_j / h) Z_j.
    """
    gamma_0 = 1 / eigenbasis(A).gamma
    powers = np.arange(c.size)
    moments = 1 / (powers + 1) - gamma_0 * (powers == 0)
    b = np.linalg.solve(np.vander(c, increasing=True).T, moments)
    return np.linalg.solve(A.T, b - A[-1]) / gamma_0
