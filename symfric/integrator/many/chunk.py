"""Chunk of an ensemble: its data, its solution, and the executor that solves it."""

from collections.abc import Callable, Generator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from contextlib import contextmanager, suppress
from dataclasses import dataclass, fields
from functools import lru_cache
from hashlib import sha256
from os import cpu_count
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation import packed
from symfric.foundation.programs import find_compiler
from symfric.foundation.status import Status
from symfric.integrator.equations.initial import consistent_many, smallest_step
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.many.given import input_of
from symfric.integrator.many.members import Members, Stretch
from symfric.integrator.many.program import Program, program
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.events import Stop
from symfric.integrator.running.integrator import Integrator, built
from symfric.integrator.running.run import ROUNDS, Tolerances, integrate, own_scale
from symfric.integrator.step.layout import Given, State
from symfric.model import Model

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
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
        """Largest magnitudes of the states, shape (members, nx); 0 for members that did not
        start.
        """
        return np.nan_to_num(np.abs(self.reach).max(axis=1))


@final
@dataclass(frozen=True, eq=False)
class Job:
    """Data shared by all chunks of an ensemble; picklable.

    Attributes:
        program: the equations.
        breaks: ends of the input intervals [s].
        times: times of the results [s]; empty for the end of each member only.
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
        """Return the job of an integrator; "auto" is compiled if there is a compiler."""
        compiled = backend == "compiled" or (backend == "auto" and find_compiler() is not None)
        return cls(program(integrator, compiled), breaks, times, max_steps)

    def digest(self) -> str:
        """Return a hash of all its data."""
        own = (self.breaks, self.times, self.max_steps)
        return digest(*(getattr(self.program, f.name) for f in fields(self.program)), *own)

    def stretch(self, chunk: Chunk, first: int, follow: bool) -> tuple[Stretch, Indices]:
        """Return all input intervals from `first` on, and the result times in them."""
        breaks, h_min = self.breaks[first:], smallest_step(chunk.ends - self.breaks[0])
        times = self.times[None] if self.times.size else chunk.ends[:, None]
        inside = np.flatnonzero((times >= breaks[0]).any(axis=0))
        data, times = chunk.data[:, :, first:], times[:, inside]
        return Stretch(breaks, data, chunk.ends, h_min, times, self.max_steps, follow), inside


def digest(*parts: object) -> str:
    """Return a hash of plain data; arrays count with every digit."""
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
    """Integrate the members of a chunk; repeat those with tiny motion on their own scale.

    The members run in `runner`, by default in the program of the job.
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
    """Integrate the members of a chunk once.

    They run through all their input intervals; if algebraic unknowns need a full search at the
    start of one, they stop there and continue afterwards. In mechanisms with the fast update,
    algebraic unknowns are also updated with it at the start.
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
            failed[int(here[k])] = (
                f"{why} Stopped at t = {t[k]:g} s; run it with simulate for details."
            )
        stuck = reason == Stop.SEARCH
        interval = np.searchsorted(job.breaks, t[stuck])
        for k in np.unique(interval).tolist():
            waiting[k] = np.concatenate([waiting.get(k, here[:0]), here[stuck][interval == k]])
    return Solved(signals, attempts, S[:, State.T].copy(), failed, reach)


def _consistent(
    job: Job, chunk: Chunk, S: Array, members: Indices, interval: int, failed: dict[int, str]
) -> Indices:
    """Update algebraic unknowns to the input data of an interval; return the successful members."""
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
    """Return the run data of members on an input interval."""
    d = chunk.R[members, Given.d(job.program.nx)]
    data = chunk[members].data[:, :, interval]
    d[:, d.shape[1] - data.shape[1] :] = data
    return d


Points = Sequence[tuple[Array, Array]]


@final
@dataclass(frozen=True, eq=False)
class Recipe:
    """Data from which another process builds the integrator of an ensemble, for `packed.dumps`.

    Attributes:
        model, inputs: equations and inputs to integrate.
        method: a key of `METHODS`.
        points: see `suited`.
        tolerances, backend, times: see `solve_one_by_one`.
    """

    model: Model
    inputs: InputData
    method: str
    points: tuple[tuple[Array, Array], ...]
    tolerances: Tolerances
    backend: str
    times: Array

    def integrator(self) -> Integrator:
        """Build the integrator, with the same pivots as the calling process."""
        plain, _ = built(self.model, self.inputs, METHODS[self.method])
        return suited(plain, self.points, self.inputs)


def suited(integrator: Integrator, points: Points, inputs: InputData) -> Integrator:
    """Return the integrator with pivots that are stable where members start, at (y, d) each."""
    begin, end = inputs.span
    known = list[tuple[Array, Array]]()
    for y, d in points:
        with suppress(ValueError):  # no consistent start: the run of that member reports it
            known.append((integrator.start(y, d), d))
            integrator = integrator.suited(known, end - begin)
    return integrator


@lru_cache(4)
def _followed(recipe: bytes) -> tuple[Recipe, Integrator]:
    """Return the recipe and its integrator; built once in a process."""
    loaded: Recipe = packed.loads(recipe)
    return loaded, loaded.integrator()


def solve_elsewhere(recipe: bytes, given: tuple[Array, Array, Array, Array]) -> Solved:
    """Integrate members like `solve_one_by_one`, from a packed `Recipe`."""
    known, integrator = _followed(recipe)
    return solve_one_by_one(
        integrator, known.inputs, known.tolerances, known.backend, known.times, given
    )


def solve_one_by_one(
    integrator: Integrator,
    inputs: InputData,
    tolerances: Tolerances,
    backend: str,
    times: Array,
    given: tuple[Array, Array, Array, Array],
) -> Solved:
    """Integrate members like `simulate`; signals are NaN after a terminal event.

    Args:
        integrator, inputs, tolerances, backend: common to all members, except for their input data.
        times: of the results [s]; empty for the end of each member only.
        given: start values of the unknowns (members, n), parameters (members, n_p), input data
            (members or 1, n_data, intervals) and ends (members,).

    Raises:
        KeyboardInterrupt: Ctrl-C; the members of the chunk are lost.
    """
    y0, p, data, ends = (np.ascontiguousarray(numbers) for numbers in given)
    count, names = y0.shape[0], integrator.signals.numel_out(0)
    signals = np.full((count, max(1, times.size), names), np.nan)
    attempts, reached = np.zeros(count, dtype=np.int64), np.zeros(count)
    failed, reach = dict[int, str](), np.full((count, 2, len(integrator.model.x)), np.nan)
    for m in range(count):
        own = input_of(inputs, data[m if data.shape[0] > 1 else 0], ends[m])
        looks = times[times <= ends[m]] if times.size else ends[m : m + 1]
        try:
            run, _ = integrate(integrator, own, y0[m], p[m], tolerances, backend, None, looks)
        except ValueError as error:  # no consistent start
            failed[m], reached[m] = str(error), inputs.breaks[0]
            continue
        if run.status is Status.INTERRUPTED:
            raise KeyboardInterrupt
        if not run.status.ok:
            failed[m] = run.message
        attempts[m], reached[m] = run.attempts, run.reached
        reach[m] = run.reach[:, : reach.shape[2]]
        y = run.outputs.reached
        at = looks[: y.shape[1]]
        d = np.hstack([np.tile(p[m], (at.size, 1)), own.values[:, own.interval(at)].T])
        (signals[m, : at.size],) = integrator.signal_columns([at, y.T, d])
    return Solved(signals, attempts, reached, failed, reach)


EXECUTORS = ("serial", "threads", "processes")


def solved(
    pool: Executor | None,
    workers: int | None,
    solve: Callable[[Any], Solved],
    prepare: Callable[[slice], Any],
    todo: dict[int, slice],
) -> Generator[tuple[int, Solved]]:
    """Yield results as they are completed; only a few chunks are in progress at once."""
    if pool is None:
        for first, pick in todo.items():
            yield first, solve(prepare(pick))
        return
    waiting: dict[Future[Solved], int] = {}
    left, most = iter(todo.items()), 2 * (workers or cpu_count() or 1)
    try:
        while True:
            while len(waiting) < most and (item := next(left, None)) is not None:
                waiting[pool.submit(solve, prepare(item[1]))] = item[0]
            if not waiting:
                return
            for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                yield waiting.pop(future), future.result()
    finally:
        for future in waiting:
            future.cancel()


@contextmanager
def pool_of(executor: str | Executor, workers: int | None) -> Generator[Executor | None]:
    """Yield the executor of this name, None for "serial"; a given executor is not shut down."""
    if isinstance(executor, Executor):
        yield executor
    elif executor == "serial":
        yield None
    else:
        kind = ThreadPoolExecutor if executor == "threads" else ProcessPoolExecutor
        with kind(workers or cpu_count() or 1) as pool:
            yield pool
