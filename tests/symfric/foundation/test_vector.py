"""Vectors in scalar expressions: parity, one line, refusals."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from symfric.foundation.numeric import asinh, atan, column, cos, erf, exp, log, sin, sqrt, tanh
from symfric.foundation.vector import NotIsotropicError, Rows, Vector
from symfric.laws.base import smooth
from symfric.laws.dynamic.element import ahead, along, onward, spent, yielding

E = np.array([0.6, -0.8])
numbers = st.floats(-3.0, 3.0)
sizes = st.floats(0.05, 3.0)


def vector(x: float, turn: float = 1e-9) -> Vector:
    return Vector([*(x * E)], turn)


def parts(a: Vector) -> np.ndarray:
    return np.array(a.parts)


ODD = {
    "sum": lambda x, y: x + 2 * y - y / 3,
    "product of three": lambda x, y: x * y * x,
    "cube": lambda x, y: x**3 + y,
    "tanh": lambda x, y: tanh(x - y),
    "atan": lambda x, y: atan(x) - asinh(y) + erf(x) + sin(y),
    "sign": lambda x, y: smooth.sign(x, 0.1) * (y * x) - smooth.sign(y, 0.0),
    "power": lambda x, y: smooth.signed_power(x, 2.5, 1e-3) + y * smooth.power(y, 1.5, 1e-3),
    "clip": lambda x, y: smooth.clip(x, -1.0, 1.0) + smooth.hold(y, 0.7, 0.2),
    "chosen": lambda x, y: smooth.choose(x * y > 0, x, y),
    "yielding": lambda x, y: yielding(x, y, 3.0, 1e-9, 1e-9),
    "onward": lambda x, y: onward(smooth.sign(x, 0.0), smooth.sign(y, 0.0)),
    "spent": lambda x, y: spent(lambda r: 1 - abs(1 - r) ** 2, x, smooth.sign(x, 0.0), y),
}
EVEN = {
    "product": lambda x, y: x * y,
    "square": lambda x, y: x**2 + (y * y + 1) ** 0.3,
    "magnitude": lambda x, y: smooth.magnitude(x, 0.1) - smooth.magnitude(y, 0.0),
    "cosine": lambda x, y: cos(x) + exp(-(y**2)) + sqrt(x * x + y * y),
    "ahead": lambda x, y: ahead(lambda r: np.exp(r), smooth.sign(x, 0.0), y),
}


@given(x=sizes, y=sizes, signs=st.tuples(*2 * [st.sampled_from([1.0, -1.0])]))
def test_expressions_of_one_line_are_those_of_numbers_along_it(
    x: float, y: float, signs: tuple[float, float]
) -> None:
    x, y = x * signs[0], y * signs[1]
    close = {"rel": 1e-9, "abs": 1e-9}
    for name, f in ODD.items():
        assert parts(f(vector(x), vector(y))) == pytest.approx(f(x, y) * E, **close), name
    for name, f in EVEN.items():
        assert f(vector(x), vector(y)) == pytest.approx(f(x, y), **close), name


a, b = vector(1.0), Vector([0.3, 2.0], 1e-9)
MIXED = {
    "adds a number": lambda: a + 1.0,
    "adds a number to": lambda: ca.SX.sym("N") - a,
    "divides by what": lambda: 1.0 / a,
    "divides by": lambda: a / b,
    "takes exp of": lambda: exp(a),
    "takes log of": lambda: log(a),
    "no integer": lambda: a**0.5,
    "that is no integer": lambda: a ** ca.SX.sym("n"),
    "compares what": lambda: a > 0,
    "compares": lambda: a == 0,
    "cuts what": lambda: smooth.positive(a, 0.1),
    "clips what": lambda: smooth.clip(a, 0.0, 1.0),
    "clips what has a direction": lambda: smooth.step5(a),
    "chooses between a number and what": lambda: smooth.choose(True, a, 1.0),
    "counts what": lambda: smooth.fraction(a),
}


def test_what_has_no_meaning_for_directions_is_refused() -> None:
    for reason, call in MIXED.items():
        with pytest.raises(NotIsotropicError, match=reason):
            call()


@pytest.mark.parametrize("kind", [ca.SX, ca.MX, ca.DM, float, np.float64, np.ones])
def test_numbers_of_any_kind_scale_from_both_sides(kind: type) -> None:
    two = kind.sym("two") if kind in (ca.SX, ca.MX) else kind(2)
    for scaled in (two * a, a * two, a / (1 / two)):
        assert isinstance(scaled, Vector)
        assert len(scaled.parts) == 2


def test_columns_with_vectors_keep_them_as_rows() -> None:
    rows = column(a, 1.0, ca.SX.sym("q"))
    assert isinstance(rows, Rows)
    assert rows.shape == (3,)
    assert rows[0] is a


def test_slip_along_the_load_alone_loads() -> None:
    """Share 1 along, 0 against, and the cosine between them where it is positive."""
    s = Vector([1.0, 0.0], 1e-9)
    angles = np.array([0.0, 1.0, 2.0, np.pi])
    shares = [along(Vector([np.cos(x), np.sin(x)], 1e-9), s) for x in angles]
    assert shares == pytest.approx([1.0, np.cos(1.0), 0.0, 0.0], abs=1e-8)
