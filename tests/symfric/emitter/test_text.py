"""Text of C: formulas, conditions, branches, locals, their order, and literals."""

from functools import reduce
from math import inf, nan
from operator import add

import casadi as ca
import numpy as np
import pytest
from one_program import block_of
from tables import Names, table

from symfric import LuGre, VelocityBased
from symfric.codegen.blocks.block import CBlock
from symfric.codegen.source import routines
from symfric.emitter.c99 import DOUBLE, FLOAT, SMALLEST_FLOAT, Real, representable
from symfric.emitter.emit import Code, emit
from symfric.emitter.logic import LOWERED, settled, simplified
from symfric.emitter.statements import ordered
from symfric.foundation.graph import SELECT, Graph, graph, rebuild
from symfric.laws.base import smooth

x, y, z = (ca.SX.sym(name) for name in "xyz")
less, equal = x < y, x == y
flag = ca.if_else(less, 1, 0)
either, both, invert = ca.logic_or, ca.logic_and, ca.logic_not


def choose(condition: ca.SX, yes: ca.SX | float, no: ca.SX | float) -> ca.SX:
    return ca.if_else(condition, yes, no)


def of(*results: ca.SX) -> Graph:
    return graph(ca.Function("f", [x, y, z], [ca.densify(ca.SX(r)) for r in results]))


def code(*results: ca.SX, real: Real = DOUBLE, names: str = "x y z", **options) -> Code:
    """Code of functions of x, y, z, whose results are r0, r1, ... or `targets`."""
    targets = options.pop("targets", None) or [f"r{k} = {{}};" for k in range(len(results))]
    columns = [[name] for name in names.split()]
    return emit(of(*results), columns, [[target] for target in targets], real, **options)


def lines(*results: ca.SX, **options) -> list[str]:
    return list(code(*results, **options).lines)


CASES = table(__file__)


def test_formulas_are_short_conditions_bools_and_extremes_comparisons():
    for expression, expected in CASES["formulas"].items():
        assert lines(NAMES.value(expression)) == [f"r0 = {expected};"], expression


s, near = ca.sin(x), ca.fabs(x) < 0.1
inner = choose(y < z, ca.exp(y), ca.cos(z))
first = choose(less, ca.exp(x), ca.sin(y))
NAMES = Names(globals())


@pytest.mark.parametrize("name", CASES["statements"])
def test_statements_are_where_they_are_needed(name):
    case = CASES["statements"][name]
    assert "\n".join(lines(*NAMES.value(case["results"]))) == case["text"]


def test_branches_that_cannot_be_one_are_two_and_nesting_ends():
    between = first + z  # it is used outside, so that one branch cannot contain both selects
    found = lines(choose(less, ca.tan(between), ca.cos(between)), between)
    assert sum("if (" in line for line in found) == 2
    found = lines(choose(less, s, inner), choose(less, z, inner * inner))
    assert {"    r0 = t1;", "    r1 = t1 * t1;"} <= {*found}
    value = x
    for k in range(200):
        value = choose(x < 200 - k, ca.sin(x + k), value)
    found = lines(value)
    assert max(len(line) - len(line.lstrip()) for line in found) <= 4 * 31
    assert sum("if (" in line for line in found) == 30
    for cheap in (1, 12):  # their operands would wait for each other
        found = lines(*(choose(less, x + k, z) for k in range(cheap)))
        assert not any("if (" in line for line in found)
    found = lines(reduce(add, [ca.sin(x + k) for k in range(40)]))
    assert len(found) > 5
    assert max(map(len, found)) < 200


def test_states_may_be_results():
    """A place is read before it is written, also in a branch, and not written with its value."""
    loads = {(0, 0): "s->x", (1, 0): "s->y"}
    targets = ["s->x = {};", "s->y = {};"]
    found = code(choose(z > 0, ca.sin(y), x), x, loads=loads, targets=targets)
    texts = [line.strip() for line in found.lines]
    assert "if (z > 0.0) {" in texts
    assert "s->x = x;" not in texts
    assert texts.index("const double x = s->x;") < texts.index("s->x = SF_SIN(y);")
    assert texts.index("const double y = s->y;") < texts.index("s->y = x;")
    assert found.used == {(0, 0), (1, 0), (2, 0)}
    kept = code(x, loads=loads, targets=targets[:1])
    assert (kept.lines, kept.used) == ((), frozenset())
    for condition, shown in ((z > 0, "!(z > 0.0)"), (z == 0, "z != 0.0")):
        found = lines(choose(condition, x, ca.sin(y)), loads={(0, 0): "s->x"}, targets=targets[:1])
        assert found == [f"if ({shown}) {{", "    s->x = SF_SIN(y);", "}"]
    found = lines(choose(less, ca.sin(x) * z, y), loads={(2, 0): "param->z"})
    assert found[1] == "    const double z = param->z;"
    found = lines(  # results are written last if places have no name
        y, choose(less, ca.sin(x), z), names="a[0] a[1] a[2]", targets=["r[0] = {};", "r[1] = {};"]
    )
    assert found[-2:] == ["r[0] = a[1];", "r[1] = t1;"]


def test_arguments_and_results_may_be_bools():
    found = code(
        choose(x, y, 2), either(x, y < 0), 1 - x, names="b y z", conditions=[0], truths=[1],
        targets=["r = {};", "const bool u = {};", "s = {};"],
    )  # fmt: skip
    expected = {"r = b ? y : 2.0;", "const bool u = b || y < 0.0;", "s = 1.0 - (b ? 1.0 : 0.0);"}
    assert {*found.lines} == expected


def test_counts_names_and_functions_of_float():
    found = code(choose(less, ca.sin(x), ca.exp(y) / z))
    assert (found.operations, found.calls) == (5, {"sin": 1, "exp": 1})
    found = code(ca.sin(x) + ca.sin(y) * ca.fabs(x))
    assert (found.operations, found.calls) == (5, {"sin": 2, "fabs": 1})
    assert found.used == {(0, 0), (1, 0)}
    assert lines(s * y + s, names="t1 y z")[0] == "const double t_1 = SF_SIN(t1);"
    text = "const float t1 = 0.1f * SF_TANHF(x) + SF_POWF(y < x ? y : x, 1.5f);"
    wanted = 0.1 * ca.tanh(x) + ca.fmin(x, y) ** 1.5 + ca.sqrt(y)
    assert lines(wanted, real=FLOAT) == [text, "r0 = t1 + sqrtf(y);"]
    with pytest.raises(ValueError, match="operations that C99 has, got erfinv, printme"):
        code(ca.erfinv(x) + ca.SX.binary(ca.OP_PRINTME, x, y))
    step = routines(CBlock(block_of(LuGre()), DOUBLE, guards=False))[-1]
    assert step.calls == {"exp": 1, "tanh": 1, "expm1": 1, "fabs": 1}
    text = "\n".join(step.statements)
    assert text.index("if (fabs(") < text.index("SF_EXPM1(") < text.rindex("} else {")
    friction = routines(CBlock(block_of(VelocityBased()), DOUBLE, guards=False))[0]
    assert friction.calls == {"fabs": 1}
    assert not any("fmin" in line or "fmax" in line for line in friction.statements)


LITERALS = {
    0.0: "0.0", 1.0: "1.0", -2.5: "-2.5", 1e5: "100000.0", 1e-9: "1.0e-9", 3e20: "3.0e+20",
    1e-4: "0.0001", 1e7: "1.0e+7", inf: "HUGE_VAL", -inf: "-HUGE_VAL",
}  # fmt: skip


def test_literals_are_short_typed_and_read_back_to_the_same_number():
    for value, text in LITERALS.items():
        assert DOUBLE.literal(value) == text
        assert FLOAT.literal(value) == (f"{text}F" if "HUGE" in text else f"{text}f")
    assert (DOUBLE.literal(-0.0), DOUBLE.literal(1e-60)) == ("-0.0", "1.0e-60")
    for value in np.random.default_rng(1).standard_normal(20) * 1e3:
        assert float(DOUBLE.literal(value)) == value
        assert np.float32(FLOAT.literal(value).removesuffix("f")) == np.float32(value)
    for value, message in (
        (nan, "got nan"), (1e39, "range of float, got 1e.39"), (1e-60, "would become 0")
    ):  # fmt: skip
        with pytest.raises(ValueError, match=message):
            FLOAT.literal(value)


def test_constants_below_the_range_of_float_become_the_smallest_number():
    whole = of(x - 1e-67, x * 2e-45, x + 3.0, x / 1e-30)
    assert representable(whole, DOUBLE) is whole
    before = sorted(n.value for n in whole.nodes if n.op == ca.OP_CONST)
    after = sorted(n.value for n in representable(whole, FLOAT).nodes if n.op == ca.OP_CONST)
    assert min(map(abs, before)) < 1e-60
    assert min(map(abs, after)) == SMALLEST_FLOAT
    assert {abs(v) for v in after} == {SMALLEST_FLOAT, 1e-30, 3.0}


def test_statements_are_in_an_order_in_which_few_values_are_live():
    random = np.random.default_rng(0)
    takes = [set(random.integers(0, i, min(i, 3)).tolist()) if i else set() for i in range(200)]
    order = ordered(takes, [{i} for i in range(200)])
    assert sorted(order) == list(range(200))
    place = {i: k for k, i in enumerate(order)}
    assert all(place[j] < place[i] for i in range(200) for j in takes[i])
    # twenty parallel chains of three statements end in one sum of two terms at a time
    takes = [set() for _ in range(20)] + [{i} for i in range(40)]
    takes += [{40, 41}] + [{59 + i, 41 + i} for i in range(1, 19)]
    order = ordered(takes, [{i} for i in range(len(takes))])
    for k in range(len(order)):
        later = set().union(*(takes[i] for i in order[k + 1 :]))
        assert len(later & {*order[: k + 1]}) <= 3
    stored = [set(), {0}, {0}, {2}], [{0}, set(), {2}, set()]  # a stored value can wait
    assert ordered(*stored) == [0, 2, 1, 3]
    circle = [set(), {0, 3}, {1}, {2}, {0}], [{0}, {1}, {2}, {3}, {4}]
    assert ordered(*circle) == [0, 4]


def selects(source: Graph) -> int:
    return sum(node.op in (SELECT, ca.OP_IF_ELSE_ZERO) for node in source.nodes)


def values(source: Graph, points: np.ndarray) -> np.ndarray:
    column = ca.vertcat(*rebuild(source, [x, y, z], {}))
    return ca.Function("f", [x, y, z], [column]).map(len(points))(*points.T).full()


a, b = x < y, y < z


def test_selects_whose_condition_is_known_are_removed():
    points = np.random.default_rng(0).integers(-2, 3, (400, 3)).astype(float)
    names = Names(globals(), smooth=smooth)
    for text, left in CASES["known_conditions"].items():
        expression = names.value(text)
        source = settled(of(expression))
        assert selects(source) == left, text
        assert np.array_equal(values(source, points), values(of(expression), points))
    known = choose(a, x, y)
    assert selects(settled(of(choose(a, known * 2, z), known))) == 2  # it is also a result
    once = simplified(of(ca.fmin(x, y), choose(flag, y, ca.fmax(x, 0)), invert(less)))
    assert not {node.op for node in once.nodes} & LOWERED
    assert simplified(once) == once
