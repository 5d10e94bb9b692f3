"""Noise of an imposed path in the residuals of a law with states.

An error of the path changes the force by G e, with independent standard normal e. The residuals
have the covariance s^2 I + G G' and are whitened by its inverse square root, relative to s:

    G / s = U diag(c) V',    r -> r - U diag(1 - 1 / sqrt(1 + c^2)) U' r

Without whitening, this error is a slow random force along the motion, which intervals and tests
would take for an effect of the motion.
Source: generalised least squares with effective variance, J. Orear, Am. J. Phys. 50, 1982.
"""

from collections.abc import Callable
from typing import NamedTuple, final

import numpy as np

from identification.data.filters import noise_level, spectrum
from identification.residuals.evaluation import Array

STEP = 1e-2
"""Step of the differences for G, in standard deviations."""
EXACT = 1e-6
"""Least noise of a force relative to its range."""


@final
class PathNoise(NamedTuple):
    """Orthonormal directions U of the residuals, (n, m), and the share removed from each, (m,)."""

    directions: Array
    shares: Array

    @classmethod
    def of(cls, force: Callable[[Array], Array], v: Array, errors: Array, F: Array) -> "PathNoise":
        """Return the whitening of a record.

        Args:
            force: function of the velocity (n,) to the force (n,).
            v: velocity (n,).
            errors: columns of the error of v for unit amplitudes, (n, m).
            F: measured force (n,), whose white noise is that of its spectrum.
        """
        level = np.sqrt(noise_level(spectrum(F, line=True)))
        sigma = max(float(level), EXACT * float(np.ptp(F)), 1e-300)
        base = force(v)
        G = np.column_stack([force(v + STEP * e) - base for e in errors.T]) / (STEP * sigma)
        U, c, _ = np.linalg.svd(G, full_matrices=False)
        return cls(U, 1 - 1 / np.sqrt(1 + c**2))

    def __call__(self, columns: Array) -> Array:
        """Return whitened residuals (n,) or sensitivities (n, k)."""
        inside = self.directions.T @ columns
        shares = self.shares if columns.ndim == 1 else self.shares[:, None]
        return columns - self.directions @ (shares * inside)
