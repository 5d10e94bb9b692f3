from dataclasses import replace

import numpy as np
import pytest
from motions import double_integrator
from phases import UNIT, there_and_back, unit_move

from ocp.formulation.expressions import integral
from ocp.formulation.phase import FREE, Free, Phase
from ocp.formulation.problem import Problem
from ocp.solving.one_solve import perturbed, solve_once
from ocp.solving.starts import Guess, initial_points, resample, start_of
from ocp.transcription.schemes import Legendre, Radau, Scheme, make_meshes
from ocp.transcription.transcribe import discretise
from ocp.transcription.transcription import Transcription

EFFORT = integral(lambda s: s.a**2)


def on(problem: Problem, intervals: int = 10, scheme: Scheme | None = None) -> Transcription:
    return discretise(problem, scheme or Radau()).on(make_meshes(problem, intervals))


def test_states_run_straight_between_the_ends_and_velocities_follow() -> None:
    into = on(unit_move(T=2.0))
    (span,) = initial_points(into).spans
    np.testing.assert_allclose(span.nodes[0], into.meshes[0])
    np.testing.assert_allclose(span.inner[0], into.inner_fractions(0))
    np.testing.assert_allclose(span.nodes[1], 0.5)  # 1 m in 2 s, although it rests at both ends
    np.testing.assert_array_equal(span.u, 0.0)


def test_states_pass_via_points_and_run_on_over_phases() -> None:
    """The middle phase asks for nothing: its line goes from the first to the last one."""
    via = unit_move(via={0.25: {"x": 2.0}})
    mesh = on(via, 8).meshes[0]
    x = initial_points(on(via, 8)).spans[0].nodes[0]
    np.testing.assert_allclose(x, np.interp(mesh, [0, 0.25, 1], [0, 2, 1]))
    chain = Phase(UNIT, 1.0) >> Phase(UNIT, 2.0) >> Phase(UNIT, 1.0, end={"x": 4.0})
    points = initial_points(on(Problem(chain, EFFORT), 4))
    for span, begin in zip(points.spans, (0.0, 1.0, 3.0), strict=True):
        np.testing.assert_allclose(span.nodes[0, [0, -1]], [begin, begin + span.T])
        np.testing.assert_allclose(span.nodes[1], 1.0)


def test_states_that_jump_start_where_the_link_says() -> None:
    bounce = Phase(UNIT, 1.0, link={"x": lambda s: 2.0 * s.x + 1.0, "v": None})
    chain = Phase(UNIT, 1.0, end={"x": 3.0}) >> bounce
    first, second = initial_points(on(Problem(chain, EFFORT))).spans
    assert (first.nodes[0, -1], second.nodes[0, 0]) == (3.0, 7.0)
    np.testing.assert_allclose(second.nodes, [[7.0] * 11, [0.0] * 11], atol=1e-12)


def test_states_of_which_only_an_output_asks_something_stay_level() -> None:
    problem = unit_move(start={"x": 3.0, "v": FREE}, end={"power": 1.0})
    (span,) = initial_points(on(problem)).spans
    np.testing.assert_array_equal(span.nodes[0], 3.0)


def test_ranges_are_entered_in_the_middle_or_at_their_finite_end() -> None:
    problem = unit_move(start={"x": (1.0, 3.0)}, end={"x": (5.0, None), "v": 0.0})
    x = initial_points(on(problem)).spans[0].nodes[0]
    assert (x[0], x[-1]) == (2.0, 5.0)


@pytest.mark.parametrize(("bounds", "expected"), [((-1, 3), 0.0), ((1, 3), 2.0), ((2, None), 2.0)])
def test_inputs_are_zero_or_in_the_middle_of_their_bounds(
    bounds: tuple[float, float | None], expected: float
) -> None:
    (span,) = initial_points(on(unit_move(bounds={"a": bounds}))).spans
    np.testing.assert_array_equal(span.u, expected)


def test_durations_with_a_fixed_sum_are_stretched_to_it() -> None:
    chain = Phase(UNIT, Free(0.1, 10.0)) >> Phase(UNIT, 1.0) >> Phase(UNIT, Free(0.4, 40.0))
    problem = Problem(chain, EFFORT, durations=(((0, 1, 2), 11.0),))
    durations = [span.T for span in initial_points(on(problem)).spans]
    np.testing.assert_allclose(durations, [2.0, 1.0, 8.0])


@pytest.mark.parametrize(
    "given", [2.0, [1.0, 2.0, 3.0], lambda t: 1.0 + t, lambda t: np.full_like(t, 2.0)]
)
def test_guess_may_be_a_number_samples_or_a_function_of_time(given: Guess) -> None:
    """Over all phases: 2 s."""
    out, back = initial_points(on(there_and_back(), 4), {"v": given}).spans
    assert out.nodes[1, 0] in (1.0, 2.0)
    assert back.nodes[1, 0] == 2.0
    assert back.nodes[1, -1] in (2.0, 3.0)


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
        initial_points(on(unit_move()), given)


@pytest.mark.parametrize("degree", [2, 4])
def test_a_solution_is_carried_to_other_meshes_by_its_polynomials(degree: int) -> None:
    """Those of a double integrator under constant input are exact everywhere."""
    old = solve_once(unit_move(), 5)
    fine = on(unit_move(), 10, Radau(degree))
    (span,) = resample(fine, old.stored).spans
    np.testing.assert_array_equal(span.u[0], np.repeat(old.controls["a"], 2))
    x, v, a = span.nodes[0, :-1], span.nodes[1, :-1], span.u[0]
    np.testing.assert_allclose(span.nodes[0, 1:], x + 0.1 * v + 0.005 * a, atol=1e-12)
    assert solve_once(unit_move(), 10, guess=old).iterations <= 3


def test_a_solution_in_two_phases_starts_one_in_one_phase() -> None:
    old = solve_once(there_and_back(), 10)
    one = unit_move(T=4.0, end={"x": 0.0, "v": 0.0}, via={0.5: {"x": 1.0}})
    into = on(one, 20)
    (span,) = resample(into, old.stored).spans
    np.testing.assert_allclose(span.nodes[0], old["x"][::3], atol=1e-12)
    assert span.T == 4.0


def test_a_model_takes_what_it_knows_by_name() -> None:
    """With a bounded rate, `a` is a state, and the solution had it as an input."""
    old = solve_once(unit_move(), 10)
    into = on(unit_move(rates={"a": (-100.0, 100.0)}))
    (span,) = resample(into, old.stored).spans
    names = [v.name for v in into.problem.spans[0].model.x]
    np.testing.assert_array_equal(span.nodes[names.index("a"), :-1], old.controls["a"])
    np.testing.assert_allclose(span.nodes[0], old["x"][::3], atol=1e-12)


def test_multipliers_are_used_where_the_program_is_the_same() -> None:
    old = solve_once(unit_move(), 10)
    start, warm = start_of(on(unit_move(), 10), old)
    assert warm
    np.testing.assert_allclose(start.w, old.iterate.w, atol=1e-12)
    np.testing.assert_array_equal(start.lam_g, old.iterate.lam_g)
    for other in (
        on(unit_move(), 11),
        on(unit_move(path=[lambda s: s.v <= 9.0]), 10),
        on(unit_move(), 10, Radau(2)),
        on(unit_move(), 10, Legendre()),  # as many unknowns and rows
    ):
        start, warm = start_of(other, old)
        assert not warm
        assert not start.lam_g.any()


def test_free_durations_are_carried_over_within_their_bounds() -> None:
    old = solve_once(unit_move(T=Free(0.5, 2.0), cost=EFFORT), 5)
    assert pytest.approx(2.0) == old.T
    assert resample(on(unit_move(T=Free(0.5, 3.0))), old.stored).spans[0].T == old.T
    assert resample(on(unit_move(T=Free(0.5, 1.5))), old.stored).spans[0].T == 1.5


def test_perturbations_are_the_same_on_every_mesh_and_as_large_as_asked() -> None:
    coarse, fine = (on(unit_move(model=double_integrator(4.0)), n) for n in (5, 10))
    one, two = (perturbed(t, initial_points(t), 0.1, seed=3) for t in (coarse, fine))
    np.testing.assert_allclose(one.spans[0].nodes, two.spans[0].nodes[:, ::2])
    moved = [perturbed(fine, initial_points(fine), 0.1, seed).spans[0].u for seed in range(200)]
    assert np.std(moved) == pytest.approx(0.1 * 4.0, rel=0.1)
    still = perturbed(fine, initial_points(fine), 0.0, seed=3)
    np.testing.assert_array_equal(still.spans[0].nodes, initial_points(fine).spans[0].nodes)


def test_points_are_a_guess() -> None:
    into = on(unit_move(), 6)
    points = initial_points(into)
    moved = replace(points, spans=(replace(points.spans[0], u=points.spans[0].u + 2.0),))
    start, warm = start_of(into, moved)
    assert not warm
    np.testing.assert_array_equal(into.unpack(start.w).spans[0].u, 2.0)


def test_points_of_another_mesh_and_what_is_no_guess_are_refused() -> None:
    into = on(unit_move(), 6)
    other = initial_points(on(unit_move(), 7))
    with pytest.raises(ValueError, match=r"guess: expected points of 1 phases, .* shape \(2, 7\)"):
        start_of(into, other)
    with pytest.raises(ValueError, match=r"guess: .* got points of other meshes or models"):
        start_of(into, initial_points(on(there_and_back(), 6)))
    with pytest.raises(ValueError, match="guess: expected values by name, a solution, or points"):
        start_of(into, 5)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"got 'move\.npz'; a file is read by ocp\.load\(path\)"):
        start_of(into, "move.npz")  # type: ignore[arg-type]
