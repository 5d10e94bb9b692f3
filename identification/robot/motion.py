"""Motion and torques of all joints of a record, filtered without phase shift.

Positions are filtered by a low pass and differentiated. Its cut-off lies far above the frequencies
of the motion, so that the equations of motion hold for the filtered motion. Torques are filtered
and decimated. The friction of a joint is ambiguous where its own velocity changes sign: only the
equations of this joint are omitted there.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from math import pi
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.differentiate import Velocity, derivatives, uncertain
from identification.data.filters import Decimation, Filter, rounded_level, spectrum
from identification.data.record import Array, Record
from identification.robot.dynamics import WHERE, RobotModel
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


def column(record: Record, joint: str, names: Iterable[str]) -> str | None:
    """Return the channel of a joint, None without one."""
    return next((n for n in (name.format(joint) for name in names) if n in record), None)


def check_columns(model: RobotModel, data: Dataset) -> None:
    """Check names, units and ranges of the columns.

    Raises:
        ValueError: missing columns, units of another kind, positions in degrees or millimetres;
            all problems at once.
    """
    problems = list[str]()
    for record in data:
        missing = [
            f"{joint} [{unit}]" if names is POSITIONS else f"{joint}_torque [{force}]"
            for names in (POSITIONS, TORQUES)
            for joint, unit, force in zip(model.names, model.units, model.forces, strict=True)
            if column(record, joint, names) is None
        ]
        have, hint = ", ".join(record.signals), "name others with columns= (--column NAME=COLUMN)"
        if len(missing) == 2 * len(model.joints):
            hint = f"is it the log of a robot other than '{model.urdf.name}'? {hint}"
        if missing:
            problems.append(
                f"data '{record.name}': expected columns {', '.join(missing)}, got {have}; {hint}, "
                "or fix joints without a log in the URDF"
            )
        else:
            problems += _wrong_numbers(model, record)
    if problems:
        raise ValueError(f"{WHERE}: " + "; ".join(problems))


def _wrong_numbers(model: RobotModel, record: Record) -> Iterator[str]:
    """Yield messages about units and positions of one record."""
    low, high = model.limits("lower", -np.inf), model.limits("upper")
    for k, joint in enumerate(model.names):
        for names, unit in ((POSITIONS, model.units[k]), (TORQUES, model.forces[k])):
            channel = column(record, joint, names) or joint
            if record.unit(channel) not in ("", unit):
                yield f"column {channel}: expected unit {unit}, got {record.unit(channel)}"
        channel = column(record, joint, POSITIONS) or joint
        q, (factor, other) = record[channel], MISTAKES[model.units[k]]
        span = high[k] - low[k] if np.isfinite(high[k] - low[k]) else 20.0
        ends = float(q.min()), float(q.max())
        slack = 0.1 * span
        inside = factor * ends[0] > low[k] - slack and factor * ends[1] < high[k] + slack
        if ends[1] - ends[0] > 1.5 * span:
            hint = "is it the log of another robot?"
            if inside:
                hint = f"are they in {other}? units={{'{channel}': '{other}'}} "
                hint += f"(--unit {channel}={other})"
            yield (
                f"data '{record.name}': column {channel}: expected positions within "
                f"{low[k]:g} ... {high[k]:g} {model.units[k]}, got {ends[0]:.4g} ... "
                f"{ends[1]:.4g}; {hint}"
            )


def motions(model: RobotModel, data: Dataset, filter: Filter | None) -> tuple[RobotMotion, ...]:
    """Return the filtered motion of each record.

    Args:
        model: the robot.
        data: records with a position and a torque of each joint, and a velocity if measured.
        filter: filter of all records; None: the highest cut-off, up to 10 bandwidths of the motion,
            for which noise has a negligible share in the acceleration.

    Raises:
        ValueError: see `check_columns`; unequal intervals, records shorter than the filter, or no
            joint moves.
    """
    check_columns(model, data)
    found = tuple(_motion(model, record.uniform(), filter) for record in data)
    if not any(one.moves.any() for one in found):
        raise ValueError(f"{WHERE}: expected joints that move, got '{data.name}', where all rest")
    return found


def _signals(model: RobotModel, record: Record) -> Iterator[tuple[Array, Array | None, Array]]:
    """Yield position, velocity if measured, and torque of each joint."""
    for joint in model.names:
        q, tau = (record[column(record, joint, names) or joint] for names in (POSITIONS, TORQUES))
        rate = column(record, joint, VELOCITIES)
        yield q, None if rate is None else record[rate], tau


def _cutoff(q: Array, v: Array | None, mixer: Velocity, step: float) -> float | None:
    """Return the cut-off [Hz] that suits one joint; None if its motion does not exceed noise."""
    band, highest = mixer.band(q, v, step), 0.1 / step
    for cutoff in np.geomspace(BANDS, 2.0, 8) * band:
        filter = Filter(min(float(cutoff), highest))
        _, speed, acceleration = (
            y[filter.inside(q.size, step)] for y in derivatives(q, v, step, filter, mixer)
        )
        noise = mixer.errors(filter, step)
        if not speed.size:
            continue
        if noise[1] ** 2 < NOISE * np.mean(acceleration**2):
            return filter.cutoff
    return None


def _motion(model: RobotModel, record: Record, filter: Filter | None) -> RobotMotion:
    step = record.step
    signals = [*_signals(model, record)]
    mixers = [Velocity.of(q, v, step) for q, v, _ in signals]
    if filter is None:
        each = [
            _cutoff(q, v, mixer, step) for (q, v, _), mixer in zip(signals, mixers, strict=True)
        ]
        known = [cutoff for cutoff in each if cutoff is not None]
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
