"""Numbers and operations in C99."""

from math import inf, nan

import casadi as ca
import numpy as np
import pytest

from symfric.emitter.c99 import CHEAP, DOUBLE, FLOAT, FORMS, TRANSCENDENTAL, operation_name


@pytest.mark.parametrize(
    ("value", "double", "single"),
    [
        (0.0, "0.0", "0.0f"),
        (-0.0, "-0.0", "-0.0f"),
        (1.0, "1.0", "1.0f"),
        (-2.5, "-2.5", "-2.5f"),
        (1e5, "100000.0", "100000.0f"),
        (1e-9, "1.0e-9", "1.0e-9f"),
        (3e20, "3.0e+20", "3.0e+20f"),
        (inf, "HUGE_VAL", "HUGE_VALF"),
        (-inf, "-HUGE_VAL", "-HUGE_VALF"),
    ],
)
def test_literals_are_short_and_typed(value, double, single):
    assert DOUBLE.literal(value) == double
    assert FLOAT.literal(value) == single


@pytest.mark.parametrize("value", np.random.default_rng(1).standard_normal(20) * 1e3)
def test_literals_read_back_to_the_same_number(value):
    assert float(DOUBLE.literal(value)) == value
    assert np.float32(FLOAT.literal(value).removesuffix("f")) == np.float32(value)


@pytest.mark.parametrize(
    ("value", "message"),
    [(nan, "got nan"), (1e39, "range of float, got 1e.39"), (1e-60, "would become 0")],
)
def test_numbers_that_float_cannot_hold_are_refused(value, message):
    with pytest.raises(ValueError, match=message):
        FLOAT.literal(value)


def test_double_holds_what_float_cannot():
    assert DOUBLE.literal(1e-60) == "1.0e-60"


def test_no_operation_is_written_in_two_ways():
    assert not set(FORMS) & set(CHEAP)
    assert not set(FORMS) & set(TRANSCENDENTAL)
    assert not set(CHEAP) & set(TRANSCENDENTAL)


def test_operations_are_named_as_casadi_names_them():
    assert operation_name(ca.OP_ERFINV) == "erfinv"
