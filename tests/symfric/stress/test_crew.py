"""Workers that crash and hang are told apart, and the rest of the work is done."""

import os
import signal
import time

from symfric.stress.crew import Crew, Died, Hung


def outcomes(work: object, tasks: list[object], limit: float = 60.0) -> dict[int, object]:
    crew = Crew(work, iter(enumerate(tasks)), 2, limit)  # pyright: ignore[reportArgumentType]
    try:
        return dict(crew.outcomes())
    finally:
        crew.dismiss()


def test_results_exceptions_exits_and_signals_are_told_apart() -> None:
    assert outcomes(abs, [-1, 2, -3]) == {0: 1, 1: 2, 2: 3}
    found = outcomes(abs, [-1, "text", -3])
    assert found[1] == Died("exit status 1", "TypeError: bad operand type for abs(): 'str'")
    assert (found[0], found[2]) == (1, 3)
    killed = outcomes(signal.raise_signal, [signal.SIGSEGV])[0]
    assert isinstance(killed, Died)
    assert killed.how == "SIGSEGV"
    assert outcomes(os._exit, [3]) == {0: Died("exit status 3", "without a word")}


def test_what_finds_no_end_is_stopped_and_the_rest_goes_on() -> None:
    found = outcomes(time.sleep, [1000.0, 0.0, 0.0], limit=8.0)
    assert found == {0: Hung(8.0), 1: None, 2: None}
