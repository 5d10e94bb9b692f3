"""The graph of a function: shared parts, if_else, parts put in anew."""

import casadi as ca
import pytest

from symfric.foundation.graph import SELECT, graph, rebuild

x, y = ca.SX.sym("x"), ca.SX.sym("y")


def operations(*expressions: ca.SX) -> list[int]:
    source = graph(ca.Function("f", [x, y], [ca.vertcat(*expressions)]))
    return [node.op for node in source.nodes]


def test_equal_expressions_built_twice_are_one_node():
    assert operations(ca.sin(x * y), ca.sin(x * y)).count(ca.OP_SIN) == 1


@pytest.mark.parametrize(
    "expression",
    [
        ca.if_else(x < y, ca.sin(x), ca.cos(y)),
        ca.if_else(ca.logic_not(x < y), ca.sin(x), ca.cos(y)),
        ca.if_else(x, ca.sin(x), ca.cos(y)),
    ],
)
def test_if_else_is_one_selection(expression):
    found = operations(expression)
    assert found.count(SELECT) == 1
    assert ca.OP_ADD not in found


def test_halves_with_different_conditions_stay_a_sum():
    halves = ca.if_else(x < y, ca.sin(x), 0) + ca.if_else(x < 2 * y, 0, ca.cos(y))
    found = operations(halves)
    assert SELECT not in found
    assert found.count(ca.OP_IF_ELSE_ZERO) == 2


def test_what_no_result_needs_is_left_out():
    source = graph(ca.Function("f", [x, y], [x + 1]))
    assert [node.op for node in source.nodes] == [ca.OP_INPUT, ca.OP_CONST, ca.OP_ADD]
    assert source.operations == 1


def test_dependence_follows_the_operations():
    source = graph(ca.Function("f", [x, y], [ca.sin(x), ca.cos(y), x * y]))
    rows = [row[0] for row in source.results]
    assert [source.depends([0])[i] for i in rows] == [True, False, True]
    assert [source.depends([1])[i] for i in rows] == [False, True, True]


def test_rebuilding_gives_the_same_function():
    expression = ca.if_else(x < y, ca.sin(x) ** 3, ca.fmin(x, y)) / (1 + y * y) - ca.sign(x)
    source = graph(ca.Function("f", [x, y], [expression]))
    (again,) = rebuild(source, [x, y], {})
    f, g = (ca.Function("f", [x, y], [e]) for e in (expression, again))
    assert float(f(0.3, 0.7)) == float(g(0.3, 0.7))
    assert float(f(0.9, -0.7)) == float(g(0.9, -0.7))


def test_rebuilding_replaces_a_part_that_is_no_symbol():
    source = graph(ca.Function("f", [x, y], [x * y, ca.sin(x * y) + 2 * (x * y) + x]))
    r = ca.SX.sym("r")
    _, replaced = rebuild(source, [x, y], {source.results[0][0]: r})
    assert not ca.depends_on(replaced, y)
    assert float(ca.Function("g", [x, r], [replaced])(1.0, 0.0)) == 1.0


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (ca.Function("f", [ca.MX.sym("x")], [ca.MX(1)]), "expected an SX function"),
        (ca.Function("f", [x], [x + y], {"allow_free": True}), "expected no free symbols"),
        (ca.Function("f", [x], [ca.SX(2, 1)]), "densify"),
    ],
)
def test_functions_that_have_no_graph_are_refused(function, message):
    with pytest.raises(ValueError, match=message):
        graph(function)
