"""Elementary functions keep the type they are given."""

from collections.abc import Hashable
from math import e, pi

import casadi as ca
import numpy as np
import pytest

from symfric.foundation import numeric
from symfric.foundation.memory import remember

FUNCTIONS = (
    (numeric.exp, 1.0, e), (numeric.log, e, 1.0), (numeric.sqrt, 9.0, 3.0),
    (numeric.sin, pi / 6, 0.5), (numeric.cos, pi / 3, 0.5), (numeric.tan, pi / 4, 1.0),
    (numeric.atan, 1.0, pi / 4), (numeric.asin, 0.5, pi / 6), (numeric.expm1, 1e-20, 1e-20),
    (numeric.tanh, 0.5, (e - 1) / (e + 1)), (numeric.erf, 0.5, 0.5204998778130465),
)  # fmt: skip


def test_functions_of_every_type() -> None:
    for function, x, expected in FUNCTIONS:
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


def test_columns_of_floats_arrays_and_matrices() -> None:
    assert numeric.column(1.0, 2.0).tolist() == [1.0, 2.0]
    assert numeric.column(1.0, np.array([2.0, 3.0])).tolist() == [[1.0, 1.0], [2.0, 3.0]]
    assert numeric.column(ca.SX.sym("x"), 1.0).shape == (2, 1)
    assert numeric.column().shape == numeric.empty(1.0).shape == (0,)
    assert numeric.empty(np.ones(4)).shape == (0, 4)
    for kind in (ca.SX, ca.MX):  # joins without a trace
        assert ca.vertcat(kind.sym("x"), numeric.empty(kind(1.0))).shape == (1, 1)


def test_smallest_of_floats_arrays_and_symbols() -> None:
    assert numeric.smallest(3.0, 1.0, 2.0) == 1.0
    assert numeric.smallest(np.array([1.0, 5.0]), 3.0).tolist() == [1.0, 3.0]
    s = ca.SX.sym("s")
    least = ca.Function("least", [s], [numeric.smallest(2.0, s)])
    assert [float(least(x)) for x in (1.0, 3.0)] == [1.0, 2.0]


def test_the_first_remembered_stays_and_the_oldest_goes() -> None:
    known: dict[Hashable, str] = {}
    for key, made, kept in ((1, "a", "a"), (1, "b", "a"), (2, "c", "c"), (2, "d", "c")):
        assert remember(known, key, made, 2) == kept
    assert remember(known, 3, "e", 2) == "e"
    assert known == {2: "c", 3: "e"}
