"""Radau IIA collocation: nodes, slopes of the interpolating polynomial, quadrature weights."""

from dataclasses import dataclass
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
class Radau:
    """Coefficients of Radau IIA collocation on [0, 1].

    A state is the polynomial through the nodes 0 = s_0 < s_1 < ... < s_d = 1,

        x(s) = sum_r l_r(s) x_r,    x'(s_j) = sum_r slopes[r, j-1] x_r = h f(x_j),  j = 1 ... d

    and an integral is sum_j weights[j-1] L(x_j). The last node is the end of the interval, so
    neighbouring intervals share it and need no continuity equations; the method is L-stable.

    Attributes:
        nodes: s_0 ... s_d, shape (d + 1,).
        slopes: l_r'(s_j), shape (d + 1, d).
        weights: shape (d,).

    Limits: order 2 d - 1 at the ends of the intervals, where the solution is smooth.
    Source: Hairer and Wanner, Solving Ordinary Differential Equations II, IV.5; slopes by the
        barycentric formula of Berrut and Trefethen, SIAM Review 46(3), 2004, 501-517.
    """

    nodes: Array
    slopes: Array
    weights: Array

    @property
    def degree(self) -> int:
        """Number of collocation points d."""
        return self.weights.size

    @property
    def order(self) -> int:
        """Order of the solution at the interval ends."""
        return 2 * self.degree - 1


def radau(degree: int) -> Radau:
    """The Radau IIA coefficients with `degree` points.

    Raises:
        ValueError: degree is not in 1 ... 9.
    """
    degree = checks.count("radau: degree", degree, most=MAX_DEGREE)
    points = np.array(ca.collocation_points(degree, "radau"))  # zeros of P_d - P_(d-1)
    nodes = np.concatenate([[0.0], points])
    moments = np.eye(degree)[0]  # of the shifted Legendre polynomials over [0, 1]
    weights = np.linalg.solve(legendre.legvander(2 * points - 1, degree - 1).T, moments)
    return Radau(nodes, _slopes(nodes)[:, 1:], weights)


def _slopes(nodes: Array) -> Array:
    """l_r'(s_j) at row r, column j."""
    gaps = nodes[:, None] - nodes[None, :]
    np.fill_diagonal(gaps, 1.0)
    products = gaps.prod(axis=1)
    slopes = products[None, :] / products[:, None] / gaps.T
    np.fill_diagonal(slopes, 0.0)
    np.fill_diagonal(slopes, -slopes.sum(axis=0))  # a constant has no slope
    return slopes
