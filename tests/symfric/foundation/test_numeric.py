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


def test_functions_of_every_type() -> None:
    for function, x, expected in FUNCTIONS.values():
        assert function(x) == pytest.approx(expected, rel=1e-14)
        many = function(np.full((2, 3), x))
        assert isinstance(many, np.ndarray)
        assert many.shape == (2, 3)
        for kind in (ca.SX, ca.DM, ca.MX):
            assert isinstance(function(kind(x)), kind)
        assert float(function(ca.DM(x))) == pytest.approx(expected, rel=1e-14)


def test_plain_numbers_and_symbols_are_told_apart() -> None:
    numbers = (1.0, 2, np.float64(1.0), np.int64(3))
    others = (True, np.ones(2), "1", None, ca.DM(1.0), ca.SX(1.0))
    symbols = (ca.SX.sym("x"), ca.MX.sym("x"))
    assert [numeric.is_number(x) for x in (*numbers, *others, *symbols)] == [True] * 4 + [False] * 8
    assert [numeric.equals(x, 1.0) for x in (*numbers, *others)] == [True, False] * 2 + [False] * 6
    assert [numeric.is_symbolic(x) for x in (*others, *symbols)] == [False] * 6 + [True] * 2


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
