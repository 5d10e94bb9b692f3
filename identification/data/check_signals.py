"""Checks of single signals: spikes, clipping, frozen intervals, jumps, resolution."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from identification.data.findings import Array, Finding, Severity, View, constant_runs, count_of
from identification.data.rough import Rough, rough_model

FAR = 12.0
"""Distance of a spike from the running median, over that of the farthest 5 % ..."""
RANGE = 0.2
"""... over the range of 98 % of the signal ..."""
BACK = 3.0
"""... and over the difference of the samples three before and three after."""
MANY = 0.02
"""Share of the samples above which they are not exceptions."""
HEAVY = 0.5
"""Share of a signal's variance in spikes above which least squares is invalid."""


def of_spikes(view: View) -> Iterator[Finding]:
    """Find spikes of every signal; those that outweigh the signal are an error."""
    named = view.roles.values()
    for signal, y in view.known():
        if view.record.t is None:
            continue
        far, off = spike_samples(y, position=signal == view.name("x"))
        if not far.size:
            continue
        k = int(far[np.argmax(off[far])])
        weight = float((off[far] ** 2).sum() / (((y - np.median(y)) ** 2).sum() + 1e-300))
        position, heavy = signal == view.name("x"), weight > HEAVY and signal in named
        unit = view.record.units[signal]
        text = (
            f"{signal} is far off its neighbours in {far.size} sample(s), most at {view.at(k)} by "
            f"{off[k]:.3g} {unit}: remove them with data.without_spikes()."
        )
        yield view.finding(
            "glitch" if position else "spikes",
            signal,
            text,
            "error" if position or heavy else "warning",
            int(far[0]),
            int(far[-1]),
        )


def spike_samples(y: Array, *, position: bool) -> tuple[NDArray[np.intp], Array]:
    """Return the samples that are spikes, and the distance of all samples from their neighbours."""
    none = np.zeros(0, dtype=np.intp)
    if y.size < 50 or np.ptp(y) == 0:
        return none, np.zeros(y.size)
    off = np.abs(y - median_of_five(y))
    usual = max(float(np.quantile(off, 0.95)), count_of(y))
    limit = max(FAR * usual, RANGE * float(np.ptp(np.quantile(y, (0.01, 0.99)))))
    if position:  # a position is smooth: a lower limit
        limit = max(FAR * usual, 3 * float(np.quantile(np.abs(np.diff(y)), 0.9)))
    through = np.abs(np.roll(y, -3) - np.roll(y, 3))  # a spike returns to its neighbours
    through[:3] = through[-3:] = 0.0
    far = np.flatnonzero((off > limit) & (off > BACK * through))
    return (far if limit > 0 and far.size <= MANY * y.size else none), off


def median_of_five(y: Array) -> Array:
    """Return the running median of five, which ignores single samples and pairs."""
    padded = np.pad(y, 2, mode="edge")
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1))


RUN, SHARE = 5, 0.002
"""Consecutive samples at an extreme value, and share of the record in such runs, that count as
clipping.
"""
THERE = 0.6
"""Least share of long constant runs at the extremes; below it, the signal has few levels."""
MEAN, MOST = 0.03, 0.1
"""Predicted force beyond the limit, over the limit: mean and 90 % quantile of the clipped samples.
If the drive itself was at its limit, the motion needs no larger force.
"""


def of_clipping(view: View) -> Iterator[Finding]:
    """Find signals held at their largest or smallest value."""
    for signal, y in view.known():
        if y.size < 50 or np.ptp(y) == 0:
            continue
        first, length = constant_runs(y)
        held = length >= RUN
        levels = y[first]
        sides: list[tuple[str, float]] = []
        for side, top in (("largest", float(y.max())), ("smallest", float(y.min()))):
            share = float(length[held & (levels == top)].sum()) / y.size
            if share >= SHARE:
                sides.append((side, top))
        at_ends = held & np.isin(levels, [top for _, top in sides])
        if not sides or length[at_ends].sum() < THERE * length[held].sum():
            continue
        if signal == view.name("x"):  # at rest at the end of its travel
            continue
        k = int(np.argmax(np.where(at_ends, length, 0)))
        samples = int(length[at_ends].sum())
        unit = view.record.units[signal]
        where = " and ".join(f"its {side} value {top:.4g} {unit}" for side, top in sides)
        severity, why = _verdict(view, signal, [top for _, top in sides])
        text = (
            f"{signal} stays at {where} in {samples / y.size:.1%} of the samples, longest from "
            f"{view.at(int(first[k]))} on: {why}."
        )
        yield view.finding(
            "clipping", signal, text, severity, int(first[k]), int(first[k] + length[k] - 1)
        )


def _verdict(view: View, signal: str, tops: list[float]) -> tuple[Severity, str]:
    """Return the severity: whether the force itself was limited, or only its measurement."""
    unsure = "the amplifier or the sensor was at its limit there"
    model = rough_model(view, curve=True) if signal == view.name("force") else None
    if model is None or view.steady is None:
        return "warning", unsure
    force = np.interp(model.t, view.steady.time, view.steady[signal])
    clipped = np.isin(force, tops)
    free, top = ~clipped, float(np.abs(tops).max())
    if clipped.sum() < 5 or free.sum() < 50:
        return "warning", unsure
    values, *_ = np.linalg.lstsq(model.columns[free], model.force[free], rcond=1e-10)
    passed = (model.columns[clipped] @ values - model.force[clipped]) * np.sign(force[clipped])
    most = float(np.quantile(passed, 0.9))
    if passed.mean() > MEAN * top and most > MOST * top:
        return "error", (
            f"the motion needs up to {most:.3g} {view.record.units[signal]} more, so its sensor "
            "was at its limit, not the drive"
        )
    return "warning", unsure


Counts = NDArray[np.intp]

FROZEN = 8
"""Number of consecutive equal values that a noisy signal does not have."""
REPEATED = 0.02
"""Share of equal neighbours below which a signal counts as never repeating."""
LOST = 0.2
"""Share of a frozen record above which it is unusable."""
JUMP = 8.0
"""Step after a frozen interval, over the usual largest one, that counts as a jump."""


def of_frozen(view: View) -> Iterator[Finding]:
    """Find intervals of equal values in signals that do not repeat elsewhere or jump afterwards."""
    for signal, y in view.known():
        if y.size < 50 or np.ptp(y) == 0:
            continue
        steps = np.abs(np.diff(y))
        first, length = constant_runs(y)
        inner = (y[first] < y.max()) & (y[first] > y.min()) | (signal == view.name("x"))
        long = (length >= FROZEN) & inner
        if not long.any():
            continue
        k, jumped = _longest_that_jumps(y, steps, first, length, long)
        outside = np.ones(y.size, dtype=bool)
        for f, n in zip(first[long].tolist(), length[long].tolist(), strict=True):
            outside[f : f + n] = False
        repeats = float(np.mean(steps[outside[1:]] == 0)) if outside[1:].any() else 1.0
        noisy = repeats < REPEATED and count_of(y) == 0
        if not jumped and not noisy:
            continue
        if not jumped:
            k = int(np.argmax(np.where(long, length, 0)))
        begin, end = int(first[k]), int(first[k] + length[k] - 1)
        after = f", then jumps by {steps[end]:.3g} {view.record.units[signal]}" if jumped else ""
        lost = length[k] > LOST * y.size and noisy
        fatal = (jumped and signal == view.name("x")) or (lost and signal in view.roles.values())
        elsewhere = ", although it never repeats elsewhere" if noisy else ""
        text = (
            f"{signal} keeps the value {y[begin]:.6g} for {length[k]} samples from "
            f"{view.at(begin)} on{after}{elsewhere}: the sensor or the recorder was stuck."
        )
        yield view.finding("frozen", signal, text, "error" if fatal else "warning", begin, end)


def _longest_that_jumps(
    y: Array, steps: Array, first: Counts, length: Counts, long: NDArray[np.bool_]
) -> tuple[int, bool]:
    """Return the longest run of equal values that ends in a jump, and whether there is one."""
    usual = float(np.quantile(steps, 0.995))
    best, found = 0, False
    for k in np.flatnonzero(long).tolist():
        end = int(first[k] + length[k] - 1)
        if end < steps.size and steps[end] > JUMP * max(usual, count_of(y)):
            if not found or length[k] > length[best]:
                best = k
            found = True
    return best, found


JUMPED = 15.0
"""Step over the 99.5 % quantile of all steps, and ..."""
NEAR = 8.0
"""... over the adjacent steps; excludes fast motion."""
LEAST = 20
"""Encoder counts below which jumps are not evaluated."""
WHITE = 0.5
"""Correlation of neighbours below which a position is noise."""
ALIKE = 0.05
"""Relative spread below which jumps are of one period."""
FORCED = 5.0
"""Step of the force, over the 90 % quantile, that accompanies a true jump."""
OFTEN = 6
"""Number of jumps of different sizes that indicates stick-slip at a low sample rate."""


def of_jumps(view: View) -> Iterator[Finding]:
    """Find wrapped positions and lost counts."""
    x = view.signal("x")
    if x is None or view.record.t is None or x.size < 50 or np.ptp(x) <= LEAST * count_of(x):
        return
    lag = float(np.corrcoef(x[1:], x[:-1])[0, 1])
    if lag < WHITE:  # noise always jumps
        return
    name, unit = view.name("x"), view.record.units[view.name("x")]
    steady = median_of_five(x)
    steps = np.diff(steady)
    size = np.abs(steps)
    usual = max(float(np.quantile(size, 0.995)), count_of(x))
    nearby = np.maximum(np.roll(size, 2), np.roll(size, -2))
    far = np.flatnonzero((size > JUMPED * usual) & (size > NEAR * np.maximum(nearby, usual)))
    if not far.size:
        raw = np.abs(np.diff(x))  # a wrap of a fast drive: many jumps raise the usual step
        far = np.flatnonzero(raw > 0.5 * np.ptp(x))
        if far.size > 0.2 * x.size:
            return
        steps, size = np.diff(x), raw
    if not far.size:
        return
    heights, k = size[far], int(far[np.argmax(size[far])])
    period = _period(x, far)
    alike = float(np.quantile(heights, 0.9) - np.quantile(heights, 0.1)) <= ALIKE * heights.max()
    if alike and period > 0.8 * np.ptp(x):
        text = (
            f"{name} jumps {far.size} time(s) by {period:.4g} {unit}, its whole range, first at "
            f"{view.at(int(far[0]))}: it is counted modulo a period; use "
            f"data.unwrapped({{'{name}': {period:.5g}}})."
        )
        yield view.error("wrap", name, text, int(far[0]), int(far[-1]) + 1)
        return
    pushed = _force_jumps(view, k)
    text = f"{name} jumps {far.size} time(s), most by {size[k]:.3g} {unit} at {view.at(k)}: " + (
        "a motion too fast for the sample rate." if pushed else "a sensor that lost its reference."
    )
    yield view.finding(
        "jump",
        name,
        text,
        "warning" if pushed or far.size >= OFTEN else "error",
        int(far[0]),
        int(far[-1]) + 1,
    )


def _force_jumps(view: View, k: int) -> bool:
    """Return True if the force jumps with the position, as in a true slip."""
    force = view.signal("force")
    if force is None:
        return False
    steps = np.abs(np.diff(force))
    near = steps[max(k - 1, 0) : k + 2]
    return bool(near.max() > FORCED * (np.quantile(steps, 0.9) + 1e-300))


def _period(x: Array, far: NDArray[np.intp]) -> float:
    """Return the jumps plus the regular motion meanwhile, estimated from adjacent steps."""
    steps = np.diff(x)
    inner = far[(far > 4) & (far < steps.size - 5)]
    found: list[float] = []
    for k in inner.tolist():
        near = np.arange(k - 2, k + 3)
        at = int(near[np.argmax(np.abs(steps[near]))])
        nearby = float(np.median(np.abs(steps[[at - 2, at - 1, at + 1, at + 2]])))
        found.append(abs(float(steps[at])) + nearby)
    return float(np.median(found)) if found else float(np.ptp(x))


COARSE = 0.04
"""Step of a force over its range above which it is reported."""
PER_SAMPLE = 0.5
"""Counts per sample at a usual speed below which velocities are inaccurate."""


def of_resolution(view: View, model: Rough) -> Iterator[Finding]:
    """Find forces of few levels, and positions of few counts at the speeds of the record."""
    force = view.signal("force")
    if force is not None and np.ptp(force) > 0:
        usual = float(np.ptp(np.quantile(force, (0.01, 0.99))))
        step, spread = count_of(force), usual or float(np.ptp(force))
        if step > COARSE * spread:
            name = view.name("force")
            text = (
                f"{name} has steps of {step:.3g} {view.record.units[name]}, {step / spread:.0%} of "
                "its range: finer differences of friction are not resolved."
            )
            yield view.warning("resolution", name, text)
    x = view.signal("x")
    if x is None or not model.clean:
        return
    count = count_of(x)
    moved = np.abs(model.v[model.moving])
    if count > 0 and moved.size:
        slow = float(np.quantile(moved, 0.25)) * model.step
        if slow < PER_SAMPLE * count:
            name = view.name("x")
            text = (
                f"{name} has counts of {count:.3g} {view.record.units[name]}, and a quarter of the "
                f"motion is less than {slow / count:.2g} counts per sample: velocities there "
                "are averages over several samples."
            )
            yield view.warning("resolution", name, text)
