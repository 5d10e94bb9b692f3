"""Resampling, time shifts and repairs of records on request.

No function bridges a gap silently.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

import numpy as np

from identification.data.check_signals import spike_samples
from identification.data.record import GAP, Array, Record
from identification.data.units import unit
from symfric.foundation import checks

SHORTEST = 10
"""Smallest number of samples in a piece between two gaps that is kept."""
MOST = 1e8
"""Largest number of samples of a record."""


def _check_no_gap(record: Record, where: str) -> None:
    parts, t = record.pieces, record.time
    if len(parts) > 1:
        k = parts[0].stop
        raise ValueError(
            f"{where}: expected intervals of at most {GAP:g} times the median one, got a gap of "
            f"{t[k] - t[k - 1]:.4g} s at t = {t[k - 1]:.6g} s ({len(parts) - 1} gaps); "
            "use gap='split' for a record of each piece"
        )


def resampled(
    record: Record, step: float | None = None, gap: Literal["split", "refuse"] = "split"
) -> list[Record]:
    """Return records at equal intervals of `step` [s], one for each piece between gaps.

    Positions are interpolated by cubic Hermite polynomials, all other signals linearly. There is no
    filter: with a larger step, noise is aliased and not averaged. The controller is dropped,
    because its reference belongs to the old samples. Pieces of fewer than 10 old or new samples are
    dropped.

    Args:
        record: record over time.
        step: sample interval; None: the median interval.
        gap: treatment of intervals longer than 5 times the median.

    Raises:
        ValueError: the step is not positive, there is a gap with gap="refuse", or no piece is long
            enough.
    """
    where = f"data '{record.name}': resampled"
    checks.choice(f"{where}: gap", gap, ("split", "refuse"))
    step = record.median_step if step is None else step
    step = checks.number(f"{where}: step", step, unit="s", above=0.0)
    span = float(record.time[-1] - record.time[0])
    if span > MOST * step:
        raise ValueError(
            f"{where}: step: expected at most {MOST:.0e} samples, got {span / step:.1e} from "
            f"{step:g} s over {span:g} s"
        )
    if gap == "refuse":
        _check_no_gap(record, where)
    parts = [record.at(part) for part in record.pieces if part.stop - part.start >= SHORTEST]
    kept = list[Record]()
    for part in parts:
        t, span = part.time, part.time[-1] - part.time[0]
        if span >= 9 * step:
            new = t[0] + step * np.arange(int(span / step * (1 + 1e-12)) + 1)
            signals = {key: interpolated(part, key, new) for key in part.signals}
            kept.append(replace(part, t=new, signals=signals, loop=None, first_row=0))
    if not kept:
        raise ValueError(
            f"{where}: expected a piece of at least {SHORTEST} samples without a gap, got none at "
            f"a step of {step:g} s"
        )
    if len(kept) == 1:
        return kept
    return [replace(p, name=f"{record.name} ({p.time[0]:.4g} s ...)") for p in kept]


def interpolated(record: Record, signal: str, at: Array) -> Array:
    """Return a signal at other times: positions by cubic Hermite, other signals linearly."""
    values = record.signals[signal]
    if record.units[signal] in ("m", "rad"):
        return hermite(at, record.time, values)
    return np.interp(at, record.time, values)


def delayed(record: Record, delays: Mapping[str, float]) -> Record:
    """Return the record with delayed signals, new(t) = old(t - delay), with the ends cut.

    A recorder that writes the force 2 ms late is corrected by {"force": -0.002}.

    Raises:
        ValueError: an unknown signal, a delay as long as the record, or a record with gaps.
    """
    where = f"data '{record.name}': delayed"
    given = {record.channel(name): checks.number(f"{where}: {name}", value, unit="s")
             for name, value in checks.named(where, delays).items()}  # fmt: skip
    _check_no_gap(record, where)
    t = record.time
    late, early = max([0.0, *given.values()]), min([0.0, *given.values()])
    inside = (t >= t[0] + late) & (t <= t[-1] + early)
    if np.count_nonzero(inside) < 2:
        raise ValueError(
            f"{where}: expected delays shorter than the record of {t[-1] - t[0]:g} s, got "
            f"{max(late, -early):g} s"
        )
    rows = np.flatnonzero(inside)
    cut = record.at(slice(int(rows[0]), int(rows[-1]) + 1))
    shifted = {n: interpolated(record, n, cut.time - delay) for n, delay in given.items()}
    signals = {**cut.signals, **shifted}
    loop = None if {"x", "force"} & given.keys() else cut.loop
    return replace(cut, signals=signals, loop=loop)


def hermite(at: Array, t: Array, y: Array) -> Array:
    """Interpolate by cubic Hermite with second-order slopes; third order on uneven samples."""
    if t.size < 3:
        return np.interp(at, t, y)
    from scipy.interpolate import CubicHermiteSpline  # noqa: PLC0415 (slow to import)

    return CubicHermiteSpline(t, y, np.gradient(y, t))(at)


def without_spikes(record: Record) -> Record:
    """Return the record with spikes replaced by linear interpolation."""
    signals = dict(record.signals)
    for name, values in record.signals.items():
        far, _ = spike_samples(values, position=name == "x")
        if far.size:
            rest = np.setdiff1d(np.arange(values.size), far)
            signals[name] = np.interp(np.arange(values.size), rest, values[rest])
    return replace(record, signals=signals)


def unwrapped(record: Record, periods: Mapping[str, float]) -> Record:
    """Return the record with periodic signals unwrapped.

    Raises:
        ValueError: an unknown signal, or a period that is not positive.
    """
    where = f"data '{record.name}': unwrapped"
    signals = dict(record.signals)
    for name, period in checks.named(where, periods).items():
        key = record.channel(name)
        step = checks.number(f"{where}: {name}", period, unit=record.units[key], above=0.0)
        signals[key] = np.unwrap(signals[key], period=step)
    return replace(record, signals=signals)


def scaled(
    record: Record, factors: Mapping[str, float], units: Mapping[str, str] | None = None
) -> Record:
    """Return the record with scaled signals, for a wrong sign or to convert volts to newtons.

    Args:
        record: record to scale.
        factors: signal -> factor.
        units: signal -> its new unit, if it changes.

    Raises:
        ValueError: an unknown signal, a factor of 0, or an unknown unit.
    """
    where = f"data '{record.name}': scaled"
    signals, now = dict(record.signals), dict(record.units)
    for name, factor in checks.named(where, factors).items():
        key = record.channel(name)
        number = checks.number(f"{where}: {name}", factor)
        if number == 0:
            raise ValueError(f"{where}: {name}: expected a factor other than 0, got 0")
        signals[key] = number * signals[key]
    for name, given in checks.named(f"{where}: units", units).items():
        key, meant = record.channel(name), unit(checks.text(f"{where}: units: {name}", given))
        if meant is None:
            raise checks.refused(f"{where}: units: {name}", "a unit, such as N or N m", given)
        signals[key], now[key] = meant.factor * signals[key], meant.si
    return replace(record, signals=signals, units=now)
