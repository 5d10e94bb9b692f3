"""Leuven friction: steady states of both signs, memory, the limits it states."""

import casadi as ca
import numpy as np
import pytest
from oracles import stribeck_curve
from rigs import prescribed_motion, through

from symfric import simulate
from symfric.laws import Leuven, MaxwellSlip, Slider

YIELDS = [0.2e-6, 0.5e-6, 1.0e-6, 1.6e-6]
SLIDERS = tuple(Slider(0.25 * 1.05 / x, 0.25 * 1.05 * 1.0001) for x in YIELDS)
PUBLISHED = Leuven(SLIDERS, mu_s=1.05, mu_d=0.2, v_s=98e-6, delta=0.78, sigma_1=0.08)
POINTS = [0.0, 1.0e-6, 0.4e-6, 0.8e-6, 0.4e-6, -0.2e-6]


@pytest.mark.parametrize("v", [5e-6, -5e-6, 200e-6, -200e-6])
def test_long_sliding_ends_on_the_stribeck_curve(v: float) -> None:
    run = simulate(prescribed_motion(PUBLISHED, 1.0, lambda t: ca.SX(v)), 20e-6 / abs(v), rtol=1e-9)
    expected = stribeck_curve(v, 1.0, 1.05, 0.2, 98e-6, 0.78)
    assert run.final["friction"] == pytest.approx(expected, rel=1e-3)


def test_every_sharing_of_the_level_is_steady() -> None:
    v, level = 2e-4, stribeck_curve(2e-4, 1.0, 1.05, 0.2, 98e-6, 0.78)
    for shares in ([0.25] * 4, [0.1, 0.2, 0.3, 0.4]):
        rate = PUBLISHED.rate(v, 1.0, level * np.array(shares))
        assert np.abs(rate).max() < 1e-3 * 1.3e6 * v


def test_far_below_the_level_it_is_maxwell_slip() -> None:
    """Up to half the level the transition takes less than (1/2)^8/8 of the stretch."""
    strong = Leuven(SLIDERS, mu_s=1.05, mu_d=1.05, sigma_1=0.0, n=100.0, delta_l=50.0)
    points = [0.5 * x for x in POINTS]
    velocity = through(points, 1.0)
    one, other = (
        simulate(prescribed_motion(law, 1.0, velocity), 5.0, rtol=1e-9)["friction"]
        for law in (strong, MaxwellSlip(SLIDERS, n=100.0))
    )
    assert one == pytest.approx(other, abs=1e-4)


def test_closed_inner_loop_returns_nearly() -> None:
    strong = Leuven(SLIDERS, mu_s=1.05, mu_d=1.05, sigma_1=0.0, n=200.0)
    run = simulate(prescribed_motion(strong, 1.0, through(POINTS, 1.0)), 5.0, rtol=1e-9)
    corners = np.interp(np.arange(6.0), run.t, run["friction"])
    assert corners[4] == pytest.approx(corners[2], abs=5e-3)


def test_settled_cycle_dissipates() -> None:
    velocity = through([0.0, *4 * [3e-6, -3e-6], 3e-6], 0.5)
    run = simulate(prescribed_motion(PUBLISHED, 1.0, velocity), 4.5, t_eval=[3.5, 4.5], rtol=1e-9)
    assert run["work"][1] - run["work"][0] > 3e-6


def test_elements_below_the_static_level_are_refused() -> None:
    with pytest.raises(ValueError, match=r"elements that carry mu_s = 0.15 together, got 0.1"):
        Leuven((Slider(1e5, 0.04), Slider(2e4, 0.06)))
