"""A part of an ensemble as plain data, so that it can be sent to any worker."""

from dataclasses import dataclass, fields
from hashlib import sha256
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.compiler import find_compiler
from symfric.foundation.status import Status
from symfric.integrator.equations.initial import consistent_many, smallest_steps
from symfric.integrator.many.members import Members, Stretch
from symfric.integrator.many.program import Program, program
from symfric.integrator.running.engine import Stop
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.sizes import ROUNDS, own_scale
from symfric.integrator.step.layout import Given, State

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
BEFORE = -1
"""In front of the first input interval."""
WHY = {Stop.ATTEMPTS: Status.MAX_STEPS, Stop.STEP_TOO_SMALL: Status.STEP_TOO_SMALL}


@final
@dataclass(frozen=True, eq=False)
class Chunk:
    """What members of their own have.

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
    """What became of the members of a chunk.

    Attributes:
        signals: shape (members, times, signals), NaN where a member did not get.
        attempts: shape (members,).
        reached: time [s] that each member reached.
        failed: number in the chunk -> sentence.
        reach: least and greatest states over the start and all accepted steps, shape
            (members, 2, nx); NaN of a member that did not start.
    """

    signals: Array
    attempts: NDArray[np.int64]
    reached: Array
    failed: dict[int, str]
    reach: Array

    @property
    def size(self) -> Array:
        """Largest magnitudes of the states, shape (members, nx); 0 without a start."""
        return np.nan_to_num(np.abs(self.reach).max(axis=1))


@final
@dataclass(frozen=True, eq=False)
class Job:
    """What all chunks of an ensemble share; picklable.

    Attributes:
        program: the equations.
        breaks: ends of the input intervals [s].
        times: times of the results [s]; none for the end of each member alone.
        max_steps: attempts allowed for a member.
    """

    program: Program
    breaks: Array
    times: Array
    max_steps: int

    @classmethod
    def of(
        cls, integrator: Integrator, breaks: Array, times: Array, backend: str, max_steps: int
    ) -> "Job":
        """The job of an integrator; "auto" is compiled where there is a compiler."""
        compiled = backend == "compiled" or (backend == "auto" and find_compiler() is not None)
        return cls(program(integrator, compiled), breaks, times, max_steps)

    def digest(self) -> str:
        """Hash of everything in it."""
        own = (self.breaks, self.times, self.max_steps)
        return digest(*(getattr(self.program, f.name) for f in fields(self.program)), *own)

    def stretch(self, chunk: Chunk, first: int, follow: bool) -> tuple[Stretch, Indices]:
        """All input intervals from `first` on, and which of the times belong to them."""
        breaks, h_min = self.breaks[first:], smallest_steps(chunk.ends - self.breaks[0])
        times = self.times[None] if self.times.size else chunk.ends[:, None]
        inside = np.flatnonzero((times >= breaks[0]).any(axis=0))
        data, times = chunk.data[:, :, first:], times[:, inside]
        return Stretch(breaks, data, chunk.ends, h_min, times, self.max_steps, follow), inside


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


def solve_chunk(job: Job, chunk: Chunk, runner: Members | None = None) -> Solved:
    """Integrate the members of a chunk, those that hardly move again on their own scale.

    What runs them is `runner`, else the program of the job.
    """
    runner = runner or job.program.load()
    found = _solved(job, chunk, runner)
    size = found.size
    scale, last = np.tile(job.program.nominal, (size.shape[0], 1)), np.arange(size.shape[0])
    for _ in range(ROUNDS):
        own = np.minimum(scale[last], own_scale(size, job.program.nominal))
        small = (own < 0.1 * scale[last]).any(axis=1)
        small &= ~np.isin(last, list(found.failed))
        if not small.any():
            break
        last = last[small]
        scale[last] = own[small]
        those, atol = chunk[last], Given.atol(job.program.nx)
        those.R[:, atol] *= scale[last] / job.program.nominal
        again = _solved(job, those, runner)
        better = np.array([m not in again.failed for m in range(last.size)])
        last, size = last[better], again.size[better]
        found.signals[last], found.attempts[last] = again.signals[better], again.attempts[better]
        found.reached[last], found.reach[last] = again.reached[better], again.reach[better]
    return found


def _solved(job: Job, chunk: Chunk, runner: Members) -> Solved:
    """The members of a chunk.

    They run through all their input intervals; where algebraic unknowns have to be searched for at
    the beginning of one, they stop, and go on from there. Those of a mechanism that is put together
    follow the first data as they follow others.
    """
    S, count = chunk.S.copy(), chunk.S.shape[0]
    signals = np.full((count, max(1, job.times.size), job.program.n_signals), np.nan)
    attempts, reach = np.zeros(count, dtype=np.int64), np.full((count, 2, job.program.nx), np.nan)
    failed: dict[int, str] = {}
    waiting, together = {BEFORE: np.arange(count)}, job.program.assembly()
    while waiting:
        first = min(waiting)
        here, follow = waiting.pop(first), first == BEFORE and together is not None
        first = max(first, 0)
        if together is not None and follow:
            d = _data(job, chunk, here, first)
            S[here, State.Y], closed = together(S[here, State.Y], d)
            waiting |= {first: here[~closed]} if not closed.all() else {}
            here = here[closed]
        else:
            here = _consistent(job, chunk, S, here, first, failed)
        stretch, inside = job.stretch(chunk[here], first, follow)
        part, made = S[here], attempts[here]
        found, reason, unknowns = runner.run(part, chunk.R[here], made, stretch)
        for k, widest in enumerate((np.fmin, np.fmax)):
            reach[here, k] = widest(reach[here, k], unknowns[:, k, : job.program.nx])
        S[here], attempts[here], t = part, made, part[:, State.T]
        signals[np.ix_(here, inside)] = found
        for k in np.flatnonzero(np.isin(reason, list(WHY))).tolist():
            why = WHY[Stop(int(reason[k]))].value
            failed[int(here[k])] = f"{why} It stands at t = {t[k]:g} s; simulate it alone for more."
        stuck = reason == Stop.SEARCH
        interval = np.searchsorted(job.breaks, t[stuck])
        for k in np.unique(interval).tolist():
            waiting[k] = np.concatenate([waiting.get(k, here[:0]), here[stuck][interval == k]])
    return Solved(signals, attempts, S[:, State.T].copy(), failed, reach)


def _consistent(
    job: Job, chunk: Chunk, S: Array, members: Indices, interval: int, failed: dict[int, str]
) -> Indices:
    """Let algebraic unknowns follow the input data of an interval; the members that can."""
    if not job.program.constraints:
        return members
    equations, together = job.program.equations()
    d = _data(job, chunk, members, interval)
    S[members, State.Y], refused = consistent_many(
        equations, together, job.program.where, S[members, State.Y], d
    )
    failed |= {int(members[m]): message for m, message in refused.items()}
    return np.delete(members, list(refused))


def _data(job: Job, chunk: Chunk, members: Indices, interval: int) -> Array:
    """Run data of members on an input interval."""
    d = chunk.R[members, Given.d(job.program.nx)]
    data = chunk[members].data[:, :, interval]
    d[:, d.shape[1] - data.shape[1] :] = data
    return d
