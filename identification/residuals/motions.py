"""Measured motion of a model: positions, rates, accelerations and inputs of one record."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.data.differentiate import derivatives, uncertain
from identification.data.filters import Decimation, Filter, Velocity, choose_filter
from identification.data.record import Record
from identification.residuals.balance import Balance, Coordinate
from identification.residuals.sampled import moving_start
from symfric.model import Model

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]

FEWEST, ENOUGH = 10, 100
"""Least number of equations of a signal, and the target if the filter is adapted."""

Raw = tuple[Array | None, Array | None]
"""Measured position and rate of a coordinate."""


@final
@dataclass(frozen=True, eq=False)
class Motion:
    """Measured motion and inputs of one record.

    Attributes:
        name: of the record.
        t: times (n,) [s].
        step: sample interval [s].
        w: positions, rates, accelerations, inputs, time, shape (nw, n).
        inputs: rows of `w` with the inputs.
        inside: samples away from the end effects of the filter.
        noise: standard deviations of the filtered rates.
        filter: the filter used.
    """

    name: str
    t: Array
    step: float
    w: Array
    inputs: slice
    inside: slice
    noise: Array
    filter: Filter

    @property
    def begin(self) -> Array:
        """The first sample, with rates near rest set to zero."""
        first, count = self.w[:, 0].copy(), self.noise.size
        first[count : 2 * count] = [moving_start(v) for v in self.w[count : 2 * count]]
        return first

    def of(self, coordinate: int) -> tuple[Array, Array, Array]:
        """Return position, rate and acceleration of a coordinate."""
        count = self.noise.size
        return self.w[coordinate], self.w[count + coordinate], self.w[2 * count + coordinate]


def measure(
    model: Model,
    found: Sequence[Coordinate],
    record: Record,
    called: Mapping[str, str],
    filter: Filter | None,
) -> Motion:
    """Differentiate a record with the channels that the model needs.

    Args:
        model: its `found` coordinates.
        record: equally spaced samples.
        called: name in the model -> channel, if they differ.
        filter: None: chosen for the fastest input, or without inputs for the fastest motion.

    Raises:
        ValueError: missing channels, unequal intervals.
    """
    step = record.uniform().step
    _check_channels(model, found, record, called)
    forces = [record[called.get(u.name, u.name)] for u in model.u]
    raw: list[Raw] = []
    for c in found:
        names = [None if s is None else called.get(s.name, s.name) for s in (c.position, c.rate)]
        x, v = (record[n] if n is not None and n in record else None for n in names)
        raw.append((x, v))
    velocities = [Velocity.of(x, v, step) for x, v in raw]
    chosen = filter or _filter_of(forces, raw, velocities, step)
    motion: list[tuple[Array, Array, Array]] = []
    noise: list[float] = []
    for (x, v), velocity in zip(raw, velocities, strict=True):
        motion.append(derivatives(x, v, step, chosen, velocity))
        noise.append(velocity.deviation(chosen, step))
    rows = [part[k] for k in range(3) for part in motion]
    inputs = slice(len(rows), len(rows) + len(forces))
    rows += [*forces, record.time]
    return Motion(
        name=record.name,
        t=record.time,
        step=step,
        w=np.vstack(rows),
        inputs=inputs,
        inside=chosen.inside(record.size, step),
        noise=np.array(noise),
        filter=chosen,
    )


def _check_channels(
    model: Model, found: Sequence[Coordinate], record: Record, called: Mapping[str, str]
) -> None:
    """Raise ValueError if the record lacks the motion or an input of the model."""
    known = ca.vertcat(ca.SX(0, 1) if model.ode is None else model.ode, model.alg)
    missing: list[str] = []
    for c in found:
        needed = c.rate if c.position is None else c.position
        has_rate = called.get(c.rate.name, c.rate.name) in record
        only_rate = has_rate and not ca.depends_on(known, needed.symbol)
        if called.get(needed.name, needed.name) not in record and not only_rate:
            missing.append(called.get(needed.name, needed.name))
    missing += [n for u in model.u if (n := called.get(u.name, u.name)) not in record]
    if missing:
        raise ValueError(
            f"data '{record.name}': expected channels {', '.join(missing)} for the inverse "
            f"dynamics of '{model.name}', got {', '.join(record.signals)}; rename columns, or use "
            "Shooting() for motion that is not measured"
        )


def _filter_of(
    forces: Sequence[Array], raw: Sequence[Raw], velocities: Sequence[Velocity], step: float
) -> Filter:
    """Return the filter for the fastest force; without forces, for the fastest motion."""
    signals = list(forces)
    for x, v in () if signals else raw:
        signals += [v] if v is not None else [np.gradient(x, step)] if x is not None else []
    bands = [t.band(x, v, step) for t, (x, v) in zip(velocities, raw, strict=True)]
    each = (choose_filter(signal, step, bands) for signal in signals)
    return max(each, key=lambda f: f.cutoff)


@final
@dataclass(frozen=True, eq=False)
class Piece:
    """A record with its decimation.

    Attributes:
        motion: the measured motion.
        decimation: low-pass filter and decimation of its samples.
        kept: for each row of the balance the decimated samples in use.
    """

    motion: Motion
    decimation: Decimation
    kept: tuple[Numbers, ...]

    def equations(self, row: int, signals: Array) -> Array:
        """Return the columns of `signals`, shape (n, k), decimated to the equations in use."""
        return self.decimation.columns(signals[self.motion.inside])[self.kept[row]]

    def times(self, row: int) -> Array:
        """Return the times of the equations in use [s]."""
        return self.decimation.centres(self.motion.t[self.motion.inside])[self.kept[row]]


def piece(made: Balance, motion: Motion, model: Model, adapts: bool = False) -> Piece:
    """Select the equations of a record that are used.

    Args:
        made, motion, model: balance, measured motion and model.
        adapts: the filter was chosen automatically; if it leaves too few equations, as for a
            motion with many reversals, the decimation is lowered.

    Raises:
        ValueError: too few equations remain.
    """
    slow = _slow(made, motion, model)
    found = _piece(made, motion, slow)
    if adapts and _fewest(found) < FEWEST:
        while _fewest(found) < ENOUGH and found.motion.filter.decimation > 1:
            less = replace(motion.filter, decimation=found.motion.filter.decimation // 2)
            found = _piece(made, replace(motion, filter=less), slow)
    if not found.decimation.rows:
        raise _too_short(found.motion, "all signals", 0)
    for row, kept in zip(made.rows, found.kept, strict=True):
        if kept.size < FEWEST:
            raise _too_short(found.motion, row.signal, kept.size)
    return found


def _fewest(found: Piece) -> int:
    return min((kept.size for kept in found.kept), default=FEWEST)


def _piece(made: Balance, motion: Motion, slow: Sequence[NDArray[np.bool_]]) -> Piece:
    """Return the equations whose low-pass filter includes no `slow` sample."""
    n = motion.t[motion.inside].size
    decimation = Decimation(n, motion.filter.decimation)
    kept: list[Numbers] = []
    for row in made.rows:
        unsure = np.zeros(n, bool)
        for k in row.slips:
            unsure |= slow[k][motion.inside]
        some = np.flatnonzero(~decimation.touched(unsure)) if decimation.rows else np.zeros(0, int)
        kept.append(some)
    return Piece(motion, decimation, tuple(kept))


def _slow(made: Balance, motion: Motion, model: Model) -> list[NDArray[np.bool_]]:
    """Return a mask for each contact: samples where its (static) law is undetermined."""
    w, p = made.equations.w, made.equations.p
    count, n = motion.noise.size, motion.t.size
    start = np.array([float(v.start) for v in model.p if v.symbol.is_leaf() and _in(v.symbol, p)])
    by_rate = ca.jacobian(made.slips, w[count : 2 * count, 0])
    at = ca.Function("slips", [w, p], [ca.densify(made.slips), ca.densify(ca.vec(by_rate))])
    if not model.contacts:
        return []
    v, slopes = (part.full() for part in at.map(n)(motion.w, np.repeat(start[:, None], n, axis=1)))
    shape = (count, len(model.contacts))
    gains = np.median(np.abs(slopes), axis=1).reshape(shape).T
    found: list[NDArray[np.bool_]] = []
    for k, c in enumerate(model.contacts):
        noise = float(np.linalg.norm(gains[k] * motion.noise))
        unsure = uncertain(v[k], noise, motion.step, motion.filter)
        found.append(unsure & (not c.states))
    return found


def _in(symbol: ca.SX, column: ca.SX) -> bool:
    return any(ca.is_equal(symbol, column[i]) for i in range(column.numel()))


def _too_short(motion: Motion, signal: str, left: int) -> ValueError:
    f = motion.filter
    limit = "by the data" if f.v_min is None else f"{f.v_min:g} m/s"
    return ValueError(
        f"data '{motion.name}': expected at least {FEWEST} equations of {signal} after the filter "
        f"({f.cutoff:g} Hz, decimation {f.decimation}, v_min {limit}), got {left}; raise the "
        "cut-off, lower the decimation or v_min in InverseDynamics(filter=Filter(...)), or leave "
        "out a part with few equations by data.between(begin, end)"
    )
