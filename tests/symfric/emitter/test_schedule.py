"""Statements in an order in which few values are live."""

import numpy as np

from symfric.emitter.statements import ordered


def live(order: list[int], takes: list[set[int]], makes: list[set[int]]) -> int:
    """Largest number of values that are made and still to be taken."""
    most, now = 0, set[int]()
    for k, i in enumerate(order):
        now |= makes[i]
        rest = set().union(*(takes[j] for j in order[k + 1 :]))
        now &= rest
        most = max(most, len(now))
    return most


def test_what_is_taken_has_been_made() -> None:
    random = np.random.default_rng(0)
    takes = [set(random.integers(0, i, min(i, 3)).tolist()) if i else set() for i in range(200)]
    makes = [{i} for i in range(200)]
    order = ordered(takes, makes)
    assert sorted(order) == list(range(200))
    place = {i: k for k, i in enumerate(order)}
    assert all(place[j] < place[i] for i in range(200) for j in takes[i])


def test_chains_are_followed_to_their_end() -> None:
    """Twenty chains of three statements, given side by side, end in one sum of two at a time."""
    takes: list[set[int]] = [set() for _ in range(20)]
    takes += [{i} for i in range(20)] + [{20 + i} for i in range(20)]
    takes += [{40, 41}] + [{59 + i, 41 + i} for i in range(1, 19)]
    makes = [{i} for i in range(len(takes))]
    assert live(list(range(len(takes))), takes, makes) == 20
    assert live(ordered(takes, makes), takes, makes) <= 3


def test_a_value_that_is_stored_and_taken_again_does_not_hurry() -> None:
    takes, makes = [set(), {0}, {0}, {2}], [{0}, set(), {2}, set()]
    assert ordered(takes, makes) == [0, 2, 1, 3]


def test_circles_are_left_out() -> None:
    takes, makes = [set(), {0, 3}, {1}, {2}, {0}], [{0}, {1}, {2}, {3}, {4}]
    assert ordered(takes, makes) == [0, 4]
