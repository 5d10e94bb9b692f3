"""Merging of two recorders of one experiment, and the delay between them.

    y1(t) = gain y2(t - shift - drift (t - middle)) + offset

The cross-correlation of both signals at the coarser step, normalised over their overlap, gives the
shift to one sample. Gauss-Newton on smoothed signals then gives it to a fraction of a sample, with
its standard error and the drift between the clocks.
"""

from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from identification.data.record import GAP, Array, Record, runs
from identification.data.resample import SHORTEST, hermite, interpolated
from symfric.foundation import checks

ALIKE = 0.8
"""Least correlation of two recordings of one quantity."""
OVERLAP = 0.5
"""Least overlap of the records, relative to the shorter one."""
RIVAL = 1.5
"""Ratio of the unexplained parts below which another shift is as likely as the best one."""
SMOOTHING = 2.0
"""Standard deviation of the smoothing window, in samples."""
NEIGHBOURS = 2 * np.sqrt(np.pi) * SMOOTHING
"""Number of samples that count as one independent sample after smoothing."""
SURE = 5.0
"""Significance level, in standard deviations."""
FLATTEST = 50
"""Number of equally likely lags above which the delay is undetermined."""
ITERATIONS = 30


class Delay(NamedTuple):
    """Offset and drift between the clocks of two records.

    Attributes:
        shift: offset added to the times of the second record [s], at `middle`.
        drift: relative excess speed of the first clock.
        middle: time of the first record at which `shift` holds [s].
        shift_error: standard error of `shift` [s].
    """

    shift: float
    drift: float
    middle: float
    shift_error: float = 0.0


def estimated_delay(first: Record, second: Record, on: tuple[str, str], drift: bool) -> Delay:
    """Estimate the delay between `first[on[0]]` and `second[on[1]]`.

    Args:
        first, second: two recordings of one quantity, up to a gain and an offset.
        on: names of the quantity in `first` and in `second`.
        drift: whether the clocks may run at different speeds; if not, a drift is an error.

    Raises:
        ValueError: the recordings correlate at no shift, several shifts are equally likely, the
            shift is undetermined, or the clocks drift.
    """
    where = f"data '{first.name}': merged with '{second.name}'"
    step = max(first.median_step, second.median_step)
    one, two = _Even(first, on[0], step), _Even(second, on[1], step)
    lag = _coarse(where, one, two)
    rigid, left = _refined(where, one, two, lag, drifting=False)
    free, least = _refined(where, one, two, lag, drifting=True)
    gained = one.values.size / NEIGHBOURS * (left / least - 1)
    total = abs(free.drift) * one.values.size * step
    if gained > SURE**2 and total > 0.5 * step and not drift:
        raise ValueError(
            f"{where}: expected clocks of one speed, got a drift of {1e6 * free.drift:.0f} "
            f"ppm, {total:.3g} s over the record; pass drift='estimate'"
        )
    return free if drift else rigid


class _Even:
    """Signal at equal intervals from `start`; `there` is False inside gaps."""

    def __init__(self, record: Record, signal: str, step: float) -> None:
        t, y = record.time, record[signal]
        self.start, self.step = float(t[0]), step
        grid = t[0] + step * np.arange(int((t[-1] - t[0]) / step * (1 + 1e-12)) + 1)
        k = np.clip(np.searchsorted(t, grid, side="right") - 1, 0, t.size - 2)
        self.there: NDArray[np.bool_] = (t[k + 1] - t[k]) <= GAP * record.median_step
        if step > 1.5 * record.median_step:  # means over a step instead of single samples
            area = np.concatenate([[0.0], np.cumsum(np.diff(t) * (y[1:] + y[:-1]) / 2)])
            low, high = np.clip(grid - step / 2, t[0], t[-1]), np.clip(grid + step / 2, t[0], t[-1])
            values = (np.interp(high, t, area) - np.interp(low, t, area)) / (high - low)
        else:
            values = np.interp(grid, t, y)
        scale = float(np.std(values[self.there])) if self.there.any() else 0.0
        if scale == 0:
            raise ValueError(
                f"data '{record.name}': merged: expected a signal '{signal}' that changes, "
                f"got {y[0]:g} throughout"
            )
        self.values: Array = (values - values[self.there].mean()) / scale

    def smoothed(self) -> tuple[Array, Array]:
        """Return times and smoothed values."""
        reach = int(4 * SMOOTHING)
        window = np.exp(-0.5 * (np.arange(-reach, reach + 1) / SMOOTHING) ** 2)
        padded = np.pad(self.values, reach, mode="edge")
        y: Array = np.convolve(padded, window / window.sum(), mode="valid").astype(np.float64)
        return self.start + self.step * np.arange(y.size, dtype=np.float64), y


def _coarse(where: str, one: _Even, two: _Even) -> int:
    """Return the lag with the best correlation, in steps."""
    size = 1 << int(np.ceil(np.log2(one.values.size + two.values.size)))

    def product(a: Array, b: Array) -> Array:
        return np.fft.irfft(np.fft.rfft(a, size) * np.conj(np.fft.rfft(b, size)), size)

    m1, m2 = one.there.astype(float), two.there.astype(float)
    y1, y2 = one.values * m1, two.values * m2
    n = np.maximum(product(m1, m2), 1e-9)
    s1, s2 = product(y1, m2), product(m1, y2)
    var1 = np.maximum(product(y1**2, m2) - s1**2 / n, 1e-30)
    var2 = np.maximum(product(m1, y2**2) - s2**2 / n, 0.0)
    common = n >= OVERLAP * min(m1.sum(), m2.sum())
    lively = common & (var1 > 1e-3 * n) & (var2 > 1e-3 * n)
    found = np.where(lively, (product(y1, y2) - s1 * s2 / n) / np.sqrt(var1 * var2 + 1e-30), 0.0)
    found = np.clip(found, -1.0, 1 - 1e-9)
    best = int(np.argmax(found))
    if found[best] < ALIKE:
        hint = "; one of them has the opposite sign" if found.min() < -ALIKE else ""
        raise ValueError(
            f"{where}: expected two recordings of one quantity, got a correlation of at most "
            f"{found[best]:.2f} at any shift{hint}"
        )
    lags = np.where(np.arange(size) < one.values.size, np.arange(size), np.arange(size) - size)
    order = np.argsort(lags, kind="stable")
    at = int(np.flatnonzero(order == best)[0])
    _check_single(where, found[order], at, one.step)
    rest = ((1 - found**2) * var1 / n)[order]  # unexplained variance, independent of the overlap
    likely = lively[order] & (rest < rest[at] * (1 + 9 * NEIGHBOURS / n[best] + 9 / n[best] ** 0.5))
    if np.count_nonzero(likely) > FLATTEST:
        raise ValueError(
            f"{where}: expected signals that determine their delay, got {np.count_nonzero(likely)} "
            f"shifts of {one.step:.2g} s that fit equally well; pass shift= [s]"
        )
    return int(lags[best])


def _check_single(where: str, values: Array, at: int, step: float) -> None:
    """Raise ValueError if a shift outside the peak of the best one fits equally well."""
    peak = values[at]
    below = np.flatnonzero(values < peak - max(0.02, 2 * RIVAL * (1 - peak)))
    left, right = below[below < at], below[below > at]
    outside = np.ones(values.size, dtype=bool)
    inner = slice(left[-1] + 1 if left.size else 0, right[0] if right.size else None)
    outside[inner] = False
    places = np.flatnonzero(outside)
    if not places.size:
        return
    rival = int(places[np.argmax(values[places])])
    if 1 - values[rival] ** 2 < RIVAL * (1 - peak**2) + 1e-4:
        raise ValueError(
            f"{where}: expected one delay, got a second one {abs((rival - at) * step):.4g} s away "
            f"that fits equally well (correlation {values[rival]:.4f} against {peak:.4f}); pass "
            "shift= [s]"
        )


def _refined(
    where: str, one: _Even, two: _Even, lag: int, *, drifting: bool
) -> tuple[Delay, float]:
    """Return the delay by Gauss-Newton on shift, drift, gain and offset, and the residual."""
    (t1, y1), (t2, y2) = one.smoothed(), two.smoothed()
    slope = np.gradient(y2, two.step)
    begin = one.start - two.start + lag * one.step
    shift, drift, middle = begin, 0.0, float(t1.mean())
    rows, residual, scale = np.eye(4), np.ones(4), np.ones(4)
    for _ in range(ITERATIONS):
        at = t1 - shift - drift * (t1 - middle)
        k = np.clip(np.rint((at - two.start) / two.step).astype(int), 0, y2.size - 1)
        use = (at >= t2[0]) & (at <= t2[-1]) & one.there & two.there[k]
        base, inner = hermite(at[use], t2, y2), np.interp(at[use], t2, slope)
        gain, offset = np.polyfit(base, y1[use], 1)
        columns = [-gain * inner, base, np.ones_like(base)]
        if drifting:
            columns.insert(1, -gain * inner * (t1[use] - middle))
        scale = np.linalg.norm(np.column_stack(columns), axis=0) + 1e-300
        rows, residual = np.column_stack(columns) / scale, y1[use] - gain * base - offset
        step = np.linalg.lstsq(rows, residual, rcond=1e-9)[0] / scale
        shift += float(np.clip(step[0], -2 * one.step, 2 * one.step))
        turn = float(np.clip(step[1], -1e-3, 1e-3)) if drifting else 0.0
        drift += turn
        if abs(step[0]) < 1e-6 * one.step and abs(turn) < 1e-9:
            break
    rest = float(residual @ residual) * NEIGHBOURS / max(residual.size - 4, 1) + 1e-30
    inverse = np.linalg.pinv(rows.T @ rows, rcond=1e-12)
    error = float(np.sqrt(rest * inverse[0, 0] / (scale[0] * scale[0])))
    if not error < one.step or abs(shift - begin) > 20 * one.step:
        raise ValueError(
            f"{where}: expected signals that determine their delay, got an error of {error:.2g} s "
            f"at samples of {one.step:.2g} s; pass shift= [s]"
        )
    return Delay(shift, drift, middle, error), rest


def merged(
    first: Record,
    second: Record,
    on: tuple[str, str],
    shift: float | Literal["estimate"] = "estimate",
    drift: float | Literal["estimate"] = 0.0,
) -> list[Record]:
    """Return the signals of both records at the times of the first, a record for each piece.

    Args:
        first: record that defines the times.
        second: record that is interpolated; the result is split at its gaps.
        on: names of a common quantity in `first` and `second`; the signal of `second` is dropped,
            unless `first` has no signal of that name.
        shift: offset added to the times of the second record [s].
        drift: relative excess speed of the first clock.

    Raises:
        ValueError: both have signals of one name or no common time, or see `estimated_delay`.
    """
    where = f"data '{first.name}': merged with '{second.name}'"
    names = checks.names(f"{where}: on", on) if len({*on}) == 2 else tuple(on)
    if len(names) != 2:
        raise checks.refused(f"{where}: on", "two names", on)
    pair = (first.channel(names[0]), second.channel(names[1]))
    if shift == "estimate":
        delay = estimated_delay(first, second, pair, drift == "estimate")
        if drift != "estimate" and drift != 0:
            raise ValueError(f"{where}: expected drift='estimate' with an estimated shift")
    else:
        moved = checks.number(f"{where}: shift", shift, unit="s")
        delay = Delay(moved, checks.number(f"{where}: drift", drift), float(first.time.mean()))
    taken = [key for key in second.signals if key != pair[1] or key not in first.signals]
    twice = [key for key in taken if key in first.signals]
    if twice:
        raise ValueError(
            f"{where}: expected signals of different names, got {', '.join(twice)} in both; "
            "use renamed()"
        )
    t, mine = second.time, first.time
    at = mine - delay.shift - delay.drift * (mine - delay.middle)
    k = np.clip(np.searchsorted(t, at, side="right") - 1, 0, t.size - 2)
    there = (at >= t[0]) & (at <= t[-1]) & (t[k + 1] - t[k] <= GAP * second.median_step)
    kept = [slice(a, b) for a, b in runs(there) if b - a >= SHORTEST]
    if not kept:
        raise ValueError(
            f"{where}: expected a common time of both, got {mine[0]:g} ... {mine[-1]:g} s and "
            f"{t[0] + delay.shift:g} ... {t[-1] + delay.shift:g} s"
        )
    error = f" +- {delay.shift_error:.1g}" if delay.shift_error else ""
    name = f"{first.name} + {second.name} (shifted by {delay.shift:.6g}{error} s)"
    units = {**first.units, **{key: second.units[key] for key in taken}}
    found: list[Record] = []
    for part in kept:
        cut = first.at(part)
        signals = {**cut.signals, **{key: interpolated(second, key, at[part]) for key in taken}}
        found.append(replace(cut, name=name, signals=signals, units=units))
    return found
