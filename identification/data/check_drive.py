"""Checks of force against motion: sign, excitation, drift, delay, hum."""

from collections.abc import Iterator

import numpy as np

from identification.data.findings import Finding, View
from identification.data.rough import Rough, rough_model

SURE = 5.0
"""Significance level, in standard errors."""
LITTLE, MUCH = 0.5, 0.8
"""Shares of the force that the rough model explains: for exchanged and for correct columns."""
NOTHING = 0.05
"""Share of the force below which it is unrelated to the motion."""
ONE_WAY = 0.005
"""Share of the path in the other direction below which the drive moves in one direction only."""


def of_direction(view: View, model: Rough) -> Iterator[Finding]:
    """Find friction that supplies power, exchanged columns, motion in one direction only."""
    x, force = view.name("x"), view.name("force")
    swapped = rough_model(view, exchanged=True)
    if (
        swapped is not None
        and model.explained < LITTLE
        and swapped.explained > max(MUCH, model.explained + 0.4)
    ):
        text = (
            f"{force} behaves like a position, {x} like a force (a rough drive explains "
            f"{swapped.explained:.0%} when exchanged, {model.explained:.0%} as given): the columns "
            "are exchanged."
        )
        yield view.error("swapped", force, text)
    elif not model.one_way():
        yield from _against(view, model, x, force)
    if model.clean and model.one_way(ONE_WAY):
        text = (
            f"The drive moves {'forwards' if model.v.sum() > 0 else 'backwards'} only: friction is "
            "not separable from a constant force or from gravity."
        )
        yield view.warning("one-way", x, text)


def _against(view: View, model: Rough, x: str, force: str) -> Iterator[Finding]:
    """Find a force that brakes the motion that it drives, or is unrelated to it."""
    _, level, viscous, *_ = model.values
    put_in = level * np.sum(np.abs(model.v[model.moving])) + viscous * np.sum(model.v**2)
    sure = max(-model.sure(1) if level < 0 else 0.0, -model.sure(2) if viscous < 0 else 0.0)
    if put_in < 0 and sure > SURE and model.explained > LITTLE:
        against = " and accelerates against it" if model.sure(0) < -SURE else ""
        text = (
            f"{force} brakes the motion that it drives{against}: the sign of {force} or of "
            f"{x} is wrong: data.scaled({{'{force}': -1}})."
        )
        yield view.error("sign", force, text)
    elif model.clean and model.explained < NOTHING and model.force.size / model.every > 100:
        signal = view.signal("force")
        white = signal is not None and abs(np.corrcoef(signal[1:], signal[:-1])[0, 1]) < 0.2
        text = (
            f"A rough drive explains {max(model.explained, 0.0):.0%} of {force}: it is not "
            f"related to the motion of {x}, or more than one mass is involved."
        )
        yield view.finding("error" if white else "warning", "unrelated", force, text)
    if model.sure(0) < -SURE and put_in > 0 and model.explained > LITTLE:
        text = (
            f"{force} accelerates against the motion (a rough mass is {model.values[0]:.3g} +- "
            f"{model.errors[0]:.1g}): it is delayed, or another force drives the axis."
        )
        yield view.warning("sign", force, text)


UNSURE = 3.0
"""Rough mass over its standard error below which the accelerations are too small."""
SPREAD = 1.7
"""Ratio of the 90 % and 10 % quantiles of the speed below which there is only one speed."""
MOST = 0.97
"""Share of the time at rest above which there is too little motion."""


def of_excitation(view: View, model: Rough) -> Iterator[Finding]:
    """Find too small accelerations, a single speed, too little motion."""
    name, unit = view.name("x"), view.unit("x")
    if not model.clean:
        text = f"The accelerations do not exceed the noise of {name}: a mass is not identifiable "
        yield view.warning("excitation", name, f"{text}from these data.")
        return
    if abs(model.sure(0)) < UNSURE:
        text = (
            f"The accelerations are too small to identify a mass: roughly {model.values[0]:.2g} +- "
            f"{model.errors[0]:.1g} {'kg m^2' if unit == 'rad' else 'kg'}; pass it as fixed."
        )
        yield view.warning("excitation", name, text)
    if model.moving.mean() < 1 - MOST:
        text = f"The drive moves only {model.moving.mean():.1%} of the time."
        yield view.warning("excitation", name, text)
    speed = np.abs(model.v[model.moving])
    low, high = np.quantile(speed, (0.1, 0.9)) if speed.size > 20 else (0.0, 0.0)
    if high < SPREAD * low:
        text = (
            f"Most of the motion is at one speed, {low:.3g} to {high:.3g} {unit}/s: the velocity "
            "dependence of friction is not identifiable."
        )
        yield view.warning("speeds", name, text)


LARGE = 0.12
"""Drift over the robust spread of the force above which it is reported."""
DRIFTS = 4.5
LAGS = (-20, -10, -5, -3, -2, -1, 1, 2, 3, 5, 10, 20)
"""Delays that are tried first, in samples; then those between the neighbours of the best one."""
BETTER = 0.88
"""Largest ratio of the unexplained parts with and without a reported delay ..."""
WORSE = 1.05
"""... if the opposite delay has at least this ratio."""
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


def of_residue(view: View, model: Rough) -> Iterator[Finding]:
    """Find drift, delay and hum of the force, and a mass that differs by direction.

    The model of these checks has a free curve of friction and a drift.
    """
    free = rough_model(view, curve=True)
    if free is None or not model.clean:
        return
    name = view.name("force")
    if model.explained >= 0.5:
        rise = float(free.values[-1])
        drifts = abs(rise) > LARGE * model.spread and abs(free.sure(-1)) > DRIFTS
        if drifts and not model.one_way():
            text = (
                f"{name} drifts by {rise:.3g} {view.unit('force')} from the first to the last "
                "sample relative to a rough drive model: a sensor with a drifting zero, or a drive "
                "that warms up."
            )
            yield view.warning("drift", name, text)
        if abs(model.sure(0)) >= 5:
            yield from _dead_time(view, model, free)
    if free.explained >= 0.5:
        yield from _hum(view, free)
        if not free.one_way() and abs(free.sure(0)) > DIFFERS:
            yield from _unequal(view, free)


def _dead_time(view: View, model: Rough, free: Rough) -> Iterator[Finding]:
    """Find a force that explains the motion better when it is shifted in time."""
    now = max(1 - free.explained, 1e-9)

    def unexplained(lag: int) -> float:
        return free.unexplained_when_late(lag * model.step) / now

    left = {lag: unexplained(lag) for lag in LAGS}
    best = min(left, key=lambda lag: left[lag])
    if not (left[best] < BETTER and left[-best] > WORSE and abs(best) > 1):
        return
    k, name = LAGS.index(best), view.name("force")
    best = min(range(LAGS[max(k - 1, 0)], LAGS[min(k + 1, len(LAGS) - 1)] + 1), key=unexplained)
    text = (
        f"{name} seems to be {'late' if best > 0 else 'early'} by about "
        f"{abs(best) * model.step:.3g} s ({abs(best)} samples) against {view.name('x')}: estimate "
        f"dead_time, or use data.delayed({{'{name}': {-best * model.step:.3g}}})."
    )
    yield view.warning("delay", name, text)


def _hum(view: View, free: Rough) -> Iterator[Finding]:
    """Find a periodic force in addition to the drive's."""
    limit = 5 * float(np.median(np.abs(free.residual)))
    left, window = np.clip(free.residual, -limit, limit), np.hanning(free.residual.size)
    power = np.abs(np.fft.rfft(left * window)) ** 2
    k = int(np.argmax(power[2:])) + 2
    share = float(power[max(k - 2, 0) : k + 3].sum() / (power.sum() + 1e-300))
    size = 2 * float(np.sqrt(power[k])) / float(window.sum())
    if share <= LINE or size <= LOUD * free.spread:
        return
    if not any(_answered(free, round(k / n)) for n in HARMONICS):
        name = view.name("force")
        text = (
            f"{name} hums: in addition to a rough drive model it has a sine of {size:.2g} "
            f"{view.unit('force')} and {k / left.size / free.step:.3g} Hz, {share:.0%} of "
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
    background = np.median(np.concatenate([power[k // 2 : k - 3], power[k + 4 : 2 * k]]))
    return bool(line.max() > CLEAR * background and line.sum() > ANSWER * power.sum())


def _unequal(view: View, free: Rough) -> Iterator[Finding]:
    """Find a mass that differs by direction."""
    value, error = free.with_column(free.a * np.sign(free.v) * free.moving)
    ratio = value / free.values[0]
    if abs(ratio) > UNEQUAL and abs(value) > DIFFERS * error:
        name = view.name("force")
        text = (
            f"{name} corresponds to a mass {2 * abs(ratio):.0%} larger "
            f"{'forwards' if ratio > 0 else 'backwards'}: its gain depends on its sign, or it is "
            "clipped or filtered on one side."
        )
        yield view.warning("unequal", name, text)
