"""How the referee of other tools judges a move, by motions that are known."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from symfric.bench.interop import GOAL, ROUTES, STEPS, InteropBenchmark, Move, N, T, miss
from symfric.integrator import flow
from symfric.laws import BrownMcPhee, Viscous
from symfric.scenes import drive

FREE = drive(Viscous(sigma_2=0.0), m=1.0, N=10.0)
"""A mass of 1 kg without friction."""


def test_the_miss_is_the_distance_and_the_speed_that_are_left() -> None:
    there_and_back = np.repeat([4 * GOAL, -4 * GOAL], N // 2)
    assert miss(FREE, there_and_back) < 1e-9
    assert miss(FREE, np.zeros(N)) == pytest.approx(GOAL)
    assert miss(FREE, np.full(N, 2 * GOAL)) == pytest.approx(2 * GOAL)  # there, at 0.2 m/s
    h, knock = T / N, np.eye(N)[0]  # a force in the first interval alone: x = h (T - h/2) F
    assert miss(FREE, knock * GOAL / (h * (T - h / 2))) == pytest.approx(GOAL / (T - h / 2))


def test_a_move_starts_at_rest_at_zero_wherever_the_model_does() -> None:
    away = replace(FREE, x=tuple(replace(v, start=0.5) for v in FREE.x))
    assert miss(away, np.zeros(N)) == pytest.approx(GOAL)


def test_the_route_of_flow_ends_where_flow_says() -> None:
    """And that of collocation near there."""
    model = drive(BrownMcPhee(v_t=0.05), m=1.0, N=10.0)
    advance = flow(model, steps=STEPS)
    left = dict[str, float]()
    for route in ("flow", "collocation"):
        controls, answer, _ = ROUTES["opti", route](model, np.array([GOAL / 2, GOAL]))
        assert answer == "Solve_Succeeded"
        x = ca.DM.zeros(2)
        for u in controls.tolist():
            x = advance(x, u, [], T / N)
        left[route] = float(np.abs(x.full().ravel() - [GOAL, 0.0]).max())
    assert left["flow"] < 1e-8 < left["collocation"] < 1e-2


def test_what_is_not_there_is_none_in_plain_data() -> None:
    failed = Move("opti", "flow", "gms", "why", 0, np.nan, np.inf, 0.5)
    (row,) = InteropBenchmark((failed,), (), ("rockit",)).to_dict()["moves"]
    assert (row["cost"], row["miss"], row["time_s"], row["answer"]) == (None, None, 0.5, "why")
