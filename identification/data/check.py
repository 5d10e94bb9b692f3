"""Complete check of a data set, and the checks of times, points, units, velocity and motion."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from identification.data.check_drive import of_direction, of_excitation, of_residue
from identification.data.check_signals import (
    of_clipping,
    of_frozen,
    of_jumps,
    of_resolution,
    of_spikes,
)
from identification.data.findings import Array, Finding, Findings, View, count_of
from identification.data.record import GAP, JITTER, Record
from identification.data.rough import Rough, rough_model, smoothed, white_part

FEWEST, FEW = 20, 50
"""Numbers of samples below which a record is an error, and a warning."""
SLOW = 0.5
"""Sample interval [s] above which times may be in ms."""


def of_times(view: View) -> Iterator[Finding]:
    """Find gaps, irregular intervals, too few samples, times that may be in another unit."""
    record, t = view.record, view.record.time
    if record.size < FEW:
        text = f"The record has only {record.size} samples."
        yield view.finding("error" if record.size < FEWEST else "warning", "short", "t", text)
    if record.size < 3:
        return
    intervals = np.diff(t)
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
    if usual >= SLOW and record.size >= 200 and np.all(np.abs(t - np.rint(t)) < 1e-9):
        text = (
            f"The samples are {usual:g} s apart over {np.ptp(t) / 3600:.2g} hours, at whole "
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
        yield view.warning("short", "v", f"The data have only {record.size} points.")
    for name in ("v", "F"):
        if np.ptp(record[name]) == 0:
            yield view.error("constant", name, f"{name} is {record[name][0]:g} throughout.")
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
    x, force = view.name("x"), view.name("force")
    mixed = tuple(view.unit(r) for r in ("x", "force") if r in view.roles)
    if len(mixed) == 2 and "" not in mixed and mixed not in TOGETHER:
        text = f"{x} is in {mixed[0]} and {force} in {mixed[1]}: a slide "
        yield view.error("units", force, f"{text}needs m and N, a shaft rad and N m.")
    for signal in view.roles.values():
        low, doubt, high = LIMITS.get(record.units[signal], (0.0, np.inf, np.inf))
        range_ = float(np.ptp(record.signals[signal]))
        if 0 < range_ < low or range_ > doubt:
            text = f"{signal} has a range of {range_:.3g} {record.units[signal]}: check its unit."
            severity = "error" if range_ < low or range_ > high else "warning"
            yield view.finding(severity, "units", signal, text)
    if model is not None and model.clean:
        fastest = float(np.quantile(np.abs(model.v), 0.99))
        doubt, high = FASTEST.get(view.unit("x"), (np.inf, np.inf))
        if fastest > doubt:
            text = f"{x} moves at {fastest:.3g} {view.unit('x')}/s: check its unit and that of "
            severity = "error" if fastest > high else "warning"
            yield view.finding(severity, "units", x, f"{text}the times.")


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
    edge = int(3 * WIDTH)
    for pair in (("x", "v"), ("v", "a")):
        if not {*pair} <= view.roles.keys():
            continue
        other, name = (view.roles[r] for r in pair)
        if np.ptp(record[name]) == 0 or np.ptp(record[other]) == 0:
            continue
        derived = (smoothed(record[other], WIDTH, 1) / record.step)[edge:-edge]
        given = smoothed(record[name], WIDTH)[edge:-edge]
        if derived.std() == 0 or given.std() == 0:
            continue
        alike = float(np.corrcoef(derived, given)[0, 1])
        scale = float(given.std() / derived.std())
        slope = f"the slope of {other}"
        if alike < -ALIKE:
            text = f"{name} is opposite to {slope} (correlation {alike:.2f}): the sign "
            yield view.error("sign", name, f"{text}of one is wrong.")
        elif alike < ALIKE:
            text = f"{name} is not {slope} (correlation {alike:.2f})."
            yield view.warning("velocity", name, text)
        elif abs(scale - 1) > OFF:
            near = [text for known, text in KNOWN.items() if abs(scale / known - 1) < 0.1]
            why = near[0] if near else "a wrong unit or scale"
            severity = "warning" if not near and 0.2 <= scale <= 5 else "error"
            text = f"{name} is {scale:.4g} times {slope}: {why}."
            yield view.finding(severity, "units", name, text)


MOVED = 6.0
"""Range of the position over its noise (standard deviation) below which nothing moved."""
COUNTS = 4
"""Encoder counts below which nothing moved."""
WHITE = 0.3
"""Correlation of neighbours below which a position is noise."""


def of_motion(view: View) -> Iterator[Finding]:
    """Find signals without motion."""
    x, force = view.signal("x"), view.signal("force")
    if x is not None and x.size >= 20:
        yield from _still(view, x)
    if force is not None and force.size >= 20 and np.ptp(force) == 0:
        name = view.name("force")
        text = f"{name} is {force[0]:g} {view.unit('force')} throughout: "
        if float(force[0]) == 0:
            text += "motion without a drive determines only friction over mass."
            yield view.warning("constant", name, text)
        else:
            yield view.error("constant", name, f"{text}nothing was measured.")


def _still(view: View, x: Array) -> Iterator[Finding]:
    name, unit = view.name("x"), view.unit("x")
    if np.ptp(x) == 0 or np.ptp(x) < COUNTS * count_of(x):
        text = f"{name} never changes by more than {np.ptp(x):.3g} {unit}: nothing moved."
        yield view.error("standstill", name, text)
        return
    centred, middle = x - x.mean(), float(np.ptp(np.quantile(x, (0.02, 0.98))))
    if float(centred[1:] @ centred[:-1] / (centred @ centred)) < WHITE:
        text = (
            f"{name} is noise of {float(np.std(np.diff(x))) / np.sqrt(2):.3g} {unit}: neighbouring "
            "samples are uncorrelated, which is not the motion of a body."
        )
        yield view.error("noise", name, text)
    elif middle < MOVED * white_part(x):
        text = f"{name} moves by {middle:.3g} {unit}, no more than its noise."
        yield view.error("standstill", name, text)


HOPELESS = {"standstill", "noise", "constant", "short", "wrap", "swapped", "glitch", "frozen"}
"""Errors after which a rough model of the drive is meaningless."""
ALONE = (of_times, of_jumps, of_spikes, of_frozen, of_velocity, of_motion)
"""Checks that precede the rough model."""
OF_MODEL = (of_direction, of_excitation, of_resolution, of_residue)
"""Checks that need it."""


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
