"""Velocity of a record from measured position and velocity, and the noise of both."""

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from identification.data.filters import (
    Array,
    Filter,
    averaged,
    band_above,
    central_difference,
    noise_level,
    position_band,
    rounded_level,
    spectrum,
    without_line,
)  # fmt: skip
from symfric.foundation import checks

WIDTH = 99
"""Least number of neighbours for the mean of a spectrum; the level is accurate to one eighth."""
CENTRAL, BACKWARD = 0.3, 1.4
"""Limits of the ratio of powers that distinguish differenced positions from white noise."""


def levels(where: str, noise: object) -> None:
    """Check a mapping of channels to standard deviations; None is allowed.

    Raises:
        ValueError: a name is not text, or a number is not above 0.
    """
    for name, value in checks.named(where, {} if noise is None else noise).items():
        checks.number(f"{where}: {name}", value, above=0.0)


def position_noise(power: Array) -> tuple[float, Array] | None:
    """Return power and gain of the position noise of a velocity that was derived from a position.

        S sin^2(w h) (central difference),   4 S sin^2(w h / 2) (backward difference)

    They differ from white noise by the ratio of the power near the Nyquist frequency and at half of
    it: below 0.1, 2, and 1 for white noise, for which the result is None.
    """
    f = np.linspace(0.0, 0.5, power.size)
    top, middle = power[f > 0.45], power[(f > 0.2) & (f < 0.3)]
    if not (top.size and middle.size and np.median(middle) > 0):
        return None
    ratio = float(np.median(top) / np.median(middle))
    if CENTRAL < ratio < BACKWARD:
        return None
    gain = np.sin(2 * np.pi * f) ** 2 if ratio <= CENTRAL else 4 * np.sin(np.pi * f) ** 2
    known = (f >= 0.25) & (f < 0.45)
    return float(np.median(power[known] / gain[known])) / float(np.log(2)), gain


def velocity_noise(power: Array) -> Array:
    """Return the spectrum of the noise of a velocity: white, or see `position_noise`."""
    found = position_noise(power)
    return np.full(power.size, noise_level(power)) if found is None else found[0] * found[1]


SURE = 2.0
"""Factor by which two mean levels must differ to be treated as different."""


@final
@dataclass(frozen=True, eq=False)
class Velocity:
    """Two measurements of one velocity, combined at each frequency by their noise.

        V = V_x + W (V_v - V_x),   W = E_x / (E_x + E_v),   E = E_x E_v / (E_x + E_v)

    This has the least noise of all unbiased combinations. E_x is white noise of the position after
    the central difference s = sin(w h) / h, plus the bias of this difference:

        E_x = S_x s^2 + (1 - s / w)^2 (|V_v|^2 - S_v)

    E_v is at least the white noise S_v of the measured velocity. If |V_v - V_x|^2 clearly exceeds
    E_x, the excess is an error of the velocity channel: its scale, delay, drift or filter. If it
    is clearly lower, the noise of both is common (a velocity derived from the position), and E_v is
    at least the difference.

    Attributes:
        frequency: frequencies of the spectra in cycles per sample, shape (k,).
        weight: W of the measured velocity; 0 without one, 1 without a position.
        noise: E [(m/s)^2 per sample]; white noise of variance e^2 has E = e^2.
        power, level: spectrum of the position or of the combined velocity, and of its noise; they
            determine the band of the motion and its gain.
        order: number of derivatives from this signal to the acceleration.

    Limits: noise levels are those of the upper half of the spectra, assumed white below it, unless
    they are given.
    """

    frequency: Array
    weight: Array
    noise: Array
    power: Array
    level: Array
    order: int

    @staticmethod
    def of(
        x: Array | None,
        v: Array | None,
        step: float,
        x_noise: float | None = None,
        v_noise: float | None = None,
    ) -> "Velocity":
        """Compute the combination from position and velocity, one of which may be missing.

        Args:
            x, v: samples of position and velocity, shape (n,).
            step: sample interval [s].
            x_noise, v_noise: standard deviations of their white noise; None: from the spectra.

        Raises:
            ValueError: both are missing.
        """
        known = v if x is None else x
        if known is None:
            raise ValueError("velocity: expected a position or a velocity, got neither")
        frequency: Array = np.asarray(np.fft.rfftfreq(known.size), np.float64)
        power = spectrum(without_line(known))
        ones = np.ones(power.size)
        of_x = ones * (rounded_level(known, power) if x_noise is None else x_noise**2)
        by_x = of_x * (np.sin(2 * np.pi * frequency) / step) ** 2
        if v is None:
            return Velocity(frequency, 0 * ones, by_x, power, of_x, 2)
        measured = power if x is None else spectrum(without_line(v))
        of_v = velocity_noise(measured) if v_noise is None else ones * v_noise**2
        if x is None:
            return Velocity(frequency, ones, of_v, power, of_v, 1)
        deficit = 1 - np.sinc(2 * frequency)
        short = deficit**2 * np.maximum(averaged(measured, step, WIDTH) - of_v, 0.0)
        usual = averaged(by_x, step, WIDTH) + short
        apart = averaged(spectrum(v - central_difference(x, step)), step, WIDTH)
        differ = (apart > SURE * usual) | (SURE * apart < usual)
        of_v = np.maximum(of_v, np.where(differ, np.abs(apart - usual), 0.0))
        by_x = by_x + short
        both = by_x + of_v
        weight = np.divide(by_x, both, out=np.ones(both.size), where=both > 0)
        found = Velocity(frequency, weight, weight * of_v, measured, weight * of_v, 1)
        mixed = spectrum(without_line(found.mixed(central_difference(x, step), v)))
        return replace(found, power=mixed)

    def mixed(self, of_x: Array, of_v: Array) -> Array:
        """Combine a signal derived from the position with one from the velocity, shape (n,)."""
        apart = of_v - of_x
        periodic = np.concatenate([apart, apart[-2:0:-1]])
        weight = np.interp(np.fft.rfftfreq(periodic.size), self.frequency, self.weight)
        return of_x + np.fft.irfft(np.fft.rfft(periodic) * weight, periodic.size)[: apart.size]

    def errors(self, filter: Filter, step: float, taps: Array | None = None) -> Array:
        """Return standard deviations of the noise of velocity and acceleration, shape (2,).

        Args:
            filter: low-pass filter of the position.
            step: sample interval [s].
            taps: weights of a further symmetric filter, such as a decimation; None: none.
        """
        f = self.frequency[1:-1]
        gain = filter.gain(f, step)
        if taps is not None:
            wide = np.fft.rfft(taps, 8 * taps.size)
            gain *= np.interp(f, np.linspace(0.0, 0.5, wide.size), np.abs(wide))
        left = gain**2 * self.noise[1:-1]
        w = 2 * np.pi * f / step
        return np.sqrt([np.mean(left), np.mean(w**2 * left)])

    def band(self, x: Array | None, v: Array | None, step: float) -> float:
        """Return the frequency [Hz] up to which the motion exceeds its noise; see `position_band`.

        If position and velocity are given, it is at least that of the position alone.
        """
        cut = slice(None) if self.order == 2 or x is None else slice(-1)
        found = band_above(self.power[cut], self.level[cut], step, self.order)
        return max(position_band(x, step), found) if x is not None and v is not None else found
