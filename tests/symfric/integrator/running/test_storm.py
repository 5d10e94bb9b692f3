"""What is a storm of events and what is none, on both sides of every threshold."""

import numpy as np

from symfric.integrator.running.crossings import Memory
from symfric.integrator.running.events import storm

TOLERANCE = 2.0**-33


def raged(times: list[float], which: list[tuple[int, ...]] | None = None) -> list[int]:
    """Numbers of the events at `times` that complete a storm."""
    memory, kinds = Memory.new(3, TOLERANCE), which or [(0,)] * len(times)
    flags = [np.isin(np.arange(3), kind) for kind in kinds]
    return [k for k, (t, w) in enumerate(zip(times, flags, strict=True)) if storm(memory, t, w)]


def shrinking(last: float) -> list[float]:
    """Four times whose gaps halve; as much as the last gap is still to come."""
    return [1.0, 1.0 + 4 * last, 1.0 + 6 * last, 1.0 + 7 * last]


def test_gaps_that_shrink_are_a_storm_once_little_is_still_to_come() -> None:
    assert raged(shrinking(999 * TOLERANCE)) == [3]
    assert raged(shrinking(1001 * TOLERANCE)) == []
    assert raged(shrinking(20 * TOLERANCE)) == [3]


def test_only_events_of_one_kind_shrink_towards_one_time() -> None:
    near = shrinking(500 * TOLERANCE)
    assert raged(near, [(0,), (1,), (0,), (1,)]) == []
    assert raged(near, [(0, 1)] * 4) == [3]


def test_gaps_that_stay_or_grow_are_none() -> None:
    assert raged([k * 500 * TOLERANCE for k in range(20)]) == []
    assert raged([k * k * 100 * TOLERANCE for k in range(20)]) == []


def test_a_hundred_events_a_few_tolerances_apart_are_a_storm_of_any_kind() -> None:
    kinds = [(k % 3,) for k in range(120)]
    close = [1.0 + k * 10 * TOLERANCE for k in range(120)]
    assert raged(close, kinds) == list(range(99, 120))
    apart = [1.0 + k * 11 * TOLERANCE for k in range(120)]
    assert raged(apart, kinds) == []


def test_late_in_a_run_the_clock_is_the_tolerance() -> None:
    """Neighbouring numbers at 1e9 s are a thousand tolerances apart."""
    late = [2.0**30 + k * 2.0**-22 for k in range(100)]
    assert raged(late, [(k % 2,) for k in range(100)]) == [99]
