"""Velocity along a path without most of its noise, and the remaining noise in the residuals.

An error of the path changes the force by G e, with independent standard normal e. The residuals
have the covariance s^2 I + G G' and are whitened by its inverse square root, relative to s:

    G / s = U diag(c) V',    r -> r - U diag(1 - 1 / sqrt(1 + c^2)) U' r

Without whitening, this error is a slow random force along the motion, which intervals and tests
would take for an effect of the motion.
Source: generalised least squares with effective variance, J. Orear, Am. J. Phys. 50, 1982.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple, final

import numpy as np

from identification.data.differentiate import Velocity, position_noise
from identification.data.filters import noise_level, smoothed, smoother_gain, spectrum
from identification.data.record import JITTER, Record
from identification.residuals.evaluation import Array

SMOOTHER = 2.0
"""Cut-off frequency of a smoothed path, relative to the highest frequency of its motion."""
LEFT = 2.0
"""Highest frequency of the remaining noise, relative to the cut-off."""
MOST = 20_000_000
"""Largest number of entries of the remaining noise."""


class SmoothPath(NamedTuple):
    """Velocity of a path, shape (n,), and its error with independent standard normal amplitudes.

    Attributes:
        v: velocity.
        errors: columns whose sum with these amplitudes is the error of v, shape (n, m); m is 0 if
            the velocity is that of the measurement, or if there would be too many entries.
    """

    v: Array
    errors: Array


def smooth_path(
    record: Record, x: str, v: str, noise: Mapping[str, float] | None = None
) -> SmoothPath:
    """Return the velocity of the channel `v`, or without it the derivative of the channel `x`.

    Noise accumulates in bristles, which follow the path. The measured signal is therefore replaced
    by its smoothing spline, with a cut-off of twice the frequency above which the noise exceeds the
    motion. Motion up to half the Nyquist frequency, and samples at unequal intervals, remain
    unchanged. A velocity with the noise of a differenced position is integrated first. The
    remaining noise is a sum of cosines of the frequencies j / (2 n) per sample.

    Args:
        record: samples over time.
        x, v: names of the channels.
        noise: channel -> standard deviation of its white noise; None: from the spectra.
    """
    given, t, n, step = dict(noise or {}), record.time, record.size, record.step
    name = v if v in record else x
    signal = record[name]
    of = None if name == x or v in given else position_noise(spectrum(signal, line=True))
    if of is not None:
        name, given[x] = x, float(np.sqrt(of[0])) * step
        signal = np.append(0.0, np.cumsum((signal[1:] + signal[:-1]) / 2 * np.diff(t)))

    def rate(y: Array) -> Array:
        return y if name == v else np.gradient(y, t, axis=0)

    none = SmoothPath(record[v] if v in record else rate(signal), np.zeros((n, 0)))
    if np.abs(np.diff(t) - step).max() > JITTER * step:
        return none
    both = (None, signal) if name == v else (signal, None)
    motion = Velocity.of(*both, step, given.get(x), given.get(v))
    cutoff = SMOOTHER * motion.band(*both, step) * step
    if cutoff >= 0.5:
        return none
    waves = np.arange(1 + int(2 * n * min(LEFT * cutoff, 0.5)))
    f = waves / (2 * n)
    if n * f.size > MOST:
        return SmoothPath(rate(smoothed(signal, cutoff)), none.errors)
    size = smoother_gain(f, cutoff) * np.sqrt(2 * np.interp(f, motion.frequency, motion.level) / n)
    cosines = np.cos(2 * np.pi * np.outer(np.arange(n) + 0.5, f))
    return SmoothPath(rate(smoothed(signal, cutoff)), rate(cosines * size))


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
