"""Residuals of friction forces at given velocities: points of a curve, or a record over time."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.record import Record
from identification.residuals.evaluation import Array, Blocks, Channel
from identification.residuals.sampled import Sampled, imposed_step, moving_start
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
    time, the states of a law follow the measured velocity instead, z' = rate(z, v(t), N(t)). They
    start in steady sliding at the first sample, or relaxed if it is slower than a twentieth of the
    usual speed. A record that begins slowly under load is modelled wrongly until the contact has
    slid once; the verdict reports this if it is visible. Points without time at exactly v = 0 are
    break-away forces, compared with the static level of the law.

    Attributes:
        v, F: channels of the sliding velocity and of the friction force, of equal sign in sliding.
        N: channel of the normal force, or a number [N]; None: the channel "N" if it exists,
            otherwise the normal force of the fit.
        weight: channel of weights, such as the number of samples of a mean: rows are multiplied by
            sqrt(weight / mean weight). None: equal weights.
        states: treatment of law states: "steady" for steady sliding, "imposed" for the velocity
            over time, or "auto": imposed if every record has times.
        offset: also fit a constant force, such as the zero of a load cell, as an unknown "offset"
            common to all records. It requires motion in both directions.
    """

    v: str = "v"
    F: str = "F"
    N: str | float | None = None
    weight: str | None = None
    states: str = "auto"
    offset: bool = False

    def __post_init__(self) -> None:
        for name, value in (("v", self.v), ("F", self.F), ("weight", self.weight)):
            if value is not None or name != "weight":
                checks.text(f"Points: {name}", value, "the name of a channel")
        if self.N is not None and not isinstance(self.N, str):
            checks.number("Points: N", self.N, unit="N", lower=0.0)
        checks.choice("Points: states", self.states, MODES)
        checks.flag("Points: offset", self.offset)

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
        del start
        law = subject.law
        if law is None:
            raise ValueError("Points: expected a law to fit to points, got a model; pass its law")
        imposed = self.imposed(law, data)
        load = float(subject.model.u[1].start) if len(subject.model.u) > 1 else 1.0
        tables = tuple(self._table(record, load, law) for record in data)
        symbolic, variables = symbolise(law, *subject.names)
        p = symbols_of(variables)
        slides, breaks = _sliding(symbolic, p, imposed), None
        if not imposed and any(table.rest.any() for table in tables):
            breaks = _break_away(symbolic, p)
        units = {unit for record in data if (unit := record.unit(self.F))}
        unit, own = units.pop() if len(units) == 1 else "N", ()
        if self.offset:
            size = max(float(np.abs(table.F).max(initial=0.0)) for table in tables) or 1.0
            own = (Unknown("offset", unit, _middle(tables), scale=size, nuisance=True),)
        channels, first = list[Channel](), 0
        for number, (t, w, F, *_) in enumerate(tables):
            rows, v = slice(first, first := first + F.size), w[0]
            signals = {"v": v, "sign(v)": np.sign(v)}
            t, ordered = (v, False) if t is None else (t, True)
            channels.append(Channel(number, "F", unit, rows, t, F, signals, ordered=ordered))
        return PointRows(subject.names, own, tuple(channels), slides, breaks, tables, imposed)

    def _table(self, record: Record, load: float, law: Law) -> "Table":
        v, F = record[self.v], record[self.F]
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
        return Table(record.t, w, F, weights, (v == 0) & (record.t is None))


class Table(NamedTuple):
    """Imposed values (2 + inputs, n), forces, weights and break-away points of a record."""

    t: Array | None
    w: Array
    F: Array
    weights: Array
    rest: NDArray[np.bool_]


@final
@dataclass(frozen=True, eq=False)
class PointRows(Blocks):
    """Residuals weight (F(v, N) + offset - F_measured) [N] of `Points`."""

    slides: Sampled
    breaks: Sampled | None
    tables: tuple[Table, ...]
    imposed: bool

    def blocks(self, p: Array, own: Array) -> Iterator[tuple[Array, Array] | str]:
        """Yield the residuals of each record, and their derivatives."""
        for table in self.tables:
            F, J = np.zeros(table.F.size), np.ones((table.F.size, p.size + own.size))
            h = np.diff(table.t) if table.t is not None and self.imposed else 1.0
            sides = np.vstack([table.w, np.sign(table.F)])
            both = (~table.rest, table.w, self.slides), (table.rest, sides, self.breaks)
            for rows, w, what in both:
                if what is None or not rows.any():
                    continue
                begin = w[:, rows][:, 0].copy()
                if self.imposed:
                    begin[0] = moving_start(w[0, rows])
                path = what.along(w[:, rows], h, p, begin)
                if isinstance(path, str):
                    yield path
                    return
                F[rows], J[rows, : p.size] = path.rows[:, 0], path.slopes[:, 0]
            yield table.weights * (F + own.sum() - table.F), table.weights[:, None] * J


def _sliding(law: Law, p: ca.SX, imposed: bool) -> Sampled:
    """Return the force in sliding at one sample; `p` are the symbols in `law`."""
    where = f"Points: {type(law).__name__}"
    w = ca.SX.sym("w", 2 + len(law.inputs))
    given = {i.name: w[2 + k] for k, i in enumerate(law.inputs)}
    v, N = w[0], w[1]
    steady = ca.SX(law.steady_state(v, N)) if law.states else ca.SX(0, 1)
    if not imposed:
        return Sampled.of(w, p, ca.SX(law.force(v, N, steady, **given)))
    z, later, h = ca.SX.sym("z", len(law.states)), ca.SX.sym("later", w.numel()), ca.SX.sym("h")
    then = {i.name: later[2 + k] for k, i in enumerate(law.inputs)}
    step = imposed_step(law, z, (v, N, given), (later[0], later[1], then), h, where)
    force = ca.SX(law.force(v, N, z, **given))
    return Sampled.of(w, p, force, z=z, start=steady, step=step, later=later, h=h)


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


def _middle(tables: tuple[Table, ...]) -> float:
    """Return the force half-way between the medians of both directions [N]."""
    v, F = (np.concatenate(part) for part in zip(*((t.w[0], t.F) for t in tables), strict=True))
    if not v.min() < 0 < v.max():
        got = "got one: an offset cannot be separated from friction"
        raise ValueError(f"Points: offset: expected motion in both directions, {got}")
    return float(np.median(F[v > 0]) + np.median(F[v < 0])) / 2
