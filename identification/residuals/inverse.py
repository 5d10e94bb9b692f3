"""Residuals of inverse dynamics: force needed for the measured motion minus measured force."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.differentiate import levels, uncertain
from identification.data.filters import Decimation, Filter, fourth_order_difference
from identification.data.record import LONG, blocks, some
from identification.residuals.balance import (
    Balance,
    ForceRow,
    Mask,
    MeasuredMotion,
    balance,
    coordinates,
    measure,
)
from identification.residuals.evaluation import DEAD_TIME, Array, Bias, Blocks, Channel
from identification.residuals.sampled import Sampled, preload, same, scaled
from identification.unknowns.roles import width_of
from identification.unknowns.spec import Unknown
from identification.unknowns.subject import Subject
from symfric.foundation import checks
from symfric.integrator.compiled.columns import Columns
from symfric.model import Model

WHERE = "InverseDynamics"
PART = 20_000
"""Number of equations of a long record in which a fit searches first."""
FEWEST, ENOUGH = 10, 100
"""Smallest number of equations of a signal, and target number if the filter is adapted."""


@final
@dataclass(frozen=True, eq=False)
class InverseDynamics:
    """Residuals of the force balance under the measured motion, without a simulation.

        r = D (force needed for x, v, a - force measured)

    v and a result from zero-phase filtering and differences of the measured position. D is a common
    low-pass filter and decimation of all terms. For a drive: D (m a + F(v, N) + offset - force).
    States of laws follow the measured sliding velocity, z' = rate(z, v(t), N(t)). The initial
    deflection of the bristles of a record, relative to steady sliding, is an unknown "preload[k]",
    or "preload.contact[k]" with several contacts. A model with
    several coordinates has one row for each input and one for each coordinate without an input.
    Reactions and normal forces that depend on friction are solved for at every sample.

    Equations of static laws near a reversal are left out (`Filter.v_min`): there the low-pass
    filter mixes both directions, and a static law does not determine the force at rest.

    Attributes:
        force, x: channels of a drive.
        v: channel of a measured velocity; None: "v" if the records have it. `Velocity` combines it
            with the velocity from the position, frequency by frequency, according to their noise. A
            noisy, delayed or wrongly scaled velocity has no weight where the position is more
            accurate.
        filter: cut-off and decimation of all records; None: from force and motion of each record.
        dead_time: bounds of the time [s] by which the measured force leads the acting force, an
            additional unknown of each record; it is negative for a force recorded late. (0, T)
            permits both, -T to T. "auto": estimated if the data determine it. None: no dead time.
        noise: channel of a position or velocity -> standard deviation of its white noise; others
            are those of the spectrum and of rounding. `Fit(noise=...)` passes such entries.

    Limits: a force that is held for a sample leads by half a sample, which lowers the viscous
    coefficient by about m w^2 h / 2 for motion at w [rad/s], unless the dead time is estimated.
    The automatic decimation is limited to the band in which the motion exceeds its noise
    (`choose_filter`). The remaining bias by white noise is corrected to second order, except in
    rows with algebraic unknowns; with a filter of the user, the noise of the acceleration must be
    small against the acceleration. Errors are those of the force up to the cut-off of the record: a
    force of pulses is wide-band and includes all noise and every resonance, so its percentage is
    not comparable with that of a slow record (EMPS: 10.9 %, 5.9 % with the filter of the slow
    record). Channels of a model have the names of its states and inputs; others are derived.
    Source: Gautier, Janot and Vandanjon, IEEE Trans. Control Syst. Technol. 21(2), 2013 (IDIM-LS).
    """

    force: str = "force"
    x: str = "x"
    v: str | None = None
    filter: Filter | None = None
    dead_time: tuple[float, float] | str | None = "auto"
    noise: Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        for name in ("force", "x") if self.v is None else ("force", "x", "v"):
            checks.text(f"{WHERE}: {name}", getattr(self, name), "the name of a channel")
        if self.filter is not None:
            checks.kind(f"{WHERE}: filter", self.filter, Filter, "a filter, such as Filter(100.0)")
        levels(f"{WHERE}: noise", self.noise)
        if isinstance(self.dead_time, str):
            checks.choice(f"{WHERE}: dead_time", self.dead_time, ("auto",))
        elif self.dead_time is not None:
            pair = checks.many(f"{WHERE}: dead_time", self.dead_time, "bounds (low, high) [s]")
            bounds = tuple(checks.number(f"{WHERE}: dead_time", b, unit="s") for b in pair)
            if len(bounds) != 2 or not bounds[0] < bounds[1]:
                raise checks.refused(f"{WHERE}: dead_time", "bounds in order", self.dead_time)
            object.__setattr__(self, "dead_time", bounds)

    def motion_channels(self, subject: Subject) -> tuple[str, ...]:
        """Return the names of the channels of positions and rates."""
        if subject.drive is not None:
            return self.x, self.v or "v"
        found = coordinates(subject.model, f"{WHERE}: model '{subject.model.name}'")
        return tuple(s.name for c in found for s in (c.position, c.rate) if s is not None)

    def prepare(
        self, subject: Subject, data: Dataset, start: Mapping[str, float] | None = None
    ) -> "InverseRows":
        """Return the residuals of `data`.

        Raises:
            ValueError: an implicit model, missing channels, unequal intervals, records too short
                for the filter, or law states that only a simulation can follow.
        """
        model = subject.model
        where = f"{WHERE}: model '{model.name}'"
        found = coordinates(model, where)
        called = {"x": self.x, "force": self.force} if subject.drive is not None else {}
        if subject.drive is not None and self.v is not None:
            called["v"] = self.v
        motions = [measure(model, found, r, called, self.filter, self.noise or {}) for r in data]
        seen = [motion.w[:, :: 1 + motion.t.size // LONG] for motion in motions]
        made = balance(model, subject.names, found, np.hstack(seen), where)
        p = np.array([float(v.start) for v in model.p if v.name in subject.names])
        own = [
            preload(f"preload.{n}[{k}]" if len(made.preloads) > 1 else f"preload[{k}]", v)
            for k, motion in enumerate(motions)
            for n, v in _slips(made, motion, model, p).items()
            if n in made.preloads
        ]
        pieces = tuple(_piece(made, motion, model, p, self.filter is None) for motion in motions)
        first = subject.names, tuple(own), tuple(_channels(made.rows, pieces))
        more = made.equations, made.rows, pieces, made.slopes, len(made.preloads), made.loaded
        usual = np.array([(start or {}).get(n, x) for n, x in zip(subject.names, p, strict=True)])
        rows = InverseRows(*first, *more, usual)
        return rows.delayed(*self.dead_time) if isinstance(self.dead_time, tuple) else rows


@final
@dataclass(frozen=True, eq=False)
class Piece:
    """Measured motion of a record with its decimation.

    Attributes:
        motion: the measured motion.
        decimation: low-pass filter and decimation of the samples.
        kept: for each row of the balance, the indices of the decimated samples that are used.
    """

    motion: MeasuredMotion
    decimation: Decimation
    kept: tuple[NDArray[np.int64], ...]

    def equations(self, row: int, signals: Array) -> Array:
        """Return the columns of `signals`, shape (n, k), decimated to the equations of a row."""
        return self.decimation.columns(signals[self.motion.inside])[self.kept[row]]

    @cached_property
    def errors(self) -> Array:
        """Standard deviations of decimated rates, then accelerations, (2 coordinates,)."""
        motion, taps = self.motion, self.decimation.taps
        each = [u.errors(motion.filter, motion.step, taps) for u in motion.velocities]
        return np.ravel(np.array(each).T)

    @property
    def halved(self) -> "Piece":
        """Equations of at least two samples, without frequencies that interpolation attenuates."""
        n, two = self.decimation.samples, Decimation(self.decimation.samples, 2)
        if self.decimation.factor > 1 or not two.rows:
            return self
        touched = (two.touched(~np.isin(np.arange(n), k)) for k in self.kept)
        motion = self.motion._replace(filter=replace(self.motion.filter, decimation=2))
        found = Piece(motion, two, tuple(np.flatnonzero(~some) for some in touched))
        return self if found.fewest < FEWEST else found

    @property
    def part(self) -> "Piece":
        """Evenly spaced blocks of the equations of a long record of static laws, as one piece."""
        motion, factor, cut = self.motion, self.decimation.factor, self.motion.inside.start
        more = -(-self.decimation.taps.size // factor)  # rows whose windows leave a block
        each = blocks(self.decimation.rows - more, PART)
        if len(each) == 1:
            return self
        size = each[0].stop - each[0].start + more
        samples = [cut + b.start * factor + np.arange(size * factor) for b in each]
        rows = np.concatenate([np.arange(cut), *samples, np.arange(cut)])
        new = np.full(self.decimation.rows, -1)
        for i, b in enumerate(each):
            new[b] = i * size + np.arange(b.stop - b.start)
        kept = tuple(found[found >= 0] for found in (new[k] for k in self.kept))
        motion = motion._replace(t=motion.t[rows], w=motion.w[:, rows])
        return Piece(motion, Decimation(rows.size - 2 * cut, factor), kept)

    @property
    def fewest(self) -> int:
        """Number of equations of the row that has the fewest."""
        return min((kept.size for kept in self.kept), default=FEWEST)


def _piece(made: Balance, motion: MeasuredMotion, model: Model, p: Array, adapts: bool) -> Piece:
    """Select the equations of a record whose low-pass filter includes no undetermined sample.

    Args:
        made, motion, model: balance, measured motion and model.
        p: start values of the unknown parameters.
        adapts: True if the filter was chosen automatically; its decimation is then lowered if too
            few equations remain, as for a motion with many reversals.

    Raises:
        ValueError: too few equations remain.
    """
    slow = _slow(made, motion, model, p)
    found = _decimated(made.rows, motion, slow)
    if adapts and found.fewest < FEWEST:
        factor = motion.filter.decimation
        while found.fewest < ENOUGH and factor > 1:
            factor //= 2
            less = motion._replace(filter=replace(motion.filter, decimation=factor))
            found = _decimated(made.rows, less, slow)
    left = {row.signal: k.size for row, k in zip(made.rows, found.kept, strict=True)}
    left = left if found.decimation.rows else {"all signals": 0}
    for signal, count in left.items():
        if count < FEWEST:
            raise ValueError(
                f"data '{motion.name}': expected at least {FEWEST} equations of {signal} after the "
                f"filter ({found.motion.filter}), got {count}; raise the cut-off, lower the "
                "decimation or v_min in InverseDynamics(filter=Filter(...)), or leave out a part "
                "with few equations by data.between(begin, end); a record at one speed is a point: "
                "Fit(Points(), ..., plateaus(data))"
            )
    return found


def _decimated(rows: Sequence[ForceRow], motion: MeasuredMotion, slow: Sequence[Mask]) -> Piece:
    n = motion.t[motion.inside].size
    decimation = Decimation(n, motion.filter.decimation)
    kept: list[NDArray[np.int64]] = []
    for row in rows:
        unsure = np.any([np.zeros(n, bool), *(slow[k][motion.inside] for k in row.slips)], axis=0)
        touched = decimation.touched(unsure) if decimation.rows else np.ones(0, bool)
        kept.append(np.flatnonzero(~touched))
    return Piece(motion, decimation, tuple(kept))


def _slips(made: Balance, motion: MeasuredMotion, model: Model, p: Array) -> dict[str, Array]:
    """Return the sliding velocity of each contact with bristles, shape (n,)."""
    if not made.preloads:
        return {}
    v, _ = Columns(made.slips)([motion.w.T, same(p, motion.t.size)])
    return dict(zip((c.name for c in model.contacts), v.T, strict=True))


def _slow(made: Balance, motion: MeasuredMotion, model: Model, p: Array) -> list[Mask]:
    """Return a mask for each contact of the samples at which its static law is undetermined."""
    if not model.contacts:
        return []
    v, slopes = (part.T for part in Columns(made.slips)([motion.w.T, same(p, motion.t.size)]))
    errors = np.array([u.errors(motion.filter, motion.step)[0] for u in motion.velocities])
    gains = np.median(np.abs(slopes), axis=1).reshape(errors.size, len(model.contacts)).T
    noise = [float(np.linalg.norm(gain * errors)) for gain in gains]
    return [
        uncertain(v[k], max(s, width_of(c.law)), motion.step, motion.filter) & (not c.states)
        for k, (c, s) in enumerate(zip(model.contacts, noise, strict=True))
    ]


def _channels(rows: Sequence[ForceRow], pieces: Sequence[Piece]) -> Iterator[Channel]:
    """Yield a channel for each balance of each record."""
    first = 0
    for number, part in enumerate(pieces):
        motion = part.motion
        times = part.decimation.centres(motion.t[motion.inside])
        for k, row in enumerate(rows):
            kept, count = part.kept[k], len(motion.velocities)
            q, v, a = motion.w[row.coordinate : 3 * count : count]
            signals = {"x": q, "v": v, "sign(v)": np.sign(v), "a": a}
            force = np.zeros_like(q) if row.input is None else motion.w[motion.inputs][row.input]
            columns = part.equations(k, np.column_stack([force, *signals.values()])).T
            breaks = tuple((np.flatnonzero(np.diff(kept) > 1) + 1).tolist())
            regressors = dict(zip(signals, columns[1:], strict=True))
            place = slice(first, first := first + kept.size)
            yield Channel(
                number, row.signal, row.unit, place, times[kept], columns[0], regressors, breaks
            )


@final
@dataclass(frozen=True, eq=False)
class InverseRows(Blocks):
    """Residuals D (force needed - force measured) of `InverseDynamics`.

    The noise e of rates and accelerations enters residuals r and sensitivities J. Their product is
    biased by c = E[dJ' dr], which lowers the mass. The residuals are therefore corrected,

        r - J (J'J)^-1 c,   c = 1/2 dB/dp,   B = sum_i |G_i S|^2,   G = dr/d(v, a),   S from spectra

    and the cost is |r|^2 - B, whose gradient has mean zero at the true values (corrected score).
    Source: Stefanski, Commun. Stat. Theory Methods 18(12), 1989; Nakamura, Biometrika 77(1), 1990.
    """

    sampled: Sampled
    rows: tuple[ForceRow, ...]
    pieces: tuple[Piece, ...]
    slopes: Sampled | None
    preloads: int
    loaded: bool
    start: Array

    def delayed(self, low: float, high: float) -> "InverseRows":
        """Return the residuals with a dead time of each record within bounds.

        Raises:
            ValueError: a law depends on the applied force.
        """
        if self.loaded:
            raise ValueError(f"{WHERE}: dead_time: expected laws without the applied force")
        low = low or -high
        first = min(max(0.0, low), high)
        late = (
            Unknown(f"{DEAD_TIME}[{k}]", "s", first, low, high, part.motion.step, nuisance=True)
            for k, part in enumerate(self.pieces)
        )
        pieces = tuple(part.halved for part in self.pieces)
        channels = tuple(_channels(self.rows, pieces))
        return replace(self, own=(*self.own, *late), pieces=pieces, channels=channels)

    def rates(self) -> Array:
        """Return the derivatives of the residuals by dead times of the records, (rows, records)."""
        found = np.zeros((self.channels[-1].rows.stop, len(self.pieces)))
        signals = [row.signal for row in self.rows]
        for channel in self.channels:
            part, k = self.pieces[channel.record], signals.index(channel.signal)
            if (i := self.rows[k].input) is not None:
                force = part.motion.w[part.motion.inputs][i]
                rate = fourth_order_difference(force, part.motion.step)
                found[channel.rows, channel.record] = part.equations(k, rate[:, None])[:, 0]
        return found

    @property
    def linear(self) -> bool:
        """True if the force is linear in the parameters, and there is no dead time."""
        return self.sampled.linear and not self.own

    @property
    def part(self) -> "InverseRows | None":
        """Residuals of blocks of long records; None for short ones and with states."""
        if self.own or self.sampled.sizes[1] or self.channels[-1].rows.stop <= LONG:
            return None
        pieces = tuple(piece.part for piece in self.pieces)
        return replace(self, pieces=pieces, channels=tuple(_channels(self.rows, pieces)))

    def blocks(self, p: Array, own: Array) -> Iterator[tuple[Array, Array] | str]:
        """Yield the residuals of each balance of each record.

        `own` contains the preloads, then the dead time, of all records.
        """
        count = self.preloads
        shares, late = np.split(own, [count * len(self.pieces)])
        for number, part in enumerate(self.pieces):
            motion, mine = part.motion, slice(number * count, (number + 1) * count)
            w, rates = motion.shifted(float(late[number])) if late.size else (motion.w, motion.w)
            path = self.sampled.along(w, motion.step, np.append(p, shares[mine]), motion.begin)
            if isinstance(path, str):
                yield f"data '{motion.name}': {path}"
                return
            for k, row in enumerate(self.rows):
                J = np.zeros((motion.t.size, p.size + own.size))
                J[:, : p.size] = path.slopes[:, k, : p.size]
                J[:, p.size :][:, mine] = path.slopes[:, k, p.size :]
                if late.size and row.input is not None:
                    J[:, p.size + shares.size + number] = rates[row.input]
                both = part.equations(k, np.column_stack([path.rows[:, k], J]))
                yield both[:, 0], both[:, 1:]

    def bias(self, values: Array) -> Bias:
        """Return the squares of the residuals by the noise of the measured motion."""
        return Bias(*self._noise(values[: len(self.parameters)]), self._usual)

    @cached_property
    def _usual(self) -> Array:
        return self._noise(self.start)[0]

    def _noise(self, p: Array) -> tuple[Array, Array]:
        """Return |G S|^2 of each channel, and half its derivatives by p."""
        squares, slopes = np.zeros(len(self.channels)), np.zeros((len(self.channels), p.size))
        for i, c in enumerate(self.channels if p.size else ()):
            part, k = self.pieces[c.record], i % len(self.rows)
            motion, here = part.motion, part.decimation.centres
            at = some(here(np.arange(motion.t.size)[motion.inside])[part.kept[k]])
            found = scaled(self.slopes, motion.w[:, at], motion.step, p, k, part.errors)
            if found is not None:
                squares[i] = c.t.size * float(np.sum(found.rows**2))
                slopes[i] = c.t.size * np.einsum("ij,ijp->p", *found)
        return squares, slopes
