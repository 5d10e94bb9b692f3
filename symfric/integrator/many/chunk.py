"""A part of an ensemble as plain data, so that it can be sent to any worker."""

from dataclasses import dataclass, fields
from functools import lru_cache
from hashlib import sha256
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.compiler import find_compiler
from symfric.foundation.status import Status
from symfric.integrator.compiled.columns import Columns
from symfric.integrator.equations.initial import Equations, consistent_many, smallest_step
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.equations.manifold import Manifold
from symfric.integrator.many.members import (
    CompiledMembers,
    Members,
    Stretch,
    VmMembers,
    many_source,
)
from symfric.integrator.running.engine import Stop
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.sizes import ROUNDS, own_scale
from symfric.integrator.step.layout import Given, State

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Rows = tuple[tuple[float, ...], ...]
Packed = tuple[tuple[str, str | int], ...]
WHY = {Stop.ATTEMPTS: Status.MAX_STEPS, Stop.STEP_TOO_SMALL: Status.STEP_TOO_SMALL}


@final
@dataclass(frozen=True, eq=False)
class Chunk:
    """Start columns S (members, rows) and run data R (members, size)."""

    S: Array
    R: Array


@final
@dataclass(frozen=True, eq=False)
class Solved:
    """What became of the members of a chunk.

    Attributes:
        signals: shape (members, times, signals), NaN where a member did not get.
        attempts: shape (members,).
        reached: time [s] that each member reached.
        failed: number in the chunk -> sentence.
    """

    signals: Array
    attempts: NDArray[np.int64]
    reached: Array
    failed: dict[int, str]


@final
@dataclass(frozen=True, eq=False)
class Job:
    """What all chunks of an ensemble share; picklable.

    Attributes:
        where: for messages.
        code: C of steps, signals and their loop, or the serialised step for the virtual machine.
        compiled: which of the two.
        signals: the serialised Function of the signals.
        n_signals: how many there are.
        constraints: the serialised algebraic equations, "" where there are none.
        free: as `System.free`, row by row.
        manifold: the constraints of a mechanism, Functions serialised; () where it is none.
        names: of the unknowns.
        nominal: typical magnitudes of the differential states.
        breaks, data: input intervals and the data on them.
        times: times of the results [s].
        max_steps: attempts allowed for a member.
    """

    where: str
    code: str
    compiled: bool
    signals: str
    n_signals: int
    constraints: str
    free: Rows
    manifold: Packed
    names: tuple[str, ...]
    nominal: Array
    breaks: Array
    data: Array
    times: Array
    max_steps: int

    @classmethod
    def of(
        cls, integrator: Integrator, inputs: InputData, times: Array, backend: str, max_steps: int
    ) -> "Job":
        """The job of an integrator; "auto" is compiled where there is a compiler."""
        compiled = backend == "compiled" or (backend == "auto" and find_compiler() is not None)
        s = integrator.system
        return cls(
            where=f"simulate_many of '{integrator.model.name}'",
            code=many_source(integrator.step, integrator.signals)
            if compiled
            else str(integrator.step.serialize()),
            compiled=compiled,
            signals=str(integrator.signals.serialize()),
            n_signals=integrator.signals.numel_out(0),
            constraints=str(s.constraints.serialize()) if s.algebraic[0] else "",
            free=tuple(map(tuple, s.free.tolist())),
            manifold=_packed(s.manifold),
            names=s.names,
            nominal=s.nominal,
            breaks=inputs.breaks,
            data=inputs.values,
            times=times,
            max_steps=max_steps,
        )

    @property
    def nx(self) -> int:
        """Number of differential states."""
        return self.nominal.size

    def digest(self) -> str:
        """Hash of everything in it."""
        return digest(*(getattr(self, f.name) for f in fields(self)))

    def load(self) -> Members:
        """What runs the members; compiled once in a process."""
        if self.compiled:
            return _compiled(self.code, self.n_signals)
        return _vm(self.code, self.signals)

    @property
    def stretches(self) -> list[tuple[int, int]]:
        """Input intervals that members go through without a stop."""
        intervals = self.breaks.size - 1
        return [(k, k + 1) for k in range(intervals)] if self.constraints else [(0, intervals)]

    def stretch(self, first: int, last: int) -> tuple[Stretch, Indices]:
        """The input intervals first ... last - 1, and which of the times belong to them."""
        breaks = self.breaks[first : last + 1]
        h_min = smallest_step(float(self.breaks[-1] - self.breaks[0]))
        ends = np.inf if last == self.breaks.size - 1 else breaks[-1]
        inside = np.flatnonzero((self.times >= breaks[0]) & (self.times < ends))
        data = np.ascontiguousarray(self.data[:, first:last])
        return (
            Stretch(breaks, data, self.times[inside], self.max_steps, h_min),
            inside,
        )


def digest(*parts: object) -> str:
    """Hash of plain data; arrays count with every digit."""
    total = sha256()
    for part in parts:
        if isinstance(part, np.ndarray):
            total.update(
                f"{part.shape} {part.dtype}".encode() + np.ascontiguousarray(part).tobytes()
            )
        else:
            total.update(repr(part).encode())
        total.update(b"\0")
    return total.hexdigest()


def _packed(manifold: Manifold | None) -> Packed:
    """A mechanism's constraints as plain data, () where there are none."""
    if manifold is None:
        return ()
    values = ((f.name, getattr(manifold, f.name)) for f in fields(manifold))
    return tuple(
        (name, str(value.serialize()) if isinstance(value, ca.Function) else value)
        for name, value in values
    )


@lru_cache(16)
def _equations(
    names: tuple[str, ...],
    nx: int,
    free: Rows,
    constraints: str,
    manifold: Packed,
) -> tuple[Equations, Columns]:
    function, mechanism = ca.Function.deserialize(constraints), None
    if manifold:
        values: dict[str, Any] = {
            name: ca.Function.deserialize(value) if isinstance(value, str) else value
            for name, value in manifold
        }
        mechanism = Manifold(**values)
    return Equations(names, nx, np.array(free), function, mechanism), Columns(function)


@lru_cache(16)
def _compiled(code: str, signals: int) -> CompiledMembers:
    return CompiledMembers.of(code, signals)


@lru_cache(16)
def _vm(step: str, signals: str) -> VmMembers:
    return VmMembers.of(step, signals)


def solve_chunk(job: Job, chunk: Chunk) -> Solved:
    """Integrate the members of a chunk, those that hardly move again on their own scale."""
    found, size = _solved(job, chunk)
    scale, last = np.tile(job.nominal, (size.shape[0], 1)), np.arange(size.shape[0])
    for _ in range(ROUNDS):
        own = np.minimum(scale[last], own_scale(size, job.nominal))
        small = (own < 0.1 * scale[last]).any(axis=1)
        small &= ~np.isin(last, list(found.failed))
        if not small.any():
            break
        last = last[small]
        scale[last] = own[small]
        R, atol = chunk.R[last], Given.atol(job.nx)
        R[:, atol] *= scale[last] / job.nominal
        again, size = _solved(job, Chunk(chunk.S[last], R))
        better = np.array([m not in again.failed for m in range(last.size)])
        last, size = last[better], size[better]
        found.signals[last], found.attempts[last] = again.signals[better], again.attempts[better]
        found.reached[last] = again.reached[better]
    return found


def _solved(job: Job, chunk: Chunk) -> tuple[Solved, Array]:
    """The members of a chunk, and the largest magnitudes of their states (members, nx).

    Algebraic unknowns follow the jumps of inputs, so members with such unknowns stop together at
    the ends of the input intervals.
    """
    runner, S, alive = job.load(), chunk.S.copy(), np.arange(chunk.S.shape[0])
    shape = (alive.size, job.times.size, job.n_signals)
    signals, attempts = np.full(shape, np.nan), np.zeros(alive.size, dtype=np.int64)
    failed: dict[int, str] = {}
    size = np.zeros((alive.size, job.nx))
    for first, last in job.stretches:
        stretch, inside = job.stretch(first, last)
        if job.constraints:
            alive = _follow(job, chunk, S, alive, first, failed)
        part, made = S[alive], attempts[alive]
        found, reason, largest = runner.run(part, chunk.R[alive], made, stretch)
        size[alive] = np.maximum(size[alive], largest[:, : job.nx])
        S[alive], attempts[alive] = part, made
        signals[np.ix_(alive, inside)] = found
        for m, why, t in zip(
            alive.tolist(), reason.tolist(), part[:, State.T].tolist(), strict=True
        ):
            if why in WHY:
                failed[m] = (
                    f"{WHY[why].value} It stands at t = {t:g} s; simulate it alone for more."
                )
        alive = alive[reason == Stop.END]
    return Solved(signals, attempts, S[:, State.T].copy(), failed), size


def _follow(
    job: Job, chunk: Chunk, S: Array, alive: Indices, interval: int, failed: dict[int, str]
) -> Indices:
    """Let algebraic unknowns follow the input data of an interval; the members that can."""
    equations, together = _equations(job.names, job.nx, job.free, job.constraints, job.manifold)
    d = chunk.R[alive, Given.d(job.nx)]
    d[:, d.shape[1] - job.data.shape[0] :] = job.data[:, interval]
    S[alive, State.Y], refused = consistent_many(
        equations, together, job.where, S[alive, State.Y], d
    )
    failed |= {int(alive[m]): message for m, message in refused.items()}
    return np.delete(alive, list(refused))
