from dataclasses import replace

import numpy as np
import pytest
from motions import fastest, least_effort, out_and_back, stage

from ocp import Problem, Solution, integral, solve
from ocp.verify import verified
from symfric import Model, Status, Variable


@pytest.fixture(scope="module")
def missed() -> Solution:
    return solve(out_and_back(), throw=False)


def test_miss_is_the_end_of_the_simulation_less_the_end_of_the_optimum(missed: Solution) -> None:
    assert missed.trajectory is not None
    simulated = missed.trajectory.final
    assert missed.terminal_miss["x"] == pytest.approx(simulated["x"] - 0.0)
    assert missed.terminal_miss["v"] == pytest.approx(simulated["v"] - 0.0)


def test_relative_miss_is_in_nominal_values(missed: Solution) -> None:
    assert missed.relative_miss["x"] == pytest.approx(missed.terminal_miss["x"] / 0.1)


def test_message_is_loud(missed: Solution) -> None:
    assert missed.status is Status.TERMINAL_MISS
    assert not missed.ok
    assert "use more intervals. It misses x by" in missed.message
    assert "v by" not in missed.message


def test_smooth_motion_is_met_to_the_tolerance_of_the_simulation() -> None:
    solution = solve(least_effort())
    assert max(map(abs, solution.terminal_miss.values())) < 1e-8


def test_miss_of_the_fastest_move_falls_with_the_transition_velocity() -> None:
    misses = [abs(solve(fastest(stage(v_t))).terminal_miss["x"]) for v_t in (1e-2, 1e-3, 1e-4)]
    assert misses[0] > 3 * misses[1] > 9 * misses[2]


def test_control_that_cannot_be_simulated_is_reported() -> None:
    """x' = u x^2 ends at x = 1/2; with another control it runs away before the end."""
    x, u = Variable("x", "1", start=1.0), Variable("u", "1/s")
    model = Model("runaway", x=(x,), u=(u,), ode=u.symbol * x.symbol**2)
    problem = Problem(model, 1.0, integral(lambda s: s.u**2), final={"x": 0.5})
    solution = solve(problem)
    wild = replace(solution, controls={"u": np.full_like(solution.controls["u"], 3.0)})
    checked = verified(wild, 0.01)
    assert not checked.ok
    assert "could not be re-simulated" in checked.message
    assert checked.terminal_miss == {}
