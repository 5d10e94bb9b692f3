"""Equations of a higher index are refused when the system is built, with a name and a way out."""

import casadi as ca
import pytest
from closed_forms import assemble

from symfric import Model, Variable, simulate

x, y = Variable("x", "m", start=1.0), Variable("y", "m")
u, v, lam = Variable("u", "m/s"), Variable("v", "m/s"), Variable("lam", "N/m")
X, Y, U, V, L = (w.symbol for w in (x, y, u, v, lam))
CONSTRAINTS = {3: X**2 + Y**2 - 1, 2: X * U + Y * V, 1: U**2 + V**2 - L * (X**2 + Y**2) - 9.81 * Y}


def pendulum(index: int) -> Model:
    ode = ca.vertcat(U, V, -L * X, -L * Y - 9.81)
    return Model("pendulum", x=(x, y, u, v), z=(lam,), ode=ode, alg=CONSTRAINTS[index])


@pytest.mark.parametrize("index", [2, 3])
def test_constraint_that_says_nothing_of_its_multiplier_is_refused(index: int) -> None:
    """This was "factorise: found no pivot for equations [4]"."""
    with pytest.raises(ValueError, match=r"^model 'pendulum': .* determine lam .*; differentiate"):
        assemble(pendulum(index))


def test_differentiated_constraint_is_taken() -> None:
    assert assemble(pendulum(1)).names == ("x", "y", "u", "v", "lam")
    run = simulate(pendulum(1), 1.0, rtol=1e-9, backend="vm")
    assert run.final["x"] ** 2 + run.final["y"] ** 2 == pytest.approx(1.0, abs=1e-6)


def test_equation_given_twice_is_refused() -> None:
    rates = ca.SX.sym("rates", 2)
    same = rates[0] - rates[1] + X
    model = Model("twice", x=(x, y), xdot=rates, residual=ca.vertcat(same, 2 * same))
    with pytest.raises(ValueError, match=r"model 'twice': .* determine x, y at given states"):
        assemble(model)


def test_charge_that_is_fixed_by_a_constraint_is_refused() -> None:
    """(x^2 + y^2) / 2 has a rate and is given at the same time."""
    rates = ca.SX.sym("rates", 2)
    residual = ca.vertcat(X * rates[0] + Y * rates[1] + X, X**2 + Y**2 - 1)
    with pytest.raises(ValueError, match="determine x_dot, y_dot at"):
        assemble(Model("fixed", x=(x, y), xdot=rates, residual=residual))
