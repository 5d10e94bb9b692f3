"""Bools stay bools, extremes are comparisons: the text of C for small expressions."""

import casadi as ca
import pytest

from symfric.emitter.c99 import DOUBLE
from symfric.emitter.emit import emit
from symfric.emitter.logic import LOWERED, simplified
from symfric.foundation.graph import graph

x, y = ca.SX.sym("x"), ca.SX.sym("y")
less, equal = x < y, x == y
flag = ca.if_else(less, 1, 0)


def text(expression: ca.SX) -> str:
    """Of all lines, a blank between them."""
    source = graph(ca.Function("f", [x, y], [expression]))
    return " ".join(emit(source, [["x"], ["y"]], [["r = {};"]], DOUBLE).lines)


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        (flag, "r = x < y ? 1.0 : 0.0;"),
        (ca.if_else(flag != 0, x, y), "r = x < y ? x : y;"),
        (ca.if_else(flag == 0, x, y), "r = x < y ? y : x;"),
        (ca.if_else(flag > 0.5, x, y), "r = x < y ? x : y;"),
        (ca.if_else(ca.logic_not(less), x, y), "r = x < y ? y : x;"),
        (ca.logic_not(equal), "r = x != y ? 1.0 : 0.0;"),
        (ca.logic_not(less), "r = !(x < y) ? 1.0 : 0.0;"),
        (ca.logic_not(ca.logic_or(equal, y < 2)), "r = x != y && !(y < 2.0) ? 1.0 : 0.0;"),
        (ca.logic_not(ca.logic_and(less, y < 2)), "r = !(x < y && y < 2.0) ? 1.0 : 0.0;"),
        (ca.if_else(less, y < 2, 0), "r = x < y && y < 2.0 ? 1.0 : 0.0;"),
        (ca.if_else(less, 1, equal), "r = x < y || x == y ? 1.0 : 0.0;"),
        (ca.if_else(equal, y < 2, 1), "r = x != y || y < 2.0 ? 1.0 : 0.0;"),
        (ca.if_else(equal, 0, y < 2), "r = x != y && y < 2.0 ? 1.0 : 0.0;"),
        (ca.if_else(ca.if_else(less, 2, 3) == 3, x, y), "r = x < y ? y : x;"),
        (ca.if_else(ca.sign(x) == 0, y, 3), "r = x == 0.0 ? y : 3.0;"),
        (ca.if_else(ca.sign(x) > 0, y, 3), "r = x > 0.0 ? y : 3.0;"),
        (ca.if_else(-x, y, 3), "r = x != 0.0 ? y : 3.0;"),
        (ca.if_else(x, y, 3), "r = x != 0.0 ? y : 3.0;"),
        (ca.logic_and(x, y), "r = x != 0.0 && y != 0.0 ? 1.0 : 0.0;"),
        (ca.if_else(less, ca.if_else(less, x, 2), y), "r = x < y ? x : y;"),
        (ca.logic_and(less, ca.logic_not(less)), "r = 0.0;"),
        (ca.logic_or(less, ca.logic_not(less)), "r = 1.0;"),
        (x > 2, "r = x > 2.0 ? 1.0 : 0.0;"),
        (x >= 2, "r = x >= 2.0 ? 1.0 : 0.0;"),
    ],
)  # fmt: skip
def test_conditions_are_bools(expression: ca.SX, expected: str) -> None:
    assert text(expression) == expected


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        (ca.fmin(x, y), "r = y < x ? y : x;"),
        (ca.fmax(x, y), "r = x < y ? y : x;"),
        (ca.fmin(x, 2), "r = x < 2.0 ? x : 2.0;"),
        (ca.fmin(2, x), "r = x < 2.0 ? x : 2.0;"),
        (ca.fmax(-1, x), "r = x > -1.0 ? x : -1.0;"),
        (ca.fmin(ca.fmax(x, -1), 1), "r = x > -1.0 ? (x < 1.0 ? x : 1.0) : -1.0;"),
        (ca.fmax(ca.fmin(x, 1), -1), "r = x < 1.0 ? (x > -1.0 ? x : -1.0) : 1.0;"),
        (ca.fmin(ca.fmax(x, 2), 1), "r = (x > 2.0 ? x : 2.0) < 1.0 ? (x > 2.0 ? x : 2.0) : 1.0;"),
        (ca.jacobian(ca.fmax(x, y), x), "r = y <= x ? (x <= y ? 0.5 : 1.0) : 0.0;"),
    ],
)
def test_extremes_are_comparisons(expression: ca.SX, expected: str) -> None:
    found = text(expression)
    if "const double t1 = " in found:
        local, result = found.split("; ", 1)
        value = local.removeprefix("const double t1 = ")
        found = result.replace("t1", f"({value})")
    assert found == expected


def test_a_reciprocal_is_one_division() -> None:
    assert text(y * (2 * (0.5 / x))) == "r = y * (1.0 / x);"


def test_sums_and_products_in_either_order_are_one() -> None:
    assert text(ca.sin(x + y) * ca.cos(y + x)).count("x + y") == 1


def test_a_simplified_graph_stays_as_it_is() -> None:
    expressions = ca.vertcat(ca.fmin(x, y), ca.if_else(flag, y, ca.fmax(x, 0)), ca.logic_not(less))
    once = simplified(graph(ca.Function("f", [x, y], [expressions])))
    assert not {node.op for node in once.nodes} & LOWERED
    assert simplified(once) == once


def test_bools_come_in_and_go_out_as_bools() -> None:
    source = graph(ca.Function("f", [x, y], [ca.if_else(x, y, 2), ca.logic_or(x, y < 0), 1 - x]))
    targets = [["r = {};"], ["const bool u = {};"], ["s = {};"]]
    code = emit(source, [["b"], ["y"]], targets, DOUBLE, conditions=[0], truths=[1])
    assert set(code.lines) == {
        "r = b ? y : 2.0;",
        "const bool u = b || y < 0.0;",
        "s = 1.0 - (b ? 1.0 : 0.0);",
    }
