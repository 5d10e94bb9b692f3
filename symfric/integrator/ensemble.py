"""Many runs of one model over arrays of parameters and start values, local or on a cluster."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from concurrent.futures import BrokenExecutor, Executor
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.foundation import checks, packed
from symfric.foundation.programs import CompileError
from symfric.foundation.status import OverloadWarning, SolveError, Status
from symfric.integrator.arguments import (
    BACKENDS,
    check_flags,
    check_model,
    check_span,
    check_times,
    chosen,
    stopping,
    tolerances,
)
from symfric.integrator.equations.initial import first_step
from symfric.integrator.many.chunk import (
    EXECUTORS,
    Chunk,
    Job,
    Recipe,
    Solved,
    digest,
    pool_of,
    solve_chunk,
    solve_elsewhere,
    solve_one_by_one,
    solved,
    suited,
)
from symfric.integrator.many.given import (
    MemberInput,
    Members,
    all_later,
    ends_of,
    members_of,
    units_of,
)
from symfric.integrator.many.store import Store
from symfric.integrator.methods.tableaux import key_of
from symfric.integrator.running.doubts import of_members
from symfric.integrator.running.integrator import Integrator, built
from symfric.integrator.running.run import Tolerances
from symfric.integrator.step.layout import State
from symfric.model import Model
from symfric.model.kinds import in_results
from symfric.results.ensemble import Ensemble

if TYPE_CHECKING:
    from symfric.integrator.cuda.on_device import OnDevice

Array = NDArray[np.float64]
CUDA, REALS = "cuda", ("double", "float")
RESULTS = 2
"""Format of the result folders, raised with every change."""
CHUNK = 500
"""Members of a CPU task."""


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
        x0, p: start values and parameters by name: numbers, or arrays with an entry per member.
        u: inputs by name, as in `simulate`, for all members; or an array with a number per member;
            or `Hold` or `Linear` with values of shape (members, n), a row per member at common
            times.
        t_eval: times of the results [s]; NaN after the end of a member. By default the `t_end` of
            each member.
        rtol, method, event_tolerance, max_steps, max_step, times: as in `simulate`; the absolute
            tolerance is 0.1 rtol nominal, for each member with the defaults of `simulate`.
        backend: "compiled", "vm", or "auto": compiled if there is a compiler. Compiled members run
            in parallel in the lanes of vector instructions; the last digits of exp, sin, pow, ...
            may differ from "vm" and `simulate`, and the number of steps with stick and slip by a
            few, within the tolerance. "cuda": on a graphics processor through CuPy (extra 'cuda'),
            one member per thread, for ensembles of a hundred thousand members and more; models
            without events, with the same equations, steps, failures and counts as the others, up
            to last digits. "auto" never chooses it, and there is no fallback.
        executor: "serial", "threads" (the compiled loop holds no lock), "processes", or any
            `concurrent.futures.Executor`, such as a dask client's or mpi4py's: a task is plain data
            and the C source, so a worker needs only this package and, for compiled code, a
            compiler. The task of a model with events holds the model, and each worker builds its
            integrator once.
        workers: number of threads or processes, or of the executor's workers; default all cores of
            this machine. Twice as many chunks are in progress at once.
        chunk: members per task; default 500, on a graphics processor so many that an attempt of all
            is a billion operations, or their results are a gigabyte.
        real: "double", or with backend="cuda" "float", single precision: for rtol of 1e-5 and more
            (`symfric.integrator.cuda`).
        out: folder for the results, written chunk by chunk, so that memory stays bounded; a call
            with the same arguments resumes an interrupted one, after checking the checksums of
            stored chunks.
        progress: called with the fraction done.

    Returns:
        The ensemble. A member that fails is reported by number and does not affect the others; an
        interrupt (Ctrl-C) returns the finished members.

    Raises:
        ValueError: bad input; arrays of different lengths.
        SolveError: a worker process ended; its `partial` has the finished members.
        RuntimeError: compiled code was requested without a working compiler, or a graphics
            processor without a device or CuPy.

    Warns:
        UserWarning: rtol above 1e-5, where stick phases may be missed; damaged results in `out`,
            which are computed again.
        OverloadWarning: friction above its static level in some members (`Ensemble.doubtful`).
    """
    check_model("simulate_many", model)
    check_flags("simulate_many", progress)
    ends = ends_of(t_end)
    t_start, last, rtol = check_span("simulate_many", model, t_start, float(np.max(ends)), rtol)
    all_later(ends, t_start)
    formula = chosen("simulate_many", method, rtol)
    _check(model, backend, executor, real)
    workers = None if workers is None else checks.count("simulate_many: workers", workers)
    chunk = None if chunk is None else checks.count("simulate_many: chunk", chunk)
    if backend == CUDA:
        _devices().check(model, executor, workers, rtol, real)
    given = members_of(model, (t_start, ends), x0, u, p)
    inputs = stopping("simulate_many", given.inputs, times, t_start, last)
    given, members = replace(given, inputs=inputs), given.count
    looks = np.zeros(0) if np.ndim(ends) else np.array([last])
    if t_eval is not None:
        looks = check_times("simulate_many", t_start, last, t_eval)
    integrator, _ = built(model, inputs, formula)
    nominal = integrator.system.nominal
    allowed = tolerances("simulate_many", rtol, None, nominal, event_tolerance, max_steps, max_step)
    points = _points(integrator, given)
    integrator = suited(integrator, points, given.inputs)
    way = _way(integrator, given, allowed, looks, (backend, real, executor))
    size = chunk or way.chunk
    picks = {first: slice(first, min(first + size, members)) for first in range(0, members, size)}
    folder = None
    if out is not None:
        place = checks.path("simulate_many: out", out)
        folder = place / _identity(way.job, integrator, allowed, given, picks)
    store = Store(folder, model.signals, members, max(1, looks.size), len(model.x))
    todo = {first: picks[first] for first in store.left(picks)}
    done, ended = members - sum(_size(pick) for pick in todo.values()), None
    if way.device is not None and progress is not None:
        way.device.report(progress, lambda: done, members)
    try:
        with (
            pool_of("serial" if way.device else executor, workers) as pool,
            closing(solved(pool, workers, way.solve, way.prepare, todo)) as results,
        ):
            for first, result in results:
                store.put(first, result)
                done += _size(picks[first])
                if progress is not None:
                    progress(done / members)
    except (KeyboardInterrupt, BrokenExecutor) as error:
        ended = error
    found = _doubted(_ensemble(model, looks, given, store, ended), model, given)
    if isinstance(ended, BrokenExecutor):
        raise _worker_ended(found, done, folder is not None) from ended
    return found


def _ensemble(
    model: Model, looks: Array, given: Members, store: Store, ended: BaseException | None
) -> Ensemble:
    """Return the ensemble of the stored members."""
    units = {n: unit for n, unit in units_of(model).items() if n in (given.varied | given.fixed)}
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
        units,
        reach,
    )


def _doubted(found: Ensemble, model: Model, given: Members) -> Ensemble:
    """Return the result with its doubtful members, and issue one warning about all of them."""
    p = np.tile(model.values("p"), (given.count, 1))
    for k, v in enumerate(model.p):
        p[:, k] = given.p.get(v.name, p[:, k])
    doubtful = of_members(model, found.reach, p, given.x0)
    doubtful = {m: why for m, why in doubtful.items() if m not in found.failed}
    for first, why in list(doubtful.items())[:1]:
        count = f"{len(doubtful)} of {given.count} members, the first is {first}"
        said = f"simulate_many '{model.name}': friction is overloaded in {count}: {why}"
        warnings.warn(said, OverloadWarning, stacklevel=3)
    return replace(found, doubtful=doubtful)


def _worker_ended(found: Ensemble, done: int, kept: bool) -> SolveError:
    """Return the error for a pool that lost a worker process."""
    how = "the same call continues" if kept else "out=FOLDER keeps finished members"
    said = (
        f"simulate_many of '{found.scene}': a worker process ended after {done} of {len(found)} "
        f"members (killed, or out of memory); {how}, fewer workers need less memory"
    )
    return SolveError(said, found.status, found)


def _size(pick: slice) -> int:
    return pick.stop - pick.start


def _check(model: Model, backend: str, executor: object, real: str) -> None:
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


def _points(integrator: Integrator, given: Members) -> tuple[tuple[Array, Array], ...]:
    """Return (y, d) at the start of the first, the middle and the last member."""
    if not integrator.has_pivots:
        return ()
    points = list[tuple[Array, Array]]()
    for m in sorted({0, given.count // 2, given.count - 1}):
        y, p, data, _ = (rows[0] for rows in _alone(integrator, given, slice(m, m + 1)))
        points.append((y, np.concatenate([p, data[:, 0]])))
    return tuple(points)


@final
@dataclass(frozen=True, eq=False)
class _Way:
    """Method by which chunks are solved.

    Attributes:
        job: data shared by the chunks.
        prepare: members -> their chunk.
        solve: chunk -> its results.
        chunk: default number of members of a chunk.
        device: the graphics processor used; None for CPUs.
    """

    job: Job
    prepare: Callable[[slice], Any]
    solve: Callable[[Any], Solved]
    chunk: int = CHUNK
    device: OnDevice | None = None


def _way(
    integrator: Integrator,
    given: Members,
    allowed: Tolerances,
    looks: Array,
    wanted: tuple[str, str, str | Executor],
) -> _Way:
    """Return the method to solve the members for a backend, a precision and an executor."""
    (backend, real, executor), most = wanted, allowed.max_steps
    model, inputs = integrator.model, given.inputs
    if backend == CUDA:
        device = _devices().OnDevice.of(integrator, inputs.breaks, looks, most, real)
        own = inputs.values.size if given.own else 0
        solve = partial(solve_chunk, device.job, runner=device.members)
        prepare = partial(_chunk, integrator, given, allowed)
        return _Way(device.job, prepare, solve, device.chunk(own), device)
    here = isinstance(executor, str) and not model.events
    job = _job(partial(Job.of, integrator, inputs.breaks, looks), backend, most, here)
    if model.events:
        alone = partial(solve_one_by_one, integrator, inputs, allowed, backend, looks)
        if executor not in ("serial", "threads"):
            points, method = _points(integrator, given), key_of(integrator.tableau)
            recipe = Recipe(model, inputs, method, points, allowed, backend, looks)
            alone = partial(solve_elsewhere, packed.dumps(recipe))
        return _Way(job, partial(_alone, integrator, given), alone)
    return _Way(job, partial(_chunk, integrator, given, allowed), partial(solve_chunk, job))


def _devices() -> Any:
    from symfric.integrator.cuda import on_device  # noqa: PLC0415  (only CUDA needs the emitter)

    return on_device


def _job(make: Callable[[str, int], Job], backend: str, max_steps: int, here: bool) -> Job:
    """Return the job of the workers; if they are `here`, it is compiled once before they start."""
    job = make(backend, max_steps)
    if here:
        try:
            job.program.load()
        except CompileError:
            if backend == "compiled":
                raise
            job = make("vm", max_steps)  # simulate in the VM if the compiler is broken
    return job


def _alone(
    integrator: Integrator, given: Members, pick: slice
) -> tuple[Array, Array, Array, Array]:
    """Return start values, parameters, input data and ends of members."""
    y, p = given.starts(integrator.system, pick)
    return y, p, given.data(pick), given.ends[pick]


def _chunk(integrator: Integrator, given: Members, tolerances: Tolerances, pick: slice) -> Chunk:
    """Return start columns and run data of members, and their inputs and ends."""
    y, p, data, ends = _alone(integrator, given, pick)
    t_start = float(given.inputs.breaks[0])
    S = np.ascontiguousarray(State.at(t_start, 0.0, y))
    h = np.minimum(first_step(ends - t_start, t_start), tolerances.max_step)
    S[:, State.H] = S[:, State.H_OLD] = h
    at_start = np.broadcast_to(data[:, :, 0], (y.shape[0], data.shape[1]))
    R = tolerances.given(float(given.inputs.breaks[-1]), np.hstack([p, at_start]))
    return Chunk(S, R, data, ends)


def _identity(
    job: Job,
    integrator: Integrator,
    tolerances: Tolerances,
    given: Members,
    picks: dict[int, slice],
) -> str:
    """Return a hash of everything that the results depend on, and of the division into chunks."""
    parts: list[Any] = [RESULTS, job.digest(), tolerances.rtol, tolerances.atol, list(picks)]
    parts.append(tolerances.max_step)
    for event in integrator.model.events:
        parts += [event.name, event.direction, event.terminal, tolerances.event, list(event.reset)]
    if integrator.crossings is not None:
        parts.append(str(integrator.crossings.jump.serialize()))
    parts.append(str(integrator.events.serialize()))
    for pick in picks.values():
        parts.append(digest(*_alone(integrator, given, pick)))
    return digest(*parts)[:16]
