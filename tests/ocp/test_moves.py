import pytest
from motions import double_integrator, fastest, stage

from ocp import Free, rest_to_rest, solve


def test_free_duration_gives_the_fastest_move() -> None:
    problem = rest_to_rest(stage(), 1.0, Free(0.1, 10.0, guess=1.0), limit=20.0)
    assert pytest.approx(solve(fastest(stage())).T, rel=1e-9) == solve(problem).T


def test_given_duration_gives_the_move_of_least_effort() -> None:
    problem = rest_to_rest(double_integrator(), 2.0, 1.0, limit=100.0, force="a")
    assert solve(problem, intervals=10).cost == pytest.approx(4 * 12 * 100 / 99, rel=1e-7)


def test_model_without_these_signals_is_refused() -> None:
    with pytest.raises(ValueError, match=r"expected one of x, v, a, got force"):
        rest_to_rest(double_integrator(), 1.0, 1.0, limit=1.0)
