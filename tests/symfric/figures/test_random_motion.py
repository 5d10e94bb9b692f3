"""Motions of populations of contacts: closed forms of springs and of free blocks."""

import casadi as ca
import numpy as np
import pytest

from symfric.figures.motion import shoved, slid
from symfric.integrator import Linear
from symfric.laws import GenericAsperity, RandomBristles

N = 10.0
SPRING = RandomBristles(delta_s=1.0)


def test_way_and_velocity_are_those_of_the_given_motion() -> None:
    t = np.linspace(0.0, 0.2, 101)
    found = slid(GenericAsperity(count=20), N, lambda s, p: 1e-3 * p * ca.sin(20 * p * s), t, 2.0)
    assert found["v"] == pytest.approx(2e-3 * np.sin(40 * t))
    assert found["x"] == pytest.approx(5e-5 * (1 - np.cos(40 * t)), abs=1e-10)


def test_bristles_that_hold_are_a_spring_along_the_way() -> None:
    t = np.linspace(0.0, 1.0, 11)
    found = slid(SPRING, N, lambda s, p: 1e-6 + 0 * s, t, 1.0)
    assert found["F"] - found["F"][0] == pytest.approx(0.1 * t, rel=1e-6)


def test_a_pushed_block_on_a_spring_swings_with_its_frequency() -> None:
    start = float(SPRING.begin().z.mean()) * 1e5
    run = shoved(SPRING, N, 0.8, start + 1.0, 0.05, None)
    w = np.sqrt(1e5 / 0.8)
    expected = 1e-5 * (1 - np.cos(w * run.step_times))
    assert run.columns["x"] == pytest.approx(expected, abs=3e-6)


def test_the_run_ends_where_the_velocity_is_reached() -> None:
    law = GenericAsperity(count=50, mu_0=0.0, mu_inf=0.0)
    run = shoved(law, N, 2.0, Linear([0.0, 1.0], [0.0, 4.0]), 1.0, 0.25)
    assert run.step_times[-1] == pytest.approx(0.5, abs=2e-3)  # v = t^2 without friction
    assert run.at(0.25)["force"] == pytest.approx(1.0)
    assert run.at([0.25])["v"] == pytest.approx(0.0625, abs=2e-3)


@pytest.mark.slow
def test_a_weak_push_is_held_and_a_strong_one_is_not() -> None:
    law = GenericAsperity(count=100, tau_c=1e-6)
    ends = [shoved(law, N, 0.8, lambda t, F=F: F + 0 * t, 0.3, None) for F in (0.5, 4.0)]
    assert abs(ends[0].columns["x"][-1]) < 2e-6
    assert ends[1].columns["x"][-1] == pytest.approx((4.0 - 2.0) / 0.8 * 0.045, rel=0.1)
