"""Conversion of the log of a drive to the motion and force of its load.

    x = count c or angle / ratio,   force = phi(F_m, v),   F_m = ratio torque_constant i

i is the current, c the counts of the encoder and phi the force after the losses of the gear, see
`symfric.Drive`. The force does not include the inertia m_r of the rotor: a mass that is fitted to
the record is that of load and rotor.

The efficiency is applied as known. A record does not distinguish it from friction in proportion to
the load; with an efficiency of 1, the losses of the gear are part of the fitted friction. The
direction of power uses a velocity filtered as that of `InverseDynamics`; near a reversal, where it
is uncertain, a static law is not compared with the data.

The losses make the force jump at reversals, which widens its band. The filter then keeps more of
the noise of the acceleration, and the residuals of a coarse encoder consist mostly of it; see
`identification.verdict.judge` for dependence on accelerations.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from identification.data.differentiate import Velocity, derivatives
from identification.data.filters import choose_filter
from identification.data.record import Array, Record
from symfric.drives.drive import Drive
from symfric.foundation import checks

CERTAIN = 0.35
"""Largest step of a counter that wraps, relative to its range; a half has no direction."""


def at_load(record: Record, drive: Drive) -> Record:
    """Return the record of the load with x, v, a and force instead of counts, angles and current.

    Raises:
        ValueError: no current, a force at the load instead of or next to it, or positions in units
            that the drive does not relate to its load.
    """
    where = f"read '{record.name}': drive"
    signals, units = dict(record.signals), dict(record.units)
    forces = [n for n, unit in units.items() if unit in ("N", "N m")]
    if "current" not in signals or "force" in signals:
        got = ", ".join(f"{n} [{units[n] or '?'}]" for n in signals)
        name = next((record.columns.get(n, n) for n, unit in units.items() if unit == "A"), "...")
        hint = f"name it with columns={{'current': '{name}'}} (--column current={name})"
        if forces:
            hint = "a log of forces or torques of the load is read without a drive"
        what = "a column of the current [A] and none of the force of the load"
        raise ValueError(f"{where}: expected {what}, got {got}; {hint}")
    along, force = ("rad", "N m") if drive.turning else ("m", "N")
    for name, rate in (("x", ""), ("v", "/s"), ("a", "/s^2")):
        if name in signals:
            unit = units[name].removesuffix(rate) if rate else units[name]
            factor = _factor(f"{where}: {name}", unit, drive)
            if name == "x" and unit == "1" and drive.counter is not None:
                signals[name] = _unwrapped(f"{where}: x", signals[name], drive.counter)
            signals[name], units[name] = factor * signals[name], along + rate
    found = replace(record, signals=signals, units=units, drive=drive)
    lossless = float(drive.force_constant) * signals.pop("current")
    v = np.zeros(record.size) if drive.losses == (0.0, 0.0) else _velocity(found, lossless)
    units.pop("current")
    columns = {n: c for n, c in record.columns.items() if n != "current"}
    signals["force"], units["force"] = np.asarray(drive.at_load(lossless, v)), force
    columns["force"] = record.columns.get("current", "current")
    return replace(found, signals=signals, units=units, columns=columns)


def _factor(where: str, unit: str, drive: Drive) -> float:
    """Return the factor from a position, in counts, angle or length, to that of the load."""
    if unit == "1":
        if drive.count is None:
            what = "counts_per_turn or resolution in the drive for a position in counts"
            raise ValueError(f"{where}: expected {what}, got none")
        return drive.count
    if unit == "rad" and drive.encoder == "motor":
        return 1 / float(drive.ratio)
    if (unit == "rad") != drive.turning:
        such = "an angle of the load" if drive.turning else "a length, or an angle of the motor"
        hint = "lead or drum_radius make the axis of a drive linear"
        raise checks.refused(where, such, unit, hint)
    return 1.0


def _unwrapped(where: str, counts: Array, counter: float) -> Array:
    """Return counts without wraps.

    Raises:
        ValueError: the counter moves so far between samples that its direction is uncertain.
    """
    found = np.unwrap(counts, period=counter)
    most = float(np.abs(np.diff(found)).max(initial=0.0)) / counter
    if most > CERTAIN:
        what = f"counts that move by at most {CERTAIN:.0%} of the counter {counter:g} per sample"
        hint = "record faster, or with a counter of more bits"
        raise ValueError(f"{where}: expected {what}, got {most:.0%}; {hint}")
    return found


def _velocity(record: Record, force: Array) -> Array:
    """Return the velocity of the load; differences of the position at unequal intervals."""
    x, v = (record.signals.get(name) for name in ("x", "v"))
    if x is None and v is None:
        what = "a position or a velocity, on which the losses of the gear depend"
        raise ValueError(f"read '{record.name}': drive: expected {what}, got none")
    try:
        step = record.uniform().step
    except ValueError:
        known: Any = x if v is None else v
        return np.gradient(known, record.time) if v is None else known
    mixer = Velocity.of(x, v, step)
    filter = choose_filter(force, step, [mixer.band(x, v, step)])
    return derivatives(x, v, step, filter, mixer)[1]
