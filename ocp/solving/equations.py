"""Linear equations of the optimality conditions: solution, condition number, second order.

    [H  A'] [dw  ]   [r]
    [A  0 ] [dlam] = [s]

Source: Nocedal and Wright, Numerical Optimization, 2006, 16.1 (second-order conditions).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, final

import numpy as np
import scipy.sparse as sp
from scipy.sparse import linalg

from ocp.formulation.phase import Array
from ocp.solving.optimum import Sparse

SOFT, TINY = 1e-11, 1e-14
"""Regularisation of dependent conditions and of a Hessian without curvature, whose effect iterative
refinement removes."""
ROUNDS = 5
SINGULAR = 1e-5
"""Largest relative residual of the linear equations."""
UNSOLVABLE = 1e13
"""Condition number above which the linear equations have no unique solution if second-order
conditions are not met."""
PENALTIES, FLAT = (1e6, 1e7, 1e8), 1e-14
"""Weights of A'A in the test of second-order conditions, and least pivot in multiples of them."""
RUIZ, ITERATIONS = 10, 6
"""Numbers of scalings of the linear equations, and of inverse iterations."""


@final
@dataclass(frozen=True, eq=False)
class KktEquations:
    """Equations with the Hessian H (n, n) of the Lagrangian and the Jacobian A (m, n)."""

    H: Sparse
    A: Sparse

    @cached_property
    def scales(self) -> Array:
        """Factors of rows and columns with which the largest entry of each row is about 1.

        Results then do not depend on units and nominal values.

        Source: Ruiz, A scaling algorithm to equilibrate both rows and columns norms in matrices,
        RAL-TR-2001-034.
        """
        K = abs(sp.bmat([[self.H, self.A.T], [self.A, None]], format="csr"))
        scales = np.ones(K.shape[0])
        for _ in range(RUIZ if scales.size else 0):
            scaled = sp.diags(scales) @ K @ sp.diags(scales)
            largest = scaled.max(axis=1).toarray().ravel()
            scales /= np.sqrt(np.where(largest > 0.0, largest, 1.0))
        return scales

    @cached_property
    def blocks(self) -> tuple[Sparse, Sparse]:
        """Scaled H and A."""
        n = self.H.shape[0]
        columns, rows = sp.diags(self.scales[:n]), sp.diags(self.scales[n:])
        return columns @ self.H @ columns, rows @ self.A @ columns

    @cached_property
    def matrix(self) -> Sparse:
        """Scaled matrix of the linear equations."""
        H, A = self.blocks
        return sp.bmat([[H, A.T], [A, None]], format="csc")

    @cached_property
    def factors(self) -> Any:
        """LU factors of the slightly regularised scaled matrix; None if it is singular."""
        soft = np.append(np.full(self.H.shape[0], TINY), np.full(self.A.shape[0], -SOFT))
        try:
            return linalg.splu(sp.csc_matrix(self.matrix + sp.diags(soft)))
        except RuntimeError:
            return None

    def solved(self, right: Array) -> Array | None:
        """Return the solution of the linear equations, or None if there is no unique one."""
        right = right * self.scales
        found, size, rest = np.zeros(right.size), float(np.abs(right).max(initial=0.0)), right
        unique = self.sufficient or self.number < UNSOLVABLE
        for _ in range(ROUNDS if unique else 0):  # iterative refinement
            found = found + self.factors.solve(rest)
            rest = right - self.matrix @ found
            if not np.isfinite(rest).all():
                return None
            if np.abs(rest).max(initial=0.0) <= 1e-12 * size:
                break
        small = np.abs(rest).max(initial=0.0) <= SINGULAR * size
        return self.scales * found if small else None

    @cached_property
    def number(self) -> float:
        """Estimated condition number of the scaled linear equations; inf if they are singular.

        Inverse iterations start from fixed random numbers, which no direction of interest avoids.
        """
        if self.factors is None:
            return np.inf
        x, size = np.random.default_rng(0).standard_normal(self.matrix.shape[0]), 1.0
        for _ in range(ITERATIONS if x.size else 0):
            x = self.factors.solve(x / np.linalg.norm(x))
            size = float(np.linalg.norm(x))
        return size * float(linalg.norm(self.matrix, 1)) if np.isfinite(size) else np.inf

    @cached_property
    def sufficient(self) -> bool:
        """True if the Hessian H is positive definite on the active conditions A.

        This holds if H + r A'A is positive definite for some r. Nearly dependent conditions require
        a large r, and the rounding of the pivots is proportional to r.
        """
        H, A = self.blocks
        return any(_positive(H + r * (A.T @ A), FLAT * r) for r in PENALTIES)


def _positive(matrix: Sparse, least: float) -> bool:
    """Return True if the pivots of LDL' of a symmetric matrix are larger than `least`."""
    if not matrix.shape[0]:
        return True
    try:
        lu = linalg.splu(
            sp.csc_matrix(matrix), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )  # fmt: skip
    except RuntimeError:
        return False
    return bool((lu.perm_r == lu.perm_c).all() and (lu.U.diagonal() > least).all())
