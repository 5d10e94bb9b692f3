"""Selects whose condition is known where they are used: which ones go, and equal bits."""

import casadi as ca
import numpy as np
import pytest

from symfric.emitter.logic import settled
from symfric.foundation.graph import SELECT, Graph, graph, rebuild
from symfric.laws.base import smooth

x, y, z = (ca.SX.sym(name) for name in "xyz")
a, b = x < y, y < z


def of(*expressions: ca.SX) -> Graph:
    return graph(ca.Function("f", [x, y, z], [ca.densify(ca.vertcat(*expressions))]))


def selects(source: Graph) -> int:
    return sum(node.op in (SELECT, ca.OP_IF_ELSE_ZERO) for node in source.nodes)


def values(source: Graph, points: np.ndarray) -> np.ndarray:
    (column,) = rebuild(source, [x, y, z], {})
    return ca.Function("f", [x, y, z], [column]).map(len(points))(*points.T).full()


def choose(condition: ca.SX, yes: ca.SX, no: ca.SX) -> ca.SX:
    return ca.if_else(condition, yes, no)


@pytest.mark.parametrize(
    ("expression", "left"),
    [
        pytest.param(smooth.phi1(x), 1, id="a guarded quotient"),
        pytest.param(choose(a, choose(a, x, y), z), 1, id="the same condition in its branch"),
        pytest.param(choose(a, x, y / choose(a, z, 3)), 1, id="and in its other branch"),
        pytest.param(choose(ca.logic_and(a, b), choose(b, x, y), z), 1, id="a part of both"),
        pytest.param(choose(ca.logic_or(a, b), x, choose(b, y, z)), 1, id="a part of neither"),
        pytest.param(choose(ca.logic_not(a), x, choose(a, y, z)), 1, id="the opposite"),
        pytest.param(choose(a, choose(ca.logic_or(a, b), x, y), z), 1, id="a whole of its part"),
        pytest.param(choose(ca.logic_and(a, choose(a, y, z)), x, y), 1, id="behind a condition"),
        pytest.param(choose(a, choose(a, x, y) * 2, choose(a, x, y)), 2, id="used on both sides"),
        pytest.param(choose(a, choose(b, x, y), z), 2, id="another condition"),
        pytest.param(choose(ca.logic_or(a, b), choose(b, x, y), z), 2, id="either is not both"),
        pytest.param(choose(choose(a, x, y) > z, x, choose(b, x, y)), 3, id="in a condition"),
        pytest.param(choose(a, x, 0) * choose(b, x, 0), 2, id="used beside each other"),
        pytest.param(choose(a, choose(a, x, 0) + y, z), 1, id="a value or zero"),
    ],
)
def test_a_select_goes_where_its_condition_is_known(expression: ca.SX, left: int) -> None:
    source = settled(of(expression))
    assert selects(source) == left
    points = np.random.default_rng(0).integers(-2, 3, (400, 3)).astype(float)
    assert np.array_equal(values(source, points), values(of(expression), points))


def test_a_result_of_its_own_keeps_its_select() -> None:
    inner = choose(a, x, y)
    assert selects(settled(of(choose(a, inner * 2, z), inner))) == 2


def test_random_nests_keep_their_bits() -> None:
    random = np.random.default_rng(1)

    def condition(level: int) -> ca.SX:
        kind = random.integers(5 if level else 2)
        if kind < 2:
            return (a, b)[kind]
        if kind == 2:
            return ca.logic_not(condition(level - 1))
        both = condition(level - 1), condition(level - 1)
        return ca.logic_and(*both) if kind == 3 else ca.logic_or(*both)

    def nest(level: int, shared: list[ca.SX]) -> ca.SX:
        if not level:
            return shared[random.integers(len(shared))]
        made = choose(condition(2), nest(level - 1, shared), nest(level - 1, shared))
        shared.append(made * nest(level - 1, shared))
        return shared[-1]

    points = np.vstack(
        [
            random.choice([-np.inf, -1.0, 0.0, 2.0, np.inf, np.nan], (200, 3)),
            random.normal(size=(200, 3)),
        ]
    )
    before = after = 0
    for _ in range(60):
        source = of(nest(4, [x, y, z]))
        slim = settled(source)
        before, after = before + selects(source), after + selects(slim)
        assert np.array_equal(values(slim, points), values(source, points), equal_nan=True)
    assert after < 0.9 * before
