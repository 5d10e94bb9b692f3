import numpy as np
import pytest

from ocp.formulation.problem import Problem
from ocp.problems import cart_pendulum, load_through_spring
from ocp.solving.one_solve import starts_around
from ocp.solving.starts import initial_points
from ocp.transcription.schemes import Radau, make_meshes
from ocp.transcription.transcribe import discretise
from ocp.transcription.transcription import Transcription


def on_mesh(problem: Problem, intervals: int) -> Transcription:
    return discretise(problem, Radau(3)).on(make_meshes(problem, intervals))


def test_the_first_start_is_the_given_one_and_others_differ() -> None:
    into = on_mesh(cart_pendulum(), 10)
    begin = initial_points(into)
    first, second, third = starts_around(into, begin, range(3), 0.5)
    assert first is begin
    assert np.abs(second.spans[0].inner - third.spans[0].inner).max() > 0.1
    again = starts_around(into, begin, [1], 0.5)[0]
    assert np.array_equal(again.spans[0].u, second.spans[0].u)


def test_rates_belong_to_positions() -> None:
    into = on_mesh(cart_pendulum(), 200)
    moved = starts_around(into, initial_points(into), [1], 0.5)[0].spans[0]
    t = 2.0 * into.meshes[0]
    x, theta, x_rate, theta_rate = moved.nodes
    assert x_rate[5:-5] == pytest.approx(np.gradient(x, t)[5:-5], abs=1e-3)
    assert theta_rate[5:-5] == pytest.approx(np.gradient(theta, t)[5:-5], abs=1e-3)


def test_ends_stay_and_phases_join() -> None:
    into = on_mesh(load_through_spring(), 20)
    begin = initial_points(into)
    moved = starts_around(into, begin, [3], 0.5)[0]
    positions = slice(0, 2)
    before, after = moved.spans
    assert before.nodes[positions, 0] == pytest.approx(begin.spans[0].nodes[positions, 0])
    assert after.nodes[positions, -1] == pytest.approx(begin.spans[1].nodes[positions, -1])
    assert before.nodes[positions, -1] == pytest.approx(after.nodes[positions, 0])


def test_a_state_that_stands_still_takes_the_size_of_its_unit() -> None:
    into = on_mesh(load_through_spring(), 20)
    begin = initial_points(into)
    assert np.ptp(begin.spans[0].nodes[0]) == 0.0
    moved = starts_around(into, begin, range(1, 20), 0.5)
    ways = [np.ptp(np.hstack([s.nodes for s in points.spans])[:2], axis=1) for points in moved]
    typical = np.median(ways, axis=0)
    assert typical[0] == pytest.approx(typical[1], rel=0.9)
