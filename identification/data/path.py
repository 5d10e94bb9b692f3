"""Velocity along a path without most of the noise of its measurement, and the remaining noise."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from identification.data.differentiate import Velocity, position_noise
from identification.data.filters import smoothed, smoother_gain, spectrum
from identification.data.record import JITTER, Array, Record

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
