"""A part of an ensemble as plain data, so that it can be sent to any worker."""

from dataclasses import dataclass, fields
from hashlib import sha256
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.compiler import find_compiler
from symfric.foundation.status import Status
from symfric.integrator.equations.initial import consistent_many, smallest_step
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.many.members import Stretch
from symfric.integrator.many.program import Program, program
from symfric.integrator.running.engine import Stop
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.sizes import ROUNDS, own_scale
from symfric.integrator.step.layout import Given, State

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
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
        program: the equations.
        breaks, data: input intervals and the data on them.
        times: times of the results [s].
        max_steps: attempts allowed for a member.
    """

    program: Program
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
        return cls(program(integrator, compiled), inputs.breaks, inputs.values, times, max_steps)

    def digest(self) -> str:
        """Hash of everything in it."""
        own = (self.breaks, self.data, self.times, self.max_steps)
        return digest(*(getattr(self.program, f.name) for f in fields(self.program)), *own)

    @property
    def stretches(self) -> list[tuple[int, int]]:
        """Input intervals that members go through without a stop."""
        intervals = self.breaks.size - 1
        return (
            [(k, k + 1) for k in range(intervals)] if self.program.constraints else [(0, intervals)]
        )

    def stretch(self, first: int, last: int, members: int) -> tuple[Stretch, Indices]:
        """The input intervals first ... last - 1, and which of the times belong to them."""
        breaks = self.breaks[first : last + 1]
        h_min = smallest_step(float(self.breaks[-1] - self.breaks[0]))
        until = np.inf if last == self.breaks.size - 1 else breaks[-1]
        inside = np.flatnonzero((self.times >= breaks[0]) & (self.times < until))
        data, times = self.data[None, :, first:last], self.times[None, inside]
        ends, h_min = np.full(members, breaks[-1]), np.full(members, h_min)
        return Stretch(breaks, data, ends, h_min, times, self.max_steps), inside


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


def solve_chunk(job: Job, chunk: Chunk) -> Solved:
    """Integrate the members of a chunk, those that hardly move again on their own scale."""
    found, size = _solved(job, chunk)
    scale, last = np.tile(job.program.nominal, (size.shape[0], 1)), np.arange(size.shape[0])
    for _ in range(ROUNDS):
        own = np.minimum(scale[last], own_scale(size, job.program.nominal))
        small = (own < 0.1 * scale[last]).any(axis=1)
        small &= ~np.isin(last, list(found.failed))
        if not small.any():
            break
        last = last[small]
        scale[last] = own[small]
        R, atol = chunk.R[last], Given.atol(job.program.nx)
        R[:, atol] *= scale[last] / job.program.nominal
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
    runner, S, alive = job.program.load(), chunk.S.copy(), np.arange(chunk.S.shape[0])
    shape = (alive.size, job.times.size, job.program.n_signals)
    signals, attempts = np.full(shape, np.nan), np.zeros(alive.size, dtype=np.int64)
    failed: dict[int, str] = {}
    size = np.zeros((alive.size, job.program.nx))
    for first, last in job.stretches:
        if job.program.constraints:
            alive = _follow(job, chunk, S, alive, first, failed)
        stretch, inside = job.stretch(first, last, alive.size)
        part, made = S[alive], attempts[alive]
        found, reason, largest = runner.run(part, chunk.R[alive], made, stretch)
        size[alive] = np.maximum(size[alive], largest[:, : job.program.nx])
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
    equations, together = job.program.equations()
    d = chunk.R[alive, Given.d(job.program.nx)]
    d[:, d.shape[1] - job.data.shape[0] :] = job.data[:, interval]
    S[alive, State.Y], refused = consistent_many(
        equations, together, job.program.where, S[alive, State.Y], d
    )
    failed |= {int(alive[m]): message for m, message in refused.items()}
    return np.delete(alive, list(refused))
