"""Repairs that somebody asks for: nothing is repaired by itself."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from identification.data.check_spikes import spike_samples
from identification.data.record import Record
from identification.data.units import unit
from symfric.foundation import checks


def without_spikes(record: Record) -> Record:
    """The record with samples far off their neighbours replaced by a line between those."""
    signals = dict(record.signals)
    for name, values in record.signals.items():
        far, _ = spike_samples(values, position=name == "x")
        if far.size:
            rest = np.setdiff1d(np.arange(values.size), far)
            signals[name] = np.interp(np.arange(values.size), rest, values[rest])
    return replace(record, signals=signals)


def unwrapped(record: Record, periods: Mapping[str, float]) -> Record:
    """The record with signals that were counted modulo a period counted through.

    Raises:
        ValueError: an unknown signal, a period that is not positive.
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
    """The record with signals times factors: a sign that was wrong, newtons from volts.

    Args:
        record: to change.
        factors: signal -> factor.
        units: signal -> its unit afterwards, where that changes.

    Raises:
        ValueError: an unknown signal, a factor of 0, no unit.
    """
    where = f"data '{record.name}': scaled"
    signals, now = dict(record.signals), dict(record.units)
    for name, factor in checks.named(where, factors).items():
        key = record.channel(name)
        number = checks.number(f"{where}: {name}", factor)
        if number == 0:
            raise ValueError(f"{where}: {name}: expected a factor other than 0, got 0")
        signals[key] = number * signals[key]
    for name, said in checks.named(f"{where}: units", units).items():
        key, meant = record.channel(name), unit(checks.text(f"{where}: units: {name}", said))
        if meant is None:
            raise checks.refused(f"{where}: units: {name}", "a unit, such as N or N m", said)
        signals[key], now[key] = meant.factor * signals[key], meant.si
    return replace(record, signals=signals, units=now)
