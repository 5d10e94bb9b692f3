"""Inverse dynamics: force needed for the measured motion, minus the measured force."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.filters import Filter
from identification.residuals.balance import Balance, Row, balance, coordinates
from identification.residuals.evaluation import Channel, Evaluation
from identification.residuals.motions import Motion, Piece, measure, piece
from identification.residuals.sampled import Sampled
from identification.unknowns.spec import Unknown
from identification.unknowns.subject import Subject
from symfric.foundation import checks
from symfric.model import Model

Array = NDArray[np.float64]

WHERE = "InverseDynamics"


@final
@dataclass(frozen=True, eq=False)
class InverseDynamics:
    """Residuals of the balance of forces under the measured motion, without a simulation.

        r = D (force needed for x, v, a - force measured)

    with v, a by zero-phase filtering and differences of the measured position and D a common
    low-pass filter and decimation of all terms. For a drive: D (m a + F(v, N) + offset - force).
    States of laws follow the measured sliding velocity, z' = rate(z, v(t), N(t)). A model with
    several coordinates has one row for each input and one for each coordinate without an input;
    reactions and normal forces that depend on friction are solved for at every sample.

    Equations of static laws near a reversal are left out (`Filter.v_min`): there the low-pass
    filter mixes both directions, and a static law does not determine the force at rest.

    Attributes:
        force, x: channels of a drive.
        v: channel of its measured velocity; None: "v" if the records have it. It is combined with
            the velocity from the position according to the noise of both, frequency by frequency
            (`Velocity`): a noisy, delayed or wrongly scaled one has no weight where the position
            is more accurate.
        filter: cut-off and decimation of all records; None: from force and motion of each record.
        dead_time: bounds of the time [s] by which the measured force leads the acting one, an own
            unknown of each record; None: no dead time.

    Limits: a force that is held for a sample leads by half of it, which lowers the viscous
    coefficient by about m w^2 h / 2 for motion at w [rad/s]; dead_time=(0, h) finds it. The motion
    is taken as exact: its remaining noise lowers the mass. Therefore the decimation follows the
    band in which the motion exceeds its noise (`choose_filter`); a user's filter may not. Errors
    are those of the force up to the cut-off of the record's own filter: a force of pulses is
    wide-band and includes all its noise and every resonance, so its percentage cannot be compared
    with that of a slow record (EMPS: 10.9 % of the pulses, 5.9 % with the filter of the slow
    record; the mass is the same within .2 %). Channels of a model are named like its states and
    inputs; velocities without a channel come from the positions.
    Source: Gautier, Janot and Vandanjon, IEEE Trans. Control Syst. Technol. 21(2), 2013 (IDIM-LS).
    """

    force: str = "force"
    x: str = "x"
    v: str | None = None
    filter: Filter | None = None
    dead_time: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        for name in ("force", "x"):
            checks.text(f"{WHERE}: {name}", getattr(self, name), "the name of a channel")
        if self.v is not None:
            checks.text(f"{WHERE}: v", self.v, "the name of a channel")
        if self.filter is not None:
            checks.kind(f"{WHERE}: filter", self.filter, Filter, "a filter, such as Filter(100.0)")
        if self.dead_time is not None:
            pair = checks.many(f"{WHERE}: dead_time", self.dead_time, "bounds (low, high) [s]")
            bounds = [checks.number(f"{WHERE}: dead_time", b, unit="s") for b in pair]
            if len(bounds) != 2 or not bounds[0] < bounds[1]:
                raise checks.refused(f"{WHERE}: dead_time", "bounds in order", self.dead_time)

    def prepare(
        self, subject: Subject, data: Dataset, start: Mapping[str, float] | None = None
    ) -> "InverseRows":
        """Return the residuals of `data`.

        Raises:
            ValueError: an implicit model, missing channels, unequal intervals, records too short
                for the filter, law states that only a simulation can follow.
        """
        del start
        model = subject.model
        where = f"{WHERE}: model '{model.name}'"
        found = coordinates(model, where)
        called = {"x": self.x, "force": self.force} if subject.drive is not None else {}
        if subject.drive is not None and self.v is not None:
            called["v"] = self.v
        motions = [measure(model, found, record, called, self.filter) for record in data]
        typical = np.median(np.hstack([m.w for m in motions]), axis=1)
        made = balance(model, subject.names, found, typical, where)
        if self.dead_time is not None:
            _check_dead_time(made, model, where)
        pieces = tuple(piece(made, motion, model, self.filter is None) for motion in motions)
        return InverseRows(
            subject.names, made.equations.compiled(), made.rows, pieces, self.dead_time
        )


def _check_dead_time(made: Balance, model: Model, where: str) -> None:
    """Raise ValueError for laws that depend on the instantaneous force."""
    if ca.depends_on(ca.vertcat(made.equations.g, made.equations.step), model.vector("u")):
        raise ValueError(f"{where}: dead_time: expected laws without the applied force")


@final
@dataclass(frozen=True, eq=False)
class InverseRows:
    """Residuals of `InverseDynamics`; see `Residuals`."""

    parameters: tuple[str, ...]
    sampled: Sampled
    rows: tuple[Row, ...]
    pieces: tuple[Piece, ...]
    dead_time: tuple[float, float] | None

    @property
    def own(self) -> tuple[Unknown, ...]:
        """The dead time of each record, if it is requested."""
        if self.dead_time is None:
            return ()
        low, high = self.dead_time
        return tuple(
            Unknown(
                f"dead_time[{k}]", "s", min(max(0.0, low), high), low, high,
                scale=part.motion.step, nuisance=True,
            )
            for k, part in enumerate(self.pieces)
        )  # fmt: skip

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters of the model, then dead times."""
        return (*self.parameters, *(unknown.name for unknown in self.own))

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Each balance of each record."""
        return self._channels

    @cached_property
    def _channels(self) -> tuple[Channel, ...]:
        found, first = list[Channel](), 0
        for number, part in enumerate(self.pieces):
            for k, row in enumerate(self.rows):
                size = part.kept[k].size
                q, v, a = part.motion.of(row.coordinate)
                signals = {"x": q, "v": v, "sign(v)": np.sign(v), "a": a}
                force = (
                    np.zeros_like(q)
                    if row.input is None
                    else part.motion.w[part.motion.inputs.start + row.input]
                )
                columns = part.equations(k, np.column_stack([force, *signals.values()]))
                breaks = np.flatnonzero(np.diff(part.kept[k]) > 1) + 1
                found.append(
                    Channel(
                        record=number,
                        signal=row.signal,
                        unit=row.unit,
                        rows=slice(first, first + size),
                        t=part.times(k),
                        measured=columns[:, 0],
                        regressors=dict(zip(signals, columns[:, 1:].T, strict=True)),
                        breaks=tuple(breaks.tolist()),
                    )
                )
                first += size
        return tuple(found)

    def at(self, values: Array) -> Evaluation | str:
        """Return the residuals D (force needed - force measured), and their derivatives."""
        given = np.asarray(values, float)
        count = len(self.parameters)
        p, delays = given[:count], given[count:]
        residuals, slopes = list[Array](), list[Array]()
        for number, part in enumerate(self.pieces):
            w, rates = self._shifted(part.motion, float(delays[number]) if delays.size else None)
            path = self.sampled.along(w, part.motion.step, p, part.motion.begin)
            if isinstance(path, str):
                return f"data '{part.motion.name}': {path}"
            for k, row in enumerate(self.rows):
                J = np.zeros((part.motion.t.size, given.size))
                J[:, :count] = path.slopes[:, k]
                if delays.size and row.input is not None:
                    J[:, count + number] = rates[row.input]
                both = part.equations(k, np.column_stack([path.rows[:, k], J]))
                residuals.append(both[:, 0])
                slopes.append(both[:, 1:])
        return Evaluation(np.concatenate(residuals), np.vstack(slopes))

    def _shifted(self, motion: Motion, delay: float | None) -> tuple[Array, Array]:
        """Return `w` with the acting force u(t - delay), and du/dt there (inputs, n)."""
        if delay is None:
            return motion.w, np.zeros((0, 0))
        from scipy.interpolate import CubicSpline  # noqa: PLC0415 (slow to import)

        spline: Any = CubicSpline(motion.t, motion.w[motion.inputs], axis=1)
        at = np.clip(motion.t - delay, motion.t[0], motion.t[-1])
        w = motion.w.copy()
        w[motion.inputs] = spline(at)
        return w, np.asarray(spline(at, 1))
