"""Motion and torques of all joints of a record, filtered without phase shift.

Positions are filtered by a low pass and differentiated. Its cut-off lies far above the frequencies
of the motion, so that the equations of motion hold for the filtered motion. Torques are filtered
and decimated. The friction of a joint is ambiguous where its own velocity changes sign: only the
equations of this joint are omitted there.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import pi
from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.differentiate import Velocity, derivatives, uncertain
from identification.data.filters import Decimation, Filter, rounded_level, spectrum
from identification.data.record import Array, Record
from identification.robot.dynamics import WHERE, RobotModel
from symfric.foundation import checks
from symfric.foundation.shown import brief

POSITIONS = ("{}", "q_{}", "{}_position", "{}_pos", "{}_angle")
TORQUES = ("{}_torque", "tau_{}", "{}_effort", "{}_force")
VELOCITIES = ("{}_velocity", "{}_rate", "{}_vel", "dq_{}", "qd_{}")
"""Names of the columns of a joint."""
RATE = 10.0
"""Equations per period of the cut-off frequency."""
BANDS = 10.0
"""Largest cut-off of the positions, relative to the bandwidth of the motion."""
NOISE = 1e-4
"""Largest share of noise in the power of an acceleration, which lowers the inertia."""
MOST = 20_000
"""Largest number of equations per record and joint."""
UNLIMITED = 20.0
"""Usual range of joints without limits [rad, m]."""
FEWEST = 10
"""Smallest number of equations of a record."""
MISTAKES = {"rad": (pi / 180, "deg"), "m": (1e-3, "mm")}
"""Factor and name of a unit that may have been read as the SI unit."""


@final
@dataclass(frozen=True, eq=False)
class RobotMotion:
    """Equations of one record: R rows of n joints.

    Attributes:
        name: name of the record.
        t: times of the rows [s], shape (R,).
        q, v, a: position, velocity and acceleration, shape (R, n) each.
        tau: measured torques after filter and decimation, shape (R, n).
        noise: standard deviation of the white noise of `tau`, from its spectrum, shape (n,).
        kept: rows of each joint without a reversal, shape (R, n).
        moves: joints that move, shape (n,).
        filter: filter and decimation of the record.
    """

    name: str
    t: Array
    q: Array
    v: Array
    a: Array
    tau: Array
    noise: Array
    kept: NDArray[np.bool_]
    moves: NDArray[np.bool_]
    filter: Filter

    __repr__ = brief


class Channels(NamedTuple):
    """Channels of a joint in a record; None if missing."""

    position: str | None
    velocity: str | None
    torque: str | None


def channels(model: RobotModel, record: Record) -> list[Channels]:
    """Return the channels of each joint."""
    names = (POSITIONS, VELOCITIES, TORQUES)
    return [
        Channels(*(next((n for n in (f.format(j) for f in forms) if n in record), None)
                   for forms in names))
        for j in model.names
    ]  # fmt: skip


def problems(model: RobotModel, record: Record) -> Iterator[str]:
    """Yield messages about missing or constant columns and about other units."""
    found, where = channels(model, record), f"data '{record.name}'"
    every = [*zip(found, model.names, model.units, model.forces, strict=True)]
    missing = [f"{joint} [{unit}]" for c, joint, unit, _ in every if c.position is None]
    missing += [f"{joint}_torque [{force}]" for c, joint, _, force in every if c.torque is None]
    if missing:
        hint = "name others with columns= (--column NAME=COLUMN), or fix joints in the URDF"
        if len(missing) == 2 * len(found):
            hint = f"is it the log of a robot other than '{model.urdf.name}'? {hint}"
        have = ", ".join(record.signals)
        yield f"{where}: expected columns {', '.join(missing)}, got {have}; {hint}"
        return
    low, high = model.limits("lower", -np.inf), model.limits("upper")
    for k, (c, joint, unit, force) in enumerate(every):
        name = c.position or joint
        for channel, wanted in ((name, unit), (c.torque or joint, force)):
            if record.unit(channel) not in ("", wanted):
                yield f"{where}: column {channel}: expected {wanted}, got {record.unit(channel)}"
        q, tau, (factor, other) = record[name], record[c.torque or ""], MISTAKES[unit]
        if np.ptp(q) > 0 and np.ptp(tau) == 0:
            such = "torques that change while the joint moves"
            yield f"{where}: column {c.torque}: expected {such}, got {tau[0]:g} in every row"
        span, ends = high[k] - low[k], (float(q.min()), float(q.max()))
        span = span if np.isfinite(span) else UNLIMITED
        if ends[1] - ends[0] > 1.5 * span:
            hint = "is it the log of another robot?"
            if factor * (ends[1] - ends[0]) < 1.5 * span:
                hint = f"is it in {other}? units={{'{name}': '{other}'}} (--unit {name}={other})"
            yield (
                f"{where}: column {name}: expected positions within {low[k]:g} ... {high[k]:g} "
                f"{unit}, got {ends[0]:.4g} ... {ends[1]:.4g}; {hint}"
            )


def motions(model: RobotModel, data: Dataset, filter: Filter | None) -> tuple[RobotMotion, ...]:
    """Return the filtered motion of each record.

    Args:
        model: the robot.
        data: records with a position and a torque of each joint, and a velocity if measured.
        filter: filter of all records; None: the highest cut-off, up to 10 bandwidths of the motion,
            for which noise has a negligible share in the acceleration.

    Raises:
        ValueError: see `problems`; unequal intervals, records shorter than the filter, or no joint
            moves.
    """
    checks.kind(f"{WHERE}: data", data, Dataset, "a Dataset")
    if filter is not None:
        checks.kind(f"{WHERE}: filter", filter, Filter, "a filter, such as Filter(10.0)")
    if wrong := [text for record in data for text in problems(model, record)]:
        raise ValueError(f"{WHERE}: " + "; ".join(wrong))
    found = tuple(_motion(model, record.uniform(), filter) for record in data)
    if not any(one.moves.any() for one in found):
        raise ValueError(f"{WHERE}: expected joints that move, got '{data.name}', where all rest")
    return found


def _cutoff(q: Array, v: Array | None, mixer: Velocity, step: float) -> float | None:
    """Return the cut-off [Hz] that suits one joint; None if its motion does not exceed noise."""
    for cutoff in (np.geomspace(BANDS, 2.0, 8) * mixer.band(q, v, step)).tolist():
        filter = Filter(min(cutoff, 0.1 / step))
        a = derivatives(q, v, step, filter, mixer)[2][filter.inside(q.size, step)]
        if a.size and mixer.errors(filter, step)[1] ** 2 < NOISE * np.mean(a**2):
            return filter.cutoff
    return None


def _motion(model: RobotModel, record: Record, filter: Filter | None) -> RobotMotion:
    step = record.step
    signals = [
        (record[q or ""], None if v is None else record[v], record[tau or ""])
        for q, v, tau in channels(model, record)
    ]
    mixers = [Velocity.of(q, v, step) for q, v, _ in signals]
    if filter is None:
        pairs = zip(signals, mixers, strict=True)
        known = [found for (q, v, _), mixer in pairs if (found := _cutoff(q, v, mixer, step))]
        filter = Filter(float(np.median(known)) if known else 0.1 / step)
    if not filter.cutoff * step < 0.5:
        such = f"below half the sample rate, {0.5 / step:g} Hz"
        raise ValueError(f"data '{record.name}': cut-off: expected {such}, got {filter.cutoff:g}")
    if filter.decimation == 1:
        usual = max(1, round(1 / (RATE * filter.cutoff * step)))
        filter = replace(filter, decimation=max(usual, record.size // MOST))
    inside = filter.inside(record.size, step)
    rows = Decimation(record.time[inside].size, filter.decimation)
    if rows.rows < FEWEST:
        raise ValueError(
            f"{WHERE}: data '{record.name}': expected at least {FEWEST} equations after the filter "
            f"({filter}), got {rows.rows} from {record.time[-1] - record.time[0]:.3g} s; record "
            "for longer, or raise the cut-off with filter="
        )
    motion, slow, moves = list[list[Array]](), list[NDArray[np.bool_]](), list[bool]()
    for (q, v, _), mixer in zip(signals, mixers, strict=True):
        part = [y[inside] for y in derivatives(q, v, step, filter, mixer)]
        slow.append(rows.touched(uncertain(part[1], mixer.errors(filter, step)[0], step, filter)))
        moves.append(not slow[-1].all())
        motion.append([rows.centres(y) for y in part])
    torques = [tau for *_, tau in signals]
    level = np.array([rounded_level(tau, spectrum(tau)) for tau in torques])
    q, v, a = (np.column_stack([part[k] for part in motion]) for k in range(3))
    return RobotMotion(
        record.name, rows.centres(record.time[inside]), q, v, a,
        rows.columns(np.column_stack(torques)[inside]),
        np.sqrt(level * float(np.sum(rows.taps**2))),
        ~np.column_stack(slow), np.array(moves), filter,
    )  # fmt: skip
