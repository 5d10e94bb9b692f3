"""Many runs of one model: over arrays of parameters and start values, on one machine or many."""

from collections.abc import Callable, Generator, Iterator, Mapping
from concurrent.futures import (
    FIRST_COMPLETED,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from os import cpu_count
from pathlib import Path
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.files import written
from symfric.integrator.chunk import Chunk, Job, Solved, solve_chunk
from symfric.integrator.initial import consistent, first_step
from symfric.integrator.inputs import Drivers, Input, drivers
from symfric.integrator.integrator import Integrator
from symfric.integrator.step import GROWTH_MEMORY
from symfric.integrator.tableaux import ROSENBROCK
from symfric.model import Model
from symfric.parameters import check_names
from symfric.status import Status

Array = NDArray[np.float64]
EXECUTORS = ("serial", "threads", "processes")


@final
@dataclass(frozen=True, eq=False)
class Ensemble:
    """Results of many runs.

    Attributes:
        scene: name of the model.
        t: times [s], shape (k,).
        signals: name -> values, shape (members, k); NaN after a member failed, and for members
            that were not reached. Memory-mapped where the results went to a folder.
        units: name -> unit.
        attempts: attempts of each member, shape (members,).
        failed: number of a failed member -> sentence.
        status: SUCCESS, or INTERRUPTED with the members that were finished.
    """

    scene: str
    t: Array
    signals: Mapping[str, Array]
    units: dict[str, str]
    attempts: NDArray[np.int64]
    failed: dict[int, str]
    status: Status

    def __getitem__(self, name: str) -> Array:
        check_names(f"ensemble of '{self.scene}'", [name], self.signals)
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
    method: str = "rodas5p",
    backend: str = "compiled",
    executor: str | Executor = "threads",
    workers: int | None = None,
    chunk: int = 500,
    max_steps: int = 10_000_000,
    out: str | Path | None = None,
    progress: Callable[[float], None] | None = None,
) -> Ensemble:
    """Integrate one model for many parameters and start values.

    Args:
        model: the equations, without events.
        t_end, t_start: span [s], common to all members.
        x0: start values by name: numbers, or arrays with an entry per member.
        u: inputs by name, common to all members.
        p: parameters by name: numbers, or arrays with an entry per member.
        t_eval: times of the results [s]; default only `t_end`.
        rtol, method, max_steps: as in `simulate`; the absolute tolerance is 0.1 rtol nominal.
        backend: "compiled", or "vm" where there is no compiler.
        executor: "serial", "threads" (the compiled loop holds no lock), "processes", or any
            `concurrent.futures.Executor`, such as a dask client's or mpi4py's: a task is plain
            data and the C source, so a worker needs nothing but this package.
        workers: number of threads or processes; default all cores.
        chunk: members per task.
        out: folder that takes the results chunk by chunk, so that memory stays bounded; a call
            with the same arguments resumes where an interrupted one stopped.
        progress: called with the fraction done.

    Returns:
        The ensemble. A member that fails is reported by number and does not disturb the others;
        an interrupt (Ctrl-C) returns what is finished.

    Raises:
        ValueError: bad input; arrays of different lengths; a model with events.
    """
    check_names("simulate_many: method", [method], [k for k in ROSENBROCK if k != "rodas3"])
    check_names("simulate_many: backend", [backend], ("compiled", "vm"))
    if isinstance(executor, str):
        check_names("simulate_many: executor", [executor], EXECUTORS)
    if model.events:
        raise ValueError(
            f"simulate_many: expected a model without events, got {len(model.events)} in "
            f"'{model.name}'; use simulate in a loop"
        )
    if chunk < 1:
        raise ValueError(f"simulate_many: expected chunk >= 1, got {chunk}")
    times = np.atleast_1d(np.asarray(t_end if t_eval is None else t_eval, dtype=float))
    if not (t_start <= times[0] and times[-1] <= t_end and (np.diff(times) > 0).all()):
        raise ValueError(
            f"simulate_many: t_eval: expected increasing times in [{t_start:g}, {t_end:g}] s"
        )
    values, members = _members({"x0": dict(x0 or {}), "p": dict(p or {})})
    inputs = drivers(model, u, t_start, t_end)
    integrator = Integrator(model, inputs, ROSENBROCK[method])
    job = Job.of(integrator, inputs, times, backend, max_steps)
    prepare = partial(_chunk, integrator, inputs, values, rtol, members)
    store = _Store(out, model, times, members, chunk, (job.digest(), values, rtol))
    starts = [k for k in range(0, members, chunk) if not store.has(k)]
    done, status = members - sum(min(chunk, members - k) for k in starts), Status.SUCCESS
    try:
        with _pool(executor, workers) as pool:
            for k, result in _solved(pool, job, prepare, starts, chunk):
                store.put(k, _evaluated(integrator, inputs, times, result), result)
                done += result.reason.size
                if progress is not None:
                    progress(done / members)
    except KeyboardInterrupt:
        status = Status.INTERRUPTED
    return store.ensemble(model, status)


def _members(given: dict[str, dict[str, ArrayLike]]) -> tuple[dict[str, dict[str, Array]], int]:
    """Arrays by group and name, and the number of members they agree on."""
    arrays = {
        group: {name: np.asarray(value, dtype=float) for name, value in items.items()}
        for group, items in given.items()
    }
    lengths = {
        f"{group}.{name}": value.size
        for group, items in arrays.items()
        for name, value in items.items()
        if value.ndim
    }
    if len(set(lengths.values())) > 1 or any(
        v.ndim > 1 for items in arrays.values() for v in items.values()
    ):
        raise ValueError(
            "simulate_many: expected numbers or arrays of one length, got "
            + ", ".join(f"{name} with {size}" for name, size in lengths.items())
        )
    members = next(iter(lengths.values()), 1)
    if members < 1:
        raise ValueError("simulate_many: expected at least one member, got empty arrays")
    return (
        {
            group: {name: np.broadcast_to(value, (members,)) for name, value in items.items()}
            for group, items in arrays.items()
        },
        members,
    )


def _chunk(
    integrator: Integrator,
    inputs: Drivers,
    values: dict[str, dict[str, Array]],
    rtol: float,
    members: int,
    first: int,
    count: int,
) -> Chunk:
    """Start columns S and run data R of the members first ... first + count."""
    model, system = integrator.model, integrator.system
    pick = slice(first, min(first + count, members))
    size = pick.stop - pick.start
    atol = 0.1 * rtol * system.nominal
    x, p = model.initial_states(
        {name: v[pick] for name, v in values["x0"].items()},
        {name: v[pick] for name, v in values["p"].items()},
        size,
    )
    t_start, t_end = float(inputs.breaks[0]), float(inputs.breaks[-1])
    y = np.zeros((size, system.n))
    y[:, : system.nx] = x
    guesses = {v.name: float(v.start) for v in model.z}
    for i, name in enumerate(system.names[system.nx :], start=system.nx):
        y[:, i] = guesses.get(name, t_start if name == "t" else 0.0)
    data = np.tile(inputs.values[:, 0], (size, 1))
    d = np.hstack([p, data])
    if system.algebraic[0]:
        where = f"simulate_many of '{model.name}'"
        y = np.vstack([consistent(system, where, y[i], d[i]) for i in range(size)])
    column = np.full((size, 1), first_step(t_end - t_start))
    start = np.full((size, 1), t_start)
    growth = np.full((size, 1), GROWTH_MEMORY)
    S = np.hstack([start, column, column, growth, np.zeros((size, 1)), y])
    R = np.hstack(
        [np.full((size, 1), t_end), np.full((size, 1), rtol), np.tile(atol, (size, 1)), d]
    )
    return Chunk(S, R)


def _solved(
    pool: Executor | None,
    job: Job,
    prepare: Callable[[int, int], Chunk],
    starts: list[int],
    chunk: int,
) -> Iterator[tuple[int, Solved]]:
    """Results as they come; never more than a few chunks are under way at once."""
    if pool is None:
        for k in starts:
            yield k, solve_chunk(job, prepare(k, chunk))
        return
    waiting: dict[Future[Solved], int] = {}
    todo = iter(starts)
    try:
        while True:
            while len(waiting) < 2 * (cpu_count() or 1) and (k := next(todo, None)) is not None:
                waiting[pool.submit(solve_chunk, job, prepare(k, chunk))] = k
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


def _evaluated(
    integrator: Integrator, inputs: Drivers, times: Array, result: Solved
) -> dict[str, Array]:
    """All signals of a chunk from its solutions (members, times, n)."""
    size, count, n = result.y.shape
    at = np.tile(times, size)
    n_p = len(integrator.model.p)
    p = np.repeat(result.p[:, :n_p], count, axis=0)
    d = np.hstack([p, inputs.values[:, inputs.interval(at)].T])
    values = integrator.signals.map(at.size)(at[None, :], result.y.reshape(-1, n).T, d.T).full()
    names = list(integrator.model.signals)
    return {name: row.reshape(size, count) for name, row in zip(names, values, strict=True)}


@final
class _Store:
    """Results in memory, or in a folder of array files that fill chunk by chunk."""

    def __init__(
        self,
        folder: str | Path | None,
        model: Model,
        times: Array,
        members: int,
        chunk: int,
        identity: object,
    ) -> None:
        self._folder = None
        self._times, self._chunk, self._members = times, chunk, members
        shape = (members, times.size)
        if folder is None:
            self.signals = {name: np.full(shape, np.nan) for name in model.signals}
        else:
            digest = sha256(repr((identity, times.tobytes(), members, chunk)).encode())
            self._folder = Path(folder) / digest.hexdigest()[:16]
            self._folder.mkdir(parents=True, exist_ok=True)
            self.signals = {
                name: _array_file(self._folder / f"{name}.npy", shape) for name in model.signals
            }
        self.attempts = np.zeros(members, dtype=np.int64)
        self.failed: dict[int, str] = {}

    def _mark(self, first: int) -> Path | None:
        return None if self._folder is None else self._folder / f"chunk-{first}.npz"

    def has(self, first: int) -> bool:
        """Whether the chunk that starts at `first` was finished before; takes it over if so."""
        mark = self._mark(first)
        if mark is None or not mark.exists():
            return False
        with np.load(mark) as saved:
            self._note(first, saved["reason"], saved["made"], saved["reached"])
        return True

    def put(self, first: int, signals: dict[str, Array], result: Solved) -> None:
        """Take the results of the chunk that starts at `first`."""
        size = result.reason.size
        for name, values in signals.items():
            self.signals[name][first : first + size] = values
            flush = getattr(self.signals[name], "flush", None)
            if flush is not None:
                flush()
        self._note(first, result.reason, result.made, result.reached)
        mark = self._mark(first)
        if mark is not None:
            with written(mark) as temporary, temporary.open("wb") as file:
                np.savez(file, reason=result.reason, made=result.made, reached=result.reached)

    def _note(
        self, first: int, reason: NDArray[np.int64], made: NDArray[np.int64], reached: Array
    ) -> None:
        self.attempts[first : first + made.size] = made
        for i in np.flatnonzero(reason):
            status = Status.MAX_STEPS if reason[i] == 2 else Status.STEP_TOO_SMALL
            self.failed[first + int(i)] = f"{status.value} It stands at t = {reached[i]:g} s."

    def ensemble(self, model: Model, status: Status) -> Ensemble:
        """What there is."""
        return Ensemble(
            model.name,
            self._times,
            self.signals,
            dict(model.signals),
            self.attempts,
            dict(sorted(self.failed.items())),
            status,
        )


def _array_file(path: Path, shape: tuple[int, int]) -> Array:
    """Memory-mapped array file, full of NaN when it is made."""
    if not path.exists():
        with written(path) as temporary:
            array = np.lib.format.open_memmap(temporary, mode="w+", dtype=float, shape=shape)
            array[:] = np.nan
            array.flush()
    return np.lib.format.open_memmap(path, mode="r+")
