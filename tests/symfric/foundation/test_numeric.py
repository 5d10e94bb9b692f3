"""Elementary functions keep the type they are given."""

from math import e, pi

import casadi as ca
import numpy as np
import pytest

from symfric.foundation import numeric

FUNCTIONS = {
    "exp": (numeric.exp, 1.0, e),
    "log": (numeric.log, e, 1.0),
    "sqrt": (numeric.sqrt, 9.0, 3.0),
    "sin": (numeric.sin, pi / 6, 0.5),
    "cos": (numeric.cos, pi / 3, 0.5),
    "tan": (numeric.tan, pi / 4, 1.0),
    "atan": (numeric.atan, 1.0, pi / 4),
    "asin": (numeric.asin, 0.5, pi / 6),
    "tanh": (numeric.tanh, 0.5, (e - 1) / (e + 1)),
    "erf": (numeric.erf, 0.5, 0.5204998778130465),
    "expm1": (numeric.expm1, 1e-20, 1e-20),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_function_of_every_type(name: str) -> None:
    function, x, expected = FUNCTIONS[name]
    assert function(x) == pytest.approx(expected, rel=1e-14)
    many = function(np.full((2, 3), x))
    assert isinstance(many, np.ndarray)
    assert many.shape == (2, 3)
    for kind in (ca.SX, ca.DM, ca.MX):
        assert isinstance(function(kind(x)), kind)
    assert float(function(ca.DM(x))) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    ("value", "number"),
    [
        (1.0, True),
        (2, True),
        (np.float64(1.0), True),
        (np.int64(3), True),
        (True, False),
        (np.ones(2), False),
        ("1", False),
        (None, False),
        (ca.DM(1.0), False),
        (ca.SX(1.0), False),
    ],
)
def test_plain_numbers_are_told_apart(value: object, number: bool) -> None:
    assert numeric.is_number(value) is number
    assert numeric.equals(value, 1.0) is (number and float(value) == 1.0)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("value", "symbolic"),
    [
        (ca.SX.sym("x"), True),
        (ca.MX.sym("x"), True),
        (ca.SX(1.0), False),
        (ca.DM(1.0), False),
        (1.0, False),
        (np.ones(2), False),
    ],
)
def test_symbols_are_told_apart(value: object, symbolic: bool) -> None:
    assert numeric.is_symbolic(value) is symbolic


def test_column_stacks_floats_arrays_and_matrices() -> None:
    assert numeric.column(1.0, 2.0).tolist() == [1.0, 2.0]
    assert numeric.column(1.0, np.array([2.0, 3.0])).tolist() == [[1.0, 1.0], [2.0, 3.0]]
    assert numeric.column(ca.SX.sym("x"), 1.0).shape == (2, 1)
    assert numeric.column().shape == (0,)


def test_smallest_of_floats_arrays_and_symbols() -> None:
    assert numeric.smallest(3.0, 1.0, 2.0) == 1.0
    assert numeric.smallest(np.array([1.0, 5.0]), 3.0).tolist() == [1.0, 3.0]
    s = ca.SX.sym("s")
    least = ca.Function("least", [s], [numeric.smallest(2.0, s)])
    assert [float(least(x)) for x in (1.0, 3.0)] == [1.0, 2.0]


def test_empty_has_no_rows_and_joins_without_a_trace() -> None:
    assert numeric.empty(1.0).shape == (0,)
    assert numeric.empty(np.ones(4)).shape == (0, 4)
    assert ca.vertcat(ca.SX.sym("x"), numeric.empty(ca.SX(1.0))).shape == (1, 1)
    assert ca.vertcat(ca.MX.sym("x"), numeric.empty(ca.MX(1.0))).shape == (1, 1)
