"""Motions in pieces with constant contact modes and continuous inputs, and their inputs."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ocp.friction.contact_modes import Modes
from ocp.friction.mode_models import KINDS
from ocp.solving.solution import Mode
from symfric import Hold, Linear, Statistics, Trajectory
from symfric.foundation import checks
from symfric.foundation.status import Status
from symfric.foundation.variable import stacked
from symfric.model import Model

Array = NDArray[np.float64]
Given = float | Hold | Linear | Callable[[ca.SX], Any]
LATER = 1e-13
"""Relative time difference by which times just after a jump are found."""


@final
class Inputs:
    """Inputs of a simulation, continuous between their jumps."""

    def __init__(self, model: Model, given: dict[str, Given], end: float) -> None:
        self.model = model
        self.given: dict[str, Given] = model.named("u", given)
        sampled = [v for v in self.given.values() if isinstance(v, Hold | Linear)]
        if any(s.rows is not None for s in sampled):
            raise checks.refused(
                "set_valued: u", "one signal for each input", "those of an ensemble"
            )
        knots = [np.asarray(s.t, dtype=float) for s in sampled]
        self.knots = np.unique(np.concatenate([*knots, [end]]))
        symbol = ca.SX.sym("t")
        self._functions = {
            name: ca.Function("u", [symbol], [ca.SX(value(symbol))])
            for name, value in self.given.items()
            if not isinstance(value, Hold | Linear) and callable(value)
        }

    def next(self, t: float, end: float) -> float:
        """Return the end of the piece that begins at `t`."""
        after = self.knots[self.knots > t + LATER * max(1.0, abs(t))]
        return min(float(after[0]) if after.size else end, end)

    def within(self, t: float) -> dict[str, Any]:
        """Return the inputs of the piece that begins at `t`."""
        return {n: self._at(n, t) if isinstance(v, Hold) else v for n, v in self.given.items()}

    def at(self, t: float) -> Array:
        """Return the values just after the time `t`, in the order of the model."""
        return self.model.values("u", {name: self._at(name, t) for name in self.given})

    def _at(self, name: str, t: float) -> float:
        value = self.given[name]
        if isinstance(value, Hold):
            times = np.asarray(value.t)
            k = int(np.searchsorted(times, t + LATER * max(1.0, abs(t)), side="right")) - 1
            return float(np.asarray(value.values)[max(k, 0)])
        if isinstance(value, Linear):
            return float(np.interp(t, np.asarray(value.t), np.asarray(value.values)))
        if name in self._functions:
            return float(self._functions[name](t))
        return checks.number(f"set_valued: u: {name}", value)


class Piece(NamedTuple):
    """Run in which no contact changes its mode and no input jumps."""

    run: Trajectory
    modes: Modes
    begin: float
    end: float


@final
@dataclass(frozen=True, eq=False)
class SetValued:
    """Motion with exact Coulomb friction, up to its end or a failure.

    `motion["v"]` is a signal at the times `motion.t`; `motion.at(times)` returns all signals at any
    times. Signals are those of the model except law states, and the friction forces "<contact>_F".
    See `trajectory` for plots, files and expressions.

    Attributes:
        model: the user's model.
        t: times of the result [s].
        pieces: runs between changes of mode and jumps of inputs.
        status, message: status of the simulation and its description.
        contacts: names of the contacts.
    """

    model: Model
    t: Array
    pieces: tuple[Piece, ...]
    status: Status = Status.SUCCESS
    message: str = Status.SUCCESS.value
    contacts: tuple[str, ...] = ()

    @property
    def span(self) -> tuple[float, float]:
        """First time and last time reached [s]."""
        return self.pieces[0].begin, self.pieces[-1].end

    @cached_property
    def modes(self) -> dict[str, tuple[Mode, ...]]:
        """Contact -> its modes in the order of time."""
        modes: dict[str, tuple[Mode, ...]] = {}
        for name in self.contacts:
            merged: list[Mode] = []
            for piece in self.pieces:
                kind, begin = KINDS[piece.modes[name]], piece.begin
                if merged and merged[-1].kind == kind:
                    begin = merged.pop().begin
                merged.append(Mode(kind, begin, piece.end))
            modes[name] = tuple(m for m in merged if m.end > m.begin)
        return modes

    @cached_property
    def last(self) -> Modes:
        """Modes in the last piece, with which a simulation can continue."""
        return dict(self.pieces[-1].modes)

    @cached_property
    def trajectory(self) -> Trajectory:
        """Trajectory of the user's model, with "<contact>_F" as additional signals.

        Expressions that contain law states or algebraic unknowns of other laws are NaN.
        """
        of_laws = {v.name for c in self.model.contacts for v in c.states}
        known = set.intersection(*(set(p.run.units) for p in self.pieces)) - of_laws
        units = {n: u for n, u in self.model.signals.items() if n in known}
        contacts = {c.name: c for c in self.model.contacts}
        units |= {f"{name}_F": contacts[name].unit("N") for name in self.contacts}
        inner = [p.run.step_times[(p.run.step_times < p.end)] for p in self.pieces]
        return Trajectory(
            scene=self.model.name,
            t=self.t,
            units=units,
            status=self.status,
            message=self.message,
            count=self._statistics,
            span=self.span,
            ends=lambda: np.unique(np.concatenate([*inner, [self.span[1]]])),
            states=self._states,
            evaluate=self._evaluated,
            express=self._expressed,
            model=self.model,
            happened=tuple((p.end, "change") for p in self.pieces[:-1]),
        )

    def _statistics(self) -> Statistics:
        every = [p.run.statistics for p in self.pieces]
        names = ("steps", "rejections", "evaluations", "jacobians", "factorisations", "run_time",
                 "build_time", "compile_time")  # fmt: skip
        total = {name: sum(getattr(s, name) for s in every) for name in names}
        least = min(s.smallest_step for s in every)
        return replace(every[0], **total, events=len(self.pieces) - 1, smallest_step=least)

    def _pieces_at(self, at: Array) -> Iterator[tuple[Piece, NDArray[np.bool_], Array]]:
        """Yield (piece, mask, times in the piece); a change of mode belongs to the later piece."""
        edges = np.array([p.begin for p in self.pieces[1:]])
        which = np.searchsorted(edges, at, side="right")
        for k in np.unique(which):
            piece, here = self.pieces[k], which == k
            yield piece, here, np.clip(at[here], piece.begin, piece.end)

    def _states(self, at: Array) -> dict[str, Array]:
        states = {v.name: np.zeros(at.size) for v in self.model.open.x}
        for piece, here, times in self._pieces_at(at):
            values = piece.run.states(times)
            for name, row in states.items():
                row[here] = values[name]
        return states

    def _evaluated(self, at: Array) -> dict[str, Array]:
        signals = {name: np.zeros(at.size) for name in self.trajectory.units}
        contacts = {c.name: c for c in self.model.contacts}
        for piece, here, times in self._pieces_at(at):
            values = piece.run.at(times)
            for name in self.contacts:
                mode = piece.modes[name]
                values[f"{name}_F"] = (
                    piece.run.express(contacts[name].sliding(mode), times)[0]
                    if mode
                    else values[f"{name}_reaction"]
                )
            for name, row in signals.items():
                row[here] = values[name]
        return signals

    def _expressed(self, column: ca.SX, at: Array) -> Array:
        values = np.full((column.numel(), at.size), np.nan)
        for piece, here, times in self._pieces_at(at):
            model = piece.run.model
            known = {v.symbol.__hash__() for group in "xzup" for v in getattr(model, group)}
            every = [v.symbol for group in "xz" for v in getattr(self.model, group)]
            gone = stacked(s for s in every if s.__hash__() not in known)
            there = ca.substitute(column, gone, ca.SX(ca.DM(gone.numel(), 1) + np.nan))
            values[:, here] = piece.run.express(ca.densify(there), times)
        return values

    def __getitem__(self, name: str) -> Array:
        return self.t if name == "t" else self.trajectory[name]

    def at(self, times: ArrayLike) -> dict[str, Array]:
        """Return all signals at `times` [s]; at a change of mode, the values after it."""
        return self.trajectory.at(times)

    def final(self) -> dict[str, float]:
        """Return the states at the end by name, without law states."""
        return {
            name: float(row[-1]) for name, row in self._states(np.array([self.span[1]])).items()
        }
