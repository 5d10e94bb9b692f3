"""Many runs of one model: over arrays of parameters and start values, on one machine or many."""

from collections.abc import Callable, Generator, Mapping
from concurrent.futures import (
    FIRST_COMPLETED,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from os import cpu_count
from pathlib import Path
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.foundation import checks
from symfric.foundation.status import Status
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
from symfric.integrator.equations.initial import first_guess, first_step
from symfric.integrator.equations.inputs import Input, InputData, input_data
from symfric.integrator.many.chunk import Chunk, Job, Solved, digest, solve_chunk
from symfric.integrator.many.one_by_one import solve_one_by_one
from symfric.integrator.many.store import Store
from symfric.integrator.running.built import built
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.run import Tolerances
from symfric.integrator.step.layout import State
from symfric.model import Model

Array = NDArray[np.float64]
EXECUTORS = ("serial", "threads", "processes")


@final
@dataclass(frozen=True, eq=False)
class Ensemble:
    """Results of many runs.

    Attributes:
        scene: name of the model.
        t: times [s], shape (k,).
        signals: name -> values, shape (members, k); NaN after a member failed or met a terminal
            event, and for members that were not reached. Memory-mapped where the results went to
            a folder.
        units: name -> unit.
        attempts: attempts of each member, shape (members,).
        reached: time [s] each member reached, shape (members,): that of a terminal event or of
            its failure, else `t_end`; NaN for members that were not started.
        failed: number of a failed member -> sentence.
        status: SUCCESS, or INTERRUPTED with the members that were finished.
    """

    scene: str
    t: Array
    signals: Mapping[str, Array]
    units: dict[str, str]
    attempts: NDArray[np.int64]
    reached: Array
    failed: dict[int, str]
    status: Status

    def __getitem__(self, name: str) -> Array:
        checks.check_names(f"ensemble of '{self.scene}'", [name], self.signals)
        return self.signals[name]


def simulate_many(
    model: Model,
    t_end: float,
    *,
    t_start: float = 0.0,
    x0: Mapping[str, ArrayLike] | None = None,
    u: Mapping[str, Input] | None = None,
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
    chunk: int = 500,
    out: str | Path | None = None,
    progress: Callable[[float], None] | None = None,
) -> Ensemble:
    """Integrate one model for many parameters and start values.

    Args:
        model: the equations.
        t_end, t_start: span [s], common to all members.
        x0: start values by name: numbers, or arrays with an entry per member.
        u: inputs by name, common to all members.
        p: parameters by name: numbers, or arrays with an entry per member.
        t_eval: times of the results [s]; default only `t_end`.
        rtol, method, event_tolerance, max_steps, max_step, times: as in `simulate`; the absolute
            tolerance is 0.1 rtol nominal, for each member as `simulate` has it by default.
        backend: "compiled", "vm", or "auto": compiled where there is a compiler.
        executor: "serial", "threads" (the compiled loop holds no lock), "processes", or any
            `concurrent.futures.Executor`, such as a dask client's or mpi4py's: a task is plain
            data and the C source, so a worker needs nothing but this package and, for compiled
            code, a compiler. Models with events are no plain data: "serial" or "threads" only.
        workers: number of threads or processes, or of the executor's workers; default all cores
            of this machine. Twice as many chunks are under way at once.
        chunk: members per task.
        out: folder that takes the results chunk by chunk, so that memory stays bounded; a call
            with the same arguments resumes where an interrupted one stopped, once the checksums
            of what is there are right.
        progress: called with the fraction done.

    Returns:
        The ensemble. A member that fails is reported by number and does not disturb the others;
        an interrupt (Ctrl-C) returns what is finished.

    Raises:
        ValueError: bad input; arrays of different lengths.
        RuntimeError: compiled code was asked for, and there is no compiler or it failed.

    Warns:
        UserWarning: rtol above 1e-5, where stick phases may get lost; results in `out` that are
            damaged, and computed again.
    """
    check_model("simulate_many", model)
    check_flags("simulate_many", progress)
    t_start, t_end, rtol = check_span("simulate_many", model, t_start, t_end, rtol)
    formula = chosen("simulate_many", method, rtol)
    _check(model, backend, executor)
    workers = None if workers is None else checks.count("simulate_many: workers", workers)
    chunk = checks.count("simulate_many: chunk", chunk)
    looks = check_times("simulate_many", t_start, t_end, [t_end] if t_eval is None else t_eval)
    x0_of, p_of, members = _members(model, x0, p)
    inputs = input_data(model, u, t_start, t_end)
    inputs = stopping("simulate_many", inputs, times, t_start, t_end)
    integrator, _ = built(model, inputs, formula)
    nominal = integrator.system.nominal
    allowed = tolerances("simulate_many", rtol, None, nominal, event_tolerance, max_steps, max_step)
    starts = partial(_starts, integrator, t_start, x0_of, p_of)
    integrator = _suited(integrator, inputs, starts, members)
    job = Job.of(integrator, inputs, looks, backend, max_steps)
    if model.events:
        solve = partial(solve_one_by_one, integrator, inputs, allowed, backend, looks)
        prepare = starts
    else:
        solve = partial(solve_chunk, job)
        prepare = partial(_chunk, inputs, allowed, starts)
        if isinstance(executor, str):
            job.program.load()  # or every worker would compile it
    firsts = range(0, members, chunk)
    picks = {first: slice(first, min(first + chunk, members)) for first in firsts}
    folder = None
    if out is not None:
        place = checks.path("simulate_many: out", out)
        folder = place / _identity(job, integrator, allowed, starts, picks)
    store = Store(folder, model.signals, members, looks.size)
    todo = {first: picks[first] for first in store.left(picks)}
    done, status = members - sum(_size(pick) for pick in todo.values()), Status.SUCCESS
    try:
        with (
            _pool(executor, workers) as pool,
            closing(_solved(pool, workers, solve, prepare, todo)) as results,
        ):
            for first, result in results:
                store.put(first, result)
                done += _size(picks[first])
                if progress is not None:
                    progress(done / members)
    except KeyboardInterrupt:
        status = Status.INTERRUPTED
    return Ensemble(
        model.name,
        looks,
        store.signals,
        dict(model.signals),
        store.attempts,
        store.reached,
        dict(sorted(store.failed.items())),
        status,
    )


def _size(pick: slice) -> int:
    return pick.stop - pick.start


def _check(model: Model, backend: str, executor: object) -> None:
    checks.choice("simulate_many: backend", backend, BACKENDS)
    if not isinstance(executor, str | Executor):
        what = f"one of {', '.join(EXECUTORS)} or a concurrent.futures.Executor"
        raise checks.refused("simulate_many: executor", what, executor)
    if isinstance(executor, str):
        checks.choice("simulate_many: executor", executor, EXECUTORS)
    if model.events and executor not in ("serial", "threads"):
        raise ValueError(
            f"simulate_many: executor: expected serial or threads for a model with events "
            f"('{model.name}' has {len(model.events)}), got {executor}"
        )


Values = dict[str, Array]


def _members(
    model: Model,
    x0_given: Mapping[str, ArrayLike] | None,
    p_given: Mapping[str, ArrayLike] | None,
) -> tuple[Values, Values, int]:
    """Start values and parameters by name, an entry per member, and the number of members."""
    where = "simulate_many"
    x0, p = model.named("x0", x0_given), model.named("p", p_given)
    given = {f"x0.{name}": x for name, x in x0.items()} | {f"p.{n}": x for n, x in p.items()}
    arrays = {name: checks.array(f"{where}: {name}", x, ndim=None) for name, x in given.items()}
    lengths = {name: value.size for name, value in arrays.items() if value.ndim}
    if len(set(lengths.values())) > 1 or any(v.ndim > 1 for v in arrays.values()):
        shapes = ", ".join(f"{name} of shape {arrays[name].shape}" for name in lengths)
        raise ValueError(f"{where}: expected numbers or arrays of one length, got {shapes}")
    members = next(iter(lengths.values()), 1)
    if members < 1:
        raise ValueError(f"{where}: expected at least one member, got empty arrays")
    for v in model.p:
        for end in (np.min, np.max) if v.name in p else ():
            v.within(f"{where}: p.{v.name}", float(end(arrays[f"p.{v.name}"])))
    every = {name: np.broadcast_to(value, (members,)) for name, value in arrays.items()}
    return (
        {name: every[f"x0.{name}"] for name in x0},
        {name: every[f"p.{name}"] for name in p},
        members,
    )


def _starts(
    integrator: Integrator, t_start: float, x0: Values, p: Values, pick: slice
) -> tuple[Array, Array]:
    """Start values of the unknowns (members, n), algebraic ones guessed, and parameters."""
    model, system = integrator.model, integrator.system
    x, values = model.initial_states(
        {name: v[pick] for name, v in x0.items()},
        {name: v[pick] for name, v in p.items()},
        _size(pick),
    )
    return first_guess(system, model, x, t_start), values


def _suited(
    integrator: Integrator,
    inputs: InputData,
    starts: Callable[[slice], tuple[Array, Array]],
    members: int,
) -> Integrator:
    """The integrator with pivots that are sound for the first, the middle and the last member."""
    if integrator.system.manifold is not None or integrator.system.is_ode:
        return integrator
    span, points = float(inputs.breaks[-1] - inputs.breaks[0]), list[tuple[Array, Array]]()
    for m in sorted({0, members // 2, members - 1}):
        y, p = (rows[0] for rows in starts(slice(m, m + 1)))
        d = np.concatenate([p, inputs.values[:, 0]])
        with suppress(ValueError):  # no consistent start: that member is reported by its number
            points.append((integrator.start(y, d), d))
            integrator = integrator.suited(points, span)
    return integrator


def _chunk(
    inputs: InputData,
    tolerances: Tolerances,
    starts: Callable[[slice], tuple[Array, Array]],
    pick: slice,
) -> Chunk:
    """Start columns and run data of members."""
    y, p = starts(pick)
    t_start, t_end = float(inputs.breaks[0]), float(inputs.breaks[-1])
    h = min(first_step(t_end - t_start, t_start), tolerances.max_step)
    data = np.tile(inputs.values[:, 0], (y.shape[0], 1))
    return Chunk(State.at(t_start, h, y), tolerances.given(t_end, np.hstack([p, data])))


def _identity(
    job: Job,
    integrator: Integrator,
    tolerances: Tolerances,
    starts: Callable[[slice], tuple[Array, Array]],
    picks: dict[int, slice],
) -> str:
    """Hash of everything that the results depend on, and of how they are cut in chunks."""
    parts: list[Any] = [job.digest(), tolerances.rtol, tolerances.atol, list(picks)]
    parts.append(tolerances.max_step)
    for event in integrator.model.events:
        parts += [event.name, event.direction, event.terminal, tolerances.event, list(event.reset)]
    if integrator.crossings is not None:
        parts.append(str(integrator.crossings.jump.serialize()))
    parts.append(str(integrator.events.serialize()))
    for pick in picks.values():
        parts.append(digest(*starts(pick)))
    return digest(*parts)[:16]


def _solved(
    pool: Executor | None,
    workers: int | None,
    solve: Callable[[Any], Solved],
    prepare: Callable[[slice], Any],
    todo: dict[int, slice],
) -> Generator[tuple[int, Solved]]:
    """Results as they come; never more than a few chunks are under way at once."""
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
def _pool(executor: str | Executor, workers: int | None) -> Generator[Executor | None]:
    if isinstance(executor, Executor):
        yield executor
    elif executor == "serial":
        yield None
    else:
        kind = ThreadPoolExecutor if executor == "threads" else ProcessPoolExecutor
        with kind(workers or cpu_count() or 1) as pool:
            yield pool
