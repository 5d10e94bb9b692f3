"""Complete check of a data set, and the checks of times, points, units and a measured velocity."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from identification.data.check_drive import (
    of_dead_time,
    of_direction,
    of_drift,
    of_excitation,
    of_motion,
    of_one_way,
    of_residue,
)
from identification.data.check_signals import (
    of_clipping,
    of_frozen,
    of_jumps,
    of_resolution,
    of_spikes,
)
from identification.data.findings import Finding, Findings, View
from identification.data.record import GAP, JITTER, Record
from identification.data.rough import Rough, rough_model, smoothed

FEWEST, FEW = 20, 50
"""Numbers of samples below which a record is an error, and a warning."""
SLOW = 0.5
"""Sample interval [s] above which times may be in ms."""


def of_times(view: View) -> Iterator[Finding]:
    """Find gaps, irregular intervals, too few samples, times that may be in another unit."""
    record = view.record
    if record.size < FEW:
        text = f"The record has only {record.size} samples."
        yield view.finding("short", "t", text, "error" if record.size < FEWEST else "warning")
    if record.t is None or record.size < 3:
        return
    intervals = np.diff(record.t)
    usual = float(np.median(intervals))
    gaps = np.flatnonzero(intervals > GAP * usual)
    if gaps.size:
        k = int(gaps[np.argmax(intervals[gaps])])
        text = (
            f"The times have {gaps.size} gap(s), the longest of {intervals[k]:.3g} s at "
            f"{view.at(k)}: data.resampled() makes one record of each piece."
        )
        yield view.warning("gap", "t", text, k, k + 1)
    off = np.abs(intervals - usual)
    off[gaps] = 0.0
    k = int(np.argmax(off))
    if off[k] > 2 * JITTER * usual:
        uneven = float(np.mean(off > 2 * JITTER * usual))
        text = (
            f"The sample intervals are not equal: {uneven:.1%} are off {usual:.4g} s by more than "
            f"{2 * JITTER:.0%}, most {intervals[k]:.4g} s at {view.at(k)}: use data.resampled()."
        )
        yield view.warning("irregular", "t", text, k, k + 1)
    whole = bool(np.all(np.abs(record.t - np.rint(record.t)) < 1e-9))
    if usual >= SLOW and whole and record.size >= 200:
        text = (
            f"The samples are {usual:g} s apart over {np.ptp(record.t) / 3600:.2g} hours, at whole "
            "seconds: are the times in ms, or row numbers?"
        )
        yield view.warning("units", "t", text)


FEWEST_POINTS = 4
WRONG = 0.2
"""Share of points with friction along the motion below which the sign is wrong."""


def of_points(view: View) -> Iterator[Finding]:
    """Find too few points, one direction, one speed, a force that drives instead of braking."""
    record = view.record
    if "v" not in record or "F" not in record:
        return
    v, force = record["v"], record["F"]
    if record.size < FEWEST_POINTS:
        text = f"The data have only {record.size} points."
        yield view.warning("short", "v", text)
    if np.ptp(v) == 0 or np.ptp(force) == 0:
        name = "v" if np.ptp(v) == 0 else "F"
        text = f"{name} is {record[name][0]:g} throughout."
        yield view.error("constant", name, text)
        return
    moving = np.abs(v) > 0.01 * np.abs(v).max()
    both = min(np.mean(v > 0), np.mean(v < 0)) > 0.1
    around = float(np.median(force)) if both else 0.0
    if np.mean(v[moving] * (force[moving] - around) > 0) < WRONG:
        text = (
            "F is opposite to v in most points: friction counts as the force that the drive needs, "
            "so F v > 0; reverse one sign."
        )
        yield view.error("sign", "F", text)
    if not both:
        text = "All points have one direction: friction and a constant force are not separable."
        yield view.warning("one-way", "v", text)


LIMITS = {
    "m": (1e-9, 50.0, 1e5),
    "rad": (1e-9, 1e5, 1e9),
    "N": (1e-9, 1e6, 1e10),
    "N m": (1e-12, 1e6, 1e10),
    "m/s": (1e-9, 100.0, 1e5),
    "rad/s": (1e-9, 1e4, 1e8),
}
"""Ranges: below the first or above the last is an error, above the second a warning."""
FASTEST = {"m": (50.0, 1e5), "rad": (1e4, 1e8)}
"""Speeds of a position for a warning and an error."""
TOGETHER = (("m", "N"), ("rad", "N m"))


def of_units(view: View, model: Rough | None) -> Iterator[Finding]:
    """Find units that do not belong together, and implausible ranges."""
    record = view.record
    mixed = [record.units[view.roles[r]] for r in ("x", "force") if r in view.roles]
    if len(mixed) == 2 and "" not in mixed and tuple(mixed) not in TOGETHER:
        text = (
            f"{view.name('x')} is in {mixed[0]} and {view.name('force')} in {mixed[1]}: a slide "
            "needs m and N, a shaft rad and N m."
        )
        yield view.error("units", view.name("force"), text)
    for signal in view.roles.values():
        low, doubt, high = LIMITS.get(record.units[signal], (0.0, np.inf, np.inf))
        range_ = float(np.ptp(record.signals[signal]))
        if 0 < range_ < low or range_ > doubt:
            text = f"{signal} has a range of {range_:.3g} {record.units[signal]}: check its unit."
            yield view.finding(
                "units", signal, text, "error" if range_ < low or range_ > high else "warning"
            )
    if model is not None and model.clean:
        unit = record.units[view.roles["x"]]
        fastest = float(np.quantile(np.abs(model.v), 0.99))
        doubt, high = FASTEST.get(unit, (np.inf, np.inf))
        if fastest > doubt:
            text = (
                f"{view.roles['x']} moves at {fastest:.3g} {unit}/s: check its unit and that of "
                "the times."
            )
            yield view.finding(
                "units", view.roles["x"], text, "error" if fastest > high else "warning"
            )


WIDTH = 12.0
"""Standard deviation of the smoothing window of both signals, in samples."""
ALIKE = 0.7
"""Least correlation of both."""
OFF = 0.2
"""Relative error of the scale above which it is reported."""
KNOWN = {
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


def of_velocity(view: View) -> Iterator[Finding]:
    """Find a velocity that differs from the slope of the position, or an acceleration likewise."""
    record = view.steady
    if record is None or record.size < 100:
        return
    for of, rate in (("x", "v"), ("v", "a")):
        if of not in view.roles or rate not in view.roles:
            continue
        name, other = view.roles[rate], view.roles[of]
        if np.ptp(record[name]) == 0 or np.ptp(record[other]) == 0:
            continue
        edge = int(3 * WIDTH)
        derived = (smoothed(record[other], WIDTH, 1) / record.step)[edge:-edge]
        given = smoothed(record[name], WIDTH)[edge:-edge]
        if derived.std() == 0 or given.std() == 0:
            continue
        alike = float(np.corrcoef(derived, given)[0, 1])
        scale = float(given.std() / derived.std())
        if alike < -ALIKE:
            text = (
                f"{name} is opposite to the slope of {other} (correlation {alike:.2f}): the sign "
                "of one is wrong."
            )
            yield view.error("sign", name, text)
        elif alike < ALIKE:
            text = f"{name} is not the slope of {other} (correlation {alike:.2f})."
            yield view.warning("velocity", name, text)
        elif abs(scale - 1) > OFF:
            near = [text for known, text in KNOWN.items() if abs(scale / known - 1) < 0.1]
            text = (
                f"{name} is {scale:.4g} times the slope of {other}: "
                f"{near[0] if near else 'a wrong unit or scale'}."
            )
            yield view.finding(
                "units", name, text, "error" if near or scale > 5 or scale < 0.2 else "warning"
            )


HOPELESS = {"standstill", "noise", "constant", "short", "wrap", "swapped", "glitch", "frozen"}
"""Errors after which a rough model of the drive is meaningless."""


def check(name: str, records: Sequence[Record], roles: Mapping[str, str]) -> Findings:
    """Check the records; errors come first.

    Args:
        name: of the data.
        records: to check.
        roles: part in the drive ("x", "v", "a", "force") -> signal, if the names differ; only
            signals with a part are compared with each other.
    """
    found = [f for k, one in enumerate(records) for f in _of_record(View.of(one, k, roles))]
    found.sort(key=lambda finding: finding.severity != "error")
    return Findings(tuple(found), name, tuple(one.name for one in records))


def _of_record(view: View) -> Iterator[Finding]:
    if view.record.t is None:
        yield from of_points(view)
        return
    jumps = list(of_jumps(view))
    wrapped = any(f.kind == "wrap" for f in jumps)
    spikes = [f for f in of_spikes(view) if not (wrapped and f.kind == "glitch")]
    alone = [
        *of_times(view),
        *jumps,
        *spikes,
        *of_frozen(view),
        *of_velocity(view),
        *of_motion(view),
    ]
    yield from alone
    hopeless = any(f.severity == "error" and f.kind in HOPELESS for f in alone)
    model = None if hopeless else rough_model(view)
    yield from of_clipping(view)
    yield from of_units(view, model)
    if model is not None:
        yield from of_direction(view, model)
        yield from of_one_way(view, model)
        yield from of_excitation(view, model)
        yield from of_resolution(view, model)
        free = rough_model(view, curve=True)
        yield from of_drift(view, model, free)
        yield from of_dead_time(view, model, free)
        yield from of_residue(view, free)
