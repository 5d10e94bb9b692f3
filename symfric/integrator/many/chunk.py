"""Chunk of an ensemble: its data, and its solution for all members together or one by one."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cached_property
from hashlib import sha256
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Array
from symfric.foundation.packed import state_of
from symfric.foundation.status import Status
from symfric.integrator.equations.initial import consistent_many, smallest_step
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.many.members import Program, Runner, Stretch, with_code
from symfric.integrator.methods.attempt import RRow, SRow
from symfric.integrator.methods.method import Method
from symfric.integrator.running.events import Stop
from symfric.integrator.running.integrator import Integrator, built
from symfric.integrator.running.run import ROUNDS, Tolerances, integrate, own_scale, watchful
from symfric.model import Model

Indices = NDArray[np.intp]
Points = Sequence[tuple[Array, Array]]
BEFORE = -1
"""Index before the first input interval."""
WHY = {Stop.ATTEMPTS: Status.MAX_STEPS, Stop.STEP_TOO_SMALL: Status.STEP_TOO_SMALL}


@final
@dataclass(frozen=True, eq=False)
class Chunk:
    """Data of the members of a chunk.

    Attributes:
        S: start columns (members, rows).
        R: run data (members, size).
        data: input data (members or 1, n_data, intervals).
        ends: end times [s], shape (members,).
    """

    S: Array
    R: Array
    data: Array
    ends: Array

    def __getitem__(self, pick: Indices) -> "Chunk":
        data = self.data if self.data.shape[0] == 1 else self.data[pick]
        return Chunk(self.S[pick], self.R[pick], data, self.ends[pick])


@final
@dataclass(frozen=True, eq=False)
class Solved:
    """Results of the members of a chunk.

    Attributes:
        signals: shape (members, times, signals), NaN after the end of a member.
        attempts: shape (members,).
        reached: time [s] that each member reached.
        failed: number in the chunk -> message.
        reach: least and greatest states over the start and all accepted steps, shape
            (members, 2, nx); NaN for a member that did not start.
    """

    signals: Array
    attempts: NDArray[np.int64]
    reached: Array
    failed: dict[int, str]
    reach: Array

    @property
    def size(self) -> Array:
        """Largest magnitudes of the states, shape (members, nx); 0 if a member did not start."""
        return np.nan_to_num(np.abs(self.reach).max(axis=1))


def digest(*parts: Any) -> str:
    """Return a hash of plain data, Functions and data classes, with all digits of arrays."""
    total = sha256()
    for part in parts:
        if isinstance(part, np.ndarray):
            total.update(f"{part.shape} {part.dtype}".encode())
            total.update(np.ascontiguousarray(part).tobytes())
        elif isinstance(part, ca.Function):
            total.update(str(part.serialize()).encode())
        elif is_dataclass(part):
            total.update(digest(*(getattr(part, item.name) for item in fields(part))).encode())
        elif isinstance(part, tuple):
            total.update(digest(*part).encode())
        else:
            total.update(repr(part).encode())
        total.update(b"\0")
    return total.hexdigest()


@final
@dataclass(frozen=True, eq=False)
class Job:
    """Task of a model without events, whose members run together in compiled code; picklable.

    Attributes:
        program: the equations.
        breaks: ends of the input intervals [s].
        times: times of the results [s]; if empty, each member has one result at its end.
        max_steps: largest number of attempts of a member.
    """

    program: Program
    breaks: Array
    times: Array
    max_steps: int

    @property
    def identity(self) -> Program:
        """Data that determine the results."""
        return self.program

    def solve(self, chunk: Chunk, run: Runner | None = None) -> Solved:
        """Integrate the members of a chunk; repeat those with tiny motion at a smaller scale.

        Args:
            chunk: data of the members.
            run: runner of the members; by default that of the program.
        """
        run, nominal = run or self.program.members.run, self.program.nominal
        found = self._solved(chunk, run)
        size = found.size
        scale, last = np.tile(nominal, (size.shape[0], 1)), np.arange(size.shape[0])
        for _ in range(ROUNDS):
            own = np.minimum(scale[last], own_scale(size, nominal))
            small = (own < 0.1 * scale[last]).any(axis=1)
            small &= ~np.isin(last, list(found.failed))
            if not small.any():
                break
            last = last[small]
            scale[last] = own[small]
            those = chunk[last]
            those.R[:, RRow.atol(nominal.size)] *= scale[last] / nominal
            again = self._solved(those, run)
            better = np.array([m not in again.failed for m in range(last.size)])
            last, size = last[better], again.size[better]
            for name in ("signals", "attempts", "reached", "reach"):
                getattr(found, name)[last] = getattr(again, name)[better]
        return found

    def _solved(self, chunk: Chunk, run: Runner) -> Solved:
        """Integrate the members of a chunk once.

        Each member runs through its input intervals. It stops at the start of an interval if the
        algebraic unknowns need a full search there, and continues after the search. Mechanisms
        with the fast update of algebraic unknowns also use it at the start of the run.
        """
        S, (count, nx) = chunk.S.copy(), (chunk.S.shape[0], self.program.nx)
        signals = np.full((count, max(1, self.times.size), self.program.n_signals), np.nan)
        attempts, reach = np.zeros(count, dtype=np.int64), np.full((count, 2, nx), np.nan)
        failed: dict[int, str] = {}
        waiting, assembly = {BEFORE: np.arange(count)}, self.program.assembly
        while waiting:
            first = min(waiting)
            here, follow = waiting.pop(first), first == BEFORE and assembly is not None
            first = max(first, 0)
            if assembly is not None and follow:
                S[here, SRow.Y], closed = assembly(S[here, SRow.Y], _data(chunk, here, first, nx))
                waiting |= {first: here[~closed]} if not closed.all() else {}
                here = here[closed]
            else:
                here = self._consistent(chunk, S, here, first, failed)
            stretch, inside = self._stretch(chunk[here], first, follow)
            part, made = S[here], attempts[here]
            found, reason, unknowns = run(part, chunk.R[here], made, stretch)
            for k, widest in enumerate((np.fmin, np.fmax)):
                reach[here, k] = widest(reach[here, k], unknowns[:, k, :nx])
            S[here], attempts[here], t = part, made, part[:, SRow.T]
            signals[np.ix_(here, inside)] = found
            for k in np.flatnonzero(np.isin(reason, list(WHY))).tolist():
                why = WHY[Stop(int(reason[k]))].value
                failed[int(here[k])] = (
                    f"{why} Stopped at t = {t[k]:g} s; run it with simulate for details."
                )
            stuck = reason == Stop.SEARCH
            interval = np.searchsorted(self.breaks, t[stuck])
            for k in np.unique(interval).tolist():
                waiting[k] = np.concatenate([waiting.get(k, here[:0]), here[stuck][interval == k]])
        return Solved(signals, attempts, S[:, SRow.T].copy(), failed, reach)

    def _consistent(
        self, chunk: Chunk, S: Array, members: Indices, interval: int, failed: dict[int, str]
    ) -> Indices:
        """Make algebraic unknowns consistent at an interval; return the successful members."""
        equations = self.program.equations
        if equations is None:
            return members
        d = _data(chunk, members, interval, self.program.nx)
        S[members, SRow.Y], refused = consistent_many(
            equations, self.program.constraints, self.program.where, S[members, SRow.Y], d
        )
        failed |= {int(members[m]): message for m, message in refused.items()}
        return np.delete(members, list(refused))

    def _stretch(self, chunk: Chunk, first: int, follow: bool) -> tuple[Stretch, Indices]:
        """Return all input intervals from `first` on, and the indices of result times in them."""
        breaks, h_min = self.breaks[first:], smallest_step(chunk.ends - self.breaks[0])
        times = self.times[None] if self.times.size else chunk.ends[:, None]
        inside = np.flatnonzero((times >= breaks[0]).any(axis=0))
        data, times = chunk.data[:, :, first:], times[:, inside]
        return Stretch(breaks, data, chunk.ends, h_min, times, self.max_steps, follow), inside


def _data(chunk: Chunk, members: Indices, interval: int, nx: int) -> Array:
    """Return the run data of members in an input interval."""
    d = chunk.R[members, RRow.d(nx)]
    data = chunk[members].data[:, :, interval]
    d[:, d.shape[1] - data.shape[1] :] = data
    return d


def suited(integrator: Integrator, points: Points, inputs: InputData) -> Integrator:
    """Return the integrator with pivots that are stable at `points`, start points (y, d)."""
    begin, end = inputs.span
    known = list[tuple[Array, Array]]()
    for y, d in points:
        with suppress(ValueError):  # the run of a member reports that it has no consistent start
            known.append((integrator.start(y, d), d))
            integrator = integrator.suited(known, end - begin)
    return integrator


@final
@dataclass(frozen=True, eq=False)
class SingleJob:
    """Task whose members run one by one as in `simulate`; picklable.

    It is used for models with events and for CasADi's virtual machine. Each process builds its own
    integrator, with the same pivots.

    Attributes:
        model, inputs, method: arguments of the integrator; the inputs of the members differ only
            in their data.
        points: start points (y, d), see `suited`.
        tolerances, backend: arguments of `integrate`.
        times: times of the results [s]; if empty, each member has one result at its end.
    """

    model: Model
    inputs: InputData
    method: Method
    points: tuple[tuple[Array, Array], ...]
    tolerances: Tolerances
    backend: str
    times: Array

    def __getstate__(self) -> dict[str, Any]:
        return state_of(self)

    @cached_property
    def integrator(self) -> Integrator:
        """Integrator, built once per process."""
        plain, _ = built(self.model, self.inputs, self.method)
        return suited(plain, self.points, self.inputs)

    @property
    def identity(self) -> tuple[Any, ...]:
        """Data that determine the results."""
        made, events = self.integrator, self.model.events
        of_events = [(e.name, e.direction, e.terminal, e.at_start, *e.reset) for e in events]
        jump = () if made.crossings is None else (made.crossings.jump, made.events)
        return with_code(made, ""), made.step, made.signals, tuple(of_events), jump

    def solve(self, chunk: Chunk) -> Solved:
        """Integrate the members of a chunk; signals are NaN after a terminal event.

        Raises:
            KeyboardInterrupt: Ctrl-C; the members of the chunk are lost.
        """
        integrator, times = self.integrator, self.times
        count, nx, names = chunk.ends.size, len(self.model.x), integrator.signals.numel_out(0)
        signals = np.full((count, max(1, times.size), names), np.nan)
        attempts, reached = np.zeros(count, dtype=np.int64), np.zeros(count)
        failed, reach = dict[int, str](), np.full((count, 2, nx), np.nan)
        for m, end in enumerate(chunk.ends.tolist()):
            own = self._inputs(chunk.data[m % chunk.data.shape[0]], end)
            looks = times[times <= end] if times.size else chunk.ends[m : m + 1]
            y0, p = chunk.S[m, SRow.Y].copy(), chunk.R[m, RRow.d(nx)][: len(self.model.p)].copy()
            try:
                allowed = watchful(self.tolerances, integrator, own)
                run, _ = integrate(integrator, own, y0, p, allowed, self.backend, None, looks)
            except ValueError as error:  # no consistent start
                failed[m], reached[m] = str(error), self.inputs.breaks[0]
                continue
            if run.status is Status.INTERRUPTED:
                raise KeyboardInterrupt
            if not run.status.ok:
                failed[m] = run.message
            attempts[m], reached[m], reach[m] = run.attempts, run.reached, run.reach[:, :nx]
            y = run.outputs.reached
            at = looks[: y.shape[1]]
            d = np.hstack([np.tile(p, (at.size, 1)), own.values[:, own.interval(at)].T])
            (signals[m, : at.size],) = integrator.signal_columns([at, y.T, d])
        return Solved(signals, attempts, reached, failed, reach)

    def _inputs(self, data: Array, end: float) -> InputData:
        """Return the inputs of one member from its data (n_data, intervals), up to its end [s]."""
        last = int(np.searchsorted(self.inputs.breaks, end))
        breaks = np.append(self.inputs.breaks[:last], end)
        return replace(self.inputs, breaks=breaks, values=np.ascontiguousarray(data[:, :last]))
