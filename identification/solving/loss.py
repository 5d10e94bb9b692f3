"""Losses of residuals: squares, and what outliers cost less.

    minimise 1/2 sum_i C^2 rho((r_i / C)^2) = 1/2 sum_i e_i^2,   e = C sign(r) sqrt(rho((r/C)^2))

r in standard deviations of the noise, C from which on a residual counts as large. e is smooth, so
the problem stays one of least squares with exact derivatives, e' = rho' r / e.

Source: P. J. Huber, E. M. Ronchetti, Robust Statistics, 2nd ed., 2009; B. Triggs et al., Bundle
Adjustment, 2000, section 3.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

THRESHOLD = {"squares": np.inf, "huber": 1.345, "soft_l1": 1.0, "cauchy": 2.385, "arctan": 3.0}
"""Loss -> C. Of huber and cauchy that for 95 % efficiency on normal noise."""


def shaped(r: Array, loss: str) -> tuple[Array, Array]:
    """E and de/dr of residuals r in standard deviations, shape of r both."""
    C = THRESHOLD[loss]
    if loss == "squares":
        return r, np.ones_like(r)
    z = (r / C) ** 2
    rho, slope = _rho(z, loss)
    small = z < 1e-12
    e = np.where(small, np.abs(r), C * np.sqrt(np.where(small, 1.0, rho)))
    de = np.where(small, 1.0, slope * np.abs(r) / np.where(small, 1.0, e))
    return np.sign(r) * e, de


def influence(r: Array, loss: str) -> Array:
    """Weight rho' of each residual in the normal equations: 1 for small ones, shape of r."""
    if loss == "squares":
        return np.ones_like(r)
    return _rho((r / THRESHOLD[loss]) ** 2, loss)[1]


def _rho(z: Array, loss: str) -> tuple[Array, Array]:
    """rho(z) and its derivative, rho(z) = z + O(z^2)."""
    if loss == "huber":
        root = np.sqrt(np.maximum(z, 1.0))
        return np.where(z <= 1, z, 2 * root - 1), 1 / root
    if loss == "soft_l1":
        root = np.sqrt(1 + z)
        return 2 * (root - 1), 1 / root
    if loss == "cauchy":
        return np.log1p(z), 1 / (1 + z)
    return np.arctan(z), 1 / (1 + z**2)
