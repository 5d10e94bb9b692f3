"""Iterates of solvers: starts, places of rows, the best one, cycling, and Hessians of Sqp."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
import pytest
from phases import UNIT, fastest_move, on, solve_once, there_and_back, unit_move

from ocp.formulation.expressions import at_end, integral
from ocp.formulation.phase import FREE, Free, Phase
from ocp.formulation.problem import Problem
from ocp.solving.methods import Convexified
from ocp.solving.motion import span_motions
from ocp.solving.prepared import as_fraction, not_finite, worst
from ocp.solving.solution import Solution
from ocp.solving.starts import Guess, initial_points, resample, start_of
from ocp.solving.watch import WINDOW, Seen, Watch
from ocp.transcription.program import Place, Program, SolverStatistics, outside, worst_of
from ocp.transcription.schemes import Legendre, Radau
from ocp.transcription.transcribe import Transcription
from ocp.transcription.unknowns import SpanPoints
from symfric import Model, Status, simulate

EFFORT = integral(lambda s: s.a**2)


def first(problem: Problem, intervals: int = 10) -> SpanPoints:
    return initial_points(on(problem, intervals)).spans[0]


@cache
def unit(intervals: int) -> Solution:
    return solve_once(unit_move(), intervals)


def carried(into: Transcription, old: Solution) -> SpanPoints:
    spans = span_motions(old.problem, old.scheme, old.meshes, old.points)
    return resample(into, spans, old.chosen).spans[0]


def test_states_run_straight_between_the_ends_and_velocities_follow() -> None:
    into = on(unit_move(T=2.0))
    (span,) = initial_points(into).spans
    np.testing.assert_allclose(span.nodes[0], into.meshes[0])
    np.testing.assert_allclose(span.inner[0], into.inner_fractions(0))
    np.testing.assert_allclose(span.nodes[1], 0.5)  # 1 m in 2 s, although it rests at both ends
    np.testing.assert_array_equal(span.u, 0.0)


def test_states_pass_via_points_and_continue_over_phases() -> None:
    """The middle phase has no conditions: its line goes from the first to the last one."""
    via = unit_move(via={0.25: {"x": 2.0}})
    expected = np.interp(on(via, 8).meshes[0], [0, 0.25, 1], [0, 2, 1])
    np.testing.assert_allclose(first(via, 8).nodes[0], expected)
    chain = Phase(UNIT, 1.0) >> Phase(UNIT, 2.0) >> Phase(UNIT, 1.0, end={"x": 4.0})
    points = initial_points(on(Problem(chain, EFFORT), 4))
    for span, begin in zip(points.spans, (0.0, 1.0, 3.0), strict=True):
        np.testing.assert_allclose(span.nodes[0, [0, -1]], [begin, begin + span.T])
        np.testing.assert_allclose(span.nodes[1], 1.0)
    bounce = Phase(UNIT, 1.0, link={"x": lambda s: 2.0 * s.x + 1.0, "v": None})
    chain = Phase(UNIT, 1.0, end={"x": 3.0}) >> bounce
    before, after = initial_points(on(Problem(chain, EFFORT))).spans
    assert before.nodes[0, -1] == 3.0
    np.testing.assert_allclose(after.nodes, [[7.0] * 11, [0.0] * 11], atol=1e-12)


def test_ranges_are_entered_in_the_middle_or_at_their_finite_end() -> None:
    x = first(unit_move(start={"x": (1.0, 3.0)}, end={"x": (5.0, None), "v": 0.0})).nodes[0]
    assert (x[0], x[-1]) == (2.0, 5.0)
    x = first(unit_move(start={"x": 3.0, "v": FREE}, end={"power": 1.0})).nodes[0]
    np.testing.assert_array_equal(x, 3.0)  # an output alone has no line
    for bounds, middle in (((-1, 3), 0.0), ((1, 3), 2.0), ((2, None), 2.0)):
        np.testing.assert_array_equal(first(unit_move(bounds={"a": bounds})).u, middle)


def test_durations_with_a_fixed_sum_are_stretched_to_it() -> None:
    chain = Phase(UNIT, Free(0.1, 10.0)) >> Phase(UNIT, 1.0) >> Phase(UNIT, Free(0.4, 40.0))
    problem = Problem(chain, EFFORT, durations=(((0, 1, 2), 11.0),))
    durations = [span.T for span in initial_points(on(problem)).spans]
    np.testing.assert_allclose(durations, [2.0, 1.0, 8.0])


@pytest.mark.parametrize("given", [[1.0, 2.0, 3.0], lambda t: 1.0 + t])
def test_guess_is_a_number_samples_or_a_function_of_time(given: Guess) -> None:
    """Over all phases: 2 s."""
    into = on(there_and_back(), 4)
    out, back = initial_points(into, {"v": given}).spans
    assert (out.nodes[1, 0], back.nodes[1, 0], back.nodes[1, -1]) == (1.0, 2.0, 3.0)
    assert (initial_points(into, {"v": 2.0}).spans[1].nodes[1] == 2.0).all()


def test_runs_are_guesses() -> None:
    """x = t^2 within 1.5 s is stretched to a given duration; a free one starts with 1.5 s."""
    fall = Model("fall", x=(UNIT.x[0], UNIT.x[1]), ode=ca.vertcat(UNIT.x[1].symbol, 2.0))
    run = simulate(fall, 1.5, t_eval=np.linspace(0.0, 1.5, 101))
    for T, expected in ((3.0, 3.0), (Free(0.1, 9.0), 1.5), (Free(0.1, 1.0), 1.0)):
        into = on(unit_move(T=T))
        (span,) = initial_points(into, run).spans
        np.testing.assert_equal(span.T, expected)
        np.testing.assert_allclose(span.nodes[0], (1.5 * into.meshes[0]) ** 2, atol=1e-3)
        np.testing.assert_allclose(span.nodes[1], 3.0 * into.meshes[0], atol=1e-6)
    found = solve_once(unit_move(), 5)
    again = initial_points(on(unit_move(), 5), found.motions[0]).spans[0]
    np.testing.assert_allclose(again.nodes, found.points.spans[0].nodes, atol=1e-2)


def test_points_are_a_guess() -> None:
    into = on(unit_move(), 6)
    points = initial_points(into)
    moved = replace(points, spans=(replace(points.spans[0], u=points.spans[0].u + 2.0),))
    start, warm = start_of(into, moved)
    assert not warm
    np.testing.assert_array_equal(into.unpack(start.w).spans[0].u, 2.0)


@pytest.mark.parametrize("degree", [2, 4])
def test_solution_is_carried_to_other_meshes_by_its_polynomials(degree: int) -> None:
    """Those of a double integrator under constant input are exact everywhere."""
    old = unit(5)
    span = carried(on(unit_move(), 10, Radau(degree)), old)
    np.testing.assert_array_equal(span.u[0], np.repeat(old.controls["a"], 2))
    x, v, a = span.nodes[0, :-1], span.nodes[1, :-1], span.u[0]
    np.testing.assert_allclose(span.nodes[0, 1:], x + 0.1 * v + 0.005 * a, atol=1e-12)
    assert solve_once(unit_move(), 10, guess=old).iterations <= 3


def test_solution_is_carried_to_other_phases_and_models_by_name() -> None:
    """With a bounded rate, `a` is a state, and the solution had it as an input."""
    old = solve_once(there_and_back(), 10)
    one = unit_move(T=4.0, end={"x": 0.0, "v": 0.0}, via={0.5: {"x": 1.0}})
    span = carried(on(one, 20), old)
    np.testing.assert_allclose(span.nodes[0], old["x"][::3], atol=1e-12)
    assert span.T == 4.0
    into = on(unit_move(rates={"a": (-100.0, 100.0)}))
    span = carried(into, unit(10))
    names = [v.name for v in into.problem.spans[0].model.x]
    np.testing.assert_array_equal(span.nodes[names.index("a"), :-1], unit(10).controls["a"])
    np.testing.assert_allclose(span.nodes[0], unit(10)["x"][::3], atol=1e-12)
    free = solve_once(unit_move(T=Free(0.5, 2.0), cost=EFFORT), 5)
    assert pytest.approx(2.0) == free.T
    for longest in (3.0, 1.5):
        assert min(free.T, longest) == carried(on(unit_move(T=Free(0.5, longest))), free).T


def test_new_scenarios_start_from_the_motion_of_the_first() -> None:
    names = ("dry", "oiled", "worn")
    two, three = (
        there_and_back(scenarios={name: {} for name in names[:count]}, shared=())
        for count in (2, 3)
    )
    into, points = on(two, 4), initial_points(on(two, 4))
    spans = tuple(replace(span, u=0.0 * span.u + k) for k, span in enumerate(points.spans))
    motions = span_motions(two, Radau(), into.meshes, replace(points, spans=spans))
    found = resample(on(three, 4), motions, {})
    assert [span.u[0, 0] for span in found.spans] == [0.0, 1.0, 2.0, 3.0, 0.0, 1.0]


def test_multipliers_are_used_where_the_program_is_the_same() -> None:
    old = unit(10)
    start, warm = start_of(on(unit_move(), 10), old)
    assert warm
    np.testing.assert_allclose(start.w, old.iterate.w, atol=1e-12)
    np.testing.assert_array_equal(start.lam_g, old.iterate.lam_g)
    bounded = unit_move(path=[lambda s: s.v <= 9.0])
    alike = on(unit_move(), 10, Legendre())  # as many unknowns and rows
    for other in (on(unit_move(), 11), on(bounded, 10), on(unit_move(), 10, Radau(2)), alike):
        start, warm = start_of(other, old)
        assert not warm
        assert not start.lam_g.any()


@cache
def bounded(**more: object) -> Program:
    return on(unit_move(bounds={"a": (-8.0, 8.0)}, **more), 4).program


def test_worst_of_rows_and_bounds_is_named_with_its_time() -> None:
    made = bounded()
    w = np.clip(np.zeros(made.w.numel()), made.lower_w, made.upper_w)
    g = np.zeros(made.g.numel())

    def text() -> str:
        return worst(made, Seen(w, 7.5, g, w, g, worst_of(made, w, g)), as_fraction)

    assert text() == "The best iterate satisfies all constraints, at a cost of 7.5."
    inputs = [k for k, place in enumerate(made.unknowns) if place.name == "a"]
    w[inputs[2]] = 8.5
    assert worst_of(made, w, g) == 0.5
    assert text() == (
        "Most violated is the bound on a at 0.5 of the duration, by 0.5 in scaled units."
    )
    rows = [k for k, place in enumerate(made.rows) if place.name == "the equation of v"]
    g[rows[-1]] = -0.75
    assert text() == (
        "Most violated is the equation of v at 1 of the duration, by 0.75 in scaled units."
    )
    g[5] = np.nan
    assert worst_of(made, w, g) == np.inf
    far = outside(np.array([1.0, 2.0, 3.0]), np.array([2.0, 2.0, -np.inf]), np.full(3, 2.5))
    np.testing.assert_allclose(far, [1.0, 0.0, 0.5])


@pytest.mark.parametrize(
    ("cost", "text"),
    [
        (integral(lambda s: ca.log(s.a)), "It is the cost."),
        (integral(lambda s: s.a**2 + ca.sqrt(s.v)), "It is the derivative of the cost in v at"),
        (at_end(lambda s: ca.sqrt(s.x)), "It is the derivative of the cost in x at 1 of"),
        (integral(lambda s: s.a**2), ""),
    ],
)
def test_what_is_not_finite_is_named(cost: object, text: str) -> None:
    made = on(unit_move(cost=cost, end={}), 4).program
    reported = not_finite(made, np.zeros(made.w.numel()), made.values, as_fraction)
    assert reported.startswith(text) and bool(reported) == bool(text)


def test_times_of_places_continue_over_the_phases() -> None:
    made = on(there_and_back(scenarios={"dry": {}, "oiled": {}}), 4)
    places = {
        (0, 0.25): "at t = 0.25 s in out of scenario dry",
        (1, 0.25): "at t = 1.25 s in back of scenario dry",
        (3, 1.0): "at t = 2 s in back of scenario oiled",
        (2, np.nan): "in out of scenario oiled",
    }
    w = np.zeros(made.program.w.numel())
    assert [made.when(w, Place("v", *at)) for at in places] == list(places.values())


# --- watching an iteration ----------------------------------------------------------------------


def seen(f: float, violation: float) -> Seen:
    none = np.zeros(0)
    return Seen(none, f, none, none, none, violation)


def test_best_is_feasible_with_the_least_cost_or_least_violated() -> None:
    for better, worse in (
        ((5.0, 1e-8), (1.0, 1e-3)),
        ((1.0, 1e-7), (5.0, 1e-9)),
        ((5.0, 1e-3), (1.0, 1e-2)),
        ((9.0, 1.0), (np.nan, 1e-9)),
        ((9.0, 1.0), (1.0, np.inf)),
    ):
        assert seen(*better).better_than(seen(*worse))
        assert not seen(*worse).better_than(seen(*better))
        assert seen(*worse).better_than(None)


def test_watch_keeps_the_best_and_stops_on_request() -> None:
    program = bounded()
    watch = Watch(program, None, None)
    w = np.clip(np.zeros(program.w.numel()), program.lower_w, program.upper_w)
    g = np.zeros(program.g.numel())
    for f, far in ((5.0, 1.0), (3.0, 0.0), (2.0, 0.0), (9.0, 0.0), (1.0, 0.3)):
        assert not watch.see(w, f, np.full_like(g, far), w, g)
    assert watch.best and watch.last
    assert (watch.best.f, watch.last.f, watch.iterations) == (2.0, 1.0, 4)
    watch.halt = Status.INTERRUPTED
    assert watch.see(w, 0.0, g, w, g)
    assert Watch(program, None, 1e-9).see(w, 0.0, g, w, g)


def test_cycling_is_distinguished_from_progress() -> None:
    k = np.arange(2.0 * WINDOW + 5)
    wild, still = 1 + 0.5 * np.sin(k), np.full(k.size, 1.0)

    def cycles(*columns: Sequence[float]) -> bool:
        watch = Watch(bounded(), None, None)
        watch.trace = [*zip(*columns, strict=True)]
        return watch.cycles

    assert cycles(5 + wild, wild, still)
    assert not cycles((5 + wild)[:WINDOW], wild[:WINDOW], still[:WINDOW])
    assert not cycles(5 + wild, wild * 0.9**k, still)
    assert not cycles(5 + wild, wild, 0.8**k)
    assert not cycles(5 - 0.01 * k, 1e-9 * wild, still)
    assert cycles(5 + wild, 1e-9 * wild, still)


def test_statistics_of_solves_add_up() -> None:
    one = SolverStatistics(10, 5, 40, 20, 7, 0.5, 1.0, 0.25)
    two = SolverStatistics(20, 8, 80, 30, 3, 0.25, 2.0, 0.5, solves=2)
    assert one.then(two) == SolverStatistics(20, 8, 80, 30, 10, 0.75, 3.0, 0.75, solves=3)


# --- Hessians of Sqp ----------------------------------------------------------------------------


def hessians(problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    """Return the Hessian of a Lagrangian, and its convexified form, at random unknowns."""
    made = on(problem, 4).program
    random = np.random.default_rng(0)
    w, lam = random.standard_normal(made.w.numel()), random.standard_normal(made.g.numel())
    triangle = ca.DM(made.hessian(w, made.values, 1.0, lam)).full()
    convex = ca.DM(Convexified(made)(w, made.values, 1.0, lam)).full()
    return triangle + np.triu(triangle, 1).T, convex


def test_hessians_of_motions_become_semidefinite_and_convex_ones_stay() -> None:
    """A free duration borders the blocks of all intervals."""
    exact, found = hessians(fastest_move(0.1))
    np.testing.assert_allclose(found, found.T, atol=1e-9)
    assert np.linalg.eigvalsh(exact).min() < -0.1
    assert np.linalg.eigvalsh(found).min() > -1e-9
    assert ((found != 0.0) >= (exact != 0.0)).all()
    exact, found = hessians(unit_move(cost=integral(lambda s: s.a**2 + s.x**2 + s.x * s.a)))
    np.testing.assert_allclose(found, exact, atol=1e-7)
    turned, clipped = hessians(unit_move(cost=integral(lambda s: s.a**2 - s.x**2 + s.v * s.a)))
    values, vectors = np.linalg.eigh(turned)
    np.testing.assert_allclose(clipped, (vectors * np.maximum(values, 0)) @ vectors.T, atol=1e-6)
