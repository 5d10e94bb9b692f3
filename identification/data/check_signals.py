"""Checks of single signals: spikes, clipping, frozen intervals, jumps, resolution, motion."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from identification.data.filters import gaussian, white_part
from identification.data.findings import Array, Finding, Rough, View, rough_model
from identification.data.record import constant_runs, count_of, joined, some

FAR = 12.0
"""Least distance of a spike from the running median, relative to its 95 % quantile."""
RANGE = 0.2
"""The same distance relative to the range of 98 % of the signal."""
BACK = 3.0
"""The same distance relative to the difference of the samples three before and three after."""
MANY = 0.02
"""Share of outlying samples above which they are not spikes."""
HEAVY = 0.5
"""Share of the variance of a signal due to spikes above which least squares is invalid."""


def of_spikes(view: View) -> Iterator[Finding]:
    """Find spikes in every signal; those that dominate the variance of the signal are an error."""
    for signal, y, _ in view.known():
        position = signal == view.name("x")
        far, off = spike_samples(y, position=position)
        if not far.size:
            continue
        k = int(far[np.argmax(off[far])])
        weight = float((off[far] ** 2).sum() / (((y - np.median(y)) ** 2).sum() + 1e-300))
        heavy = weight > HEAVY and signal in view.roles.values()
        kind, ends = "glitch" if position else "spikes", (int(far[0]), int(far[-1]))
        values = {"count": far.size, "worst": view.at(k), "off": off[k]}
        yield view.finding(position or heavy, kind, signal, "spikes", *ends, **values)


def spike_samples(y: Array, *, position: bool) -> tuple[NDArray[np.intp], Array]:
    """Return the indices of spikes, and the distance of each sample from the running median."""
    none = np.zeros(0, dtype=np.intp)
    if y.size < 50 or np.ptp(y) == 0:
        return none, np.zeros(y.size)
    off = np.abs(y - median_of_five(y))
    usual = max(float(np.quantile(some(off), 0.95)), count_of(y))
    limit = max(FAR * usual, RANGE * float(np.ptp(np.quantile(some(y), (0.01, 0.99)))))
    if position:  # positions are smooth, hence a lower limit
        limit = max(FAR * usual, 3 * float(np.quantile(some(np.abs(np.diff(y))), 0.9)))
    far = np.flatnonzero(off > limit)
    inner = (far >= 3) & (far < y.size - 3)
    through = np.zeros(far.size)  # small at a spike, because y returns
    through[inner] = np.abs(y[far[inner] + 3] - y[far[inner] - 3])
    far = far[off[far] > BACK * through]
    return (far if limit > 0 and far.size <= MANY * y.size else none), off


def median_of_five(y: Array) -> Array:
    """Return the running median of five samples, which ignores single outliers and pairs."""
    from scipy.ndimage import median_filter  # noqa: PLC0415 (slow to import)

    return np.asarray(median_filter(y, 5, mode="nearest"))


RUN, SHARE = 5, 0.002
"""Clipping: least number of consecutive samples at an extreme value, and least share of the record
in such runs.
"""
THERE = 0.6
"""Least share of long constant runs at the extremes; below it, the signal has only few levels."""
MEAN, MOST = 0.03, 0.1
"""Excess of the predicted force relative to the limit: mean and 90 % quantile over clipped samples.
Below them the drive itself was at its limit, because the motion needs no larger force.
"""


def of_clipping(view: View) -> Iterator[Finding]:
    """Find signals held at their largest or smallest value; positions may rest there."""
    for signal, y, unit in view.known():
        if signal == view.name("x"):
            continue
        first, length = constant_runs(y)
        held, levels = length >= RUN, y[first]
        tops = {
            side: top
            for side, top in (("largest", float(y.max())), ("smallest", float(y.min())))
            if float(length[held & (levels == top)].sum()) / y.size >= SHARE
        }
        at_ends = held & np.isin(levels, [*tops.values()])
        samples = int(length[at_ends].sum())
        if not tops or samples < THERE * length[held].sum():
            continue
        k = int(np.argmax(np.where(at_ends, length, 0)))
        where = " and ".join(f"its {side} value {top:.4g} {unit}" for side, top in tops.items())
        sensor = _limited_sensor(view, signal, [*tops.values()])
        why = sensor or "the amplifier or the sensor was at its limit there"
        values = {"where": where, "share": samples / y.size, "why": why}
        ends = int(first[k]), int(first[k] + length[k]) - 1
        yield view.finding(bool(sensor), "clipping", signal, "clipping", *ends, **values)


def _limited_sensor(view: View, signal: str, tops: list[float]) -> str:
    """Return the reason why only the measurement was limited; "" if this is not certain."""
    model = rough_model(view, curve=True) if signal == view.name("force") else None
    if model is None:
        return ""
    force = np.interp(model.t, view.record.time, view.record[signal])
    clipped = np.isin(force, tops)
    if clipped.sum() < 5 or (~clipped).sum() < 50:
        return ""
    values, *_ = np.linalg.lstsq(model.columns[~clipped], model.force[~clipped], rcond=1e-10)
    passed = (model.columns[clipped] @ values - model.force[clipped]) * np.sign(force[clipped])
    most, top = float(np.quantile(passed, 0.9)), float(np.abs(tops).max())
    if not (passed.mean() > MEAN * top and most > MOST * top):
        return ""
    needed = f"the motion needs up to {most:.3g} {view.unit('force')} more"
    return f"{needed}, so its sensor was at its limit, not the drive"


FROZEN = 8
"""Number of consecutive equal values that do not occur in a noisy signal."""
REPEATED = 0.02
"""Share of equal neighbours below which a signal counts as never repeating."""
LOST = 0.2
"""Share of a frozen record above which it is unusable."""
JUMP = 8.0
"""Ratio of the step after a frozen interval to the usual largest step that counts as a jump."""


def of_frozen(view: View) -> Iterator[Finding]:
    """Find intervals of equal values in signals that otherwise never repeat, or jump afterwards."""
    for signal, y, unit in view.known():
        position = signal == view.name("x")
        first, length = constant_runs(y)
        long = (length >= FROZEN) & ((y[first] < y.max()) & (y[first] > y.min()) | position)
        if not long.any():
            continue
        steps = np.abs(np.diff(y))
        inside = np.repeat(long, length)[1:]
        repeats = float(np.mean(steps[~inside] == 0)) if not inside.all() else 1.0
        noisy = repeats < REPEATED and count_of(y) == 0
        usual = max(float(np.quantile(some(steps), 0.995)), count_of(y))
        after = np.append(steps, 0.0)[first + length - 1]
        jumps = long & (after > JUMP * usual)
        jumped = bool(jumps.any())
        if not jumped and not noisy:
            continue
        k = int(np.argmax(np.where(jumps if jumped else long, length, 0)))
        begin, end = int(first[k]), int(first[k] + length[k] - 1)
        then = f", then jumps by {after[k]:.3g} {unit}" if jumped else ""
        then += ", although it never repeats elsewhere" if noisy else ""
        lost = length[k] > LOST * y.size and noisy and signal in view.roles.values()
        values = {"value": y[begin], "length": length[k], "then": then}
        serious = (jumped and position) or bool(lost)
        yield view.finding(serious, "frozen", signal, "frozen", begin, end, **values)


JUMPED = 15.0
"""Least ratio of a jump to the 99.5 % quantile of all steps."""
NEAR = 8.0
"""Least ratio of a jump to the steps nearby, which excludes fast motion."""
LEAST = 20
"""Encoder counts below which jumps are not evaluated."""
WHITE = 0.5
"""Correlation of neighbouring samples below which a position is noise."""
ALIKE = 0.05
"""Relative spread of jumps below which they have the same period."""
FORCED = 5.0
"""Step of the force, relative to the 90 % quantile, that accompanies a true jump."""
OFTEN = 6
"""Number of jumps of different sizes that indicates stick-slip at a low sample rate."""


def of_jumps(view: View) -> Iterator[Finding]:
    """Find wrapped positions and lost encoder counts."""
    x = view.signal("x")
    if x is None or x.size < 50 or np.ptp(x) <= LEAST * count_of(x):
        return
    if np.corrcoef(x[1:], x[:-1])[0, 1] < WHITE:  # noise jumps at every sample
        return
    name, size = view.name("x"), np.abs(np.diff(median_of_five(x)))
    usual = max(float(np.quantile(some(size), 0.995)), count_of(x))
    far = np.flatnonzero(size > JUMPED * usual)
    nearby = np.maximum(size[far - 2], size[(far + 2) % size.size])
    far = far[size[far] > NEAR * np.maximum(nearby, usual)]
    if not far.size:
        size = np.abs(np.diff(x))  # many wraps of a fast drive raise the usual step
        far = np.flatnonzero(size > 0.5 * np.ptp(x))
        if not 0 < far.size <= 0.2 * x.size:
            return
    heights, k = size[far], int(far[np.argmax(size[far])])
    begin, end = int(far[0]), int(far[-1]) + 1
    period = _period(x, far)
    alike = float(np.quantile(heights, 0.9) - np.quantile(heights, 0.1)) <= ALIKE * heights.max()
    if alike and period > 0.8 * np.ptp(x):
        drive = view.record.drive
        counts = period / abs((drive.count if drive else None) or np.inf)
        case = "counter" if counts > 0 else "wrap"
        values = {"count": far.size, "period": period, "counts": counts}
        yield view.error("wrap", name, case, begin, end, **values)
        return
    pushed, force = False, view.signal("force")
    if force is not None:  # in a true slip, the force jumps, too
        steps = np.abs(np.diff(force))
        near = steps[max(k - 1, 0) : k + 2]
        pushed = bool(near.max() > FORCED * (np.quantile(steps, 0.9) + 1e-300))
    why = "a motion too fast for the sample rate" if pushed else "a sensor that lost its reference"
    values = {"count": far.size, "size": size[k], "worst": view.at(k), "why": why}
    serious = not pushed and far.size < OFTEN
    yield view.finding(serious, "jump", name, "jump", begin, end, **values)


def _period(x: Array, far: NDArray[np.intp]) -> float:
    """Return the period of a wrap, the median of the jumps plus the regular motion of a step."""
    steps = np.abs(np.diff(x))
    found: list[float] = []
    for k in far[(far > 4) & (far < steps.size - 5)].tolist():
        at = k - 2 + int(np.argmax(steps[k - 2 : k + 3]))
        found.append(float(steps[at] + np.median(steps[[at - 2, at - 1, at + 1, at + 2]])))
    return float(np.median(found)) if found else float(np.ptp(x))


COARSE = 0.04
"""Ratio of the step of a force to its range above which it is reported."""
PER_SAMPLE = 0.5
"""Counts per sample at a usual speed below which velocities are inaccurate."""


def of_resolution(view: View, model: Rough) -> Iterator[Finding]:
    """Find forces with few levels, and positions with few counts at the speeds of the record."""
    x, force = view.signal("x"), view.signal("force")
    if force is not None and np.ptp(force) > 0:
        usual = float(np.ptp(np.quantile(force, (0.01, 0.99))))
        step, spread = count_of(force), usual or float(np.ptp(force))
        if step > COARSE * spread:
            values = {"step": step, "share": step / spread}
            yield view.warning("resolution", view.name("force"), "coarse_force", **values)
    moved = np.abs(model.v[model.moving])
    if x is None or not model.clean or not moved.size or not (count := count_of(x)) > 0:
        return
    slow = float(np.quantile(moved, 0.25)) * model.step
    if slow < PER_SAMPLE * count:
        values = {"count": count, "slow": slow / count}
        yield view.warning("resolution", view.name("x"), "coarse_position", **values)


WIDTH = 12.0
"""Standard deviation of the smoothing window of both signals, in samples."""
RELATED = 0.7
"""Least correlation of the given and the derived signal."""
OFF = 0.2
"""Relative error of the scale above which it is reported."""
SCALES = {
    57.2958: "deg/s taken as rad/s",
    0.0174533: "rad/s taken as deg/s",
    9.5493: "rpm taken as rad/s",
    0.10472: "rad/s taken as rpm",
    6.28319: "rad/s taken as rev/s",
    0.159155: "rev/s taken as rad/s",
    1000.0: "mm/s taken as m/s",
    0.001: "m/s taken as mm/s",
    1e6: "um/s taken as m/s",
    100.0: "cm/s taken as m/s",
    60.0: "per minute taken as per second",
}
"""Ratio of a velocity to the slope of a position -> its cause."""


def of_velocity(view: View) -> Iterator[Finding]:
    """Find a velocity or acceleration that differs from the derivative of position or velocity."""
    steady = view.steady
    if not steady or view.record.size < 100:
        return
    inner = slice(int(3 * WIDTH), -int(3 * WIDTH))
    for pair in (("x", "v"), ("v", "a")):
        if not {*pair} <= view.roles.keys():
            continue
        other, name = (view.roles[r] for r in pair)
        known, signal = joined(steady, other), joined(steady, name)
        if np.ptp(signal) == 0 or np.ptp(known) == 0:
            continue
        derived = (gaussian(known, WIDTH, 1) / steady[0].step)[:, inner].ravel()
        given = gaussian(signal, WIDTH)[:, inner].ravel()
        if derived.std() == 0 or given.std() == 0:
            continue
        alike = float(np.corrcoef(derived, given)[0, 1])
        scale = float(given.std() / derived.std())
        values = {"other": other, "alike": alike, "scale": scale}
        if alike < -RELATED:
            yield view.error("sign", name, "opposite", **values)
        elif alike < RELATED:
            yield view.warning("velocity", name, **values)
        elif abs(scale - 1) > OFF:
            near = [text for known, text in SCALES.items() if abs(scale / known - 1) < 0.1]
            why = near[0] if near else "a wrong unit or scale"
            serious = bool(near) or not 0.2 <= scale <= 5
            yield view.finding(serious, "units", name, "scale", why=why, **values)


MOVED = 6.0
"""Ratio of the range of a position to its standard deviation of noise below which it is at rest."""
COUNTS = 4
"""Encoder counts below which the position is at rest."""
NOISE = 0.3
"""Correlation of neighbouring samples below which a position is noise."""


def of_motion(view: View) -> Iterator[Finding]:
    """Find positions at rest or of noise only, and a constant force."""
    x, force = view.signal("x"), view.signal("force")
    if x is not None and x.size >= 20:
        yield from _still(view, x)
    if force is not None and force.size >= 20 and np.ptp(force) == 0:
        case = "constant" if force[0] else "undriven"
        yield view.finding(bool(force[0]), "constant", view.name("force"), case, value=force[0])


def _still(view: View, x: Array) -> Iterator[Finding]:
    name = view.name("x")
    if np.ptp(x) == 0 or np.ptp(x) < COUNTS * count_of(x):
        yield view.error("standstill", name, range=np.ptp(x))
        return
    centred, middle = x - x.mean(), float(np.ptp(np.quantile(x, (0.02, 0.98))))
    if float(centred[1:] @ centred[:-1] / (centred @ centred)) < NOISE:
        yield view.error("noise", name, size=float(np.std(np.diff(x))) / np.sqrt(2))
    elif middle < MOVED * white_part(x):
        yield view.error("standstill", name, "hidden", range=middle)
