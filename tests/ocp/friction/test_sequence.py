"""Sequences of modes: read off, cut, pruned, edited."""

import numpy as np
import pytest

from ocp.friction.sequence import (
    Run,
    Track,
    cut,
    flat,
    inserted,
    placed,
    pruned,
    read,
    shown,
    tracks_of,
    with_rests,
)


def there_and_back() -> Track:
    t = np.linspace(0.0, 2.0, 201)
    return read("guide", t, np.sin(np.pi * t), creep=0.05, shortest=0.05)


def test_runs_are_read_without_gaps_and_short_ones_belong_to_their_neighbours() -> None:
    track = there_and_back()  # rests of 0.03 s at 0, 1 and 2 s
    assert [run.mode for run in track.runs] == [1, -1]
    assert track.runs[0].begin == 0.0
    assert track.runs[0].end == track.runs[1].begin == pytest.approx(1.0)
    assert track.runs[1].end == 2.0


def test_a_rest_long_enough_is_read() -> None:
    t = np.linspace(0.0, 3.0, 301)
    slip = np.where(t < 1, 1.0, np.where(t < 2, 1e-3, -1.0))
    assert [run.mode for run in read("guide", t, slip, 0.01, 0.05).runs] == [1, 0, -1]


def test_rests_are_put_in_at_reversals_and_ends_where_something_can_hold() -> None:
    track = with_rests(there_and_back(), lambda t: True, 0.02)
    assert [run.mode for run in track.runs] == [0, 1, 0, -1, 0]
    for before, after in zip(track.runs[:-1], track.runs[1:], strict=True):
        assert before.end == after.begin
    held = with_rests(there_and_back(), lambda t: t > 1.5, 0.02, (True, True))
    assert [run.mode for run in held.runs] == [1, -1, 0]
    moving = with_rests(there_and_back(), lambda t: True, 0.02, (False, False))
    assert [run.mode for run in moving.runs] == [1, 0, -1]


def test_legs_are_cut_where_any_contact_changes() -> None:
    one = Track("one", (Run(1, 0.0, 1.2), Run(-1, 1.2, 2.0)))
    two = Track("two", (Run(0, 0.0, 0.5), Run(1, 0.5, 2.0)))
    legs = (cut([one, two], (0, 0), 0.0, 1.0), cut([one, two], (1, 0), 1.0, 2.0))
    assert shown(legs) == "(+0)(++) | (++)(-+)"
    assert [arc.duration for arc in flat(legs)] == pytest.approx([0.5, 0.5, 0.2, 0.8])
    assert tracks_of(legs) == {"one": one.runs, "two": two.runs}


def test_pruning_drops_what_has_vanished_and_joins_what_is_alike() -> None:
    track = Track("guide", (Run(1, 0.0, 0.6), Run(0, 0.6, 0.7), Run(1, 0.7, 1.0)))
    (leg,) = placed([cut([track], (0, 0), 0.0, 1.0)], [0.69, 1e-5, 0.31 - 1e-5])
    (left,) = pruned([leg], 1e-4)
    assert shown([left]) == "+"
    assert (left.arcs[0].begin, left.arcs[0].end) == (0.0, pytest.approx(1.0))


def test_a_leg_keeps_its_longest_arc() -> None:
    track = Track("guide", (Run(1, 0.0, 4e-5), Run(0, 4e-5, 1e-4)))
    (left,) = pruned([cut([track], (0, 0), 0.0, 1e-4)], 1e-3)
    assert shown([left]) == "0"


def test_a_mode_is_inserted_inside_an_arc() -> None:
    track = Track("guide", (Run(1, 0.0, 1.0),))
    legs = inserted([cut([track], (0, 0), 0.0, 1.0)], 0, "guide", 0, 0.4, 0.5)
    assert shown(legs) == "+0+"
    at_end = inserted([cut([track], (0, 0), 0.0, 1.0)], 0, "guide", 0, 0.4, 1.0)
    assert shown(at_end) == "+0"
