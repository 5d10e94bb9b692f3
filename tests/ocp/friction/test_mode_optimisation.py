"""Exact motions by modes, against closed forms and against the law at widths of 1e-5."""

from dataclasses import replace
from functools import cache

import pytest

from ocp.formulation.phase import Chain
from ocp.formulation.problem import Problem
from ocp.friction.mode_optimisation import optimise_modes
from ocp.friction.smooth_models import smooth_model, widths
from ocp.problems import out_and_back
from ocp.solving.one_solve import solve_once
from ocp.solving.solution import Solution
from symfric.integrator import Hold, simulate


def smoothed(problem: Problem, layer: float) -> Problem:
    """`problem` with smooth friction of that width."""
    return replace(
        problem,
        phases=Chain(
            tuple(
                replace(
                    phase,
                    model=smooth_model(phase.model),
                    p={w.parameter: w.at(layer) for w in widths(phase.model)},
                )
                for phase in problem.chain
            )
        ),
    )


@cache
def polished() -> Solution:
    problem = out_and_back()
    smooth = solve_once(smoothed(problem, 0.05), intervals=25)
    smooth = solve_once(smoothed(problem, 0.015), intervals=25, guess=smooth)
    return next(optimise_modes(smooth, problem, {"guide": 0.015}))[0]


def test_out_and_back_is_the_closed_form() -> None:
    """J = 40 + 0.5 / (1 - 4 tanh 0.25) for controls that may follow any curve."""
    assert polished().ok
    assert polished().cost == pytest.approx(64.59984, rel=1e-3)
    assert polished().cost > 64.59984


def test_modes_are_slip_forwards_and_backwards_with_the_superfluous_rests_pruned() -> None:
    (modes,) = polished().modes.values()
    assert [mode.kind for mode in modes] == ["slip+", "slip-"]
    assert [mode.end for mode in modes] == pytest.approx([1.0, 2.0])


def test_the_result_is_in_the_terms_of_the_user() -> None:
    solution = polished()
    assert [phase.name for phase in solution.phases] == ["out", "back"]
    assert [phase.T for phase in solution.phases] == pytest.approx([1.0, 1.0])
    assert solution["x"][solution.t.searchsorted(1.0 - 1e-9)] == pytest.approx(1.0)
    assert set(solution.signals) >= {"x", "v", "force", "friction"}


def test_under_a_sharp_law_it_ends_where_it_says() -> None:
    """Width 1e-5, a controller that holds: within 0.1 mm of 1 m and of rest at 0."""
    solution, problem = polished(), out_and_back(v_t=1e-5)
    run = simulate(
        problem.chain[0].model,
        2.0,
        u={"force": Hold(solution.t_control, solution.controls["force"])},
        rtol=1e-9,
        t_eval=[0.0, 1.0, 2.0],
    )
    assert run["x"][1] == pytest.approx(1.0, abs=1e-4)
    assert run["x"][2] == pytest.approx(0.0, abs=1e-4)
    assert run["v"][2] == pytest.approx(0.0, abs=1e-4)
