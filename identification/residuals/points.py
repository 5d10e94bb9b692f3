"""Friction forces at given velocities: points of a friction curve, or a record over time."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.record import Record
from identification.residuals.evaluation import Channel, Evaluation
from identification.residuals.sampled import Equations, Sampled, imposed_step, moving_start
from identification.unknowns.spec import Unknown
from identification.unknowns.subject import Subject
from symfric.foundation import checks
from symfric.foundation.parameters import symbolise
from symfric.foundation.variable import symbols_of
from symfric.laws import Law
from symfric.laws.base.law import FORCE, chosen

Array = NDArray[np.float64]

MODES = ("auto", "steady", "imposed")


@final
@dataclass(frozen=True, eq=False)
class Points:
    """Residuals F(v, N) - F_measured of velocities and forces, with or without time.

    A static law is a curve through the points, and so is a law with states in steady sliding. Over
    time, its states follow the measured velocity instead, z' = rate(z, v(t), N(t)), from steady
    sliding at the first sample, or relaxed if it is slower than a twentieth of the usual speed. A
    record that begins slowly under load is modelled wrongly until the contact has slid once; the
    verdict reports it if it is visible. Points without time at exactly v = 0 are break-away forces,
    compared with the static level of the law.

    Attributes:
        v, F: channels of the sliding velocity and of the friction force, of equal sign in sliding.
        N: channel of the normal force, or a number [N]; None: the channel "N" if there is one,
            else the normal force of the fit.
        weight: channel of weights, such as the number of samples of a mean: rows are multiplied by
            sqrt(weight / mean weight). None: equal weights.
        states: of a law with states: "steady" sliding, "imposed" velocity over time, or "auto":
            imposed if every record has a time.
        offset: also fit a constant force, such as the zero of a load cell: an own unknown
            "offset" of all records together. It requires motion in both directions.
    """

    v: str = "v"
    F: str = "F"
    N: str | float | None = None
    weight: str | None = None
    states: str = "auto"
    offset: bool = False

    def __post_init__(self) -> None:
        for name in ("v", "F"):
            checks.text(f"Points: {name}", getattr(self, name), "the name of a channel")
        if self.N is not None and not isinstance(self.N, str):
            checks.number("Points: N", self.N, unit="N", lower=0.0)
        if self.weight is not None:
            checks.text("Points: weight", self.weight, "the name of a channel")
        checks.choice("Points: states", self.states, MODES)
        checks.flag("Points: offset", self.offset)

    def imposed(self, law: Law, data: Dataset) -> bool:
        """Return True if the states of `law` follow the velocity over time."""
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
            ValueError: a subject without a law, missing channels, a law that needs an applied force
                or whose static level is unknown although break-away needs it.
        """
        del start
        law = subject.law
        if law is None:
            raise ValueError("Points: expected a law to fit to points, got a model; pass its law")
        imposed = self.imposed(law, data)
        load = float(subject.model.u[1].start) if len(subject.model.u) > 1 else 1.0
        further = [i.name for i in law.inputs]
        tables = [self._table(record, load, further) for record in data]
        symbolic, variables = symbolise(law, *subject.names)
        p = symbols_of(variables)
        slides = _equations(symbolic, p, imposed).compiled()
        breaks = None
        if not imposed and any(table.rest.any() for table in tables):
            breaks = _break_away(symbolic, p).compiled()
        unit, shift = _unit(data, self.F), _middle(tables) if self.offset else None
        return PointRows(
            parameters=subject.names,
            slides=slides,
            breaks=breaks,
            tables=tuple(tables),
            imposed=imposed,
            unit=unit,
            shift=shift,
        )

    def _table(self, record: Record, load: float, further: list[str]) -> "Table":
        v, F = record[self.v], record[self.F]
        N = self._load(record, load)
        if (N < 0).any():
            k = int(np.argmax(N < 0))
            raise ValueError(
                f"data '{record.name}': normal force: expected >= 0 N, got {N[k]:g} at "
                f"{record.place(k)}"
            )
        given = [record[name] for name in further]
        weights = np.ones(v.size)
        if self.weight is not None:
            weights = record[self.weight]
            if (weights < 0).any() or not weights.any():
                raise ValueError(f"data '{record.name}': weight: expected >= 0 and some > 0")
            weights = np.sqrt(weights / weights.mean())
        rest = (v == 0) & (record.t is None)
        return Table(record.t, np.vstack([v, N, *given]), F, weights, rest)

    def _load(self, record: Record, load: float) -> Array:
        channel = "N" if self.N is None and "N" in record else self.N
        if isinstance(channel, str):
            return record[channel]
        return np.full(record.size, load if channel is None else float(channel))


@final
@dataclass(frozen=True, eq=False)
class Table:
    """A record: imposed values (2 + inputs, n), measured forces, weights, break-away points."""

    t: Array | None
    w: Array
    F: Array
    weights: Array
    rest: NDArray[np.bool_]


@final
@dataclass(frozen=True, eq=False)
class PointRows:
    """Residuals of `Points`; see `Residuals`."""

    parameters: tuple[str, ...]
    slides: Sampled
    breaks: Sampled | None
    tables: tuple[Table, ...]
    imposed: bool
    unit: str
    shift: float | None = None

    @property
    def own(self) -> tuple[Unknown, ...]:
        """The offset of the force, if it is requested."""
        if self.shift is None:
            return ()
        size = max(float(np.abs(table.F).max(initial=0.0)) for table in self.tables)
        return (Unknown("offset", self.unit, self.shift, scale=size or 1.0, nuisance=True),)

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters of the law, then the offset."""
        return (*self.parameters, *(unknown.name for unknown in self.own))

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The force of each record."""
        found, first = list[Channel](), 0
        for number, table in enumerate(self.tables):
            v, n = table.w[0], table.F.size
            found.append(
                Channel(
                    record=number, signal="F", unit=self.unit, rows=slice(first, first + n),
                    t=v if table.t is None else table.t, measured=table.F,
                    regressors={"v": v, "sign(v)": np.sign(v)}, ordered=table.t is not None,
                )
            )  # fmt: skip
            first += n
        return tuple(found)

    def at(self, values: Array) -> Evaluation | str:
        """Return residuals weight (F(v, N) + offset - F_measured) [N], and their derivatives."""
        given = np.asarray(values, float)
        p, shift = given[: len(self.parameters)], given[len(self.parameters) :]
        residuals, slopes = list[Array](), list[Array]()
        for table in self.tables:
            found = self._forces(table, p)
            if isinstance(found, str):
                return found
            residuals.append(table.weights * (found[0] + shift.sum() - table.F))
            J = np.hstack([found[1], np.ones((table.F.size, shift.size))])
            slopes.append(table.weights[:, None] * J)
        return Evaluation(np.concatenate(residuals), np.vstack(slopes))

    def _forces(self, table: Table, p: Array) -> tuple[Array, Array] | str:
        """Return predicted forces (n,) and their derivatives by p (n, n_p)."""
        F, J = np.zeros(table.F.size), np.zeros((table.F.size, p.size))
        h = np.diff(table.t) if table.t is not None and self.imposed else 1.0
        side = np.sign(table.F)
        sides = np.vstack([table.w, side])
        for rows, w, what in (
            (~table.rest, table.w, self.slides),
            (table.rest, sides, self.breaks),
        ):
            if what is None or not rows.any():
                continue
            path = what.along(w[:, rows], h, p, self._begin(w[:, rows]))
            if isinstance(path, str):
                return path
            F[rows], J[rows] = path.rows[:, 0], path.slopes[:, 0]
        return F, J

    def _begin(self, w: Array) -> Array:
        first = w[:, 0].copy()
        first[0] = moving_start(w[0]) if self.imposed else w[0, 0]
        return first


def _equations(law: Law, p: ca.SX, imposed: bool) -> Equations:
    """Return the force at one sample; `p` are symbols in `law`."""
    where = f"Points: {type(law).__name__}"
    w = ca.SX.sym("w", 2 + len(law.inputs))
    given = {i.name: w[2 + k] for k, i in enumerate(law.inputs)}
    v, N = w[0], w[1]
    if not imposed:
        z = ca.SX(law.steady_state(v, N)) if law.states else ca.SX(0, 1)
        return Equations(w, p, ca.SX(law.force(v, N, z, **given)))
    z, later, h = ca.SX.sym("z", len(law.states)), ca.SX.sym("later", w.numel()), ca.SX.sym("h")
    then = {i.name: later[2 + k] for k, i in enumerate(law.inputs)}
    step = imposed_step(law, z, (v, N, given), (later[0], later[1], then), h, where)
    return Equations(
        w, p, ca.SX(law.force(v, N, z, **given)), z=z,
        start=ca.SX(law.steady_state(v, N)), step=step, later=later, h=h,
    )  # fmt: skip


def _break_away(law: Law, p: ca.SX) -> Equations:
    """Return the break-away force, with the direction of the pull as the last entry of `w`."""
    w = ca.SX.sym("w", 3 + len(law.inputs))
    given = {i.name: w[2 + k] for k, i in enumerate(law.inputs) if i.name != FORCE}
    side = w[w.numel() - 1]
    try:
        levels = [ca.SX(law.static_level(w[1], s, **chosen(law, given))) for s in (1, -1)]
    except ValueError as error:
        raise ValueError(f"Points: break-away at v = 0: {error}") from None
    return Equations(w, p, ca.if_else(side > 0, levels[0], -levels[1]))


def _middle(tables: list[Table]) -> float:
    """Return the force half-way between both directions [N]."""
    v, F = (np.concatenate(part) for part in zip(*((t.w[0], t.F) for t in tables), strict=True))
    if not v.min() < 0 < v.max():
        raise ValueError(
            "Points: offset: expected motion in both directions, got one: an offset cannot be "
            "separated from friction"
        )
    return float(np.median(F[v > 0]) + np.median(F[v < 0])) / 2


def _unit(data: Dataset, F: str) -> str:
    units = {record.unit(F) for record in data if record.unit(F)}
    return units.pop() if len(units) == 1 else "N"
