"""What all methods have in common."""

import casadi as ca
import pytest
from closed_forms import assemble, smooth_dae, smooth_ode

from symfric import Model, Variable
from symfric.integrator.methods.families import need_ode
from symfric.integrator.methods.method import combination

x, y = Variable("x", "1", start=1.0), Variable("y", "1", start=1.0)
rate = ca.SX.sym("rate", 2)


def test_combination_leaves_out_terms_of_weight_zero() -> None:
    a, b, c = (ca.SX.sym(name, 2) for name in "abc")
    found = combination([2.0, 0.0, -1.0], [a, b, c], ca.SX)
    assert not ca.depends_on(found, b)
    value = ca.Function("f", [a, c], [found])([1.0, 2.0], [3.0, 5.0])
    assert value.full().ravel().tolist() == [-1.0, -1.0]


@pytest.mark.parametrize("kind", [ca.SX, ca.MX])
def test_empty_combination_is_zero(kind: type) -> None:
    assert combination([], [], kind).is_zero()
    assert combination([0.0], [kind.sym("a")], kind).is_zero()


def test_ode_is_taken() -> None:
    need_ode(assemble(smooth_ode().model), "any")


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (smooth_dae().model, "method Euler: expected an ODE .* got the algebraic unknowns z; use"),
        (
            Model(
                "mass", x=(x, y), xdot=rate,
                residual=ca.vertcat(2 * rate[0] + x.symbol, rate[1] + y.symbol),
            ),
            "got a mass matrix",
        ),
        (
            Model(
                "swapped", x=(x, y), xdot=rate,
                residual=ca.vertcat(rate[1] + y.symbol, rate[0] + x.symbol),
            ),
            "got a mass matrix",
        ),
    ],
    ids=["dae", "mass", "swapped"],
)  # fmt: skip
def test_anything_but_an_ode_is_refused_saying_what(model: Model, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        need_ode(assemble(model), "Euler")
