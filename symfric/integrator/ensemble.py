"""Many runs of one model over arrays of parameters and start values, local or on a cluster."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable, Generator, Mapping
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from contextlib import closing, contextmanager
from dataclasses import replace
from functools import lru_cache, partial
from os import cpu_count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.foundation.programs import CompileError, find_compiler
from symfric.foundation.status import OverloadWarning, SolveError, Status
from symfric.integrator.compiled.columns import BACKENDS
from symfric.integrator.equations.initial import first_step
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.many.chunk import Chunk, Job, Points, SingleJob, Solved, digest, suited
from symfric.integrator.many.member_data import MemberData, MemberInput, Store, ends_of, member_data
from symfric.integrator.many.members import program
from symfric.integrator.methods.attempt import SRow
from symfric.integrator.methods.tableaux import chosen
from symfric.integrator.prepared import check_flags, check_span, check_times, stopping, tolerances
from symfric.integrator.running.doubts import of_members
from symfric.integrator.running.integrator import Integrator, built, in_results
from symfric.integrator.running.run import Tolerances
from symfric.model import Model, check_model
from symfric.results.ensemble import Ensemble

if TYPE_CHECKING:
    from symfric.integrator.cuda.on_device import OnDevice

    Task = Job | SingleJob | OnDevice
    """Part of the work that all chunks of an ensemble share."""

CUDA, REALS = "cuda", ("double", "float")
EXECUTORS = ("serial", "threads", "processes")
RESULTS = 4
"""Format number of the result folders, incremented with every change."""
CHUNK = 500
"""Number of members of a task on a CPU."""


def simulate_many(
    model: Model,
    t_end: float | ArrayLike,
    *,
    t_start: float = 0.0,
    x0: Mapping[str, ArrayLike] | None = None,
    u: Mapping[str, MemberInput] | None = None,
    p: Mapping[str, ArrayLike] | None = None,
    t_eval: ArrayLike | None = None,
    rtol: float = 1e-6,
    method: str = "auto",
    backend: str = "auto",
    event_tolerance: float = 1e-10,
    max_steps: int = 10_000_000,
    max_step: float | None = None,
    times: ArrayLike = (),
    executor: str | Executor = "threads",
    workers: int | None = None,
    chunk: int | None = None,
    real: str = "double",
    out: str | Path | None = None,
    progress: Callable[[float], None] | None = None,
) -> Ensemble:
    """Integrate one model for many parameters and start values.

    Args:
        model: the equations.
        t_end: last time [s], or an array with one per member.
        t_start: first time [s], common to all members.
        x0, p: start values and parameters by name: numbers, or arrays with one entry per member.
        u: inputs by name: as in `simulate`, for all members; an array with one number per member;
            or `Hold` or `Linear` with values of shape (members, n), one row per member at common
            times.
        t_eval: times of the results [s]; results after the end of a member are NaN. By default the
            `t_end` of each member.
        rtol, method, event_tolerance, max_steps, max_step, times: as in `simulate`; the absolute
            tolerance is 0.1 rtol nominal, for each member with the defaults of `simulate`.
        backend: "compiled", "vm", or "auto": compiled if there is a compiler. Compiled members run
            in parallel in the lanes of vector instructions. The last digits of exp, sin, pow, ...
            may differ from "vm" and `simulate`; with stick and slip, the number of steps may then
            differ by a few, within the tolerance. "cuda" uses a graphics processor through CuPy
            (extra 'cuda'), with one member per thread, for a hundred thousand members and more. It
            supports models without events; equations, steps, failures and counts equal those of
            the other backends up to last digits. "auto" never chooses it; there is no fallback.
        executor: "serial", "threads" (the compiled loop holds no lock), "processes", or any
            `concurrent.futures.Executor`, such as those of dask and mpi4py. A compiled task is
            plain data and C source, so a worker needs only this package and a compiler. With
            events or backend="vm", the task contains the model, whose classes a worker imports;
            each worker builds its integrator once and runs members one by one, as `simulate` does.
        workers: number of threads or processes, or of the executor's workers; default all cores of
            this machine. Twice as many chunks are in progress at once.
        chunk: members per task; default 500. On a graphics processor the default is limited by a
            billion operations per attempt of all members, or a gigabyte of results.
        real: "double", or "float" (single precision) with backend="cuda" and rtol of 1e-5 or more
            (`symfric.integrator.cuda`).
        out: folder for the results, written chunk by chunk to bound the memory. A call with the
            same arguments verifies the checksums of the stored chunks and resumes an interrupted
            run.
        progress: called with the fraction done.

    Returns:
        The ensemble. A failed member is reported by number and does not affect the others. After
        an interrupt (Ctrl-C) the ensemble contains the finished members.

    Raises:
        ValueError: bad input; arrays of different lengths.
        SolveError: a worker process ended; its `partial` contains the finished members.
        RuntimeError: compiled code was requested without a working compiler, or a graphics
            processor without a device or CuPy.

    Warns:
        UserWarning: rtol above 1e-5, where stick phases may be missed; damaged results in `out`,
            which are computed again.
        OverloadWarning: friction above its static level in some members (`Ensemble.doubtful`).
    """
    where = "simulate_many"
    check_model(where, model)
    check_flags(where, progress)
    ends = ends_of(t_end)
    t_start, last, rtol = check_span(where, model, t_start, float(np.max(ends)), rtol)
    if np.min(ends) <= t_start:
        raise ValueError(
            f"{where}: expected t_end > t_start = {t_start:g} s, got {np.min(ends):g} s for "
            f"member {np.argmin(ends)}"
        )
    formula = chosen(where, method, rtol)
    _check(backend, executor, real)
    workers = None if workers is None else checks.count(f"{where}: workers", workers)
    chunk = None if chunk is None else checks.count(f"{where}: chunk", chunk)
    if backend == CUDA:
        _devices().check(model, executor, workers, rtol, real)
    given = member_data(model, (t_start, ends), x0, u, p)
    inputs = stopping(where, given.inputs, times, t_start, last)
    given, members = replace(given, inputs=inputs), given.count
    looks = np.zeros(0) if np.ndim(ends) else np.array([last])
    if t_eval is not None:
        looks = check_times(where, t_start, last, t_eval)
    integrator, _ = built(model, inputs, formula)
    limits = integrator.system.nominal, event_tolerance, max_steps, max_step
    allowed = tolerances(where, rtol, None, *limits)
    points = _points(integrator, given)
    integrator = suited(integrator, points, inputs)
    device: OnDevice | None = None
    if backend == CUDA:
        device = _devices().OnDevice.of(integrator, inputs.breaks, looks, max_steps, real)
    task = device or _task(integrator, inputs, allowed, points, looks, backend, executor)
    size = chunk or (CHUNK if device is None else device.chunk(given))
    prepare = partial(_chunk, integrator, given, allowed)
    picks = {first: slice(first, min(first + size, members)) for first in range(0, members, size)}
    folder = None
    if out is not None:
        chunks = tuple(digest(prepare(pick)) for pick in picks.values())
        identity = digest(RESULTS, task.identity, allowed, looks, chunks)
        folder = checks.path("simulate_many: out", out) / identity[:16]
    store = Store(folder, model.signals, members, max(1, looks.size), len(model.x))
    todo = {first: picks[first] for first in store.left(picks)}
    done, ended = members - sum(pick.stop - pick.start for pick in todo.values()), None
    if device is not None and progress is not None:
        device.report(progress, lambda: done, members)
    try:
        with (
            pool_of("serial" if device else executor, workers) as pool,
            closing(solved(pool, workers, task, prepare, todo)) as results,
        ):
            for first, result in results:
                store.put(first, result)
                done += result.attempts.size
                if progress is not None:
                    progress(done / members)
    except (KeyboardInterrupt, BrokenExecutor) as error:
        ended = error
    found = _doubted(_ensemble(model, looks, given, store, ended), model, given)
    if isinstance(ended, BrokenExecutor):
        raise _worker_ended(found, done, folder is not None) from ended
    return found


def _ensemble(
    model: Model, looks: Array, given: MemberData, store: Store, ended: BaseException | None
) -> Ensemble:
    """Return the ensemble of the stored members."""
    units = {v.name: v.unit for v in model.p} | {"t_end": "s"}
    for what, group in (("x0", model.x), ("u", model.u)):
        units |= {f"{what}.{v.name}": v.unit for v in group}
    reach = {
        v.name: in_results(v.kind, ends)
        for v, ends in zip(model.x, store.reach.transpose(2, 1, 0), strict=True)
    }
    return Ensemble(
        model.name,
        looks if looks.size else given.ends[:, None],
        store.signals,
        dict(model.signals),
        store.attempts,
        store.reached,
        dict(sorted(store.failed.items())),
        Status.SUCCESS if ended is None else Status.INTERRUPTED,
        given.varied,
        given.fixed,
        {n: unit for n, unit in units.items() if n in given.varied or n in given.fixed},
        reach,
    )


def _doubted(found: Ensemble, model: Model, given: MemberData) -> Ensemble:
    """Return the result with its doubtful members, and issue one warning about all of them."""
    p = np.tile(model.values("p"), (given.count, 1))
    for k, v in enumerate(model.p):
        p[:, k] = given.p.get(v.name, p[:, k])
    doubtful = of_members(model, found.reach, p, given.x0)
    doubtful = {m: why for m, why in doubtful.items() if m not in found.failed}
    for first, why in list(doubtful.items())[:1]:
        count = f"{len(doubtful)} of {given.count} members, the first is {first}"
        message = f"simulate_many '{model.name}': friction is overloaded in {count}: {why}"
        warnings.warn(message, OverloadWarning, stacklevel=3)
    return replace(found, doubtful=doubtful)


def _worker_ended(found: Ensemble, done: int, kept: bool) -> SolveError:
    """Return the error for a pool that lost a worker process."""
    how = "the same call continues" if kept else "out=FOLDER keeps finished members"
    message = (
        f"simulate_many of '{found.scene}': a worker process ended after {done} of {len(found)} "
        f"members (killed, or out of memory); {how}, fewer workers need less memory"
    )
    return SolveError(message, found.status, found)


def _check(backend: str, executor: object, real: str) -> None:
    checks.choice("simulate_many: backend", backend, (*BACKENDS, CUDA))
    checks.choice("simulate_many: real", real, REALS)
    if real != "double" and backend != CUDA:
        raise ValueError(
            f"simulate_many: real: expected double for this backend, got "
            f"{real}; single precision needs backend='cuda'"
        )
    if not isinstance(executor, str | Executor):
        what = f"one of {', '.join(EXECUTORS)} or a concurrent.futures.Executor"
        raise checks.refused("simulate_many: executor", what, executor)
    if isinstance(executor, str):
        checks.choice("simulate_many: executor", executor, EXECUTORS)


def _points(integrator: Integrator, given: MemberData) -> Points:
    """Return (y, d) at the start of the first, the middle and the last member."""
    if not integrator.system.has_pivots:
        return ()
    points = list[tuple[Array, Array]]()
    for m in sorted({0, given.count // 2, given.count - 1}):
        pick = slice(m, m + 1)
        (y,), (p,) = given.starts(integrator.system, pick)
        points.append((y, np.concatenate([p, given.data(pick)[0, :, 0]])))
    return points


def _devices() -> Any:
    from symfric.integrator.cuda import on_device  # noqa: PLC0415  (only CUDA needs the emitter)

    return on_device


def _task(
    integrator: Integrator,
    inputs: InputData,
    allowed: Tolerances,
    points: Points,
    looks: Array,
    backend: str,
    executor: str | Executor,
) -> Task:
    """Return the task of the workers; compile its C first if they run on this machine."""
    model = integrator.model
    together = backend == "compiled" or (backend == "auto" and find_compiler() is not None)
    if together and not model.events:
        try:
            if isinstance(executor, str):
                _ = program(integrator).members
            return Job(program(integrator), inputs.breaks, looks, allowed.max_steps)
        except CompileError:
            if backend == "compiled":
                raise
            backend = "vm"  # simulate in the VM if the compiler is broken
    return SingleJob(model, inputs, integrator.tableau, tuple(points), allowed, backend, looks)


def _chunk(integrator: Integrator, given: MemberData, tolerances: Tolerances, pick: slice) -> Chunk:
    """Return the start columns, run data, inputs and end times of the members in `pick`."""
    y, p = given.starts(integrator.system, pick)
    data, ends = given.data(pick), given.ends[pick]
    t_start = float(given.inputs.breaks[0])
    S = np.ascontiguousarray(SRow.at(t_start, 0.0, y))
    h = np.minimum(first_step(ends - t_start, t_start), tolerances.max_step)
    S[:, SRow.H] = S[:, SRow.H_OLD] = h
    at_start = np.broadcast_to(data[:, :, 0], (y.shape[0], data.shape[1]))
    R = tolerances.given(float(given.inputs.breaks[-1]), np.hstack([p, at_start]))
    return Chunk(S, R, data, ends)


def solved(
    pool: Executor | None,
    workers: int | None,
    task: Task,
    prepare: Callable[[slice], Chunk],
    todo: dict[int, slice],
) -> Generator[tuple[int, Solved]]:
    """Yield the results in order of completion; only a few chunks are in progress at once."""
    if pool is None:
        for first, pick in todo.items():
            yield first, task.solve(prepare(pick))
        return
    solve = task.solve
    if not isinstance(pool, ThreadPoolExecutor):
        solve = partial(_solve_pickled, pickle.dumps(task))
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


def _solve_pickled(task: bytes, chunk: Chunk) -> Solved:
    """Integrate the members of a chunk; each process unpickles the task once."""
    return _task_of(task).solve(chunk)


@lru_cache(4)
def _task_of(task: bytes) -> Task:
    return pickle.loads(task)


@contextmanager
def pool_of(executor: str | Executor, workers: int | None) -> Generator[Executor | None]:
    """Yield the executor of this name, or None for "serial"; do not shut down a given executor."""
    if isinstance(executor, Executor):
        yield executor
    elif executor == "serial":
        yield None
    else:
        kind = ThreadPoolExecutor if executor == "threads" else ProcessPoolExecutor
        with kind(workers or cpu_count() or 1) as pool:
            yield pool
