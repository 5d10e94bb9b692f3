from dataclasses import replace

import numpy as np
import pytest
from motions import fastest, least_effort, out_and_back, stage

from ocp import FREE, Guess, Problem, at_end, integral, solve
from ocp.collocation import radau
from ocp.guess import initial_points, resample
from ocp.transcribe import Transcription, make_mesh, transcribe


def program(problem: Problem, intervals: int = 10) -> Transcription:
    return transcribe(problem, make_mesh(problem, intervals), radau(3))


def test_states_run_straight_between_the_boundary_values_and_velocities_follow() -> None:
    nlp = program(least_effort(T=2.0))
    points = initial_points(nlp)
    np.testing.assert_allclose(points.x[0], nlp.fractions)
    np.testing.assert_allclose(points.x[1], 0.5)  # 1 m in 2 s, although it starts and ends at rest
    np.testing.assert_array_equal(points.u, 0.0)


def test_states_pass_the_via_points() -> None:
    nlp = program(out_and_back())
    points = initial_points(nlp)
    np.testing.assert_allclose(points.x[0], 1 - abs(1 - 2 * nlp.fractions), atol=1e-12)
    np.testing.assert_allclose(points.x[1, 1:10], 1.0)
    np.testing.assert_allclose(points.x[1, -9:], -1.0)


def test_states_without_conditions_stay_level() -> None:
    problem = least_effort(cost=at_end(lambda s: s.x**2), final={}, initial={"x": 3.0, "v": FREE})
    points = initial_points(program(problem))
    np.testing.assert_array_equal(points.x[0], 3.0)
    np.testing.assert_allclose(points.x[1], 0.0, atol=1e-12)


def test_ranges_are_entered_in_the_middle_or_at_their_finite_end() -> None:
    problem = least_effort(initial={"x": (1.0, 3.0)}, final={"x": (5.0, None), "v": 0.0})
    x = initial_points(program(problem)).x[0]
    assert (x[0], x[-1]) == (2.0, 5.0)


@pytest.mark.parametrize(("bounds", "expected"), [((-1, 3), 0.0), ((1, 3), 2.0), ((2, None), 2.0)])
def test_inputs_are_zero_or_in_the_middle_of_their_bounds(
    bounds: tuple[float, float | None], expected: float
) -> None:
    points = initial_points(program(least_effort(bounds={"a": bounds})))
    np.testing.assert_array_equal(points.u, expected)


@pytest.mark.parametrize(
    "given", [2.0, [1.0, 2.0, 3.0], lambda t: 1.0 + t, lambda t: np.full_like(t, 2.0)]
)
def test_guess_may_be_a_number_samples_or_a_function_of_time(given: Guess) -> None:
    nlp = program(least_effort(T=2.0), 5)
    v = initial_points(nlp, {"v": given}).x[1]
    assert v[0] in (1.0, 2.0)
    assert np.interp(0.5, nlp.fractions, v) == pytest.approx(2.0)
    assert v[-1] in (2.0, 3.0)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"w": 1.0}, "guess: expected one of x, v, a, got w"),
        ({"x": np.nan}, "guess of x: expected finite numbers, got nan"),
        ({"x": []}, r"guess: expected for x a number, samples, or a function .* shape \(0,\)"),
        ({"x": np.ones((2, 2))}, r"got an array of shape \(2, 2\)"),
        ({"a": lambda t: t[:3]}, r"guess: expected for a a number.* shape \(3,\)"),
    ],
)
def test_bad_guesses_are_refused(given: dict[str, Guess], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        initial_points(program(least_effort()), given)


def test_solution_is_carried_to_another_mesh() -> None:
    coarse = solve(least_effort(), intervals=8)
    nlp = program(least_effort(), 16)
    points = resample(nlp, coarse)
    np.testing.assert_array_equal(points.u[0], np.repeat(coarse.controls["a"], 2))
    np.testing.assert_allclose(points.x[0, ::6], coarse["x"][::3], atol=1e-12)


def test_free_duration_is_carried_over_within_its_bounds() -> None:
    quick = solve(fastest(stage()))
    assert resample(program(fastest(stage())), quick).T[0] == quick.T
    narrow = replace(fastest(stage()), T=type(quick.problem.T)(0.5, 2.0))
    assert resample(program(narrow), quick).T[0] == 0.5


def test_velocity_guess_spares_most_iterations() -> None:
    """At v = 0, where friction is steepest, Ipopt is lost; the slope of x leads it straight on."""
    problem = Problem(stage(), 1.0, integral(lambda s: s.force**2), final={"x": 1.0, "v": 0.0})
    lost = solve(problem, guess={"v": 0.0}, throw=False)
    assert 4 * solve(problem).iterations < lost.iterations
