"""Meshes that follow from errors until the cost has four digits and the motion lands."""

from dataclasses import replace
from math import cos, pi, sin, sqrt

import casadi as ca
import numpy as np
import pytest

from ocp.checking.mesh_refinement import Goals, refined_solve
from ocp.checking.verify import verify
from ocp.formulation.expressions import TIME, integral
from ocp.formulation.phase import Free, Phase
from ocp.formulation.problem import Problem
from ocp.problems import OTHERS, alp_rider, brachistochrone, bryson_denham, goddard, hang_glider
from ocp.solving.methods import Ipopt
from ocp.solving.solution import Solution
from ocp.transcription.program import Progress
from ocp.transcription.schemes import make_meshes
from symfric.foundation.parameters import Variable
from symfric.foundation.status import Status
from symfric.model import Model

FOUR_DIGITS = 5e-5


def solved(problem: Problem, intervals: int = 50) -> Solution:
    return refined_solve(problem, make_meshes(problem, intervals))


def optimum(name: str) -> float:
    return next(ready.optimum for ready in OTHERS if ready.name == name)


def cycloid() -> float:
    """Fastest slide from (0, 10) to (10, 5): x = r (a - sin a), drop = r (1 - cos a)."""
    low, high = 0.1, 2 * pi - 0.1
    for _ in range(200):
        a = (low + high) / 2
        low, high = (a, high) if (a - sin(a)) / (1 - cos(a)) < 2.0 else (low, a)
    return high * sqrt(5.0 / (1 - cos(high)) / 9.80665)


def test_brachistochrone_is_as_fast_as_the_cycloid() -> None:
    assert cycloid() == pytest.approx(1.8016, abs=5e-5)  # as Dymos says
    assert optimum("brachistochrone") == pytest.approx(cycloid(), abs=1e-7)
    solution = solved(brachistochrone())
    assert solution.cost == pytest.approx(cycloid(), rel=FOUR_DIGITS)
    assert verify(solution).ok


@pytest.mark.parametrize("wall", [1 / 9, 0.15])
def test_bryson_denham_keeps_its_wall_between_nodes(wall: float) -> None:
    solution = solved(bryson_denham(wall), 20)
    assert solution.cost == pytest.approx(4 / (9 * wall), rel=FOUR_DIGITS)
    verification = verify(solution, tolerance=1e-5)
    assert verification.ok
    assert solution.statistics.solves <= 6


def test_hang_glider_flies_as_far_as_published() -> None:
    solution = solved(hang_glider())
    assert solution.cost == pytest.approx(optimum("hang_glider"), rel=FOUR_DIGITS)
    assert verify(solution).ok


def test_goddard_flies_as_high_as_published() -> None:
    solution = solved(goddard())
    assert solution.cost + 1 == pytest.approx(optimum("goddard") + 1, rel=1e-4)  # of the rise
    assert verify(solution).ok


@pytest.mark.slow
def test_alp_rider_costs_what_is_published_and_is_told_to_be_unstable() -> None:
    solution = solved(alp_rider())
    assert solution.cost == pytest.approx(optimum("alp_rider"), rel=FOUR_DIGITS)
    verification = verify(solution)
    assert verification.status is Status.UNSTABLE and not verification.ok


def test_switch_of_a_bang_bang_input_is_found_between_nodes() -> None:
    x, v, a = Variable("x", "m"), Variable("v", "m/s"), Variable("a", "m/s^2", lower=-1, upper=2)
    model = Model("cart", x=(x, v), u=(a,), ode=ca.vertcat(v.symbol, a.symbol))
    problem = Problem(Phase(model, Free(0.5, 5.0), end={"x": 1.0, "v": 0.0}), TIME)
    solution = solved(problem, 20)  # switches at a third of the time, which is no node
    assert solution.cost == pytest.approx(sqrt(3.0), rel=FOUR_DIGITS)
    assert solution.meshes[0].size - 1 <= 60


def test_second_pass_on_as_many_intervals_builds_nothing() -> None:
    """Where errors only sit in the wrong place, nodes move and their number stays."""
    x, u, t = Variable("x", "m"), Variable("u", "m/s"), ca.SX.sym("t")
    pulse = ca.exp(-((t - 0.3) ** 2) / 2e-4)
    model = Model("pulse", x=(x,), u=(u,), t=t, ode=u.symbol + 50 * pulse * (1 - x.symbol))
    problem = Problem(Phase(model, 1.0, end={"x": 1.0}), integral(lambda s: s.u**2))
    goals = replace(Goals.of(1e-3), loss=1.0)
    meshes = make_meshes(problem, 40)
    solution = refined_solve(problem, meshes, goals=goals)
    assert solution.meshes[0].size == meshes[0].size
    assert solution.statistics.solves > 1
    lengths = np.diff(solution.meshes[0])
    assert lengths[np.abs(solution.meshes[0][:-1] - 0.3) < 0.03].max() < 1 / 40
    assert max(e.max() for e in verify(solution).local_errors) <= goals.local


def test_large_program_is_not_refined_for_the_cost_alone_and_says_so() -> None:
    problem = bryson_denham()
    goals = replace(Goals.of(1e-3), nonzeros=5000)
    solution = refined_solve(problem, make_meshes(problem, 20), goals=goals)
    statistics = solution.statistics
    assert 2500 < statistics.jacobian_nonzeros + statistics.hessian_nonzeros < 5500
    share = (solution.cost - 4.0) / 4.0
    assert share > goals.loss
    assert f"lower the cost by about {100 * share:.1g} %" in solution.message


def test_stop_on_a_later_mesh_gives_the_solution_before() -> None:
    def stop(progress: Progress) -> None:
        if progress.stage == "mesh 2":
            raise KeyboardInterrupt

    problem = bryson_denham()
    solution = refined_solve(problem, make_meshes(problem, 20), progress=stop)
    assert solution.status is Status.INTERRUPTED
    assert solution.meshes[0].size == 21
    assert solution.cost == pytest.approx(4.0, rel=1e-2)
    assert "previous mesh" in solution.message


def test_first_solve_that_fails_is_returned_as_it_is() -> None:
    problem = brachistochrone()
    solution = refined_solve(problem, make_meshes(problem, 50), solver=Ipopt(max_iter=2))
    assert solution.status is Status.MAX_ITERATIONS
    assert solution.statistics.solves == 1
