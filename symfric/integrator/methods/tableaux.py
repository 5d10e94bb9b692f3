"""Radau IIA collocation, and all methods by their public names (coefficients: `tableaux.toml`)."""

import tomllib
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np

from symfric.foundation import checks
from symfric.foundation.numeric import reciprocal
from symfric.integrator.equations.blocks import at_rest, blocks
from symfric.integrator.equations.matrices import Factors, factorise
from symfric.integrator.equations.system import System
from symfric.integrator.methods.families import (
    BackwardEuler,
    Explicit,
    Exponential,
    Rosenbrock,
)
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


def _array(rows: list[Any]) -> Array:
    """Return a vector, or a matrix whose short rows are filled with zeros."""
    if rows and isinstance(rows[0], list):
        width = len(rows[-1]) + (not rows[0])
        return np.array([_array(row).tolist() + [0.0] * (width - len(row)) for row in rows])
    return np.array([Fraction(value) for value in rows], dtype=float)


def shampine(b: Array, D: Array) -> Array:
    """Return the coefficients H of the quartic that has the slopes k_1 and k_s at its ends.

    With the increment r = sum_j b_j k_j and the free term q = sum_j D_j k_j, the quartic is

        y_0 + theta [r + (1 - theta) (k_1 - r + theta (2 r - k_1 - k_s + (1 - theta) q))]

    D = 0 gives the cubic of Hermite, which has two rows.
    """
    first, last = np.eye(b.size)[[0, -1]]
    rows = [first - b, 2 * b - first - last + D, -D]
    return np.array(rows if D.any() else rows[:2])


def through(c: Array) -> Array:
    """Return the coefficients H of the polynomial through 0 and the increments at nodes c.

    The last node is 1.
    """
    inner, rows = c[:-1], np.eye(c.size)
    values = (rows[:-1] - inner[:, None] * rows[-1]) / (inner * (1 - inner))[:, None]
    vandermonde: Array = np.vander(inner, increasing=True)
    return np.linalg.solve(vandermonde, values)


def _explicit(A: Array, D: Array, **fields: Any) -> Explicit:
    """Return an explicit method whose dense output has the free term with the increments D."""
    return Explicit(A=A, H=shampine(A[-1], D), **fields)


def _read(family: Any, key: str) -> Any:
    """Return the method `key` of `tableaux.toml`."""
    fields = _TABLEAUX[key].items()
    return family(**{k: _array(v) if isinstance(v, list) else v for k, v in fields})


_TABLEAUX = tomllib.loads(Path(__file__).with_name("tableaux.toml").read_text("utf-8"))
_NODES = np.array([(4 - np.sqrt(6.0)) / 10, (4 + np.sqrt(6.0)) / 10, 1.0])
_POWERS = _NODES[:, None] ** np.arange(1, 4) / np.arange(1, 4)

RODAS5P: Rosenbrock = _read(Rosenbrock, "rodas5p")
DOPRI5: Explicit = _read(_explicit, "dopri5")
RADAU5 = Radau(
    name="Radau5",
    A=_POWERS @ np.linalg.inv(np.vander(_NODES, increasing=True)),
    E=np.array([-(13 + 7 * np.sqrt(6.0)) / 3, (-13 + 7 * np.sqrt(6.0)) / 3, -1 / 3]),
    H=through(_NODES),
    iterations=3,
    more=1,
    order=5,
    embedded=3,
    dense=4,
    dense_dae=4,
    source="Hairer and Wanner, Solving Ordinary Differential Equations II, IV.5 and IV.8, 1996",
)
_NODES_9 = nodes(5)
_MATRIX_9 = collocation(_NODES_9)
RADAU9 = Radau(
    name="Radau9",
    A=_MATRIX_9,
    E=error_weights(_NODES_9, _MATRIX_9),
    H=through(_NODES_9),
    iterations=5,
    more=3,
    order=9,
    embedded=5,
    dense=6,
    dense_dae=6,
    source="Hairer and Wanner, Stiff differential equations solved by Radau methods, "
    "J. Comp. Appl. Math. 111, 1999",
)
FOR_DERIVATIVES = replace(RADAU5, finer=8.0)
"""Method for derivatives of runs.

A step across the whole steep part of a law gives the right motion, but a wrong derivative. Limiting
steps to half the width of that part takes a quarter more steps, and reduces the error of
derivatives of a pump at rtol 1e-6 from 6e-3 to 1.5e-4. Derivatives by Rodas5P have twenty times the
error of Rodas5P itself.
"""
BACKWARD_EULER = BackwardEuler(
    name="backward Euler",
    iterations=4,
    order=1,
    source="Hairer and Wanner, Solving Ordinary Differential Equations II, IV.3, 1996",
)
EXPONENTIAL = Exponential(
    name="exponential Euler",
    order=1,
    source="Hochbruck and Ostermann, Exponential integrators, Acta Numerica 19, 2010",
)

METHODS: dict[str, Method] = {
    "rodas5p": RODAS5P,
    "rodas4p": _read(Rosenbrock, "rodas4p"),
    "rodas3": _read(Rosenbrock, "rodas3"),
    "radau5": RADAU5,
    "radau9": RADAU9,
    "dopri5": DOPRI5,
    "backward_euler": BACKWARD_EULER,
    "exponential": EXPONENTIAL,
}
"""All methods by their public names; the order test covers each of them."""
ADAPTIVE = {name: method for name, method in METHODS.items() if method.adaptive}
"""Methods with step size control, which `simulate` accepts."""


def key_of(method: Method) -> str:
    """Return the public name of `method`."""
    return next(key for key, known in METHODS.items() if known.name == method.name)


LOOSE = 1e-5
"""Relative tolerance above which whole stick phases may be missed without notice."""


def another(method: Method) -> str:
    """Return the name of an iterative formula if `method` is not iterative, and vice versa."""
    return "rodas5p" if isinstance(method, Radau) else "radau5"


def chosen(where: str, name: str, rtol: float) -> Method:
    """Return the adaptive method of this name; "auto" is Rodas5P, and Radau5 at loose tolerances.

    Raises:
        ValueError: an unknown name, or a method with fixed steps.
    """
    name = checks.choice(f"{where}: method", name, ["auto", *METHODS])
    if name in METHODS and name not in ADAPTIVE:
        raise ValueError(
            f"{where}: method: expected one with error control, one of {', '.join(ADAPTIVE)}, got "
            f"{name}, which has fixed steps; use it with flow or in the C of plants"
        )
    automatic = "radau5" if rtol > LOOSE else "rodas5p"
    return ADAPTIVE[automatic if name == "auto" else name]
