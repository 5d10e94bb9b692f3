"""The order of statements: each where it is used, so that few values are live at a time."""

from collections.abc import Iterable, Sequence
from heapq import heappop, heappush

IDLE = 2
"""Growth of a statement that makes and ends nothing: it waits for those that make one value."""


def ordered(takes: Sequence[Iterable[int]], makes: Sequence[Iterable[int]]) -> list[int]:
    """An order of statements 0, 1, ... in which what is taken has been made before.

    Of those that are ready the one comes next that adds least to the values that are live: it makes
    some, and ends those that nobody else takes. Of several it is the first that takes a single
    value, which is often a call, else the first. The time is that of sorting all that is taken.

    Args:
        takes: values that each statement takes; those that none makes are there from the beginning.
        makes: values that each statement makes, each by one.

    Returns:
        The order; statements that wait for each other in a circle, and what waits for them, are
        missing.
    """
    maker = {value: i for i, values in enumerate(makes) for value in values}
    takers: dict[int, set[int]] = {}
    waits = [0] * len(takes)
    next_ones: list[list[int]] = [[] for _ in takes]
    for i, values in enumerate(takes):
        for value in set(values):
            takers.setdefault(value, set()).add(i)
        before = {maker[value] for value in set(values) if value in maker}
        waits[i] = len(before)
        for j in before:
            next_ones[j].append(i)

    def rank(i: int) -> tuple[int, int, int]:
        made = sum(bool(takers.get(value)) for value in makes[i])
        ended = sum(len(takers[value]) == 1 for value in set(takes[i]))
        return made - ended if made or ended else IDLE, min(len(set(takes[i])), 2), i

    heap: list[tuple[int, int, int]] = []
    for i, count in enumerate(waits):
        if count == 0:
            heappush(heap, rank(i))
    found: list[int] = []
    done = [False] * len(takes)
    while heap:
        _, _, i = heappop(heap)
        if done[i]:
            continue
        done[i] = True
        found.append(i)
        fewer: set[int] = set()
        for value in set(takes[i]):
            takers[value].discard(i)
            if len(takers[value]) == 1:
                fewer |= takers[value]
        for j in next_ones[i]:
            waits[j] -= 1
            if waits[j] == 0:
                heappush(heap, rank(j))
        for j in fewer:
            if waits[j] == 0 and not done[j]:
                heappush(heap, rank(j))
    return found
