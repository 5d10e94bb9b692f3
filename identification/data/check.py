"""Checks of a data set: times, points, units, and consistency of the force with the motion."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.data.check_signals import (
    of_clipping,
    of_frozen,
    of_jumps,
    of_motion,
    of_resolution,
    of_spikes,
    of_velocity,
)
from identification.data.findings import Finding, Findings, Rough, View, robust, rough_model
from identification.data.record import GAP, JITTER, Array, Record

FEWEST, FEW = 20, 50
"""Numbers of samples below which a record gives an error, and a warning."""
SLOW = 0.5
"""Sample interval [s] above which times may be in ms."""


def of_times(view: View) -> Iterator[Finding]:
    """Find gaps, irregular intervals, too few samples, and times that may be in another unit."""
    record, t = view.record, view.record.time
    if record.size < FEW:
        yield view.finding(record.size < FEWEST, "short", "t", size=record.size)
    if record.size < 3:
        return
    intervals = np.diff(t)
    usual = float(np.median(intervals))
    gaps = np.flatnonzero(intervals > GAP * usual)
    if gaps.size:
        k = int(gaps[np.argmax(intervals[gaps])])
        yield view.warning("gap", "t", "gap", k, k + 1, count=gaps.size, longest=intervals[k])
    off = np.abs(intervals - usual)
    off[gaps] = 0.0
    k = int(np.argmax(off))
    if off[k] > (limit := 2 * JITTER) * usual:
        values = {"share": np.mean(off > limit * usual), "usual": usual, "worst": intervals[k]}
        yield view.warning("irregular", "t", "irregular", k, k + 1, limit=limit, **values)
    if usual >= SLOW and record.size >= 200 and np.all(np.abs(t - np.rint(t)) < 1e-9):
        yield view.warning("units", "t", "times", step=usual, hours=np.ptp(t) / 3600)


FEWEST_POINTS = 4
WRONG = 0.2
"""Smallest share of points with friction along the motion; below it, the sign is wrong."""


def of_points(view: View) -> Iterator[Finding]:
    """Find too few points, one direction, one speed, and a force that drives instead of brakes."""
    record = view.record
    if "v" not in record or "F" not in record:
        return
    v, force = record["v"], record["F"]
    if record.size < FEWEST_POINTS:
        yield view.warning("short", "v", "few_points", size=record.size)
    for name in ("v", "F"):
        if np.ptp(record[name]) == 0:
            yield view.error("constant", name, "same_points", value=record[name][0])
            return
    moving = np.abs(v) > 0.01 * np.abs(v).max()
    both = min(np.mean(v > 0), np.mean(v < 0)) > 0.1
    around = float(np.median(force)) if both else 0.0
    if np.mean(v[moving] * (force[moving] - around) > 0) < WRONG:
        yield view.error("sign", "F", "points_against")
    if not both:
        yield view.warning("one-way", "v", "points_one_way")


LIMITS = {
    "m": (1e-9, 50.0),
    "rad": (1e-9, 1e5),
    "N": (1e-9, 1e6),
    "N m": (1e-12, 1e6),
    "m/s": (1e-9, 100.0),
    "rad/s": (1e-9, 1e4),
}
"""Usual ranges of signals by unit. Others are doubtful only: a fit does not depend on units."""
FASTEST = {"m": 50.0, "rad": 1e4}
"""Speeds of a position above which a warning is given."""
TOGETHER = (("m", "N"), ("rad", "N m"))


def of_units(view: View, model: Rough | None) -> Iterator[Finding]:
    """Find inconsistent units of position and force, and implausible ranges."""
    record = view.record
    mixed = tuple(view.unit(r) for r in ("x", "force") if r in view.roles)
    if len(mixed) == 2 and "" not in mixed and mixed not in TOGETHER:
        of_x, of_force = mixed
        yield view.error("units", view.name("force"), "apart", of_x=of_x, of_force=of_force)
    for signal in view.roles.values():
        low, high = LIMITS.get(record.units[signal], (0.0, np.inf))
        range_ = float(np.ptp(record.signals[signal]))
        if 0 < range_ < low or range_ > high:
            yield view.warning("units", signal, "range", range=range_)
    if model is not None and model.clean:
        fastest = float(np.quantile(np.abs(model.v), 0.99))
        if fastest > FASTEST.get(view.unit("x"), np.inf):
            yield view.warning("units", view.name("x"), "speed", fastest=fastest)


SURE = 5.0
"""Significance level, in standard errors."""
LITTLE, MUCH = 0.5, 0.8
"""Shares of the force explained by the rough model: at most with exchanged columns, at least with
correct ones."""
NOTHING = 0.05
"""Share of the force explained by the motion below which they are unrelated."""
ONE_WAY = 0.005
"""Share of the path against the main direction below which the drive moves in one direction."""


def of_direction(view: View, model: Rough) -> Iterator[Finding]:
    """Find friction that supplies power, exchanged columns, and motion in one direction only."""
    swapped, given = rough_model(view, exchanged=True), model.explained
    exchanged = 0.0 if swapped is None else swapped.explained
    if given < LITTLE and exchanged > max(MUCH, given + 0.4):
        yield view.error("swapped", view.name("force"), exchanged=exchanged, given=given)
    elif not model.one_way():
        yield from _against(view, model, view.name("force"))
    if model.clean and model.one_way(ONE_WAY):
        way = "forwards" if model.v.sum() > 0 else "backwards"
        yield view.warning("one-way", view.name("x"), way=way)


def _against(view: View, model: Rough, force: str) -> Iterator[Finding]:
    """Find a force that brakes the motion it should drive, or that is unrelated to it."""
    _, level, viscous, *_ = model.values
    put_in = level * np.sum(np.abs(model.v[model.moving])) + viscous * np.sum(model.v**2)
    sure = max(-model.sure(1) if level < 0 else 0.0, -model.sure(2) if viscous < 0 else 0.0)
    if put_in < 0 and sure > SURE and model.explained > LITTLE:
        against = " and accelerates against it" if model.sure(0) < -SURE else ""
        case = "brakes" if view.record.drive is None else "reversed"
        yield view.error("sign", force, case, against=against)
    elif model.clean and model.explained < NOTHING and model.force.size / model.every > 100:
        signal = view.signal("force")
        white = signal is not None and abs(np.corrcoef(signal[1:], signal[:-1])[0, 1]) < 0.2
        yield view.finding(white, "unrelated", force, share=max(model.explained, 0.0))
    if model.sure(0) < -SURE and put_in > 0 and model.explained > LITTLE:
        mass, error = model.values[0], model.errors[0]
        yield view.warning("sign", force, "negative_mass", mass=mass, error=error)


UNSURE = 3.0
"""Ratio of the rough mass to its standard error below which the accelerations are too small."""
STIFFNESS = 3
"""Column of the stiffness in the rough model."""
SPREAD = 1.7
"""Ratio of the 90 % and 10 % quantiles of the speed below which there is only one speed."""
MOST = 0.97
"""Share of the time at rest above which there is too little motion."""


def of_excitation(view: View, model: Rough) -> Iterator[Finding]:
    """Find too small accelerations, a single speed, and too little motion."""
    name = view.name("x")
    if not model.clean:
        yield view.warning("excitation", name, "no_acceleration")
        return
    if abs(model.sure(0)) < UNSURE:  # at one frequency, a stiffness has the effect of a mass
        plain = np.delete(model.columns, STIFFNESS, axis=1)[:: model.every]
        values, errors, _ = robust(plain, model.force[:: model.every])
        if abs(values[0]) < UNSURE * errors[0]:
            of_mass = "kg m^2" if view.unit("x") == "rad" else "kg"
            given = {"mass": values[0], "error": errors[0], "of_mass": of_mass}
            yield view.warning("excitation", name, "no_mass", **given)
    if (share := model.moving.mean()) < 1 - MOST:
        yield view.warning("excitation", name, "rest", share=share)
    speed = np.abs(model.v[model.moving])
    low, high = np.quantile(speed, (0.1, 0.9)) if speed.size > 20 else (0.0, 0.0)
    if high < SPREAD * low:
        yield view.warning("speeds", name, low=low, high=high)


LARGE = 0.12
"""Ratio of the drift to the robust spread of the force above which it is reported."""
DRIFTS = 4.5
LAGS = (-20, -10, -5, -3, -2, -1, 1, 2, 3, 5, 10, 20)
"""Delays tried first, in samples; then those between the neighbours of the best one are tried."""
BETTER = 0.88
"""Largest ratio of the unexplained parts with and without a delay that is reported."""
WORSE = 1.05
"""Smallest such ratio that the opposite delay must have."""
RESOLVED = 0.2
"""Least of `LAGS` that is reported, relative to the standard deviation of the smoothing window."""
LINE = 0.45
"""Share of one spectral line in the power of the residuals above which it is a hum."""
LOUD = 0.02
"""Ratio of the amplitude of a hum to the spread of the force above which it is reported."""
PERIODS, CLEAR, ANSWER = 8, 20.0, 0.01
"""Least periods in the record, power over the background, and share of the power of a spectral line
of the velocity."""
HARMONICS = (1, 2)
"""Harmonics of an excitation that friction can cause in the force."""
UNEQUAL, DIFFERS = 0.04, 6.0
"""Least difference of the mass between both directions: relative, and in standard errors."""


def of_residue(view: View, model: Rough) -> Iterator[Finding]:
    """Find drift, delay and hum of the force, and a mass that depends on the direction.

    The model of these checks has a free friction curve and a drift.
    """
    free = rough_model(view, curve=True)
    if free is None or not model.clean:
        return
    if model.explained >= 0.5:
        rise = float(free.values[-1])
        drifts = abs(rise) > LARGE * model.spread and abs(free.sure(-1)) > DRIFTS
        if drifts and not model.one_way():
            yield view.warning("drift", view.name("force"), rise=rise)
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
    found = left[best] < BETTER and left[-best] > WORSE
    if not found or abs(best) <= max(1, RESOLVED * free.width):
        return
    k = LAGS.index(best)
    best = min(range(LAGS[max(k - 1, 0)], LAGS[min(k + 1, len(LAGS) - 1)] + 1), key=unexplained)
    when, shift = "late" if best > 0 else "early", -best * model.step
    values = {"when": when, "time": abs(shift), "samples": abs(best), "shift": shift}
    yield view.warning("delay", view.name("force"), **values)


def _hum(view: View, free: Rough) -> Iterator[Finding]:
    """Find a periodic force that the drive does not cause."""
    limit = 5 * float(np.median(np.abs(free.residual)))
    power, window = _power(free, np.clip(free.residual, -limit, limit))
    k = int(np.argmax(power[2:])) + 2
    share = float(power[max(k - 2, 0) : k + 3].sum() / (power.sum() + 1e-300))
    size = 2 * float(np.sqrt(power[k])) / float(window.sum())
    if share <= LINE or size <= LOUD * free.spread:
        return
    if not any(_answered(free, round(k / n)) for n in HARMONICS):
        values = {"size": size, "frequency": k / window.size / free.step, "share": share}
        yield view.warning("hum", view.name("force"), **values)


def _power(free: Rough, signal: Array) -> tuple[Array, Array]:
    """Return the mean power of the blocks of a signal under a Hann window, and the window."""
    parts = signal.reshape(free.blocks, -1)
    window = np.hanning(parts.shape[1])
    return np.mean(np.abs(np.fft.rfft(parts * window)) ** 2, axis=0), window


def _answered(free: Rough, k: int) -> bool:
    """Return True if the velocity has a spectral line at bin k, which indicates an excitation.

    Below `PERIODS` periods a line and a single move are indistinguishable, and the result is False;
    a slow excitation that only bends bristles can therefore be reported as a hum. In the blocks of
    a long record, such lines are ignored.
    """
    if k < PERIODS:
        return free.blocks > 1
    power, _ = _power(free, free.v - free.v.mean())
    line = power[k - 2 : k + 3]
    background = np.median(np.concatenate([power[k // 2 : k - 3], power[k + 4 : 2 * k]]))
    return bool(line.max() > CLEAR * background and line.sum() > ANSWER * power.sum())


def _unequal(view: View, free: Rough) -> Iterator[Finding]:
    """Find a mass that depends on the direction."""
    value, error = free.with_column(free.a * np.sign(free.v) * free.moving)
    ratio = value / free.values[0]
    if abs(ratio) > UNEQUAL and abs(value) > DIFFERS * error:
        way = "forwards" if ratio > 0 else "backwards"
        yield view.warning("unequal", view.name("force"), more=2 * abs(ratio), way=way)


HOPELESS = {"standstill", "noise", "constant", "short", "wrap", "swapped", "glitch", "frozen"}
"""Errors after which a rough model of the drive is meaningless."""
ALONE = (of_times, of_jumps, of_spikes, of_frozen, of_velocity, of_motion)
"""Checks that run before the rough model is computed."""
OF_MODEL = (of_direction, of_excitation, of_resolution, of_residue)
"""Checks that need the rough model."""


def check(name: str, records: Sequence[Record], roles: Mapping[str, str]) -> Findings:
    """Check the records and return the findings, errors first.

    Args:
        name: name of the data.
        records: records to check.
        roles: part in the drive ("x", "v", "a", "force") -> signal, if the names differ; only
            signals with a part are compared with each other.
    """
    timed = [k for k, one in enumerate(records) if one.t is not None]
    found = [f for k in timed for f in _of_record(View.of(records[k], k, roles))]
    found += _of_points([k for k in range(len(records)) if k not in timed], records, roles)
    found.sort(key=lambda finding: finding.severity != "error")
    return Findings(tuple(found), name, tuple(one.name for one in records))


def _of_points(
    numbers: Sequence[int], records: Sequence[Record], roles: Mapping[str, str]
) -> Iterator[Finding]:
    """Yield the findings of all points together: each record may be of one speed."""
    if not numbers:
        return
    some = [records[k] for k in numbers]
    shared = [n for n in some[0].signals if all(n in one.signals for one in some)]
    signals = {n: np.concatenate([one.signals[n] for one in some]) for n in shared}
    whole = replace(some[0], signals=signals) if shared else some[0]
    for finding in of_points(View.of(whole, numbers[0], roles)):
        yield from (replace(finding, record=k) for k in numbers)


def _of_record(view: View) -> Iterator[Finding]:
    alone = [finding for of in ALONE for finding in of(view)]
    if any(f.kind == "wrap" for f in alone):  # a wrap looks like glitches
        alone = [f for f in alone if f.kind != "glitch"]
    yield from alone
    hopeless = any(f.severity == "error" and f.kind in HOPELESS for f in alone)
    model = None if hopeless else rough_model(view)
    yield from of_clipping(view)
    yield from of_units(view, model)
    if model is not None:
        for of in OF_MODEL:
            yield from of(view, model)
