"""Checks of single signals: spikes, clipping, frozen stretches, jumps, resolution."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from identification.data.findings import Array, Finding, Severity, View, constant_runs, count_of
from identification.data.rough import Rough, rough_model

FAR = 12.0
"""Distance from the running median, over that of the farthest 5 %, that is a spike."""
RANGE = 0.2
"""... and over the range that 98 % of the signal have."""
BACK = 3.0
"""... and over the difference of the samples three before and three behind."""
MANY = 0.02
"""Share of the samples from which on they are no exceptions."""
HEAVY = 0.5
"""Share of a signal's variance that lies in its spikes and spoils any least squares."""


def of_spikes(view: View) -> Iterator[Finding]:
    """Spikes of every signal; those that outweigh the signal are an error."""
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
            f"{off[k]:.3g} {unit}: take them out with data.without_spikes()."
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
    """The samples that are spikes, and the distance of all samples from their neighbours."""
    none = np.zeros(0, dtype=np.intp)
    if y.size < 50 or np.ptp(y) == 0:
        return none, np.zeros(y.size)
    off = np.abs(y - median_of_five(y))
    usual = max(float(np.quantile(off, 0.95)), count_of(y))
    limit = max(FAR * usual, RANGE * float(np.ptp(np.quantile(y, (0.01, 0.99)))))
    if position:  # smooth: much less is a glitch
        limit = max(FAR * usual, 3 * float(np.quantile(np.abs(np.diff(y)), 0.9)))
    through = np.abs(np.roll(y, -3) - np.roll(y, 3))  # what moves on has no spike
    through[:3] = through[-3:] = 0.0
    far = np.flatnonzero((off > limit) & (off > BACK * through))
    return (far if limit > 0 and far.size <= MANY * y.size else none), off


def median_of_five(y: Array) -> Array:
    """The running median, which single samples and pairs do not move."""
    padded = np.pad(y, 2, mode="edge")
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1))


RUN, SHARE = 5, 0.002
"""Samples in a row at the extreme value, and share of all that lie in such runs, from which on
it is clipping."""
THERE = 0.6
"""Share of all long constant runs that lie at the extremes: else the signal is of few levels."""
MEAN, MOST = 0.03, 0.1
"""Force that the motion asks for beyond the limit, over it: mean and 90 % of the clipped samples.
Where the drive itself was at its limit, the motion asks for no more than that."""


def of_clipping(view: View) -> Iterator[Finding]:
    """Signals that are held at their largest or smallest value."""
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
        if signal == view.name("x"):  # at rest at the end of its way
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
    """Whether the force itself was limited, or only what the sensor could show of it."""
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
            f"the motion asks for up to {most:.3g} {view.record.units[signal]} more, so it was not "
            "the drive but its sensor that was at its limit"
        )
    return "warning", unsure


Counts = NDArray[np.intp]

FROZEN = 8
"""Equal values in a row that a signal with noise does not have."""
REPEATED = 0.02
"""Share of equal neighbours up to which a signal counts as one that never repeats."""
LOST = 0.2
"""Share of a record that may be frozen before nothing can come of it."""
JUMP = 8.0
"""Step after a frozen stretch, over the usual largest one, that betrays it."""


def of_frozen(view: View) -> Iterator[Finding]:
    """Stretches of equal values in signals that do not repeat elsewhere, or that end in a jump."""
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
        elsewhere = ", while it never repeats elsewhere" if noisy else ""
        text = (
            f"{signal} keeps the value {y[begin]:.6g} for {length[k]} samples from "
            f"{view.at(begin)} on{after}{elsewhere}: the sensor or the recorder stood still."
        )
        yield view.finding("frozen", signal, text, "error" if fatal else "warning", begin, end)


def _longest_that_jumps(
    y: Array, steps: Array, first: Counts, length: Counts, long: NDArray[np.bool_]
) -> tuple[int, bool]:
    """The longest run of equal values after which the signal is somewhere else."""
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
"""Step over that which 99.5 % of all stay below, and ..."""
NEAR = 8.0
"""... over the steps next to it: what moved fast before or after has not jumped."""
LEAST = 20
"""Counts of an encoder below which nothing can be told."""
WHITE = 0.5
"""Correlation of neighbours below which a position is noise."""
ALIKE = 0.05
"""Relative spread of jumps that are a period."""
FORCED = 5.0
"""Step of the force, over that which 90 % stay below, that goes with a true jump."""
OFTEN = 6
"""So many jumps of different sizes are stick-slip at a low sample rate rather than losses."""


def of_jumps(view: View) -> Iterator[Finding]:
    """Wrapped positions and lost ones."""
    x = view.signal("x")
    if x is None or view.record.t is None or x.size < 50 or np.ptp(x) <= LEAST * count_of(x):
        return
    lag = float(np.corrcoef(x[1:], x[:-1])[0, 1])
    if lag < WHITE:  # noise jumps all the time
        return
    name, unit = view.name("x"), view.record.units[view.name("x")]
    steady = median_of_five(x)
    steps = np.diff(steady)
    size = np.abs(steps)
    usual = max(float(np.quantile(size, 0.995)), count_of(x))
    beside = np.maximum(np.roll(size, 2), np.roll(size, -2))
    far = np.flatnonzero((size > JUMPED * usual) & (size > NEAR * np.maximum(beside, usual)))
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
        "a motion too fast for the sample rate." if pushed else "a sensor that lost its place."
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
    """Whether the force jumps with the position: then the body did, as in a slip."""
    force = view.signal("force")
    if force is None:
        return False
    steps = np.abs(np.diff(force))
    near = steps[max(k - 1, 0) : k + 2]
    return bool(near.max() > FORCED * (np.quantile(steps, 0.9) + 1e-300))


def _period(x: Array, far: NDArray[np.intp]) -> float:
    """The jumps plus what the position moved on meanwhile, as it did before and after."""
    steps = np.diff(x)
    inner = far[(far > 4) & (far < steps.size - 5)]
    found: list[float] = []
    for k in inner.tolist():
        near = np.arange(k - 2, k + 3)
        at = int(near[np.argmax(np.abs(steps[near]))])
        beside = float(np.median(np.abs(steps[[at - 2, at - 1, at + 1, at + 2]])))
        found.append(abs(float(steps[at])) + beside)
    return float(np.median(found)) if found else float(np.ptp(x))


COARSE = 0.04
"""Step of a force over its range that is told."""
PER_SAMPLE = 0.5
"""Counts per sample at a usual speed below which velocities are guesses."""


def of_resolution(view: View, model: Rough) -> Iterator[Finding]:
    """Forces of few levels, positions of few counts at the speeds of the record."""
    force = view.signal("force")
    if force is not None and np.ptp(force) > 0:
        usual = float(np.ptp(np.quantile(force, (0.01, 0.99))))
        step, spread = count_of(force), usual or float(np.ptp(force))
        if step > COARSE * spread:
            name = view.name("force")
            text = (
                f"{name} has steps of {step:.3g} {view.record.units[name]}, {step / spread:.0%} of "
                "its range: finer differences of friction cannot be told."
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
                f"motion makes less than {slow / count:.2g} of one per sample: velocities there "
                "are averages over several."
            )
            yield view.warning("resolution", name, text)
