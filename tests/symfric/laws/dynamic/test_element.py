"""The step of an elastoplastic element with held velocity against fine steps of its definition."""

import casadi as ca
import numpy as np
import pytest

from symfric.laws.dynamic.element import Held

K, LIMIT, H = 2.0, 1.0, 0.5


def fine(F: float, v: float, count: int = 4000) -> tuple[float, float]:
    """End and mean of the load in many small steps, cut at the limit in the way of the motion."""
    mean = 0.0
    for _ in range(count):
        before = F
        F += K * v * H / count
        F = min(F, LIMIT) if v > 0 else max(F, -LIMIT) if v < 0 else F
        mean += (before + F) / 2 / count
    return F, mean


@pytest.mark.parametrize("v", [0.0, 0.3, -0.3, 0.9, -1.1, 2.5, -2.5])
@pytest.mark.parametrize("F", [0.0, 0.4, -0.4, 0.999, -1.0])
def test_end_and_mean_are_those_of_small_steps(F: float, v: float) -> None:
    held = Held.over(v, H)
    end, mean, mode = held.yielded(F, 0.25, K, LIMIT)
    exact = fine(F, v)
    assert end == pytest.approx(exact[0], abs=1e-12)
    assert mean == pytest.approx(exact[1], abs=1e-4)
    assert mode == (0.25 if v == 0 else float(abs(exact[0]) == LIMIT and exact[0] * v > 0))


def test_an_element_beyond_its_limit_comes_back_at_once_when_it_is_moved_on() -> None:
    assert Held.over(0.1, H).yielded(3.0, 0.0, K, LIMIT) == (LIMIT, LIMIT, 1.0)


@pytest.mark.parametrize("v", [0.0, 0.3, 2.5])
def test_derivatives_are_those_of_the_course_that_is_taken(v: float) -> None:
    F, speed, k = (ca.SX.sym(name) for name in ("F", "v", "k"))
    rows = ca.vertcat(*Held.over(speed, H).yielded(F, ca.SX(0), k, LIMIT)[:2])
    given = ca.vertcat(F, speed, k)
    derivative = ca.Function("d", [given], [ca.jacobian(rows, given)])
    found = derivative([0.2, v, K]).full()
    gap, way = LIMIT - 0.2, K * v * H
    if 0.2 + way < LIMIT:
        expected = [[1.0, K * H, v * H], [1.0, K * H / 2, v * H / 2]]
    else:
        slope = gap**2 / (2 * way**2)
        expected = [[0.0, 0.0, 0.0], [gap / way, slope * K * H, slope * v * H]]
    assert np.allclose(found, expected, rtol=1e-12, atol=1e-12)
