"""Honest timing of short calls."""

import warnings
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from time import perf_counter, process_time
from typing import TypeVar

T = TypeVar("T")


@contextmanager
def unwarned() -> Generator[None]:
    """Loose tolerances are measured on purpose, and what stands around a call is not measured."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def best_time(
    call: Callable[[], T],
    budget: float = 0.05,
    most: int = 30,
    clock: Callable[[], float] = perf_counter,
) -> tuple[float, T]:
    """Shortest time [s] of `call` over repeats within `budget` seconds, and its result.

    The shortest one is what the code costs; everything above it is the rest of the machine. Of a
    call that has no threads the processor time (`time.process_time`) is the better clock.
    """
    best, spent, result = float("inf"), 0.0, None
    for _ in range(most):
        begin = clock()
        result = call()
        elapsed = clock() - begin
        best, spent = min(best, elapsed), spent + elapsed
        if spent > budget:
            break
    return best, result  # pyright: ignore[reportReturnType]  (called at least once)


def interleaved(
    calls: Mapping[str, Callable[[], object]], rounds: int = 7, budget: float = 0.0
) -> dict[str, float]:
    """Shortest processor time [s] of each of the `calls`, which take turns.

    What disturbs the machine for a while disturbs all of them alike, so that ratios hold.

    Args:
        calls: by name; the first call of each is not measured.
        rounds: how often each is measured at least.
        budget: time [s] in all up to which further rounds are made.
    """
    best = dict.fromkeys(calls, float("inf"))
    for call in calls.values():
        call()
    began, made = perf_counter(), 0
    while made < rounds or perf_counter() - began < budget:
        for name, call in calls.items():
            begin = process_time()
            call()
            best[name] = min(best[name], process_time() - begin)
        made += 1
    return best
