"""Solves from several starts on executors, callbacks with iterates, and the live plot."""

from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from phases import unit_move

from ocp import LivePlot, Phase, Problem, Progress, at_end, integral, load, solve
from ocp.formulation.expressions import Cost
from ocp.problems import out_and_back
from symfric import BrownMcPhee, Model, SolveError, Status, Variable
from symfric.scenes import drive

EFFORT = integral(lambda s: s.force**2)


def hill() -> Problem:
    """A point that passes a hill to the left or, at less cost, to the right."""
    x, y = Variable("x", "m"), Variable("y", "m")
    u, v = Variable("u", "m/s"), Variable("v", "m/s")
    model = Model("walk", x=(x, y), u=(u, v), ode=ca.vertcat(u.symbol, v.symbol))
    steep = integral(lambda s: s.u**2 + s.v**2 + 20.0 * ca.exp(-20 * ((s.x - 1) ** 2 + s.y**2)))
    ends = {"start": {"x": 0.0, "y": 0.05}, "end": {"x": 2.0, "y": 0.0}}
    return Problem(Phase(model, 1.0, **ends), steep + integral(lambda s: 0.5 * s.y))


def test_starts_find_the_better_of_two_optima() -> None:
    one, many = (solve(hill(), starts=n, intervals=20) for n in (None, 8))
    assert many.cost < one.cost - 0.01
    assert one["y"].max() > 0.1 and many["y"].min() < -0.1
    assert many.statistics.solves >= 8
    assert "The best of 8 starts is continued: " in many.message


REST = {"x": 0.0, "v": 0.0}
PUSH = {"end": {}, "start": REST, "bounds": {"a": (-1.0, 1.0)}}
"""Motions from rest with |a| <= 1, whose costs fall in both directions."""


@pytest.mark.parametrize(
    ("cost", "best"),
    [
        (at_end(lambda s: -(s.x**2)), -1.0 / 4.0),
        (integral(lambda s: -(s.v**2)), -1.0 / 3.0),
        (at_end(lambda s: -s.x * s.v), -1.0 / 2.0),
    ],
)
def test_rest_at_the_largest_cost_is_no_solution(cost: Cost, best: float) -> None:
    found = solve(unit_move(cost=cost, **PUSH))
    assert found.cost == pytest.approx(best, rel=1e-4)
    assert "another one costs less" in found.message


def test_rest_at_the_least_cost_is_the_solution() -> None:
    found = solve(unit_move(cost=integral(lambda s: s.x**2 + s.v**2), **PUSH))
    assert found.cost == pytest.approx(0.0, abs=1e-9)
    assert "another" not in found.message


def test_start_at_a_saddle_of_an_unbounded_problem() -> None:
    with pytest.raises(SolveError) as caught:
        solve(unit_move(cost=integral(lambda s: s.x * s.a), end={}, start=REST))
    assert caught.value.status is Status.UNBOUNDED
    assert not caught.value.partial.verified


@pytest.mark.slow
@pytest.mark.parametrize("problem", [hill, out_and_back])
def test_executors_give_the_same_bits(problem: Any) -> None:
    alone = solve(problem(), starts=4, intervals=20)
    for kind in (ThreadPoolExecutor, ProcessPoolExecutor):
        with kind(2) as executor:
            found = solve(problem(), starts=4, intervals=20, executor=executor)
        np.testing.assert_array_equal(found.iterate.w, alone.iterate.w)
        assert found.statistics.iterations == alone.statistics.iterations
        assert found.message == alone.message


class Interrupted(Executor):
    """Executor whose second result is an interruption by the user."""

    def __init__(self) -> None:
        self.calls = 0

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.calls += 1
        if self.calls == 2:
            future.set_exception(KeyboardInterrupt())
        else:
            future.set_result(fn(*args, **kwargs))
        return future


def test_interruption_of_starts_keeps_the_best() -> None:
    found = solve(hill(), starts=4, intervals=20, executor=Interrupted(), throw=False)
    assert found.status is Status.INTERRUPTED
    assert "Stopped by the user after 1 of 4 starts; the result is the best" in found.message
    assert np.isfinite(found["y"]).all()


@pytest.mark.slow
def test_solutions_by_modes_are_resumed(tmp_path: Path) -> None:
    """From a neighbouring problem, the optimum of six starts or a better one needs none of them."""

    def move(m: float = 1.0, T: float = 1.4, mu_d: float = 4.0) -> Problem:
        stage = drive(BrownMcPhee(mu_s=6.0, mu_d=mu_d, mu_v=0.5, v_t=1e-5), m=m, N=1.0)
        rest = {"x": 0.0, "v": 0.0}
        phase = Phase(stage, T, start=rest, end=rest | {"x": 0.1})
        return Problem(phase, EFFORT, bounds={"force": (-50.0, 50.0)})

    solve(move()).save(tmp_path / "move.npz")
    guess = load(tmp_path / "move.npz")
    for problem in (move(m=2.0), move(T=1.0)):
        seen: list[Progress] = []
        cold, warm = solve(problem), solve(problem, guess=guess, progress=seen.append)
        assert warm.verified
        assert warm.cost <= cold.cost * (1 + 1e-4)
        assert not any(now.stage.startswith("start") for now in seen)


def test_executor_and_starts_are_checked() -> None:
    with pytest.raises(ValueError, match="solve: executor: expected an executor of concurrent"):
        solve(hill(), executor="processes")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="solve: starts: expected"):
        solve(hill(), starts=0)


def test_progress_has_the_motion_of_the_iterate() -> None:
    seen: list[Progress] = []
    found = solve(unit_move(), intervals=8, progress=seen.append)
    np.testing.assert_allclose(seen[-1].motion["x"], found["x"], atol=1e-6)
    assert seen[0].violation > seen[-1].violation
    with ThreadPoolExecutor(1) as executor:
        solve(hill(), starts=3, intervals=20, executor=executor, progress=seen.append)
    assert {p.stage for p in seen} >= {"start 1", "start 2", "start 3"}
    assert all(p.motion["y"].size for p in seen if p.stage.startswith("start"))


def test_live_plot_shows_the_last_iterate() -> None:
    live = LivePlot("x", "a", every=0.0)
    found = solve(unit_move(), intervals=8, progress=live)
    x, a = live.figure.axes
    np.testing.assert_allclose(x.lines[0].get_ydata(), found["x"], atol=1e-6)
    assert (len(x.lines), len(a.lines)) == (1, 1)
    assert "violation" in x.get_title()
    with pytest.raises(SolveError, match=r"expected one of .* got nothing"):
        solve(unit_move(), progress=LivePlot("nothing"))
