"""Checks of force against motion: sign, delay, excitation, standstill, drift, hum."""

from collections.abc import Iterator

import numpy as np

from identification.data.findings import Array, Finding, View, count_of
from identification.data.rough import Rough, explained_when_late, one_way, rough_model, with_column

SURE = 5.0
"""Significance level, in standard errors."""
LITTLE, MUCH = 0.5, 0.8
"""Shares of the force that the rough model explains: for exchanged and for correct columns."""
NOTHING = 0.05
"""Share of the force below which it is unrelated to the motion."""


def of_direction(view: View, model: Rough) -> Iterator[Finding]:
    """Find friction that supplies power, and columns that fit only when exchanged."""
    names = view.name("force"), view.name("x")
    swapped = rough_model(view, exchanged=True)
    if (
        swapped is not None
        and model.explained < LITTLE
        and swapped.explained > MUCH
        and swapped.explained > model.explained + 0.4
    ):
        text = (
            f"{names[0]} behaves like a position, {names[1]} like a force (a rough drive explains "
            f"{swapped.explained:.0%} when exchanged, {model.explained:.0%} as given): the columns "
            "are exchanged."
        )
        yield view.error("swapped", names[0], text)
        return
    both = not one_way(model)
    _, level, viscous, *_ = model.values
    moved = np.sum(np.abs(model.v[model.moving]))
    put_in = level * moved + viscous * np.sum(model.v**2)
    sure = max(-model.sure(1) if level < 0 else 0.0, -model.sure(2) if viscous < 0 else 0.0)
    if both and put_in < 0 and sure > SURE and model.explained > LITTLE:
        against = " and accelerates against it" if model.sure(0) < -SURE else ""
        text = (
            f"{names[0]} brakes the motion that it drives{against}: the sign of {names[0]} or of "
            f"{names[1]} is wrong: data.scaled({{'{names[0]}': -1}})."
        )
        yield view.error("sign", names[0], text)
    elif both and model.clean and model.explained < NOTHING and model.independent > 100:
        text = (
            f"A rough drive explains {max(model.explained, 0.0):.0%} of {names[0]}: it is not "
            f"related to the motion of {names[1]}, or more than one mass is involved."
        )
        yield view.finding("unrelated", names[0], text, "error" if _white(view) else "warning")
    if both and model.sure(0) < -SURE and put_in > 0 and model.explained > LITTLE:
        text = (
            f"{names[0]} accelerates against the motion (a rough mass is {model.values[0]:.3g} +- "
            f"{model.errors[0]:.1g}): it is delayed, or another force drives the axis."
        )
        yield view.warning("sign", names[0], text)


def _white(view: View) -> bool:
    """Return True if neighbouring samples of the force are nearly uncorrelated."""
    force = view.signal("force")
    return force is not None and abs(float(np.corrcoef(force[1:], force[:-1])[0, 1])) < 0.2


LARGE = 0.12
"""Drift over the robust spread of the force above which it is reported."""
DRIFTS = 4.5
LAGS = (-20, -10, -5, -3, -2, -1, 1, 2, 3, 5, 10, 20)
"""Delays that are tried first, in samples; then those between the neighbours of the best one."""
BETTER = 0.88
"""Largest ratio of the unexplained parts with and without a reported delay ..."""
WORSE = 1.05
"""... if the opposite delay has at least this ratio."""


def of_drift(view: View, model: Rough, free: Rough | None) -> Iterator[Finding]:
    """Find a force that drifts with time relative to the force of a rough drive."""
    if not model.clean or model.explained < 0.5 or free is None or one_way(model):
        return
    rise, sure = float(free.values[-1]), free.sure(-1)
    spread = float(np.ptp(np.quantile(model.force, (0.25, 0.75))))
    if abs(rise) > LARGE * spread and abs(sure) > DRIFTS:
        name = view.name("force")
        text = (
            f"{name} drifts by {rise:.3g} {view.record.units[name]} from the first to the last "
            "sample relative to a rough drive model: a sensor with a drifting zero, or a drive "
            "that warms up."
        )
        yield view.warning("drift", name, text)


def of_dead_time(view: View, model: Rough, free: Rough | None) -> Iterator[Finding]:
    """Find a force that explains the motion better when it is shifted in time."""
    if not model.clean or model.explained < 0.5 or abs(model.sure(0)) < 5 or free is None:
        return
    now = max(1 - free.explained, 1e-9)

    def unexplained(lag: int) -> float:
        return (1 - explained_when_late(free, lag * model.step)) / now

    left = {lag: unexplained(lag) for lag in LAGS}
    best = min(left, key=lambda lag: left[lag])
    if left[best] < BETTER and left[-best] > WORSE and abs(best) > 1:
        k = LAGS.index(best)
        best = min(range(LAGS[max(k - 1, 0)], LAGS[min(k + 1, len(LAGS) - 1)] + 1), key=unexplained)
        name = view.name("force")
        word = "late" if best > 0 else "early"
        text = (
            f"{name} seems to be {word} by about {abs(best) * model.step:.3g} s ({abs(best)} "
            f"samples) against {view.name('x')}: estimate dead_time, or use data.delayed("
            f"{{'{name}': {-best * model.step:.3g}}})."
        )
        yield view.warning("delay", name, text)


UNSURE = 3.0
"""Rough mass over its standard error below which the accelerations are too small."""
SPREAD = 1.7
"""Ratio of the 90 % and 10 % quantiles of the speed below which there is only one speed."""
MOST = 0.97
"""Share of the time at rest above which there is too little motion."""


def of_excitation(view: View, model: Rough) -> Iterator[Finding]:
    """Find too small accelerations, a single speed, too little motion."""
    if not model.clean:
        text = (
            f"The accelerations do not exceed the noise of {view.name('x')}: a mass is "
            "not identifiable from these data."
        )
        yield view.warning("excitation", view.name("x"), text)
        return
    if abs(model.sure(0)) < UNSURE:
        unit = "kg m^2" if view.record.units[view.name("x")] == "rad" else "kg"
        text = (
            f"The accelerations are too small to identify a mass: roughly {model.values[0]:.2g} "
            f"+- {model.errors[0]:.1g} {unit}; pass it as fixed."
        )
        yield view.warning("excitation", view.name("x"), text)
    moving = model.moving
    if moving.mean() < 1 - MOST:
        text = f"The drive moves only {moving.mean():.1%} of the time."
        yield view.warning("excitation", view.name("x"), text)
    speed = np.abs(model.v[moving])
    if speed.size > 20:
        low, high = np.quantile(speed, (0.1, 0.9))
        if high < SPREAD * low:
            text = (
                f"Most of the motion is at one speed, {low:.3g} to {high:.3g} "
                f"{view.record.units[view.name('x')]}/s: the velocity dependence of friction is "
                "not identifiable."
            )
            yield view.warning("speeds", view.name("x"), text)


MOVED = 6.0
"""Range of the position over its noise (standard deviation) below which nothing moved."""
COUNTS = 4
"""Encoder counts below which nothing moved."""
WHITE = 0.3
"""Correlation of neighbours below which a position is noise."""
ONE_WAY = 0.005
"""Share of the path in the other direction below which the drive moves in one direction only."""


def of_motion(view: View) -> Iterator[Finding]:
    """Find signals without motion."""
    x, force = view.signal("x"), view.signal("force")
    if x is not None and view.record.t is not None and x.size >= 20:
        yield from _still(view, x)
    if force is not None and force.size >= 20 and np.ptp(force) == 0:
        name = view.name("force")
        text = f"{name} is {force[0]:g} {view.record.units[name]} throughout: "
        if float(force[0]) == 0:
            text += "motion without a drive determines only friction over mass."
            yield view.warning("constant", name, text)
        else:
            yield view.error("constant", name, f"{text}nothing was measured.")


def _still(view: View, x: Array) -> Iterator[Finding]:
    name, unit = view.name("x"), view.record.units[view.name("x")]
    steps = np.diff(x)
    if np.ptp(x) == 0 or np.ptp(x) < COUNTS * count_of(x):
        text = f"{name} never changes by more than {np.ptp(x):.3g} {unit}: nothing moved."
        yield view.error("standstill", name, text)
        return
    centred = x - x.mean()
    lag = float(centred[1:] @ centred[:-1] / (centred @ centred))
    noise = float(np.std(steps)) / np.sqrt(2)
    if lag < WHITE:
        text = (
            f"{name} is noise of {noise:.3g} {unit}: neighbouring samples "
            "are uncorrelated, which is not the motion of a body."
        )
        yield view.error("noise", name, text)
    elif np.ptp(np.quantile(x, (0.02, 0.98))) < MOVED * _white_part(x):
        text = (
            f"{name} moves by {np.ptp(np.quantile(x, (0.02, 0.98))):.3g} {unit}"
            ", no more than its noise."
        )
        yield view.error("standstill", name, text)


def _white_part(x: Array) -> float:
    """Return the standard deviation of the white part of the position."""
    return float(np.std(np.diff(x, 3))) / np.sqrt(20)


def of_one_way(view: View, model: Rough) -> Iterator[Finding]:
    """Find motion in one direction only."""
    if model.clean and one_way(model, ONE_WAY):
        direction = "forwards" if model.v.sum() > 0 else "backwards"
        text = (
            f"The drive moves {direction} only: friction is not separable from a constant force "
            "or from gravity."
        )
        yield view.warning("one-way", view.name("x"), text)


LINE = 0.45
"""Share of the residuals in one spectral line above which it is a hum."""
LOUD = 0.02
"""Its amplitude over the spread of the force above which it is reported."""
PERIODS, CLEAR, ANSWER = 8, 20.0, 0.01
"""Spectral line of the velocity: periods in the record, power over background, power share."""
HARMONICS = (1, 2)
"""Harmonics of an excitation that friction may leave in the force."""
UNEQUAL, DIFFERS = 0.04, 6.0
"""Difference of the mass between both directions, relative, and in standard errors."""


def of_residue(view: View, free: Rough | None) -> Iterator[Finding]:
    """Find a periodic force in addition to the drive's, and a mass that differs by direction."""
    if free is None or not free.clean or free.explained < 0.5:
        return
    yield from _hum(view, free)
    if not one_way(free) and abs(free.sure(0)) > DIFFERS:
        yield from _unequal(view, free)


def _hum(view: View, free: Rough) -> Iterator[Finding]:
    limit = 5 * float(np.median(np.abs(free.residual)))
    left, window = np.clip(free.residual, -limit, limit), np.hanning(free.residual.size)
    power = np.abs(np.fft.rfft(left * window)) ** 2
    k = int(np.argmax(power[2:])) + 2
    share = float(power[max(k - 2, 0) : k + 3].sum() / (power.sum() + 1e-300))
    size = 2 * float(np.sqrt(power[k])) / float(window.sum())
    loud = size > LOUD * float(np.ptp(np.quantile(free.force, (0.25, 0.75))))
    if share > LINE and loud and not any(_answered(free, round(k / n)) for n in HARMONICS):
        name = view.name("force")
        text = (
            f"{name} hums: in addition to a rough drive model it has a sine of {size:.2g} "
            f"{view.record.units[name]} and {k / left.size / free.step:.3g} Hz, {share:.0%} of "
            "the residuals: the mains, or a motion that the position does not show."
        )
        yield view.warning("hum", name, text)


def _answered(free: Rough, k: int) -> bool:
    """Return True if the velocity has a spectral line at bin k: an excitation, not a hum.

    Not tested below `PERIODS` periods, where a line and a move are indistinguishable; so a slow
    excitation that only bends bristles can still be reported as a hum.
    """
    if k < PERIODS:
        return False
    power = np.abs(np.fft.rfft((free.v - free.v.mean()) * np.hanning(free.v.size))) ** 2
    line = power[k - 2 : k + 3]
    beside = np.concatenate([power[k // 2 : k - 3], power[k + 4 : 2 * k]])
    out = float(line.max()) > CLEAR * float(np.median(beside))
    return out and float(line.sum()) > ANSWER * float(power.sum())


def _unequal(view: View, free: Rough) -> Iterator[Finding]:
    value, error = with_column(free, free.a * np.sign(free.v) * free.moving)
    ratio = value / free.values[0]
    if abs(ratio) > UNEQUAL and abs(value) > DIFFERS * error:
        name = view.name("force")
        text = (
            f"{name} corresponds to a mass {2 * abs(ratio):.0%} larger "
            f"{'forwards' if ratio > 0 else 'backwards'}: its gain depends on its sign, or it is "
            "clipped or filtered on one side."
        )
        yield view.warning("unequal", name, text)
