"""Crashes and endless loops are distinguished, and the other tasks are completed."""

import os
import signal
import time

import pytest

from symfric.stress import campaign as workers
from symfric.stress.campaign import Crashed, TimedOut, WorkerPool


def outcomes(work: object, tasks: list[object], limit: float = 60.0) -> dict[int, object]:
    pool = WorkerPool(work, iter(enumerate(tasks)), 2, limit)  # pyright: ignore[reportArgumentType]
    try:
        return dict(pool.outcomes())
    finally:
        pool.stop()


def test_results_exceptions_exits_and_signals_are_distinguished() -> None:
    found = outcomes(abs, [-1, "text", -3])
    assert found[1] == Crashed("exit status 1", "TypeError: bad operand type for abs(): 'str'")
    assert (found[0], found[2]) == (1, 3)
    killed = outcomes(signal.raise_signal, [signal.SIGSEGV])[0]
    assert isinstance(killed, Crashed)
    assert killed.how == "SIGSEGV"
    assert outcomes(os._exit, [3]) == {0: Crashed("exit status 3", "no output")}


def test_an_endless_loop_in_compiled_code_is_stopped_by_its_processor_time() -> None:
    found = outcomes(sum, [range(10**12), (1, 2)], limit=1.0)
    assert found == {0: TimedOut(1.0), 1: 3}


def test_a_task_that_waits_is_not_stopped_at_its_limit() -> None:
    """Wall time on a loaded machine says nothing about a case."""
    assert outcomes(time.sleep, [2.0], limit=0.5) == {0: None}


def test_a_blocked_task_is_stopped_by_wall_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "WALL", 1)
    found = outcomes(time.sleep, [1000.0, 0.0, 0.0], limit=8.0)
    assert found == {0: TimedOut(8.0), 1: None, 2: None}
