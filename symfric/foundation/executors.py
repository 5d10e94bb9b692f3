"""Calls on any executor of `concurrent.futures`, with results in the order of the calls."""

import pickle
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Executor, Future
from functools import lru_cache
from threading import get_ident
from typing import Any, TypeVar

Result = TypeVar("Result")


def in_order(
    executor: Executor,
    function: Callable[..., Result],
    thing: object,
    calls: Sequence[tuple[object, ...]],
) -> Generator[Result]:
    """Yield the results of `function(thing, *arguments)` for each of `calls`.

    Each thread of each process unpickles `thing` once. Calls that have not started are cancelled
    when the generator is closed.

    Args:
        executor: executor of threads or processes.
        function: function at the top of a module.
        thing: first argument of all calls; it must be picklable.
        calls: further arguments of each call.
    """
    packed = pickle.dumps(thing)
    waiting: list[Future[Result]] = [
        executor.submit(_called, function, packed, arguments) for arguments in calls
    ]
    try:
        for future in waiting:
            yield future.result()
    finally:
        for future in waiting:
            future.cancel()


def _called(
    function: Callable[..., Result], packed: bytes, arguments: tuple[object, ...]
) -> Result:
    return function(_unpacked(packed, get_ident()), *arguments)


@lru_cache(maxsize=4)
def _unpacked(packed: bytes, thread: int) -> Any:
    """Return the object of this thread; what it compiles is kept for its next call."""
    del thread
    return pickle.loads(packed)
