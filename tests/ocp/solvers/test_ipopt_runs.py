import os
import signal
import threading
from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from phases import fastest_move, unit_move

from ocp.formulation.expressions import Signals, integral
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.solving.methods import ANSWERS, Ipopt
from ocp.solving.one_solve import solve_once
from ocp.solving.solution import Solution
from ocp.transcription.program import Progress, in_stage
from symfric import Model, Status, Variable

HARD = fastest_move()


def test_only_solved_answers_are_ok() -> None:
    good = {answer for answer, status in ANSWERS["Ipopt"].items() if status.ok}
    assert good == {"Solve_Succeeded", "Feasible_Point_Found", "Solved_To_Acceptable_Level"}


def test_progress_is_reported_after_every_iteration_with_its_stage() -> None:
    seen: list[Progress] = []
    solution = solve_once(HARD, progress=in_stage(seen.append, "widths 0.1"))
    assert [p.iteration for p in seen] == list(range(solution.iterations + 1))
    assert seen[-1].cost == pytest.approx(solution.cost, rel=1e-6)
    assert seen[-1].violation < 1e-6 < seen[0].violation
    assert {p.stage for p in seen} == {"widths 0.1"}
    assert in_stage(None, "widths 0.1") is None


def test_nothing_is_printed(capfd: pytest.CaptureFixture[str]) -> None:
    solve_once(unit_move())
    assert capfd.readouterr() == ("", "")


def test_options_reach_ipopt(capfd: pytest.CaptureFixture[str]) -> None:
    solver = Ipopt(max_iter=7).with_options(print_level=3)
    assert dict(solver.options) == {"max_iter": 7, "print_level": 3}
    solve_once(unit_move(), solver=solver)
    assert "Number of Iterations" in capfd.readouterr().out


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"no_such_option": 1}, "{'no_such_option': 1}; No such IPOPT option: no_such_option"),
        ({"max_iter": "many"}, "type mismatch"),
        ({"linear_solver": "nonsense"}, "Invalid options were detected by Ipopt"),
        ({"linear_solver": "ma57"}, "they do not go together, or need a missing library"),
    ],
)
def test_unknown_options_are_refused(
    options: dict[str, str | int], reason: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(ValueError, match=f"Ipopt: expected options of Ipopt, got .*{reason}"):
        solve_once(unit_move(), 3, solver=Ipopt(**options))
    capfd.readouterr()


@pytest.mark.parametrize(("name", "value"), [("max_iter", None), ("max_time", -1.0)])
def test_values_that_are_none_are_refused(name: str, value: object) -> None:
    with pytest.raises(ValueError, match=f"Ipopt: .*{name}"):
        Ipopt(**{name: value})


def test_too_few_iterations_return_the_best_iterate() -> None:
    partial = solve_once(HARD, solver=Ipopt(max_iter=5))
    assert partial.status is Status.MAX_ITERATIONS
    assert partial.iterations == 5
    assert np.ptp(partial["v"]) > 1.0
    assert "Ipopt after 5 iterations: Maximum_Iterations_Exceeded" in partial.message
    assert "Most violated is the equation of v at t = 0." in partial.message


def test_a_time_limit_says_that_it_is_one() -> None:
    partial = solve_once(HARD, solver=Ipopt(max_time=1e-6))
    assert partial.status is Status.TIME_LIMIT
    assert "The time limit of 1e-06 s ended Ipopt after 0 iterations" in partial.message
    assert solve_once(HARD, solver=Ipopt(max_time=1e3)).ok
    own = solve_once(HARD, solver=Ipopt(max_wall_time=1e-6))
    assert own.status is Status.TIME_LIMIT
    assert "The time limit ended Ipopt" in own.message


def test_ctrl_c_stops_after_the_iteration_and_keeps_the_best_iterate() -> None:
    before = signal.getsignal(signal.SIGINT)
    seen: list[Progress] = []

    def interrupt(progress: Progress) -> None:
        seen.append(progress)
        if progress.iteration == 6:
            os.kill(os.getpid(), signal.SIGINT)

    partial = solve_once(HARD, progress=interrupt)
    assert partial.status is Status.INTERRUPTED
    assert "Stopped by the user after 6 iterations" in partial.message
    best = min(seen, key=lambda p: p.violation)
    assert partial.cost == best.cost
    assert best is not seen[-1]
    assert signal.getsignal(signal.SIGINT) is before
    solve_once(unit_move(), 5)
    assert signal.getsignal(signal.SIGINT) is before


def test_an_exception_in_progress_keeps_the_best_iterate() -> None:
    def fail(progress: Progress) -> None:
        if progress.iteration == 3:
            raise LookupError("no more")

    partial = solve_once(HARD, progress=fail)
    assert partial.status is Status.INTERRUPTED
    assert "exception in progress after 3 iterations: LookupError('no more')" in partial.message
    assert isinstance(partial.cause, LookupError)

    def leave(progress: Progress) -> None:
        raise SystemExit(progress.iteration)

    with pytest.raises(SystemExit):
        solve_once(HARD, progress=leave)


def test_solving_works_in_a_thread() -> None:
    found: list[Solution] = []
    thread = threading.Thread(target=lambda: found.append(solve_once(unit_move(), 5)))
    thread.start()
    thread.join()
    assert found[0].cost == pytest.approx(12.5)


def test_a_cost_that_is_not_a_number_leaves_the_start(capfd: pytest.CaptureFixture[str]) -> None:
    partial = solve_once(unit_move(cost=integral(lambda s: ca.log(-1 - s.a**2))))
    assert partial.status is Status.NOT_FINITE
    assert partial.message.endswith("It is the cost.")
    assert partial.to_dict()["cost"] is None
    np.testing.assert_allclose(partial["x"], partial.t)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("slope", "start", "said"),
    [
        (lambda x, u: ca.sqrt(x) + u, -1.0, "It is the equation of x at t = 0.00"),
        (lambda x, u: ca.sqrt(x) + u, 0.0, "It is the derivative of the equation of x in x at"),
    ],
)
def test_equation_that_returns_nan_is_named(slope: object, start: float, said: str) -> None:
    x, u = Variable("x", "m", start=start), Variable("u", "m/s")
    model = Model("root", x=(x,), u=(u,), ode=slope(x.symbol, u.symbol))  # type: ignore[operator]
    partial = solve_once(Problem(Phase(model, 1.0), integral(lambda s: s.u**2)))
    assert partial.status is Status.NOT_FINITE
    assert said in partial.message


def test_what_cannot_be_reached_is_infeasible_and_named() -> None:
    partial = solve_once(unit_move(bounds={"a": (-1.0, 1.0)}), 10)
    assert partial.status is Status.INFEASIBLE
    assert "No point satisfies all constraints" in partial.message
    assert "Most violated is " in partial.message


def test_more_equations_than_unknowns_are_told() -> None:
    partial = solve_once(unit_move(), 1)
    assert not partial.ok
    assert "There are more equations than unknowns" in partial.message


@pytest.mark.parametrize(("cost", "more"), [(lambda s: -s.x, {"end": {}}), (lambda s: 1 / s.x, {})])
def test_unknowns_that_grow_without_end_are_told(
    cost: Callable[[Signals], ca.SX], more: dict[str, dict[str, float]]
) -> None:
    """The first cost has no bound, the second falls to zero far away."""
    partial = solve_once(unit_move(cost=integral(cost), **more), 50)
    assert partial.status is Status.UNBOUNDED
    assert "The unknowns grow without bound" in partial.message
    assert "cost falls without bound" not in partial.message
    assert partial.iterations < 100


def test_true_and_false_are_its_yes_and_no() -> None:
    solver = Ipopt(check_derivatives_for_naninf=True, honor_original_bounds=False)
    assert dict(solver.options) == {
        "check_derivatives_for_naninf": "yes",
        "honor_original_bounds": "no",
    }
    assert solve_once(unit_move(), 5, solver=solver).ok
