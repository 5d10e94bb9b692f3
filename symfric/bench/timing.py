"""Honest timing of short calls, and of the C compiler."""

import os
import warnings
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from time import perf_counter, process_time
from typing import TypeVar

from symfric.foundation.compiler import find_compiler, no_compiler
from symfric.integrator.compiled.compiler import FLAGS

T = TypeVar("T")
FASTEST = (*(f for f in FLAGS if f != "-ffp-contract=off"), "-freciprocal-math")
"""Flags for others, which need not round as CasADi's virtual machine does."""


@contextmanager
def unwarned() -> Generator[None]:
    """No warnings: loose tolerances are measured on purpose."""
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

    The shortest one is what the code costs; the rest is what else the machine does. Of a
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


def compile_time(source: str, target: str | os.PathLike[str] = os.devnull) -> float:
    """Processor time [s] of the C compiler on `source`, with the fastest flags.

    Raises:
        CompileError: no compiler.
    """
    compiler = find_compiler()
    if compiler is None:
        raise no_compiler()
    before = os.times()
    compiler.run(*FASTEST, "-x", "c", "-", "-o", str(target), "-lm", code=source)
    after = os.times()
    user = after.children_user - before.children_user
    return user + after.children_system - before.children_system
