"""Timing: the shortest of several calls, and the result."""

from symfric.bench.table import best_time, interleaved


def test_shortest_call_counts_until_the_budget_is_spent() -> None:
    """Calls of 4, 2, 3 and 1 seconds with a budget of 8."""
    clock = iter([0.0, 4.0, 10.0, 12.0, 20.0, 23.0, 30.0, 31.0])
    calls: list[int] = []

    def call() -> int:
        calls.append(1)
        return len(calls)

    assert best_time(call, budget=8.0, clock=lambda: next(clock)) == (2.0, 3)


def test_number_of_calls_is_limited() -> None:
    calls: list[int] = []
    best_time(lambda: calls.append(1), budget=100.0, most=5)
    assert len(calls) == 5


def test_contenders_take_turns() -> None:
    order: list[str] = []
    best = interleaved({name: lambda n=name: order.append(n) for name in "ab"}, rounds=2)
    assert "".join(order) == "ababab"
    assert set(best) == {"a", "b"}
