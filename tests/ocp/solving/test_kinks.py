import pytest
from motions import stage
from phases import fastest_move

from ocp.formulation.expressions import integral
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.solving.methods import Ipopt
from ocp.solving.one_solve import solve_once


@pytest.mark.parametrize(("v_t", "named"), [(1e-4, True), (0.5, False)])
def test_a_width_that_is_small_against_the_motion_is_named(v_t: float, named: bool) -> None:
    message = solve_once(fastest_move(v_t), 10, solver=Ipopt(max_iter=5)).message
    said = "Friction is smoothed over a small width: contact 'guide' has v_t = 0.0001 m/s; raise"
    assert (said in message) == named


def test_a_contact_that_never_turns_round_is_not_blamed() -> None:
    phase = Phase(stage(1e-4), 1.0, start={"v": 1.0}, end={"x": 4.0})
    problem = Problem(phase, integral(lambda s: s.force**2), bounds={"v": (0.5, None)})
    message = solve_once(problem, 10, solver=Ipopt(max_iter=1)).message
    assert "maximum number of iterations" in message
    assert "Friction" not in message


def test_a_solve_that_goes_well_says_nothing_of_it() -> None:
    assert "Friction" not in solve_once(fastest_move(1e-4), 10).message
