"""Velocity and acceleration of a record from measured position and velocity, and their noise."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.data.filters import (
    SEGMENT,
    Decimation,
    Filter,
    any_within,
    averaged,
    band_above,
    choose_filter,
    fourth_order_difference,
    frequencies,
    lowpass,
    noise_level,
    position_band,
    rounded_level,
    second_difference,
    spectrum,
    weighted,
)
from identification.data.record import Array, Record, blocks
from symfric.foundation import checks
from symfric.foundation.shown import brief

Mask = NDArray[np.bool_]

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

        V = V_x + W (V_v - V_x),   W = E_x / (E_x + E_v),   E = W^2 E_v + (1 - W)^2 E_x

    With W averaged over 1/250 of the band or 99 frequencies, this has almost the least noise of
    all unbiased combinations. E_x is white noise of the position after the difference of fourth
    order, with the gain s instead of w, plus the bias of this difference:

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
        frequency = frequencies(known.size)
        power = spectrum(known, line=True)
        ones = np.ones(power.size)
        of_x = ones * (rounded_level(known, power) if x_noise is None else x_noise**2)
        gain = np.sinc(2 * frequency) * (4 - np.cos(2 * np.pi * frequency)) / 3  # s / w
        by_x = of_x * (2 * np.pi * frequency * gain / step) ** 2
        if v is None:
            return Velocity(frequency, 0 * ones, by_x, power, of_x, 2)
        measured = power if x is None else spectrum(v, line=True)
        of_v = velocity_noise(measured) if v_noise is None else ones * v_noise**2
        if x is None:
            return Velocity(frequency, ones, of_v, power, of_v, 1)
        short = (1 - gain) ** 2 * np.maximum(averaged(measured, WIDTH) - of_v, 0.0)
        usual = averaged(by_x, WIDTH) + short
        derived = fourth_order_difference(x, step)
        apart = averaged(spectrum(v - derived), WIDTH)
        differ = (apart > SURE * usual) | (SURE * apart < usual)
        of_v = np.maximum(of_v, np.where(differ, np.abs(apart - usual), 0.0))
        by_x = by_x + short
        both = by_x + of_v
        best = np.divide(by_x, both, out=np.ones(both.size), where=both > 0)
        weight = averaged(best, WIDTH)  # narrow bands ring at ends of the record and jumps
        noise = weight**2 * of_v + (1 - weight) ** 2 * by_x
        found = Velocity(frequency, weight, noise, measured, noise, 1)
        mixed = spectrum(found.mixed(derived, v), line=True)
        return replace(found, power=mixed)

    def mixed(self, of_x: Array, of_v: Array) -> Array:
        """Combine a signal derived from the position with one from the velocity, shape (n,)."""

        def weight(f: Array) -> Array:
            return np.interp(f, self.frequency, self.weight)

        return of_x + weighted(of_v - of_x, weight, SEGMENT / 4, odd=False)

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


def noise_of(record: Record, name: str | None, given: Mapping[str, float]) -> float | None:
    """Return the standard deviation of the noise of a signal; None to take it from its spectrum.

    The position of a drive has at least the noise of the counts of its encoder, count / sqrt(12).
    """
    count = None if record.drive is None else record.drive.count
    if name != "x" or name in given or count is None:
        return None if name is None else given.get(name)
    level = noise_level(spectrum(record[name], line=True))
    return float(np.sqrt(max(level, count**2 / 12)))


CERTAIN = 4.0
"""Number of standard deviations of noise within which a velocity may be zero."""


@final
@dataclass(frozen=True, eq=False)
class MotionSignals:
    """A record differentiated without phase shift, with its disturbed ends cut off.

    Attributes:
        name: name of the record.
        t, x, v, a: time [s], filtered position [m], velocity [m/s], acceleration [m/s^2].
        force: unfiltered measured force [N].
        filter: filter of the position and decimation of the equations.
        slow: samples with an uncertain direction of motion.
    """

    name: str
    t: Array
    x: Array
    v: Array
    a: Array
    force: Array
    filter: Filter
    slow: Mask

    __repr__ = brief

    @cached_property
    def decimation(self) -> Decimation:
        """Low-pass filter and decimation from samples to equations."""
        return Decimation(self.t.size, self.filter.decimation)

    @cached_property
    def kept(self) -> NDArray[np.int64]:
        """Indices of the decimated rows whose windows contain no slow sample."""
        return np.flatnonzero(~self.decimation.touched(self.slow))

    def equations(self, signal: Array) -> Array:
        """Return `signal` decimated to the equations that are used, shape (rows,)."""
        return self.decimation(signal)[self.kept]

    @property
    def times(self) -> Array:
        """Times of the equations [s]."""
        return self.decimation.centres(self.t)[self.kept]


def derivatives(
    x: Array | None, v: Array | None, step: float, filter: Filter, mixer: Velocity
) -> tuple[Array, Array, Array]:
    """Return filtered position, velocity and acceleration, each shape (n,).

    Differences of the filtered position have the order four: gains of velocity and acceleration
    are (w h)^4 / 30 and (w h)^4 / 90 below one. A measured velocity is filtered and differentiated
    once. If both are measured, `mixer` combines their derivatives.

    Args:
        x: samples of the position; None: not measured (zeros are returned).
        v: samples of a measured velocity, or None.
        step: sample interval [s].
        filter: cut-off frequency and order.
        mixer: `Velocity.of(x, v, step)`.
    """
    by_x: list[Array] = []
    by_v: list[Array] = []
    if x is not None:
        x = lowpass(x, filter.cutoff, step, filter.order)
        by_x = [fourth_order_difference(x, step), second_difference(x, step)]
    if v is not None:
        v = lowpass(v, filter.cutoff, step, filter.order)
        by_v = [v, fourth_order_difference(v, step)]
    both = [*map(mixer.mixed, by_x, by_v)] if by_x and by_v else by_x or by_v
    return np.zeros_like(both[0]) if x is None else x, both[0], both[1]


def uncertain(v: Array, noise: float, step: float, filter: Filter) -> Mask:
    """Return a mask of the samples at which the force of a static law is undetermined, shape (n,).

    At these samples the velocity changes sign or is not distinguishable from rest (four standard
    deviations of its `noise`). The mask includes neighbours within half of 1 / cutoff, which the
    low-pass filter mixes with them. With `filter.v_min`, it marks only samples slower than that.
    """
    if filter.v_min is not None:
        return np.abs(v) < filter.v_min
    slow = np.abs(v) <= CERTAIN * noise
    turns = np.signbit(v[1:]) != np.signbit(v[:-1])
    slow[1:] |= turns
    slow[:-1] |= turns
    around = ceil(0.5 / (filter.cutoff * step))
    return any_within(np.pad(slow, around), 2 * around + 1)


def differentiated(record: Record, filter: Filter | None, **called: str) -> list[MotionSignals]:
    """Return `differentiate` of a record; of a long record only of those evenly spaced blocks
    that move.

    Raises:
        ValueError: see `differentiate`.
    """
    parts, found = blocks(record.size), list[MotionSignals]()
    for part in parts:
        try:
            found.append(
                differentiate(record.at(part) if len(parts) > 1 else record, filter, **called)
            )
        except ValueError:
            if part is parts[-1] and not found:
                raise
    return found


def differentiate(
    record: Record,
    filter: Filter | None = None,
    *,
    force: str = "force",
    x: str = "x",
    v: str | None = None,
) -> MotionSignals:
    """Return filtered position, velocity and acceleration of a record of a drive.

    Args:
        record: equally spaced samples.
        filter: cut-off and decimation; None: chosen by `choose_filter`.
        force, x: names of the channels.
        v: channel of a measured velocity, which `Velocity` combines with that of the position;
            None: "v" if the record has it.

    Raises:
        ValueError: unequal intervals, a cut-off above the Nyquist frequency, too short a record.
    """
    step = record.uniform().step
    rate = v or ("v" if "v" in record else None)
    measured = record[x], None if rate is None else record[rate]
    mixer = Velocity.of(*measured, step)
    chosen = filter or choose_filter(record[force], step, [mixer.band(*measured, step)])
    motion = derivatives(*measured, step, chosen, mixer)
    slow = uncertain(motion[1], mixer.errors(chosen, step)[0], step, chosen)
    inside = chosen.inside(record.size, step)
    cut = (y[inside] for y in (record.time, *motion, record[force]))
    signals = MotionSignals(record.name, *cut, filter=chosen, slow=slow[inside])
    if signals.decimation.rows == 0 or signals.kept.size < 10:
        raise ValueError(
            f"data '{record.name}': expected enough samples for the filter ({chosen}), got "
            f"{record.size}; raise the cut-off, lower the decimation or v_min"
        )
    return signals
