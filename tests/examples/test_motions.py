"""The optimal motions of the examples: closed forms, and what must be dearer than what."""

from dataclasses import replace

import numpy as np
import pytest
from phases import solve_once

from examples import (
    arm_to_a_place,
    co_design,
    crank_start_up,
    quarter_car_profile,
    swing_up,
    through_a_spring,
)
from ocp import Problem, Solution, solve
from ocp.friction.smooth_models import smoothed


def softly(problem: Problem, **widths: float) -> Solution:
    """One solve on a coarse mesh, friction smoothed over wide layers."""
    solution = solve_once(replace(smoothed(problem), p=dict(problem.p) | widths), intervals=20)
    assert solution.status.ok
    return solution


def test_best_spring_is_nearly_in_resonance_and_cheaper_than_any_other() -> None:
    chosen = co_design.problem()
    best = softly(chosen, rail_v_t=0.02)
    assert best.chosen["k"] == pytest.approx(co_design.RESONANCE, rel=0.02)
    assert best.cost == pytest.approx(co_design.PRICE, rel=0.02)
    for factor in (0.95, 1.05):
        k = factor * best.chosen["k"]
        other = softly(replace(chosen, choose={}, p={"k": k}), rail_v_t=0.02)
        assert other.cost > best.cost


def test_motor_of_the_crank_pays_for_the_bearing() -> None:
    smooth = solve_once(crank_start_up.start_up(crank_start_up.machine(0.0)), 20)
    rough = softly(
        crank_start_up.start_up(crank_start_up.machine(0.15)), crank_v_t=0.03, crank_eps=3.0
    )
    assert 1.1 * smooth.cost < rough.cost < 2.0 * smooth.cost
    assert rough["crank_rate"][-1] == pytest.approx(crank_start_up.SPEED)


def test_arm_ends_at_the_place_and_stays_above_the_table() -> None:
    best = solve_once(arm_to_a_place.problem(), intervals=8)
    assert best.status.ok
    for name, place in arm_to_a_place.PLACE.items():
        assert best[name][-1] == pytest.approx(place, abs=1e-6)
    assert best["link6_z"].min() > arm_to_a_place.TABLE - 1e-6


def test_body_rises_no_gentler_than_alone() -> None:
    best = softly(quarter_car_profile.problem(), guide_v_t=0.03)
    assert quarter_car_profile.GENTLEST < best.cost < 1.1 * quarter_car_profile.GENTLEST
    assert best["tyre"].min() > -quarter_car_profile.WEIGHT
    assert np.abs(np.diff(best["speed"]) / np.diff(best.t)).max() < 20.0 + 1e-6


def test_bob_keeps_between_the_walls_and_the_force_does_not_jump() -> None:
    best = softly(swing_up.problem(), x_v_t=0.3)
    assert np.abs(best["bob_x"]).max() < swing_up.WALL + 1e-6
    assert np.abs(np.diff(best["force"]) / np.diff(best.t)).max() < 400.0 + 1e-6
    assert best["theta"][-1] == pytest.approx(np.pi)


@pytest.mark.slow
def test_load_behind_a_spring_sticks_until_the_spring_is_wound_up() -> None:
    best = solve(through_a_spring.problem())
    assert best.verified
    kinds = [mode.kind for mode in best.modes["guide"]]
    assert kinds[0] == "stick"
    assert {"slip+", "slip-"} <= set(kinds)
    breaks = best.modes["guide"][0].end
    assert np.interp(breaks, best.t, best["spring"]) == pytest.approx(6.0, abs=0.05)
    assert best.cost < 28.8
