"""Ipopt, Fatrop and Sqp: results, options, limits, stops, and messages about failures."""

import os
import signal
import threading
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
from discretised import dae
from discretised import stage as wide_stage
from motions import stage
from phases import algebraic_move, fastest_move, on, solve_once, there_and_back, unit_move

from ocp.formulation.expressions import at_end, integral
from ocp.formulation.phase import FREE, Free, Phase
from ocp.formulation.problem import Problem
from ocp.solving.methods import ANSWERS, Fatrop, Ipopt, Sqp
from ocp.solving.solution import Solution
from ocp.solving.starts import start_of
from ocp.solving.watch import Progress, in_stage
from ocp.transcription.schemes import Legendre, Radau, Scheme
from symfric import Model, Status, Variable

HARD = fastest_move()
EFFORT = integral(lambda s: s.force**2)
PUSH = Phase(wide_stage(), 1.0, end={"x": 0.1, "v": 0.0}, via={0.5: {"x": (0.06, None)}})
LIMITS = {"force": (-20.0, 20.0), "power": (None, 3.0)}
PUSHED = Problem(PUSH, EFFORT, bounds=LIMITS, path=[lambda s: s.v <= 0.15])
NEAR = integral(lambda s: s.u**2) + at_end(lambda s: (s.x - 1) ** 2)
ALGEBRAIC = Problem(Phase(dae(), 1.0, start={"x": 0.5}), NEAR)
RUBBED = unit_move(model=stage(0.1), cost=EFFORT)
SOLVERS = (Ipopt, Fatrop, Sqp)
UNLIKE = {Ipopt: HARD, Fatrop: PUSHED, Sqp: fastest_move(0.1)}
"""Solver -> a problem that takes it many iterations."""


def hard(solver: Any, progress: Any = None, **options: Any) -> Solution:
    return solve_once(UNLIKE[solver], 20, solver=solver(**options), progress=progress)


# --- solutions ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("N", "scheme"), [(4, Radau(2)), (10, Radau(4)), (5, Legendre(2))])
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
    cost = integral(lambda s: 1 + s.a**2)
    problem = unit_move(model=algebraic_move(), T=Free(0.5, 5.0), cost=cost)
    one, two = (solve_once(problem, 8, solver=solver) for solver in (Sqp(), Ipopt()))
    assert one.ok
    assert pytest.approx(two.T, rel=1e-5) == one.T


def test_multipliers_of_fatrop_satisfy_the_optimality_conditions() -> None:
    transcription = on(PUSHED, 10)
    program = transcription.program
    found = Fatrop().prepared(program).run(start_of(transcription, None)[0]).iterate
    slope = ca.DM(program.gradient(found.w, program.values)[1])
    jacobian = ca.DM(program.jacobian(found.w, program.values)[1])
    residual = slope + jacobian.T @ found.lam_g + found.lam_w
    assert np.abs(residual.full()).max() < 1e-7
    one = solve_once(PUSHED, 10, solver=Fatrop())
    assert solve_once(PUSHED, 10, guess=one).iterations < solve_once(PUSHED, 10).iterations / 2


def test_prepared_solver_runs_with_other_starts_and_parameters() -> None:
    even = on(HARD, 10)
    late = on(HARD, np.linspace(0.0, 1.0, 11) ** 1.2)
    prepared, start = Ipopt().prepared(even.program), start_of(even, None)[0]
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
    own = hard(Ipopt, max_wall_time=1e-6, max_time=1e3)
    assert own.status is Status.TIME_LIMIT
    assert "ended Ipopt" in own.message


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


ONWARDS = Problem(Phase(stage(1e-4), 1.0, start={"v": 1.0}, end={"x": 4.0}), EFFORT,
                  bounds={"v": (0.5, None)})  # fmt: skip


def test_overdetermined_programs_are_reported() -> None:
    partial = solve_once(unit_move(), 1)
    assert partial.status is Status.INFEASIBLE
    assert "There are more equations than unknowns" in partial.message


@pytest.mark.parametrize(
    ("problem", "iterations", "named"),
    [
        (fastest_move(1e-4), 5, True),
        (fastest_move(0.5), 5, False),
        (fastest_move(0.5), 1, False),
        (fastest_move(1e-4), 300, False),  # it is solved
        (ONWARDS, 1, False),  # the contact never reverses
    ],
)
def test_narrow_widths_are_named_where_a_solve_fails(
    problem: Problem, iterations: int, named: bool
) -> None:
    message = solve_once(problem, 10, solver=Ipopt(max_iter=iterations)).message
    text = "Friction is smoothed over a small width: contact 'guide' has v_t = 0.0001 m/s; raise"
    assert (text in message) == named
    assert ("Friction" in message) == named


def test_good_answers_of_ipopt() -> None:
    good = {answer for answer, status in ANSWERS["Ipopt"].items() if status.ok}
    assert good == {"Solve_Succeeded", "Feasible_Point_Found", "Solved_To_Acceptable_Level"}
