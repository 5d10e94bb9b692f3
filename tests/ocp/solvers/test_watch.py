import numpy as np
import pytest
from phases import unit_move

from ocp.solving.watch import WINDOW, Halt, Seen, Watch, goes_round
from ocp.transcription.program import Program, SolverStatistics, outside, worst_of
from ocp.transcription.schemes import Radau, make_meshes
from ocp.transcription.transcribe import discretise


@pytest.fixture(scope="module")
def program() -> Program:
    problem = unit_move(bounds={"a": (-8.0, 8.0)})
    return discretise(problem, Radau()).on(make_meshes(problem, 4)).program


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
def test_feasible_comes_first_then_the_cost_else_the_violation(
    better: tuple[float, float], worse: tuple[float, float]
) -> None:
    assert seen(*better).better_than(seen(*worse))
    assert not seen(*worse).better_than(seen(*better))
    assert seen(*worse).better_than(None)


def test_violations_count_bounds_and_what_is_no_number(program: Program) -> None:
    w, g = np.zeros(program.w.numel()), np.zeros(program.g.numel())
    inside = np.clip(w, program.lower_w, program.upper_w)
    assert worst_of(program, inside, g) == 0.0
    bounded = int(np.argmax(np.isfinite(program.upper_w) & (program.lower_w < 0)))
    inside[bounded] = program.upper_w[bounded] + 0.25
    assert worst_of(program, inside, g) == pytest.approx(0.25)
    g[3] = -0.5
    assert worst_of(program, inside, g) == 0.5
    g[5] = np.nan
    assert worst_of(program, inside, g) == np.inf
    far = outside(np.array([1.0, 2.0, 3.0]), np.array([2.0, 2.0, -np.inf]), np.full(3, 2.5))
    np.testing.assert_allclose(far, [1.0, 0.0, 0.5])


def test_a_watch_keeps_the_best_and_stops_when_told(program: Program) -> None:
    watch = Watch(program, None, None)
    w, g = (
        np.clip(np.zeros(program.w.numel()), program.lower_w, program.upper_w),
        np.zeros(program.g.numel()),
    )
    for f, far in ((5.0, 1.0), (3.0, 0.0), (2.0, 0.0), (9.0, 0.0), (1.0, 0.3)):
        assert not watch.see(w, f, np.full_like(g, far), w, g)
    assert watch.best is not None
    assert watch.last is not None
    assert (watch.best.f, watch.last.f, watch.iterations) == (2.0, 1.0, 4)
    watch.halt = Halt.USER
    assert watch.see(w, 0.0, g, w, g)
    assert Watch(program, None, 1e-9).see(w, 0.0, g, w, g)


def trace(costs: list[float], violations: list[float], steps: list[float]) -> bool:
    return goes_round(list(zip(costs, violations, steps, strict=True)))


def test_going_round_is_told_from_getting_somewhere() -> None:
    k = np.arange(2.0 * WINDOW + 5)
    wild = 1 + 0.5 * np.sin(k)
    still = np.full(k.size, 1.0)
    assert trace(list(5 + wild), list(wild), list(still))
    assert not trace(list(5 + wild)[:WINDOW], list(wild)[:WINDOW], list(still)[:WINDOW])
    assert not trace(list(5 + wild), list(wild * 0.9**k), list(still))
    assert not trace(list(5 + wild), list(wild), list(0.8**k))
    assert not trace(list(5 - 0.01 * k), list(1e-9 * wild), list(still))
    assert trace(list(5 + wild), list(1e-9 * wild), list(still))


def test_statistics_of_solves_in_a_row_add_up() -> None:
    one = SolverStatistics(10, 5, 40, 20, 7, 0.5, 1.0, 0.25)
    two = SolverStatistics(20, 8, 80, 30, 3, 0.25, 2.0, 0.5, solves=2)
    assert one.then(two) == SolverStatistics(20, 8, 80, 30, 10, 0.75, 3.0, 0.75, solves=3)
