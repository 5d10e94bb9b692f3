"""Honest timing of short calls."""

from collections.abc import Callable
from time import perf_counter
from typing import TypeVar

T = TypeVar("T")


def best_time(call: Callable[[], T], budget: float = 0.05, most: int = 30) -> tuple[float, T]:
    """Shortest wall time [s] of `call` over repeats within `budget` seconds, and its result.

    The shortest one is what the code costs; everything above it is the rest of the machine.
    """
    best, spent, result = float("inf"), 0.0, None
    for _ in range(most):
        begin = perf_counter()
        result = call()
        elapsed = perf_counter() - begin
        best, spent = min(best, elapsed), spent + elapsed
        if spent > budget:
            break
    return best, result  # pyright: ignore[reportReturnType]  (called at least once)
