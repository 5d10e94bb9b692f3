import os
import signal
import threading

import casadi as ca
import numpy as np
import pytest
from motions import fastest, least_effort, stage

from ocp import Problem, Progress, Solution, integral, solve
from ocp.ipopt import ANSWERS
from symfric import Model, SolveError, Status, Variable


def test_every_known_answer_has_a_status_and_only_solved_ones_are_ok() -> None:
    good = {answer for answer, status in ANSWERS.items() if status.ok}
    assert good == {"Solve_Succeeded", "Feasible_Point_Found", "Solved_To_Acceptable_Level"}


def test_progress_is_reported_after_every_iteration() -> None:
    seen: list[Progress] = []
    solution = solve(fastest(stage()), progress=seen.append)
    assert [p.iteration for p in seen] == list(range(solution.iterations + 1))
    assert seen[-1].cost == pytest.approx(solution.cost, rel=1e-6)
    assert seen[-1].violation < 1e-6 < seen[0].violation


def test_nothing_is_printed(capfd: pytest.CaptureFixture[str]) -> None:
    solve(least_effort())
    assert capfd.readouterr() == ("", "")


def test_options_reach_ipopt(capfd: pytest.CaptureFixture[str]) -> None:
    solve(least_effort(), options={"print_level": 3})
    assert "Number of Iterations" in capfd.readouterr().out


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"no_such_option": 1}, "No such IPOPT option: no_such_option"),
        ({"max_iter": "many"}, "type mismatch"),
        ({"linear_solver": "nonsense"}, "Invalid options were detected by Ipopt"),
    ],
)
def test_unknown_options_are_refused(options: dict[str, object], reason: str) -> None:
    with pytest.raises(ValueError, match=f"options: expected options of Ipopt, .*; {reason}"):
        solve(least_effort(), options=options)


def test_too_few_iterations_return_the_last_iterate() -> None:
    with pytest.raises(SolveError, match="maximum number of iterations") as error:
        solve(fastest(stage()), options={"max_iter": 5})
    partial = error.value.partial
    assert isinstance(partial, Solution)
    assert error.value.status is partial.status is Status.MAX_ITERATIONS
    assert partial.iterations == 5
    assert np.ptp(partial["v"]) > 1.0
    assert partial.trajectory is None
    assert "Most violated is the equation of" in partial.message


def test_ctrl_c_stops_after_the_iteration_and_keeps_the_iterate() -> None:
    before = signal.getsignal(signal.SIGINT)

    def interrupt(progress: Progress) -> None:
        if progress.iteration == 6:
            os.kill(os.getpid(), signal.SIGINT)

    partial = solve(fastest(stage()), progress=interrupt, throw=False)
    assert partial.status is Status.INTERRUPTED
    assert "Stopped by the user after 6 iterations" in partial.message
    assert np.ptp(partial["v"]) > 1.0
    assert signal.getsignal(signal.SIGINT) is before


def test_exception_in_the_callback_comes_through() -> None:
    def fail(progress: Progress) -> None:
        if progress.iteration == 3:
            raise LookupError("no more")

    with pytest.raises(LookupError, match="no more"):
        solve(fastest(stage()), progress=fail)


def test_solving_works_in_a_thread() -> None:
    found: list[Solution] = []
    thread = threading.Thread(target=lambda: found.append(solve(least_effort())))
    thread.start()
    thread.join()
    assert found[0].ok


def test_not_a_number_is_reported_with_the_start_as_last_iterate(
    capfd: pytest.CaptureFixture[str],
) -> None:
    problem = least_effort(cost=integral(lambda s: ca.log(-1 - s.a**2)))
    partial = solve(problem, throw=False)
    assert partial.status is Status.NOT_FINITE
    assert partial.to_dict()["cost"] is None
    np.testing.assert_allclose(partial["x"], partial.t)
    assert capfd.readouterr() == ("", "")


def test_equation_that_returns_nan_is_named() -> None:
    x, u = Variable("x", "m", start=-1.0), Variable("u", "m/s")
    model = Model("root", x=(x,), u=(u,), ode=ca.sqrt(x.symbol) + u.symbol)
    partial = solve(Problem(model, 1.0, integral(lambda s: s.u**2)), throw=False)
    assert partial.status is Status.NOT_FINITE
    assert "Most violated is the equation of x at t =" in partial.message
