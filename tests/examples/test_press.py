"""The press of the example: what the drive spends is what the blank and the bearings take."""

import numpy as np
import pytest

from examples.press import BEARINGS, DEPTH, FORCE, OMEGA, L, R, press
from symfric import Trajectory


@pytest.fixture(scope="module")
def strokes() -> tuple[Trajectory, Trajectory]:
    return press(friction=False), press(friction=True)


def work(run: Trajectory) -> float:
    return OMEGA * float(run.integral("drive_moment")[-1])


def test_without_friction_the_blank_takes_all(strokes: tuple[Trajectory, Trajectory]) -> None:
    """Force times depth, rounded over half a millimetre."""
    assert work(strokes[0]) == pytest.approx(FORCE * DEPTH, rel=5e-3)


def test_friction_costs_what_the_bearings_lose(strokes: tuple[Trajectory, Trajectory]) -> None:
    lost = sum(float(strokes[1].integral(f"{name}_power")[-1]) for name in BEARINGS)
    assert work(strokes[1]) - work(strokes[0]) == pytest.approx(lost, rel=1e-3)


def test_slide_follows_the_closed_form(strokes: tuple[Trajectory, Trajectory]) -> None:
    """From the top, where the slide is at L - R, to L + R and back."""
    for run in strokes:
        angle = OMEGA * run.t
        x = -R * np.cos(angle) + np.sqrt(L**2 - (R * np.sin(angle)) ** 2)
        assert run["guide"] == pytest.approx(x, abs=1e-9)


def test_the_crank_carries_the_load_of_the_rod(strokes: tuple[Trajectory, Trajectory]) -> None:
    """While it presses, the bearing of the crank feels at least the force of the blank."""
    assert 0.95 * FORCE < strokes[1]["crank_N"].max() < 1.2 * FORCE
