"""Zero-phase filtering, differentiation and parallel decimation of sampled signals.

Identification by the inverse model requires velocity and acceleration without a phase shift from
the position, and the same low-pass filter for the measured and the predicted force.
Source: Gautier, Janot and Vandanjon, IEEE Trans. Control Syst. Technol. 21(2), 2013 (IDIM-LS).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from math import ceil, log2
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from identification.data.record import LONG, count_of
from symfric.foundation import checks

Array = NDArray[np.float64]

LOBES = 3
"""Zero crossings of the decimation filter on each side; few, so a reversal affects few rows."""
PASS = 0.9
"""Cut-off (-6 dB) of the decimation filter, relative to the Nyquist frequency after decimation."""
ABOVE = 4.0
"""Power relative to the noise power above which a motion is significant."""
LOST = 0.01
"""Largest share of noise in the acceleration of the used band."""
DIFFERENCE = (1.0, -2.0, 1.0)
"""Coefficients of the second difference."""
FEW, WIDE = 19, 2e-3
"""Least number and share of entries for the mean of a spectrum, to separate motion from noise."""


@final
@dataclass(frozen=True)
class Filter:
    """Smoothing of positions and decimation of equations.

    Attributes:
        cutoff: cut-off of the low-pass filter of position (and measured velocity) [Hz]; its gain
            there is 1/2, because the filter runs forward and backward.
        decimation: samples per equation, after a low-pass filter on all terms of the equation.
        order: order of the Butterworth filter.
        v_min: equations of a static law that include samples slower than this are omitted [m/s or
            rad/s]. Filtering blurs the switch of friction at standstill, which a static law
            does not describe. None: omit reversals and samples not distinguishable from rest.
    """

    cutoff: float
    decimation: int = 1
    order: int = 4
    v_min: float | None = None

    def __post_init__(self) -> None:
        checked: dict[str, Any] = {
            "cutoff": checks.number("Filter: cutoff", self.cutoff, unit="Hz", above=0.0),
            "decimation": checks.count("Filter: decimation", self.decimation),
            "order": checks.count("Filter: order", self.order),
        }
        if self.v_min is not None:
            checked["v_min"] = checks.number("Filter: v_min", self.v_min, unit="m/s", lower=0.0)
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    def __str__(self) -> str:
        limit = "by the data" if self.v_min is None else f"{self.v_min:g} m/s"
        return f"{self.cutoff:g} Hz, decimation {self.decimation}, v_min {limit}"

    def inside(self, size: int, step: float) -> slice:
        """Return the samples far enough from both ends not to be affected by reflection."""
        cut = ceil(5.0 / (self.cutoff * step) - 1e-9)
        return slice(cut, max(cut, size - cut))

    def gain(self, frequency: Array, step: float) -> Array:
        """Return the gain |H|^2 at frequencies below 1/2 in cycles per sample; see `lowpass`."""
        ratio = np.tan(np.pi * frequency) / np.tan(np.pi * self.cutoff * step)
        return 1 / (1 + ratio ** (2 * self.order))


def lowpass(signal: Array, cutoff: float, step: float, order: int = 4) -> Array:
    """Apply a Butterworth low-pass filter forward and backward, with zero phase and gain |H|^2.

        |H|^2 = 1 / (1 + (tan(pi f h) / tan(pi f_c h))^(2 order))

    This is `filtfilt` of the bilinear Butterworth filter. The straight line between the end samples
    is subtracted, and the signal is continued at both ends by odd reflection.

    Args:
        signal: samples, shape (n,).
        cutoff: f_c [Hz], below the Nyquist frequency.
        step: sample time h [s].
        order: order of one pass.

    Raises:
        ValueError: a cut-off at or above the Nyquist frequency.
    """
    if not 0 < cutoff * step < 0.5:
        such = f"below the Nyquist frequency {0.5 / step:g} Hz"
        raise ValueError(f"lowpass: cutoff: expected {such}, got {cutoff:g} Hz")
    line = np.linspace(signal[0], signal[-1], signal.size)
    gain = partial(Filter(cutoff, order=order).gain, step=step)
    return line + weighted(signal - line, gain, DECAY / (cutoff * step), odd=True)


DECAY = 12.0
"""Time in periods of the cut-off after which the response of `lowpass` is rounding error."""
LEAST = 2**15
"""Smallest number of samples of a block that is transformed at once."""


def weighted(signal: Array, gain: Callable[[Array], Array], reach: float, *, odd: bool) -> Array:
    """Return a signal multiplied by a gain in the frequency domain, shape (n,).

    It is continued at both ends by reflection. Long signals are divided into overlapping blocks
    (overlap-save).

    Args:
        signal: samples, shape (n,).
        gain: function of frequencies in cycles per sample.
        reach: samples after which the response to a pulse is negligible.
        odd: odd or even reflection.
    """
    n, side = signal.size, -1.0 if odd else 1.0
    block = max(LEAST, 1 << ceil(log2(8 * reach)))
    if n <= max(LONG, block):
        periodic = np.concatenate([signal, side * signal[-2:0:-1]])
        here = gain(np.asarray(np.fft.rfftfreq(periodic.size), np.float64))
        return np.fft.irfft(np.fft.rfft(periodic) * here, periodic.size)[:n]
    edge = ceil(reach)
    before, after = side * signal[edge:0:-1], side * signal[-2 : -edge - 2 : -1]
    whole = np.concatenate([before, signal, after])
    here = gain(np.asarray(np.fft.rfftfreq(block), np.float64))
    step, found = block - 2 * edge, np.empty(n)
    for k in range(0, n, step):
        part = np.fft.irfft(np.fft.rfft(whole[k : k + block], block) * here, block)
        found[k : k + step] = part[edge : edge + min(step, n - k)]
    return found


def smoother_gain(frequency: Array, cutoff: float) -> Array:
    """Return the gain of `smoothed` at frequencies in cycles per sample."""
    g = (np.sin(np.pi * frequency) / np.sin(np.pi * cutoff)) ** 4
    return 1 - (g / (1 + g)) ** 2


def smoothed(signal: Array, cutoff: float) -> Array:
    """Return a signal smoothed twice by the spline S, S u + S (u - S u), without end reflections.

        S u = argmin |u - y|^2 + |D y|^2 / (2 sin(pi f_c))^4,   gain of S 1 / (1 + g),
        gain of both 1 - (g / (1 + g))^2,   g = (sin(pi f) / sin(pi f_c))^4

    D are second differences. The second step (twicing) returns most of the motion that S removes.
    Source: E. T. Whittaker, Proc. Edinb. Math. Soc. 41, 1923; P. Eilers, Anal. Chem. 75, 2003;
    J. W. Tukey, Exploratory Data Analysis, 1977, section 16 (twicing).

    Args:
        signal: samples, shape (n,).
        cutoff: f_c in cycles per sample, where the gain is 3/4.
    """
    from scipy.linalg import solveh_banded  # noqa: PLC0415 (slow to import)

    n = signal.size
    bands = np.zeros((3, n))  # upper form of 1 + penalty D'D
    for shift in range(3):
        for i in range(3 - shift):
            here = slice(shift + i, n - 2 + shift + i)
            bands[2 - shift, here] += DIFFERENCE[i] * DIFFERENCE[i + shift]
    bands *= (2 * np.sin(np.pi * cutoff)) ** -4
    bands[2] += 1.0
    once = np.asarray(solveh_banded(bands, signal))
    return once + np.asarray(solveh_banded(bands, signal - once))


def gaussian(y: Array, width: float, order: int = 0) -> Array:
    """Return a signal smoothed by a Gaussian window, or its central differences per sample.

    Rows are smoothed separately.
    """
    from scipy.ndimage import gaussian_filter1d  # noqa: PLC0415  (slow to import)

    found = np.asarray(gaussian_filter1d(y, width, mode="nearest"), dtype=np.float64)
    for _ in range(order):  # unlike SciPy's derivatives, differences remove a constant exactly
        found = np.gradient(found, axis=-1)
    return found


def central_difference(signal: Array, step: float) -> Array:
    """Return the first derivative, of second order inside and one-sided at both ends."""
    return np.gradient(signal, step)


def fourth_order_difference(x: Array, step: float) -> Array:
    """Return (x[-2] - 8 x[-1] + 8 x[+1] - x[+2]) / (12 h), and `central_difference` at the ends.

    Its gain is (8 sin(w h) - sin(2 w h)) / (6 h) instead of w.
    """
    rate = central_difference(x, step)
    if x.size > 4:
        rate[2:-2] = (8 * (x[3:-1] - x[1:-3]) - (x[4:] - x[:-4])) / (12 * step)  # constant: 0
    return rate


def second_difference(x: Array, step: float) -> Array:
    """Return (-x[-2] + 16 x[-1] - 30 x + 16 x[+1] - x[+2]) / (12 h^2), repeated at both ends."""
    here = x[2:-2]
    near = (x[1:-3] - here) + (x[3:-1] - here)
    far = (x[:-4] - here) + (x[4:] - here)
    return np.pad((16 * near - far) / (12 * step**2), 2, mode="edge")


@final
@dataclass(frozen=True)
class Decimation:
    """Linear low-pass filter and decimation of `samples` values to `rows`, without phase shift.

        y = D u,   a sinc filter of 3 lobes under a Hamming window, cut-off 0.9 Nyquist / factor

    Only rows whose window lies inside the data are kept. Since D is linear and acts equally on
    measured force, acceleration and any law, the regression is unbiased.
    """

    samples: int
    factor: int

    @cached_property
    def taps(self) -> Array:
        """Weights of one row, with sum one."""
        if self.factor == 1:
            return np.ones(1)
        k = np.arange(-LOBES * self.factor, LOBES * self.factor + 1)
        taps = np.sinc(PASS * k / self.factor) * np.hamming(k.size)
        return taps / taps.sum()

    @property
    def rows(self) -> int:
        """Number of rows; zero if the window is longer than the data."""
        return max(0, (self.samples - self.taps.size) // self.factor + 1)

    def centres(self, samples: NDArray[Any]) -> NDArray[Any]:
        """Return the samples at the centres of the rows, shape (rows,)."""
        half = self.taps.size // 2
        return samples[half : half + self.rows * self.factor : self.factor]

    def __call__(self, signal: Array) -> Array:
        """Return D applied to `signal`, shape (samples,)."""
        return np.convolve(signal, self.taps, mode="valid")[:: self.factor]

    def columns(self, signals: Array) -> Array:
        """Return D applied to each column of `signals`; shape (samples, k) becomes (rows, k)."""
        if self.factor == 1:
            return signals
        windows = np.lib.stride_tricks.sliding_window_view(signals, self.taps.size, axis=0)
        return windows[:: self.factor] @ self.taps

    def touched(self, samples: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return a mask of the rows whose windows contain any of `samples`, shape (rows,)."""
        return any_within(samples, self.taps.size)[:: self.factor]


def any_within(samples: NDArray[np.bool_], size: int) -> NDArray[np.bool_]:
    """Return a mask of the windows of `size` that contain any of `samples`, (n - size + 1,)."""
    count = np.concatenate([[0], np.cumsum(samples)])
    return count[size:] > count[:-size]


def bandwidth(force: Array, step: float, share: float = 0.999) -> float:
    """Return the frequency [Hz] below which `share` of the noise-free variance of `force` lies.

    The level of the white noise is the median of the upper half of the spectrum divided by ln 2,
    the ratio of median and mean for white noise; spectral lines do not affect the median.
    """
    centred = force - force.mean()
    short = force.size <= LONG
    power = np.abs(np.fft.rfft(centred)) ** 2 if short else spectrum(centred)
    frequency = frequencies(force.size) / step
    noise = np.median(power[frequency > 0.25 / step]) / np.log(2)
    total = np.cumsum(power - noise)
    return float(frequency[np.argmax(total >= share * total.max())])


SEGMENT = 2**14
"""Number of samples of the segments over which the spectrum of a long signal is averaged."""


def frequencies(n: int) -> Array:
    """Return the frequencies of `spectrum` for n samples, in cycles per sample."""
    return np.asarray(np.fft.rfftfreq(n if n <= LONG else SEGMENT), np.float64)


def spectrum(signal: Array, *, line: bool = False) -> Array:
    """Return the power under a Hann window at `frequencies`; for white noise, its variance.

    Signals longer than `LONG` are divided into segments, over which the power is averaged (Bartlett
    and Welch).

    Args:
        signal: samples, shape (n,).
        line: subtract the straight line from the first to the last sample, of each segment.
    """
    n = signal.size
    size, count = (n, 1) if n <= LONG else (SEGMENT, n // SEGMENT)
    window, total = np.hanning(size), np.zeros(size // 2 + 1)
    for part in signal[: size * count].reshape(count, size):
        rest = part - np.linspace(part[0], part[-1], size) if line else part
        total += np.abs(np.fft.rfft(rest * window)) ** 2
    return total / (0.375 * size * count)


def noise_level(power: Array) -> float:
    """Return the power of the white noise in a spectrum from its upper half, free of motion.

    The level is the median divided by ln 2; spectral lines do not affect the median.
    """
    return float(np.median(power[power.size // 2 :])) / float(np.log(2))


def white_part(x: Array) -> float:
    """Return the standard deviation of the white noise of a position."""
    return float(np.std(np.diff(x, 3))) / np.sqrt(20)


def rounded_level(signal: Array, power: Array) -> float:
    """Return the power of the noise of a signal, at least that of its rounding, count^2 / 12."""
    return max(noise_level(power), count_of(signal) ** 2 / 12)


def averaged(power: Array, least: int = FEW) -> Array:
    """Return a spectrum averaged over its share `WIDE` or `least` neighbours, the wider one."""
    width = min(max(least, 2 * round(WIDE * (power.size - 1)) + 1), power.size)
    window = np.hanning(width + 2)[1:-1]
    count = np.convolve(np.ones(power.size), window, mode="same")
    return np.convolve(power, window, mode="same") / count


def position_band(x: Array, step: float) -> float:
    """Return the frequency [Hz] above which the noise of the position exceeds its motion.

    The noise level is that of the upper half of the spectrum. Accelerations above this frequency
    are noise.
    """
    power = spectrum(x, line=True)
    return band_above(power, np.full(power.size, rounded_level(x, power)), step, 2)


def band_above(power: Array, noise: Array, step: float, order: int) -> float:
    """Return the highest frequency [Hz] at which the mean exceeds `ABOVE` times the noise.

    The noise of the acceleration, derivative number `order`, up to this frequency is at most the
    share `LOST` of its motion. Isolated lines far above the motion, such as those of a coarse
    encoder, are therefore ignored.
    """
    frequency = np.linspace(0.0, 0.5 / step, power.size)
    weight = np.arange(power.size) ** (2.0 * order)
    lost = np.cumsum(weight * noise) > LOST * np.cumsum(weight * np.maximum(power - noise, 0.0))
    known = np.flatnonzero((averaged(power) > ABOVE * noise) & ~lost)
    return float(frequency[max(1, known[-1])] if known.size else frequency[1])


def choose_filter(force: Array, step: float, bands: Sequence[float], rows: int = 100) -> Filter:
    """Choose a filter from the data by the bandwidths f_b of the force and f_a of the motion.

        cut-off max(5 f_b, f_a) (at most Nyquist / 2),   decimation 0.8 Nyquist / (2 f_b)

    The factors are those of the EMPS reference, which sets f_b = 20 Hz by hand. f_a is the median
    of `bands`, the significant bandwidths of the coordinates. It limits f_b and the cut-off of the
    decimation, 0.9 Nyquist / decimation, because noise in the acceleration lowers the mass. Lower
    cut-offs spread the jumps of the force at reversals. At least `rows` equations remain, if
    possible.
    """
    nyquist = 0.5 / step
    known = float(np.median(bands))
    f_b = max(min(bandwidth(force, step), known), 1 / (force.size * step))
    wanted = max(round(0.4 * nyquist / f_b), round(PASS * nyquist / known))
    decimation = min(wanted, force.size // (rows + 4 * LOBES))
    return Filter(min(max(5 * f_b, known), 0.5 * nyquist), max(1, decimation))
