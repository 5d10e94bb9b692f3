"""The velocity that position and a measured velocity tell together, and how noisy it is."""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.signals.filters import (
    Filter,
    band_above,
    central_difference,
    noise_level,
    position_band,
    spectrum,
    without_line,
)

Array = NDArray[np.float64]

WIDTH = 99
"""Fewest neighbours over which a spectrum is averaged: a level is then sure within an eighth."""
SURE = 2.0
"""Factor by which two averaged levels must differ to count as different."""


@final
@dataclass(frozen=True, eq=False)
class Velocity:
    """Two measurements of one velocity, mixed at each frequency by their noise.

        V = V_x + W (V_v - V_x),   W = E_x / (E_x + E_v),   E = E_x E_v / (E_x + E_v)

    which has the least noise of all mixtures and leaves the motion as it is. E_x is white noise of
    the position under the central difference s = sin(w h) / h, and what that falls short:

        E_x = S_x s^2 + (1 - s / w)^2 |V_v|^2

    E_v is the white noise S_v of the measured velocity, at least. Where |V_v - V_x|^2 exceeds E_x
    clearly, the excess is laid on the velocity channel: its scale, delay, drift or filter. Where it
    falls clearly below, both share their noise (a velocity that was made from the position), and
    E_v is not below E_x less it.

    Attributes:
        frequency: of the spectra, cycles per sample, shape (k,).
        weight: W of the measured velocity; 0 without one, 1 without a position.
        noise: E [(m/s)^2 per sample]; white noise of variance e^2 has E = e^2.

    Limit: noise levels are those of the upper half of the spectra, white below.
    """

    frequency: Array
    weight: Array
    noise: Array

    @staticmethod
    def of(x: Array | None, v: Array | None, step: float) -> "Velocity":
        """From the samples of position and velocity, one of which may be missing.

        Raises:
            ValueError: neither.
        """
        known = v if x is None else x
        if known is None:
            raise ValueError("velocity: expected a position or a velocity, got neither")
        frequency: Array = np.asarray(np.fft.rfftfreq(known.size), np.float64)
        s = np.sin(2 * np.pi * frequency) / step
        of_x = np.zeros(s.size) if x is None else noise_level(spectrum(without_line(x))) * s**2
        if v is None:
            return Velocity(frequency, np.zeros(s.size), of_x)
        measured = spectrum(without_line(v))
        of_v = np.full(s.size, noise_level(measured))
        if x is None:
            return Velocity(frequency, np.ones(s.size), of_v)
        lost = 1 - np.sinc(2 * frequency)
        of_x = _averaged(of_x + lost**2 * measured, step)
        apart = _averaged(spectrum(v - central_difference(x, step)), step)
        differ = (apart > SURE * of_x) | (SURE * apart < of_x)
        of_v = np.maximum(of_v, np.where(differ, np.abs(apart - of_x), 0.0))
        both = of_x + of_v
        weight = np.divide(of_x, both, out=np.ones(s.size), where=both > 0)
        return Velocity(frequency, weight, weight * of_v)

    def mixed(self, of_x: Array, of_v: Array) -> Array:
        """A signal by way of the position and by way of the velocity, each shape (n,), as one."""
        apart = of_v - of_x
        periodic = np.concatenate([apart, apart[-2:0:-1]])
        weight = np.interp(np.fft.rfftfreq(periodic.size), self.frequency, self.weight)
        return of_x + np.fft.irfft(np.fft.rfft(periodic) * weight, periodic.size)[: apart.size]

    def deviation(self, filter: Filter, step: float) -> float:
        """Standard deviation of the noise after the low pass of `filter` [m/s]."""
        inside = slice(1, -1)
        gain = filter.gain(self.frequency[inside], step)
        return float(np.sqrt(np.mean(gain**2 * self.noise[inside])))

    def band(self, x: Array | None, v: Array | None, step: float) -> float:
        """Frequency [Hz] up to which the motion stands out of its noise; see `position_band`.

        With both measured it is not below that of the position alone.
        """
        if x is None or v is None:
            known = v if x is None else x
            return 0.5 / step if known is None else position_band(known, step)
        mixed = without_line(self.mixed(central_difference(x, step), v))
        both = band_above(spectrum(mixed)[:-1], self.noise[:-1], step)
        return max(position_band(x, step), both)


def _averaged(power: Array, step: float) -> Array:
    """A spectrum averaged over 1 Hz or `WIDTH` neighbours, whichever is wider."""
    samples = 2 * (power.size - 1)
    width = min(max(WIDTH, 2 * round(0.5 * samples * step) + 1), power.size)
    ones = np.ones(width)
    count = np.convolve(np.ones(power.size), ones, mode="same")
    return np.convolve(power, ones, mode="same") / count
