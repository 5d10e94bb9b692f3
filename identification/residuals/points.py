"""Residuals of friction forces at given velocities: points of a curve, or a record over time."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.differentiate import levels
from identification.data.record import LONG, Record
from identification.residuals.evaluation import Array, Blocks, Channel
from identification.residuals.path_noise import PathNoise, SmoothPath, smooth_path
from identification.residuals.sampled import (
    Sampled,
    begun,
    imposed_step,
    moving_start,
    preload,
    usual,
)  # fmt: skip
from identification.unknowns.spec import Unknown
from identification.unknowns.subject import Subject
from symfric.foundation import checks
from symfric.foundation.parameters import symbolise
from symfric.foundation.variable import symbols_of
from symfric.laws import Law
from symfric.laws.base.law import FORCE, chosen

MODES = ("auto", "steady", "imposed")


@final
@dataclass(frozen=True, eq=False)
class Points:
    """Residuals F(v, N) - F_measured of velocities and forces, with or without time.

    A static law is a curve through the points, and so is a law with states in steady sliding. Over
    time, the states of a law follow the measured velocity instead, z' = rate(z, v(t), N(t)). Noise
    of this velocity would accumulate in them. Most of it is removed by a smoothing spline
    (`smooth_path`); the remaining noise is part of the covariance of the residuals (`PathNoise`).
    The initial deflection of the bristles of a record is an unknown "preload[k]", relative to
    steady sliding. Points without time at exactly v = 0 are break-away forces, compared with the
    static level of the law.

    Attributes:
        v, F: channels of the sliding velocity and of the friction force, of equal sign in sliding.
        x: channel of the sliding distance over time, used if there is no channel `v`.
        N: channel of the normal force, or a number [N]; None: the channel "N" if it exists,
            otherwise the normal force of the fit.
        weight: channel of weights, such as the number of samples of a mean: rows are multiplied by
            sqrt(weight / mean weight). None: equal weights.
        states: treatment of law states: "steady" for steady sliding, "imposed" for the velocity
            over time, or "auto": imposed if every record has times.
        offset: also fit a constant force, such as the zero of a load cell, as an unknown "offset"
            common to all records. It requires motion in both directions.
        noise: channel of x or v over time -> standard deviation of its white noise; others are
            estimated from the spectrum. `Fit(noise=...)` passes its entries that are not compared.
        near: values at which the effect of this noise is linearised; None: those of the
            start, then those of the fit.

    Limits: points without time and static laws take the velocity as exact. States that change sign
    with the velocity share one preload: a partial reversal before the record is not represented.
    """

    v: str = "v"
    F: str = "F"
    x: str = "x"
    N: str | float | None = None
    weight: str | None = None
    states: str = "auto"
    offset: bool = False
    noise: Mapping[str, float] | None = None
    near: Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        for name, value in (("v", self.v), ("F", self.F), ("x", self.x), ("weight", self.weight)):
            if value is not None or name != "weight":
                checks.text(f"Points: {name}", value, "the name of a channel")
        if self.N is not None and not isinstance(self.N, str):
            checks.number("Points: N", self.N, unit="N", lower=0.0)
        checks.choice("Points: states", self.states, MODES)
        levels("Points: noise", self.noise)
        checks.flag("Points: offset", self.offset)

    def motion_channels(self, subject: Subject) -> tuple[str, ...]:
        """Return the names of the channels of position and velocity."""
        del subject
        return self.x, self.v

    def imposed(self, law: Law, data: Dataset) -> bool:
        """Return True if the states of `law` follow the velocity over time.

        Raises:
            ValueError: `states` is "imposed", but a record has no times.
        """
        timed = all(record.t is not None for record in data)
        if self.states == "imposed" and not timed:
            raise ValueError(
                "Points: states: expected records over time for states under imposed velocity, "
                "got points without time; use states='steady'"
            )
        return bool(law.states) and timed and self.states != "steady"

    def prepare(
        self, subject: Subject, data: Dataset, start: Mapping[str, float] | None = None
    ) -> "PointRows":
        """Return the residuals of `data`.

        Raises:
            ValueError: the subject has no law, channels are missing, or break-away points need a
                static level that the law does not have or that depends on an applied force.
        """
        law = subject.law
        if law is None:
            raise ValueError("Points: expected a law to fit to points, got a model; pass its law")
        imposed = self.imposed(law, data)
        load = float(subject.model.u[1].start) if len(subject.model.u) > 1 else 1.0
        tables = tuple(self._table(record, load, law, imposed) for record in data)
        symbolic, variables = symbolise(law, *subject.names)
        p = symbols_of(variables)
        speed = usual(np.concatenate([table.w[0] for table in tables]))
        slides, breaks = _sliding(symbolic, p, speed if imposed else None), None
        if not imposed and any(table.rest.any() for table in tables):
            breaks = _break_away(symbolic, p)
        units = {unit for record in data if (unit := record.unit(self.F))}
        unit, own = units.pop() if len(units) == 1 else "N", list[Unknown]()
        preloads = imposed and not all(state.even for state in law.states)
        if preloads:
            own += [preload(f"preload[{k}]", table.w[0]) for k, table in enumerate(tables)]
        if self.offset:
            size = max(float(np.abs(table.F).max(initial=0.0)) for table in tables) or 1.0
            own.append(Unknown("offset", unit, _middle(tables), scale=size, nuisance=True))
        channels, first = list[Channel](), 0
        for number, (t, w, F, *_) in enumerate(tables):
            rows, v = slice(first, first := first + F.size), w[0]
            signals = {"v": v, "sign(v)": np.sign(v)}
            t, ordered = (v, False) if t is None else (t, True)
            channels.append(Channel(number, "F", unit, rows, t, F, signals, ordered=ordered))
        rows = PointRows(
            subject.names, tuple(own), tuple(channels), slides, breaks, tables, imposed, preloads
        )
        if not any(table.errors.size for table in tables):
            return rows
        values = {v.name: float(v.start) for v in (*variables, *own)}
        values |= {**(start or {}), **(self.near or {})}
        return rows.whitened(np.array([values[n] for n in rows.names]))

    def path(self, record: Record) -> SmoothPath:
        """Return the velocity over time of a law with states, and its noise."""
        return smooth_path(record, self.x, self.v, self.noise)

    def _table(self, record: Record, load: float, law: Law, imposed: bool) -> "PointTable":
        F, path = record[self.F], SmoothPath(np.zeros(0), np.zeros((record.size, 0)))
        if imposed or (self.v not in record and self.x in record):
            path = self.path(record)
        v = path.v if path.v.size else record[self.v]
        channel = "N" if self.N is None and "N" in record else self.N
        number = load if channel is None or isinstance(channel, str) else float(channel)
        N = record[channel] if isinstance(channel, str) else np.full(record.size, number)
        if (N < 0).any():
            k, where = int(np.argmax(N < 0)), f"data '{record.name}': normal force"
            raise ValueError(f"{where}: expected >= 0 N, got {N[k]:g} at {record.place(k)}")
        weights = np.ones(v.size)
        if self.weight is not None:
            weights = record[self.weight]
            if (weights < 0).any() or not weights.any():
                raise ValueError(f"data '{record.name}': weight: expected >= 0 and some > 0")
            weights = np.sqrt(weights / weights.mean())
        w = np.vstack([v, N, *(record[i.name] for i in law.inputs)])
        return PointTable(record.t, w, F, weights, (v == 0) & (record.t is None), path.errors)


class PointTable(NamedTuple):
    """Imposed values (2 + inputs, n), forces, weights and break-away points of a record.

    `errors` (n, m) are those of the velocity, see `SmoothPath`.
    """

    t: Array | None
    w: Array
    F: Array
    weights: Array
    rest: NDArray[np.bool_]
    errors: Array


@final
@dataclass(frozen=True, eq=False)
class PointRows(Blocks):
    """Residuals weight (F(v, N) + offset - F_measured) [N] of `Points`.

    With `preloads`, `own` contains the preload of each record, then the offset. `noises` whiten the
    residuals of each record; empty: no whitening.
    """

    slides: Sampled
    breaks: Sampled | None
    tables: tuple[PointTable, ...]
    imposed: bool
    preloads: bool
    noises: tuple[PathNoise, ...] = ()

    @property
    def linear(self) -> bool:
        """True if the law is linear in its parameters."""
        return self.slides.linear and (self.breaks is None or self.breaks.linear)

    @property
    def part(self) -> "PointRows | None":
        """Residuals of part of the points of long records; None for short ones and over time."""
        if self.imposed or self.channels[-1].rows.stop <= LONG:
            return None
        tables, channels, first = list[PointTable](), list[Channel](), 0
        for table, channel in zip(self.tables, self.channels, strict=True):
            every = slice(None, None, 1 + table.F.size // LONG)
            F, weights, rest = table.F[every], table.weights[every], table.rest[every]
            thin = PointTable(None, table.w[:, every], F, weights, rest, table.errors[every])
            rows = slice(first, first := first + thin.F.size)
            t, measured = channel.t[every], channel.measured[every]
            tables.append(thin)
            channels.append(replace(channel, rows=rows, t=t, measured=measured, ordered=False))
        return replace(self, tables=tuple(tables), channels=tuple(channels))

    def blocks(self, p: Array, own: Array) -> Iterator[tuple[Array, Array] | str]:
        """Yield the residuals of each record, and their derivatives."""
        count = len(self.tables) if self.preloads else 0
        offset = float(own[count:].sum())
        for k, table in enumerate(self.tables):
            found = self._forces(k, table.w, p, own)
            if isinstance(found, str):
                yield found
                return
            F, slopes = found
            J = np.zeros((F.size, p.size + own.size))
            J[:, : p.size], J[:, p.size + count :] = slopes[:, : p.size], 1.0
            if self.preloads:
                J[:, p.size + k] = slopes[:, p.size]
            both = table.weights * (F + offset - table.F), table.weights[:, None] * J
            yield (self.noises[k](both[0]), self.noises[k](both[1])) if self.noises else both

    def whitened(self, values: Array) -> "PointRows":
        """Return the residuals whitened at `values`, see `PathNoise`."""
        p, own = np.split(values, [len(self.parameters)])
        noises = list[PathNoise]()
        for k, table in enumerate(self.tables):

            def force(v: Array, k: int = k, table: PointTable = table) -> Array:
                found = self._forces(k, np.vstack([v, table.w[1:]]), p, own)
                return table.weights * (np.zeros(v.size) if isinstance(found, str) else found[0])

            noises.append(PathNoise.of(force, table.w[0], table.errors, table.F))
        return replace(self, noises=tuple(noises))

    def _forces(self, k: int, w: Array, p: Array, own: Array) -> tuple[Array, Array] | str:
        """Return the forces of record k for imposed values w (2 + inputs, n), and derivatives."""
        table, share = self.tables[k], own[k : k + 1] if self.preloads else np.zeros(1)
        p = np.append(p, share) if self.imposed else p
        F, slopes = np.zeros(table.F.size), np.zeros((table.F.size, p.size))
        h = np.diff(table.t) if table.t is not None and self.imposed else 1.0
        sides = np.vstack([w, np.sign(table.F)])
        for rows, some, what in (~table.rest, w, self.slides), (table.rest, sides, self.breaks):
            if what is None or not rows.any():
                continue
            begin = some[:, rows][:, 0].copy()
            if self.imposed:
                begin[0] = moving_start(some[0, rows])
            path = what.along(some[:, rows], h, p, begin)
            if isinstance(path, str):
                return path
            F[rows], slopes[rows] = path.rows[:, 0], path.slopes[:, 0]
        return F, slopes


def _sliding(law: Law, p: ca.SX, speed: float | None) -> Sampled:
    """Return the force in sliding at one sample; `p` are the symbols in `law`.

    With the usual speed of the records over time, the unknowns are p and the preload.
    """
    where = f"Points: {type(law).__name__}"
    w = ca.SX.sym("w", 2 + len(law.inputs))
    given = {i.name: w[2 + k] for k, i in enumerate(law.inputs)}
    v, N = w[0], w[1]
    if speed is None:
        steady = ca.SX(law.steady_state_at(v, N, **given)) if law.states else ca.SX(0, 1)
        return Sampled.of(w, p, ca.SX(law.force(v, N, steady, **given)))
    share = ca.SX.sym("preload")
    start = begun(law, (v, N), speed, share)
    z, later, h = ca.SX.sym("z", len(law.states)), ca.SX.sym("later", w.numel()), ca.SX.sym("h")
    then = {i.name: later[2 + k] for k, i in enumerate(law.inputs)}
    step = imposed_step(law, z, (v, N, given), (later[0], later[1], then), h, where)
    force = ca.SX(law.force(v, N, z, **given))
    p = ca.vertcat(p, share)
    return Sampled.of(w, p, force, z=z, start=start, step=step, later=later, h=h)


def _break_away(law: Law, p: ca.SX) -> Sampled:
    """Return the break-away force; the last entry of `w` is the direction of the pull."""
    w = ca.SX.sym("w", 3 + len(law.inputs))
    given = {i.name: w[2 + k] for k, i in enumerate(law.inputs) if i.name != FORCE}
    side = w[w.numel() - 1]
    try:
        levels = [ca.SX(law.static_level(w[1], s, **chosen(law, given))) for s in (1, -1)]
    except ValueError as error:
        raise ValueError(f"Points: break-away at v = 0: {error}") from None
    return Sampled.of(w, p, ca.if_else(side > 0, levels[0], -levels[1]))


def _middle(tables: tuple[PointTable, ...]) -> float:
    """Return the force half-way between the medians of both directions [N]."""
    v, F = (np.concatenate(part) for part in zip(*((t.w[0], t.F) for t in tables), strict=True))
    if not v.min() < 0 < v.max():
        got = "got one: an offset cannot be separated from friction"
        raise ValueError(f"Points: offset: expected motion in both directions, {got}")
    return float(np.median(F[v > 0]) + np.median(F[v < 0])) / 2
