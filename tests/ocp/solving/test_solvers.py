"""Ipopt, Fatrop and Sqp: results, options, limits, stops, and messages about failures."""

import os
import signal
import threading
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import pytest
from discretised import dae
from discretised import stage as wide_stage
from motions import stage
from phases import fastest_move, solve_once, there_and_back, unit_move

from ocp.formulation.expressions import at_end, integral
from ocp.formulation.phase import FREE, Free, Phase
from ocp.formulation.problem import Problem
from ocp.solving.methods import ANSWERS, Convexified, Fatrop, Ipopt, Sqp
from ocp.solving.solution import Solution
from ocp.solving.starts import start_of
from ocp.solving.watch import WINDOW, Seen, Watch, as_fraction, not_finite, worst
from ocp.transcription.program import (
    Place,
    Program,
    Progress,
    SolverStatistics,
    in_stage,
    outside,
    worst_of,
)
from ocp.transcription.schemes import Legendre, Radau, Scheme, make_meshes
from ocp.transcription.transcribe import discretise
from symfric import Model, Status, Variable

HARD = fastest_move()
EFFORT = integral(lambda s: s.force**2)
PUSHED = Problem(
    Phase(wide_stage(), 1.0, end={"x": 0.1, "v": 0.0}, via={0.5: {"x": (0.06, None)}}),
    EFFORT,
    bounds={"force": (-20.0, 20.0), "power": (None, 3.0)},
    path=[lambda s: s.v <= 0.15],
)
ALGEBRAIC = Problem(
    Phase(dae(), 1.0, start={"x": 0.5}),
    integral(lambda s: s.u**2) + at_end(lambda s: (s.x - 1) ** 2),
)
RUBBED = unit_move(model=stage(0.1), cost=EFFORT)
SOLVERS = (Ipopt, Fatrop, Sqp)
UNLIKE = {Ipopt: HARD, Fatrop: PUSHED, Sqp: fastest_move(0.1)}
"""Solver -> a problem that takes it many iterations."""


def hard(solver: Any, progress: Any = None, **options: Any) -> Solution:
    return solve_once(UNLIKE[solver], 20, solver=solver(**options), progress=progress)


# --- solutions ----------------------------------------------------------------------------------


@pytest.mark.parametrize("N", [4, 10])
@pytest.mark.parametrize("scheme", [Radau(2), Radau(4), Legendre(2)], ids=str)
def test_unit_move_has_the_cost_of_held_inputs(N: int, scheme: Scheme) -> None:
    """All schemes are exact for a double integrator under constant input."""
    solution = solve_once(unit_move(), N, scheme)
    assert solution.cost == pytest.approx(12 * N**2 / (N**2 - 1), rel=1e-8)
    assert solution.message == "ocp 'double integrator': " + solution.status.value


@pytest.mark.parametrize(
    ("solver", "problem"),
    [(Fatrop(), PUSHED), (Fatrop(), ALGEBRAIC), (Fatrop(), there_and_back()), (Sqp(), RUBBED)],
)
def test_solvers_agree_with_ipopt(
    solver: Any, problem: Problem, capfd: pytest.CaptureFixture[str]
) -> None:
    two = solve_once(problem, 20)
    one = solve_once(problem, 20, solver=solver, guess=two)  # there may be other minima
    assert one.ok
    assert one.cost == pytest.approx(two.cost, rel=1e-6)
    for name, values in two.states.items():
        np.testing.assert_allclose(one[name], values, atol=1e-5)
    assert capfd.readouterr() == ("", "")


def test_free_durations_scenarios_and_algebraic_variables() -> None:
    quick = solve_once(unit_move(T=Free(0.5, 2.0), bounds={"a": (-16.0, 16.0)}), 20)
    assert pytest.approx(2.0) == quick.T
    start = {"x": (-0.5, 0.0), "v": FREE}
    several = solve_once(unit_move(start=start, scenarios={"a": {}, "b": {}}, shared=["a"]), 10)
    assert list(several.scenarios) == ["a", "b"]
    np.testing.assert_allclose(several.scenarios["a"]["a"], several.scenarios["b"]["a"])
    x, v, z = Variable("x", "m"), Variable("v", "m/s"), Variable("z", "m/s")
    a = Variable("a", "m/s^2")
    ode, alg = ca.vertcat(z.symbol, a.symbol), z.symbol - v.symbol
    model = Model("dae", x=(x, v), z=(z,), u=(a,), ode=ode, alg=alg)
    problem = unit_move(model=model, T=Free(0.5, 5.0), cost=integral(lambda s: 1 + s.a**2))
    one, two = (solve_once(problem, 8, solver=solver) for solver in (Sqp(), Ipopt()))
    assert one.ok
    assert pytest.approx(two.T, rel=1e-5) == one.T


def test_multipliers_of_fatrop_satisfy_the_optimality_conditions() -> None:
    transcription = discretise(PUSHED, Radau()).on(make_meshes(PUSHED, 10))
    program = transcription.program
    found = Fatrop().prepared(program).run(start_of(transcription, None)[0]).iterate
    slope = ca.DM(program.gradient(found.w, program.values)[1])
    jacobian = ca.DM(program.jacobian(found.w, program.values)[1])
    residual = slope + jacobian.T @ found.lam_g + found.lam_w
    assert np.abs(residual.full()).max() < 1e-7
    one = solve_once(PUSHED, 10, solver=Fatrop())
    assert solve_once(PUSHED, 10, guess=one).iterations < solve_once(PUSHED, 10).iterations / 2


def test_prepared_solver_runs_with_other_starts_and_parameters() -> None:
    on = discretise(HARD, Radau()).on([np.linspace(0.0, 1.0, 11)])
    late = discretise(HARD, Radau()).on([np.linspace(0.0, 1.0, 11) ** 1.2])
    prepared, start = Ipopt().prepared(on.program), start_of(on, None)[0]
    first = prepared.run(start)
    warm = prepared.run(first.iterate, warm=True)
    cold = prepared.run(first.iterate)
    counts = [one.statistics.iterations for one in (warm, cold, first)]
    assert counts[0] < min(counts[1], counts[2] / 2)
    other = prepared.run(start_of(late, None)[0], late.program.values)
    direct = Ipopt().prepared(late.program).run(start_of(late, None)[0])
    assert other.cost == pytest.approx(direct.cost)
    assert other.cost != first.cost


# --- options ------------------------------------------------------------------------------------


def test_options_reach_the_solver(capfd: pytest.CaptureFixture[str]) -> None:
    solver = Ipopt(max_iter=7).with_options(print_level=3)
    assert dict(solver.options) == {"max_iter": 7, "print_level": 3}
    solve_once(unit_move(), 5, solver=solver)
    assert "Number of Iterations" in capfd.readouterr().out
    flags = Ipopt(check_derivatives_for_naninf=True, honor_original_bounds=False)
    assert list(flags.options.values()) == ["yes", "no"]
    assert solve_once(unit_move(), 5, solver=flags).ok
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Ipopt(no_such_option=1), "Ipopt: .* got {'no_such_option': 1}; No such IPOPT opt"),
        (lambda: Ipopt(max_iter="many"), "Ipopt: expected options of Ipopt, .*type mismatch"),
        (lambda: Ipopt(linear_solver="nonsense"), "Invalid options were detected by Ipopt"),
        (lambda: Ipopt(linear_solver="ma57"), "they do not go together, or need a missing library"),
        (lambda: Ipopt(max_iter=None), "Ipopt: .*max_iter"),
        (lambda: Ipopt(max_time=-1.0), "Ipopt: .*max_time"),
        (lambda: Fatrop(no_such_option=1), "Fatrop: expected options of Fatrop, .*: no_such"),
        (lambda: Fatrop(max_iter="many"), "Fatrop: option max_iter: expected a finite number"),
        (lambda: Sqp(no_such_option=1), r"Sqp: expected options of Sqp, got \{.*\}; "),
        (lambda: Sqp(qpsol="nonsense"), r"Sqp: expected options of Sqp, got \{.*\}; "),
        (lambda: Sqp(max_iter="many"), r"Sqp: expected options of Sqp, got \{.*\}; "),
    ],
)
def test_bad_options_are_refused(
    make: Callable[[], Any], message: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(ValueError, match=message):
        solve_once(unit_move(), 3, solver=make())
    capfd.readouterr()


def test_programs_without_stages_are_refused_by_fatrop() -> None:
    text = r"Fatrop: .* stages, got one with a free duration; use Ipopt\(\)"
    with pytest.raises(ValueError, match=text):
        solve_once(unit_move(T=Free(0.5, 2.0)), 5, solver=Fatrop())
    good = {answer for answer, status in ANSWERS["Ipopt"].items() if status.ok}
    assert good == {"Solve_Succeeded", "Feasible_Point_Found", "Solved_To_Acceptable_Level"}


# --- progress, limits and stops -----------------------------------------------------------------


@pytest.mark.parametrize("solver", SOLVERS)
def test_progress_is_reported_after_every_iteration(solver: Any) -> None:
    seen: list[Progress] = []
    solution = hard(solver, in_stage(seen.append, "widths 0.1"), max_iter=8)
    assert [p.iteration for p in seen] == list(range(solution.iterations + 1))
    assert {p.stage for p in seen} == {"widths 0.1"}
    assert solution.status is Status.MAX_ITERATIONS
    assert f"({solver.__name__} after " in solution.message
    assert " iterations: Maximum_Iterations_Exceeded.)" in solution.message
    assert "Most violated is " in solution.message
    assert solution.cost in [p.cost for p in seen]


@pytest.mark.parametrize("solver", SOLVERS)
def test_time_limits_are_reported(solver: Any) -> None:
    late = hard(solver, max_time=1e-6)
    assert late.status is Status.TIME_LIMIT
    assert f"The time limit of 1e-06 s ended {solver.__name__} after 0 iterations" in late.message


def test_time_limit_of_ipopt_itself_is_one() -> None:
    assert hard(Ipopt, max_time=1e3).ok
    own = hard(Ipopt, max_wall_time=1e-6)
    assert own.status is Status.TIME_LIMIT
    assert "The time limit ended Ipopt" in own.message


def fail(progress: Progress) -> None:
    if progress.iteration == 3:
        raise LookupError("no more")


def interrupt(progress: Progress) -> None:
    if progress.iteration == 3:
        os.kill(os.getpid(), signal.SIGINT)


@pytest.mark.parametrize("solver", [Ipopt, Fatrop])
@pytest.mark.parametrize(
    ("stop", "text"),
    [
        (interrupt, "Stopped by the user after 3 iterations"),
        (fail, "Stopped by an exception in progress after 3 iterations: LookupError('no more')"),
    ],
)
def test_stop_after_an_iteration_keeps_the_best_iterate(
    solver: Any, stop: Callable[[Progress], None], text: str
) -> None:
    before, seen = signal.getsignal(signal.SIGINT), list[Progress]()

    def progress(now: Progress) -> None:
        seen.append(now)
        stop(now)

    partial = hard(solver, progress)
    assert partial.status is Status.INTERRUPTED
    assert text in partial.message
    assert isinstance(partial.cause, LookupError) == (stop is fail)
    assert partial.cost == min(seen[:4], key=lambda p: p.violation).cost
    assert signal.getsignal(signal.SIGINT) is before


def test_exit_in_progress_passes_and_threads_solve() -> None:
    def leave(progress: Progress) -> None:
        raise SystemExit(progress.iteration)

    with pytest.raises(SystemExit):
        hard(Ipopt, leave)
    found: list[Solution] = []
    thread = threading.Thread(target=lambda: found.append(solve_once(unit_move(), 5)))
    thread.start()
    thread.join()
    assert found[0].cost == pytest.approx(12.5)


# --- failures -----------------------------------------------------------------------------------


def rooted(start: float) -> Problem:
    x, u = Variable("x", "m", start=start), Variable("u", "m/s")
    model = Model("root", x=(x,), u=(u,), ode=ca.sqrt(x.symbol) + u.symbol)
    return Problem(Phase(model, 1.0), integral(lambda s: s.u**2))


LOG = unit_move(cost=integral(lambda s: ca.log(-1 - s.a**2)))
WEAK = unit_move(bounds={"a": (-1.0, 1.0)})


@pytest.mark.parametrize(
    ("problem", "solver", "status", "text"),
    [
        (LOG, Ipopt(), "NOT_FINITE", "It is the cost."),
        (LOG, Fatrop(max_iter=5), "NOT_FINITE", "It is the cost."),
        (rooted(-1.0), Ipopt(), "NOT_FINITE", "It is the equation of x at t = 0.0"),
        (rooted(0.0), Ipopt(), "NOT_FINITE", "It is the derivative of the equation of x in x at"),
        (WEAK, Ipopt(), "INFEASIBLE", "No point satisfies all constraints"),
        (WEAK, Fatrop(), "INFEASIBLE", "Most violated is"),
        (unit_move(cost=integral(lambda s: -s.x), end={}), Ipopt(), "UNBOUNDED", "grow without"),
        (unit_move(cost=integral(lambda s: 1 / s.x)), Ipopt(), "UNBOUNDED", "grow without bound"),
    ],
)
def test_failures_are_explained(
    problem: Problem, solver: Any, status: str, text: str, capfd: pytest.CaptureFixture[str]
) -> None:
    partial = solve_once(problem, 50 if status == "UNBOUNDED" else 5, solver=solver)
    assert partial.status.name == status
    assert text in partial.message
    assert partial.iterations < 100
    assert isinstance(solver, Fatrop) or capfd.readouterr() == ("", "")
    if problem is LOG and isinstance(solver, Ipopt):
        assert partial.to_dict()["cost"] is None
        np.testing.assert_allclose(partial["x"], partial.t)  # the start


def test_overdetermined_programs_are_reported() -> None:
    partial = solve_once(unit_move(), 1)
    assert partial.status is Status.INFEASIBLE
    assert "There are more equations than unknowns" in partial.message


@pytest.mark.parametrize(
    ("problem", "iterations", "named"),
    [
        (fastest_move(1e-4), 5, True),
        (fastest_move(0.5), 5, False),
        (fastest_move(1e-4), 300, False),  # it is solved
        (
            Problem(
                Phase(stage(1e-4), 1.0, start={"v": 1.0}, end={"x": 4.0}),
                EFFORT,
                bounds={"v": (0.5, None)},
            ),
            1,
            False,  # the contact never reverses
        ),
    ],
)
def test_narrow_widths_are_named_where_a_solve_fails(
    problem: Problem, iterations: int, named: bool
) -> None:
    message = solve_once(problem, 10, solver=Ipopt(max_iter=iterations)).message
    text = "Friction is smoothed over a small width: contact 'guide' has v_t = 0.0001 m/s; raise"
    assert (text in message) == named
    assert ("Friction" in message) == named


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


def convex(cost: ca.SX, w: ca.SX, fractions: list[float], at: np.ndarray) -> np.ndarray:
    """Return the convexified Hessian of an unconstrained cost."""
    p, g, n = ca.SX(0, 1), ca.SX(0, 1), w.numel()
    lam_f, lam_g = ca.SX.sym("lam_f"), ca.SX.sym("lam_g", 0)
    x, f = ca.MX.sym("x", n), ca.Function("f", [w], [cost])
    points, both = ["x", "p"], ["x", "p", "lam_f", "lam_g"]
    gradient = [cost, ca.gradient(cost, w)]
    triangle = ca.triu(ca.hessian(lam_f * cost, w)[0])
    none = np.zeros(0)
    places = [Place(f"w_{k}", 0, s) for k, s in enumerate(fractions)]
    made = Program(
        x, ca.MX(0, 1), f(x), ca.MX(0, 1),
        ca.Function("nlp_grad_f", [w, p], gradient, points, ["f", "grad_f_x"]),
        ca.Function("nlp_jac_g", [w, p], [g, ca.SX(0, n)], points, ["g", "jac_g_x"]),
        ca.Function("nlp_hess_l", [w, p, lam_f, lam_g], [triangle], both, ["triu_hess_gamma_x_x"]),
        np.full(n, -np.inf), np.full(n, np.inf), none, none, none, np.ones(n),
        places=lambda: ([], places),
    )  # fmt: skip
    return ca.DM(Convexified(made)(at, [], 1.0, [])).full()


def test_negative_eigenvalues_vanish_block_by_block() -> None:
    """Unknowns of the whole phase border every block: [[A_1, b_1], [b_1', c]] + ..."""
    w = ca.SX.sym("w", 5)
    cost = w[0] * w[3] - 2 * w[1] ** 2 + w[2] ** 2
    expected = np.diag([0.5, 0.0, 2.0, 0.5, 0.0])
    expected[0, 3] = expected[3, 0] = 0.5
    np.testing.assert_allclose(convex(cost, w, [0.0] * 5, np.zeros(5)), expected, atol=1e-7)
    bordered = [0.0] * 4 + [np.nan]
    good = ca.sumsqr(w) + 0.5 * w[4] * ca.sum1(w[:4]) + 0.1 * w[0] * w[1]
    whole = ca.DM(ca.hessian(good, w)[0]).full()
    np.testing.assert_allclose(convex(good, w, bordered, np.ones(5)), whole, atol=1e-7)
    bad = w[4] * ca.sumsqr(w[:4]) - w[4] ** 2 - w[0] * w[1]
    found = convex(bad, w, bordered, np.arange(5.0) - 3)
    assert np.linalg.eigvalsh(found).min() > -1e-12
    assert found[2, 3] == 0.0


def test_hessians_of_motions_become_semidefinite() -> None:
    problem = fastest_move(0.1)
    made = discretise(problem, Radau()).on(make_meshes(problem, 4)).program
    random = np.random.default_rng(0)
    w, lam = random.standard_normal(made.w.numel()), random.standard_normal(made.g.numel())
    triangle = ca.DM(made.hessian(w, made.values, 1.0, lam)).full()
    exact = triangle + np.triu(triangle, 1).T
    found = ca.DM(Convexified(made)(w, made.values, 1.0, lam)).full()
    np.testing.assert_allclose(found, found.T, atol=1e-9)
    assert np.linalg.eigvalsh(exact).min() < -0.1
    assert np.linalg.eigvalsh(found).min() > -1e-9
