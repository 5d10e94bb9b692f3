"""Variables and vectors in equations, and graphs of Functions."""

import operator
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import pytest
from chains import attach
from hypothesis import given
from hypothesis import strategies as st

from symfric import BrownMcPhee, LuGre, Model, Variable, contact, simulate
from symfric.foundation.graph import graph
from symfric.foundation.numeric import asinh, atan, column, cos, erf, exp, log, sin, sqrt, tanh
from symfric.foundation.symbolic import plain, with_symbols
from symfric.foundation.variable import at_start, stacked, starts_of, strays, symbols_of
from symfric.foundation.vector import NotIsotropicError, Vector, VectorRows
from symfric.laws.base import smooth
from symfric.laws.dynamic.element import ahead, along, onward, spent, yielding
from symfric.multibody import JointFriction, Mechanism, Revolute

A, B = Variable("a", "m"), Variable("b", "m/s")
BINARY = (
    operator.add, operator.sub, operator.mul, operator.truediv, operator.pow, operator.mod,
    operator.floordiv, operator.lt, operator.le, operator.gt, operator.ge,
)  # fmt: skip


def same(left: object, right: object) -> bool:
    assert isinstance(left, ca.SX)
    assert isinstance(right, ca.SX)
    return left.shape == right.shape and ca.is_equal(ca.densify(left), ca.densify(right), 40)


@pytest.mark.parametrize("operate", BINARY, ids=lambda o: o.__name__)
def test_operators_are_those_of_the_symbol_on_either_side(operate):
    assert same(operate(A, B), operate(A.symbol, B.symbol))
    for other in (3.0, np.float64(3.0), ca.DM(3.0), ca.SX.sym("c")):
        assert same(operate(A, other), operate(A.symbol, other))
        turned = operate(other, A)  # Python turns a < b around itself
        assert same(ca.SX(turned) if operate in BINARY[-4:] else turned, operate(other, A.symbol))


def test_columns_matrices_and_functions_of_casadi_take_variables():
    column, numbers = ca.vertcat(A, B), np.array([[1.0, 2.0], [3.0, 4.0]])
    assert same(column, ca.vertcat(A.symbol, B.symbol))
    assert same(numbers @ column, ca.DM(numbers) @ ca.vertcat(A.symbol, B.symbol))
    assert same(np.array([1.0, 2.0]) * A, ca.vertcat(A.symbol, 2 * A.symbol))
    assert same(ca.DM([1.0, 2.0]) * A, ca.vertcat(A.symbol, 2 * A.symbol))
    assert same(np.array([1.0, 2.0]) @ np.array([A, B]), A.symbol + 2 * B.symbol)
    assert same(-A, -A.symbol)
    assert same(+A, A.symbol)
    assert same(abs(A), ca.fabs(A.symbol))
    assert same(ca.sin(A) * ca.atan2(A, B), ca.sin(A.symbol) * ca.atan2(A.symbol, B.symbol))
    assert same(ca.jacobian(A * B, ca.vertcat(A, B)), ca.horzcat(B.symbol, A.symbol))
    assert float(ca.Function("f", [A, B], [A - 2 * B])(5.0, 2.0)) == 1.0
    assert float(ca.substitute(A - 1, A, 3)) == 2.0
    assert not ca.depends_on(ca.sin(A), B)


def test_a_variable_is_found_in_tuples_and_is_a_key():
    assert A in (B, A)
    assert A not in (B,)
    assert [B, A].index(A) == 1
    assert {A: 1, B: 2}[B] == 2
    assert len({A, B, A}) == 2
    assert (A, B) == (A, B)
    assert (A, B) != (B, A)
    assert A != B
    assert not A == B  # noqa: SIM201
    assert A is not None
    assert A != "a"
    assert None not in (A, B)


def test_equality_is_an_expression_where_casadi_or_a_number_asks():
    equal = ca.Function("f", [A, B], [ca.if_else(A == B, 1, 2), ca.if_else(A != B, 1, 2)])
    assert [float(x) for x in equal(3, 3)] == [1.0, 2.0]
    assert [float(x) for x in equal(3, 4)] == [2.0, 1.0]
    assert same(A == 0, A.symbol == 0)
    assert same(B.symbol != A, A.symbol != B.symbol)
    assert repr(A == A) == "True"
    assert same(Variable("c", "1", start=A == B).start, A.symbol == B.symbol)
    assert same(A * (A == B), A.symbol * (A.symbol == B.symbol))


@pytest.mark.filterwarnings("ignore:\\s*casadi:FutureWarning")
def test_functions_of_numpy_take_variables():
    assert same(np.dot(np.array([1.0, 2.0]), A), ca.vertcat(A.symbol, 2 * A.symbol))
    assert same(np.maximum(A, 2.0), ca.fmax(A.symbol, 2.0))
    assert same(np.clip(A, 0.0, 1.0), ca.fmin(ca.fmax(A.symbol, 0.0), 1.0))


def test_what_does_not_fit_is_reported():
    for mixed in (lambda: ca.MX.sym("m") * A, lambda: A - ca.MX.sym("m")):
        with pytest.raises(ValueError, match=r"variable 'a': expected SX or numbers .* got MX"):
            mixed()
    for odd in (lambda: A + "1", lambda: None * A, lambda: A < "1"):  # type: ignore[operator]
        with pytest.raises(TypeError):
            odd()


def test_a_condition_on_a_symbol_is_no_truth_value():
    for decide in (lambda: max(A, 1.0), lambda: 1 if A > 0 else 2, lambda: A >= 0 and B):
        with pytest.raises(ValueError, match=r"got the condition .*write casadi.if_else"):
            decide()
    chosen = ca.Function("f", [A.symbol], [ca.if_else(A > 0, 1, 2), (A <= 1) * A])
    assert [float(x) for x in chosen(0.5)] == [1.0, 0.5]


@dataclass(frozen=True, eq=False)
class Part:
    """Of a mechanism."""

    at: Any


def test_plain_and_parts_go_into_lists_tuples_and_mappings():
    assert plain((A, [B, 1.0]))[0] is A.symbol
    assert plain({"x": A, "y": 2})["x"] is A.symbol
    given, whole = {"y": 2}, Part((1.0, A.symbol))
    assert plain(given) is given
    assert with_symbols(whole) is whole
    assert with_symbols(Part(A)).at is A.symbol
    assert with_symbols(Part((A, [B, 0.0]))).at[1][0] is B.symbol


def test_models_are_the_same_with_variables_and_with_their_symbols():
    def sled(written):
        s, v = Variable("s", "m", nominal=0.1), Variable("v", "m/s", nominal=0.1)
        S, V = (s, v) if written else (s.symbol, v.symbol)
        slip = contact("ground", LuGre(), V, 10 + S, rest={"v": 0.0}, F_e=50 * S)
        rates = ca.vertcat(0.02 - V, (50 * S - slip.force) / 2)
        return Model("sled", x=(s, v), ode=rates, contacts=(slip,))

    plainly, shortly = (simulate(sled(written), 1.0) for written in (False, True))
    assert shortly.final == plainly.final


def test_laws_and_bearings_take_variables_as_parameters():
    mu, R, m = Variable("mu", "1", start=0.3), Variable("R", "m", start=0.1), Variable("m", "kg")
    law = BrownMcPhee(mu_s=mu, mu_d=0.1)
    assert same(law.mu_s, mu.symbol)
    assert same(law.force(A, 5.0), law.force(A.symbol, 5.0))
    assert same(LuGre().rate(A, B, mu), LuGre().rate(A.symbol, B.symbol, mu.symbol))
    machine = Mechanism("wheel", gravity=(0.0, 0.0, -9.81))
    bearing = JointFriction(law, radius=R, preload=5.0)
    attach(machine, Revolute, "hub", "disc", mass=m, J=(0.1, 0.1, m * R**2), to=(R, 0.0, 0.0),
           rate=3.0, friction=bearing)  # fmt: skip
    model = machine.build(p=(mu, R, Variable("m", "kg", start=2.0, symbol=m.symbol)))
    slow, fast = (simulate(model, 0.1, p={"mu": x}).final["hub_rate"] for x in (0.4, 0.1))
    assert slow < fast < 3.0


def test_variables_in_other_units_are_refused_where_si_is_meant():
    v = Variable("v", "mm/s", start=1.0)
    with pytest.raises(ValueError, match=r"BrownMcPhee: v_t: expected SI .* write 0.001 \* v"):
        BrownMcPhee(v_t=v)
    with pytest.raises(ValueError, match=r"friction: radius: expected SI .*'d' \[mm\]"):
        JointFriction(LuGre(), radius=Variable("d", "mm"))
    with pytest.warns(UserWarning, match="no_unit"):
        own = Variable("v", "no_unit")
    assert same(BrownMcPhee(v_t=own).v_t, own.symbol)  # a symbol of unknown size


def test_variables_are_stacked_in_their_order() -> None:
    for none in (stacked(()), symbols_of(()), starts_of(())):
        assert none.shape == (0, 1)
    a = Variable("a", "m", start=2.0)
    b = Variable("b", "m", start=3.0 * a.symbol)
    assert same(symbols_of((a, b)), ca.vertcat(a.symbol, b.symbol))
    assert strays(starts_of((a, b)), ca.SX(0, 1)) == ["a"]
    assert float(at_start(a.symbol**2 + 1, (a,))) == 5.0


def test_stray_symbols_are_identified_by_the_symbol_and_not_by_its_name() -> None:
    known, other = ca.SX.sym("x"), ca.SX.sym("x")
    assert strays(ca.vertcat(known, other, other), known) == ["x"]
    assert strays(known * known, known) == []


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
REFUSED = (
    ("adds a number to a vector", (lambda: a + 1.0, lambda: ca.SX.sym("N") - a)),
    ("divides by a vector", (lambda: 1.0 / a, lambda: a / b)),
    ("takes exp of a vector", (lambda: exp(a),)),
    ("takes log of a vector", (lambda: log(a),)),
    ("a power that is not an integer", (lambda: a**0.5, lambda: a ** ca.SX.sym("n"))),
    ("compares a vector", (lambda: a > 0, lambda: a == 0)),
    ("cuts a vector", (lambda: smooth.positive(a, 0.1),)),
    ("clips a vector", (lambda: smooth.clip(a, 0.0, 1.0), lambda: smooth.step5(a))),
    ("chooses between a number and a vector", (lambda: smooth.choose(True, a, 1.0),)),
    ("counts a vector", (lambda: smooth.fraction(a),)),
)


def test_what_has_no_meaning_for_directions_is_refused() -> None:
    for reason, calls in REFUSED:
        for call in calls:
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
    assert isinstance(rows, VectorRows)
    assert rows.shape == (3,)
    assert rows[0] is a


def test_slip_along_the_load_alone_loads() -> None:
    """Share 1 along, 0 against, and the cosine between them where it is positive."""
    s = Vector([1.0, 0.0], 1e-9)
    angles = np.array([0.0, 1.0, 2.0, np.pi])
    shares = [along(Vector([np.cos(x), np.sin(x)], 1e-9), s) for x in angles]
    assert shares == pytest.approx([1.0, np.cos(1.0), 0.0, 0.0], abs=1e-8)


x, y = ca.SX.sym("x"), ca.SX.sym("y")


def operations(*expressions: ca.SX) -> list[int]:
    source = graph(ca.Function("f", [x, y], [ca.vertcat(*expressions)]))
    return [node.op for node in source.nodes]


def test_what_no_result_needs_is_left_out_and_dependence_follows_the_operations():
    source = graph(ca.Function("f", [x, y], [x + 1]))
    assert [node.op for node in source.nodes] == [ca.OP_INPUT, ca.OP_CONST, ca.OP_ADD]
    assert source.operations == 1
    source = graph(ca.Function("f", [x, y], [ca.sin(x), ca.cos(y), x * y]))
    rows = [row[0] for row in source.results]
    for k, expected in enumerate(([True, False, True], [False, True, True])):
        assert [source.depends([k])[i] for i in rows] == expected


def test_functions_that_have_no_graph_are_refused():
    for function, message in (
        (ca.Function("f", [ca.MX.sym("x")], [ca.MX(1)]), "expected an SX function"),
        (ca.Function("f", [x], [x + y], {"allow_free": True}), "expected no free symbols"),
        (ca.Function("f", [x], [ca.SX(2, 1)]), "densify"),
    ):
        with pytest.raises(ValueError, match=message):
            graph(function)
