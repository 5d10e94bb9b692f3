"""Prescribed motions go where they are told, at the pace they are told."""

import numpy as np
import pytest

from symfric import LuGre, simulate
from symfric.figures.motion import fine, prescribed, pushed, slides, through
from symfric.laws import Karnopp


@pytest.mark.parametrize("pace", [1.0, 5.0])
def test_the_contact_passes_every_turning_point(pace: float) -> None:
    points = (0.0, 2e-5, -1e-5, 3e-5)
    curve = slides(LuGre(), 1.0, through(points, 0.5))("", np.linspace(0.0, 1.5 / pace, 4), pace)
    assert curve["x"] == pytest.approx(points, abs=1e-10)
    assert curve["v"] == pytest.approx(np.zeros(4), abs=1e-10)


def test_it_starts_in_steady_sliding_at_its_first_velocity() -> None:
    model = prescribed(LuGre(), 1.0, lambda t, pace: 1e-2 + 0 * t * pace)
    F = simulate(model, 0.1, samples=11)["friction"]
    assert pytest.approx(np.full(11, 0.1), rel=1e-9) == F


def test_a_law_that_needs_the_applied_force_is_refused() -> None:
    with pytest.raises(ValueError, match="F_e: expected an applied force"):
        prescribed(Karnopp(), 1.0, through((0.0, 1.0), 1.0))


def test_a_pushed_block_stops_where_it_has_broken_away() -> None:
    run = pushed(LuGre(), 1.0, 1.0, 2.0, 10.0, until=0.5)
    assert run.final["v"] == pytest.approx(0.5, rel=1e-6)
    assert run.step_times[-1] < 0.4  # 2 N - 0.1 N on 1 kg need about 0.26 s


def test_times_between_the_steps_hold_the_ends_of_the_steps() -> None:
    run = pushed(LuGre(), 1.0, 1.0, 0.05, 0.1)
    times = fine(run, 4)
    assert times[::4] == pytest.approx(run.step_times)
    assert (np.diff(times) > 0).all()
