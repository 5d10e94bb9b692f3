"""Who solves the chunks of an ensemble: nobody else, threads, processes, or any executor."""

from collections.abc import Callable, Generator
from concurrent.futures import (
    FIRST_COMPLETED,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from contextlib import contextmanager
from os import cpu_count
from typing import Any

from symfric.integrator.many.chunk import Solved

EXECUTORS = ("serial", "threads", "processes")


def solved(
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
def pool_of(executor: str | Executor, workers: int | None) -> Generator[Executor | None]:
    """The executor of this name; None for "serial". Those of others are not shut down."""
    if isinstance(executor, Executor):
        yield executor
    elif executor == "serial":
        yield None
    else:
        kind = ThreadPoolExecutor if executor == "threads" else ProcessPoolExecutor
        with kind(workers or cpu_count() or 1) as pool:
            yield pool
