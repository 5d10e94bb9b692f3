"""The tangent that steps run: against the exact one, at exceptional numbers, where it belongs."""

import casadi as ca
import numpy as np
import pytest

import symfric as sf
from symfric.integrator.equations.expressions import LARGE, MIDDLE, branchless, tanh
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.system import system
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.step.attempt import build_fixed, build_step

X = ca.SX.sym("x")


def of(x: np.ndarray) -> np.ndarray:
    return ca.Function("tanh", [X], [tanh(X)]).map(x.size)(x[None]).full().ravel()


def exactly(x: np.ndarray) -> np.ndarray:
    """To the precision of x87's long double."""
    return np.tanh(x.astype(np.longdouble))


def test_it_is_tanh_everywhere() -> None:
    rng = np.random.default_rng(0)
    near = MIDDLE + np.linspace(-1e-9, 1e-9, 2001)
    x = np.concatenate([rng.uniform(0, 2, 20000), 10 ** rng.uniform(-310, 3, 20000), near])
    error = np.abs(of(x) / exactly(x) - 1)
    assert error.max() < 3.5e-16
    assert np.array_equal(of(-x), -of(x))
    assert (np.diff(of(np.sort(near))) >= -2e-16).all()


def test_exceptional_numbers() -> None:
    tiny = 5e-324
    x = np.array([0.0, -0.0, np.inf, -np.inf, np.nan, 1e308, -1e308, 400.0, 355.0, tiny, -tiny])
    expected = np.array([0, 0, 1, -1, np.nan, 1, -1, 1, 1, tiny, -tiny])
    np.testing.assert_array_equal(of(x), expected)


def test_its_derivative_is_that_of_tanh_on_both_sides_and_at_zero() -> None:
    slope = ca.Function("slope", [X], [ca.jacobian(tanh(X), X)])
    for x in (0.0, 0.3, -0.3, 0.699, 0.701, -0.701, 3.0, 30.0):
        assert float(slope(x)) == pytest.approx(1 - np.tanh(x) ** 2, rel=1e-12, abs=1e-15)


def test_a_function_without_or_a_large_one_stays_itself() -> None:
    plain = ca.Function("f", [X], [ca.exp(X)])
    assert branchless(plain) is plain
    long = X
    for _ in range(LARGE):
        long = ca.sin(long)
    long = ca.Function("f", [X], [ca.tanh(long)])
    assert branchless(long) is long


def tangents(function: ca.Function) -> int:
    operations = (function.instruction_id(k) for k in range(function.n_instructions()))
    return sum(operation == ca.OP_TANH for operation in operations)


@pytest.mark.parametrize("method", ["rodas5p", "radau5", "dopri5"])
def test_steps_have_none_and_what_is_differentiated_keeps_it(method: str) -> None:
    model = sf.rabinowicz(sf.BrownMcPhee())
    whole = system(model, input_data(model, None, 0.0, 1.0))
    fixed = build_fixed(whole, METHODS[method])
    assert tangents(fixed) > 0
    assert tangents(build_step(whole, METHODS[method])) == 0
