"""Rates of inputs: slopes of samples, derivatives of functions, and back again by integration."""

import casadi as ca
import numpy as np
import pytest

from symfric import Hold, Linear, Model, Variable, rate_of, simulate


def integral() -> Model:
    x, v = Variable("x", "m"), Variable("v", "m/s")
    return Model("integral", x=(x,), u=(v,), ode=v.symbol)


def test_the_integral_of_the_rate_goes_through_the_samples() -> None:
    t = np.array([0.1, 0.15, 0.4, 0.41, 0.9])
    x = np.array([1.0, -2.0, 0.5, 0.5, 3.0])
    at = np.array([0.0, *t, 1.2])
    run = simulate(
        integral(), 1.2, x0={"x": 1.0}, u={"v": rate_of(Linear(t, x))}, t_eval=at, rtol=1e-9
    )
    assert run["x"] == pytest.approx([1.0, *x, 3.0], abs=1e-12)


def test_members_have_their_own_rates() -> None:
    rate = rate_of(Linear([0.0, 1.0, 3.0], [[0.0, 1.0, 5.0], [1.0, 1.0, -1.0]]))
    assert isinstance(rate, Hold)
    assert np.asarray(rate.values).tolist() == [[0.0, 1.0, 2.0, 0.0], [0.0, 0.0, -1.0, 0.0]]


def test_functions_are_differentiated_and_numbers_stand_still() -> None:
    rate = rate_of(lambda t: 3 * t**2)
    assert float(_at(rate, 2.0)) == 12.0
    assert rate_of(4.0) == 0.0
    assert rate_of(Linear([1.0], [2.0])) == 0.0


def _at(rate: object, value: float) -> ca.DM:
    t = ca.SX.sym("t")
    return ca.Function("rate", [t], [rate(t)])(value)  # type: ignore[operator]


def test_what_jumps_or_is_no_input_is_refused() -> None:
    with pytest.raises(ValueError, match="rate_of: expected a signal without jumps"):
        rate_of(Hold([0.0, 1.0], [0.0, 1.0]))
    with pytest.raises(ValueError, match="rate_of: expected an input is a number"):
        rate_of("x")  # type: ignore[arg-type]
