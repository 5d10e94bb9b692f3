"""How a motion is put on a mesh: collocation after Radau or Gauss-Legendre, or shooting."""

from dataclasses import dataclass
from functools import cache
from typing import final

import casadi as ca
import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from symfric.foundation import checks

Array = NDArray[np.float64]
MAX_DEGREE = 9


@final
@dataclass(frozen=True, eq=False)
class Coefficients:
    """Collocation on one interval [0, 1].

    A state is the polynomial through s_0 = 0 < s_1 < ... < s_d <= 1,

        x(s) = sum_r l_r(s) x_r,    x'(s_j) = sum_r slopes[r, j-1] x_r = h f(x_j),  j = 1 ... d,

    an integral is sum_j weights[j-1] L(x_j), and the interval ends with x(1) = sum_r ends[r] x_r.

    Attributes:
        nodes: s_0 ... s_d, shape (d + 1,).
        slopes: l_r'(s_j), shape (d + 1, d).
        weights: shape (d,).
        ends: l_r(1), shape (d + 1,).
        inner_ends: values at 1 of the polynomials through s_1 ... s_d, which carry the algebraic
            variables, shape (d,).
    """

    nodes: Array
    slopes: Array
    weights: Array
    ends: Array
    inner_ends: Array

    @property
    def degree(self) -> int:
        """Number of collocation points d."""
        return self.weights.size

    @property
    def meets_end(self) -> bool:
        """Whether the last collocation point is the end of the interval."""
        return bool(self.nodes[-1] == 1.0)


@final
@dataclass(frozen=True)
class Radau:
    """Radau IIA collocation with `degree` points: L-stable, order 2 d - 1 at the nodes.

    Limits: the order holds where the solution is smooth.
    Source: Hairer and Wanner, Solving Ordinary Differential Equations II, IV.5.

    Raises:
        ValueError: degree is not in 1 ... 9.
    """

    degree: int = 3

    def __post_init__(self) -> None:
        degree = checks.count("Radau: degree", self.degree, most=MAX_DEGREE)
        object.__setattr__(self, "degree", degree)

    @property
    def order(self) -> int:
        """Order of the solution at the nodes of the mesh."""
        return 2 * self.degree - 1

    def coefficients(self) -> Coefficients:
        """What defines the method on an interval."""
        return _collocation("radau", self.degree)


@final
@dataclass(frozen=True)
class Legendre:
    """Gauss-Legendre collocation with `degree` points: order 2 d at the nodes, conserves energy.

    Limits: A-stable, not L-stable: what is stiff rings from interval to interval. The end of an
    interval is no collocation point: algebraic variables there are extrapolated.
    Source: Hairer and Wanner, Solving Ordinary Differential Equations II, IV.5.

    Raises:
        ValueError: degree is not in 1 ... 9.
    """

    degree: int = 3

    def __post_init__(self) -> None:
        degree = checks.count("Legendre: degree", self.degree, most=MAX_DEGREE)
        object.__setattr__(self, "degree", degree)

    @property
    def order(self) -> int:
        """Order of the solution at the nodes of the mesh."""
        return 2 * self.degree

    def coefficients(self) -> Coefficients:
        """What defines the method on an interval."""
        return _collocation("legendre", self.degree)


@final
@dataclass(frozen=True)
class Shooting:
    """Multiple shooting: each interval is `steps` equal steps of a method of `symfric.flow`.

    "exponential" passes through stiff bristles, where collocation points do not converge.

    Limits: bounds and path conditions hold at the nodes of the mesh only, and they cannot name
    algebraic variables: these are inside of the steps. Second derivatives of steps that solve
    equations are dear: of an arm with six joints fifty times those of collocation.

    Raises:
        ValueError: unknown method, fewer than one step.
    """

    method: str = "rodas5p"
    steps: int = 2

    def __post_init__(self) -> None:
        from symfric.integrator.methods.tableaux import METHODS  # noqa: PLC0415  (of shooting only)

        checks.choice("Shooting: method", self.method, METHODS)
        object.__setattr__(self, "steps", checks.count("Shooting: steps", self.steps))

    def coefficients(self) -> Coefficients:
        """No point inside of an interval, whose end is none of a polynomial."""
        none = np.zeros(0)
        return Coefficients(np.zeros(1), np.zeros((1, 0)), none, np.zeros(1), none)


Scheme = Radau | Legendre | Shooting


@cache
def _collocation(kind: str, degree: int) -> Coefficients:
    points = np.array(ca.collocation_points(degree, kind))
    nodes = np.concatenate([[0.0], points])
    moments = np.eye(degree)[0]  # of the shifted Legendre polynomials over [0, 1]
    weights = np.linalg.solve(legendre.legvander(2 * points - 1, degree - 1).T, moments)
    return Coefficients(nodes, _slopes(nodes)[:, 1:], weights, _at_end(nodes), _at_end(points))


def _slopes(nodes: Array) -> Array:
    """l_r'(s_j) at row r, column j, by the barycentric formula.

    Source: Berrut and Trefethen, SIAM Review 46(3), 2004, 501-517.
    """
    gaps = nodes[:, None] - nodes[None, :]
    np.fill_diagonal(gaps, 1.0)
    products = gaps.prod(axis=1)
    slopes = products[None, :] / products[:, None] / gaps.T
    np.fill_diagonal(slopes, 0.0)
    np.fill_diagonal(slopes, -slopes.sum(axis=0))  # a constant has no slope
    return slopes


def _at_end(nodes: Array) -> Array:
    """l_r(1); exactly a unit vector where 1 is a node."""
    gaps = nodes[:, None] - nodes[None, :]
    np.fill_diagonal(gaps, 1.0)
    factors = np.tile(1.0 - nodes, (nodes.size, 1))
    np.fill_diagonal(factors, 1.0)
    return np.prod(factors, axis=1) / np.prod(gaps, axis=1)
