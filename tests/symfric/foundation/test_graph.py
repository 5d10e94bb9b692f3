"""The graph of a function: shared parts, if_else, parts put in anew."""

import casadi as ca
import pytest

from symfric.foundation.graph import SELECT, graph, rebuild

x, y = ca.SX.sym("x"), ca.SX.sym("y")


def operations(*expressions: ca.SX) -> list[int]:
    source = graph(ca.Function("f", [x, y], [ca.vertcat(*expressions)]))
    return [node.op for node in source.nodes]


def test_if_else_is_one_selection():
    for condition in (x < y, ca.logic_not(x < y), x):
        found = operations(*2 * [ca.if_else(condition, ca.sin(x * y), ca.cos(y))])
        assert (found.count(SELECT), found.count(ca.OP_SIN), found.count(ca.OP_ADD)) == (1, 1, 0)


def test_halves_with_different_conditions_stay_a_sum():
    halves = ca.if_else(x < y, ca.sin(x), 0) + ca.if_else(x < 2 * y, 0, ca.cos(y))
    found = operations(halves)
    assert SELECT not in found
    assert found.count(ca.OP_IF_ELSE_ZERO) == 2


def test_what_no_result_needs_is_left_out_and_dependence_follows_the_operations():
    source = graph(ca.Function("f", [x, y], [x + 1]))
    assert [node.op for node in source.nodes] == [ca.OP_INPUT, ca.OP_CONST, ca.OP_ADD]
    assert source.operations == 1
    source = graph(ca.Function("f", [x, y], [ca.sin(x), ca.cos(y), x * y]))
    rows = [row[0] for row in source.results]
    for k, expected in enumerate(([True, False, True], [False, True, True])):
        assert [source.depends([k])[i] for i in rows] == expected


def test_rebuilding_gives_the_same_function_with_parts_replaced():
    expression = ca.if_else(x < y, ca.sin(x) ** 3, ca.fmin(x, y)) / (1 + y * y) - ca.sign(x)
    f = ca.Function("f", [x, y], [expression, x * y, ca.sin(x * y) + 2 * (x * y) + x])
    source, r = graph(f), ca.SX.sym("r")
    again = ca.Function("g", [x, y], rebuild(source, [x, y], {}))
    for at in ((0.3, 0.7), (0.9, -0.7)):
        assert list(map(float, f(*at))) == list(map(float, again(*at)))
    *_, replaced = rebuild(source, [x, y], {source.results[1][0]: r})
    assert not ca.depends_on(replaced, y)
    assert float(ca.Function("g", [x, r], [replaced])(1.0, 0.0)) == 1.0


def test_functions_that_have_no_graph_are_refused():
    for function, message in (
        (ca.Function("f", [ca.MX.sym("x")], [ca.MX(1)]), "expected an SX function"),
        (ca.Function("f", [x], [x + y], {"allow_free": True}), "expected no free symbols"),
        (ca.Function("f", [x], [ca.SX(2, 1)]), "densify"),
    ):
        with pytest.raises(ValueError, match=message):
            graph(function)
