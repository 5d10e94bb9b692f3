"""Iterates of solvers: the worst row, places, the best one, cycling, and Hessians of Sqp."""

from collections.abc import Sequence
from functools import cache

import casadi as ca
import numpy as np
import pytest
from phases import fastest_move, there_and_back, unit_move

from ocp.formulation.expressions import at_end, integral
from ocp.formulation.problem import Problem
from ocp.solving.methods import Convexified
from ocp.solving.watch import WINDOW, Seen, Watch, as_fraction, not_finite, worst
from ocp.transcription.program import Place, Program, SolverStatistics, outside, worst_of
from ocp.transcription.schemes import Radau, make_meshes
from ocp.transcription.transcribe import discretise
from symfric import Status


@cache
def bounded(**more: object) -> Program:
    problem = unit_move(bounds={"a": (-8.0, 8.0)}, **more)
    return discretise(problem, Radau()).on(make_meshes(problem, 4)).program


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
    problem = unit_move(cost=cost, end={})
    made = discretise(problem, Radau()).on(make_meshes(problem, 4)).program
    said = not_finite(made, np.zeros(made.w.numel()), made.values, as_fraction)
    assert said.startswith(text) and bool(said) == bool(text)


def test_times_of_places_continue_over_the_phases() -> None:
    problem = there_and_back(scenarios={"dry": {}, "oiled": {}})
    on = discretise(problem, Radau()).on(make_meshes(problem, 4))
    places = {
        (0, 0.25): "at t = 0.25 s in out of scenario dry",
        (1, 0.25): "at t = 1.25 s in back of scenario dry",
        (3, 1.0): "at t = 2 s in back of scenario oiled",
        (2, np.nan): "in out of scenario oiled",
    }
    w = np.zeros(on.program.w.numel())
    assert [on.when(w, Place("v", *at)) for at in places] == list(places.values())


# --- watching an iteration ----------------------------------------------------------------------


def seen(f: float, violation: float) -> Seen:
    none = np.zeros(0)
    return Seen(none, f, none, none, none, violation)


@pytest.mark.parametrize(
    ("better", "worse"),
    [
        ((5.0, 1e-8), (1.0, 1e-3)),
        ((1.0, 1e-7), (5.0, 1e-9)),
        ((5.0, 1e-3), (1.0, 1e-2)),
        ((9.0, 1.0), (np.nan, 1e-9)),
        ((9.0, 1.0), (1.0, np.inf)),
    ],
)
def test_best_is_feasible_with_the_least_cost_or_least_violated(
    better: tuple[float, float], worse: tuple[float, float]
) -> None:
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
    assert watch.best is not None
    assert watch.last is not None
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
    made = discretise(problem, Radau()).on(make_meshes(problem, 4)).program
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
