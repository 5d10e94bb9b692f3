"""Ends and bounds in another unit than the model's are asked about where a solve fails."""

import casadi as ca
import pytest

from ocp import TIME, Free, Phase, Problem, integral, solve
from ocp.formulation.validate import doubts
from symfric import Model, Variable


def cart(reach: float, most: float) -> Problem:
    x, v = Variable("x", "m", nominal=0.1), Variable("v", "m/s", nominal=0.5)
    f = Variable("force", "N", nominal=20.0)
    model = Model("cart", x=(x, v), u=(f,), ode=ca.vertcat(v.symbol, f.symbol))
    phase = Phase(model, 1.0, start={"v": 0.0}, end={"x": reach, "v": 0.0}, name="go")
    return Problem(phase, integral(lambda s: s.force**2), bounds={"force": (-most, most)})


@pytest.mark.parametrize(
    ("reach", "most", "said"),
    [
        (0.3, 40.0, ""),
        (29.0, 0.07, ""),
        (0.0, 40.0, ""),
        (0.3, 0.0, ""),
        (300.0, 40.0, "end: x = 300 m is 3000 times its nominal 0.1 m: check the unit."),
        (0.3, 0.04, "bounds: force = 0.04 N is 500 times less than its nominal 20 N"),
    ],
)
def test_what_is_odd_is_said_with_its_size(reach: float, most: float, said: str) -> None:
    assert said in doubts(cart(reach, most))
    assert bool(doubts(cart(reach, most))) == bool(said)


def test_an_algebraic_variable_has_a_usual_size_too() -> None:
    x, z, f = Variable("x", "m"), Variable("z", "N", nominal=2.0), Variable("f", "N")
    model = Model("rod", x=(x,), z=(z,), u=(f,), ode=z.symbol, alg=z.symbol - f.symbol)
    problem = Problem(Phase(model, 1.0, end={"z": 2000.0}), integral(lambda s: s.f**2))
    assert "z = 2000 N is 1000 times its nominal 2 N" in doubts(problem)


def test_only_a_solve_that_fails_asks() -> None:
    failed = solve(cart(300.0, 40.0), throw=False)
    assert not failed.ok
    assert failed.message.endswith("check the unit.")
    assert "check the unit" not in solve(cart(300.0, 4000.0)).message


def test_a_duration_at_its_lower_bound_is_told() -> None:
    x = Variable("x", "m")
    v = Variable("v", "m/s")
    model = Model("point", x=(x,), u=(v,), ode=v.symbol)
    problem = Problem(Phase(model, Free(0.1, 3.0), end={"x": 0.3}), TIME, bounds={"v": (-1.0, 1.0)})
    assert "lower bound" not in str(solve(problem))
    idle = Problem(Phase(model, Free(0.1, 3.0)), TIME, bounds={"v": (-1.0, 1.0)})
    assert "T is at its lower bound, 0.1 s" in str(solve(idle))
