"""Every operation in C, bit for bit against CasADi's virtual machine; form of the statements."""

from functools import reduce
from operator import add, mul, sub, truediv

import casadi as ca
import numpy as np
import pytest

from symfric import Output, Variable
from symfric.codegen import Block, generate
from symfric.codegen.runner import link_program, program, run_c, run_vm
from symfric.emitter.c99 import DOUBLE, FLOAT, FORMS, FUNCTIONS, REALS
from symfric.emitter.emit import emit
from symfric.emitter.logic import LOWERED
from symfric.foundation.graph import LEAVES, graph

a, b = Variable("a", "1"), Variable("b", "1")
x, y = a.symbol, b.symbol
less, equal = x < y, x == y

OPERATIONS = {
    "add": x + y,
    "sub": x - y,
    "mul": x * y,
    "div": x / y,
    "neg": -x,
    "sq": x * x,
    "twice": 2 * x,
    "inv": 1 / x,
    "sqrt": ca.sqrt(x),
    "sin": ca.sin(x),
    "cos": ca.cos(x),
    "tan": ca.tan(x),
    "asin": ca.asin(x),
    "acos": ca.acos(x),
    "atan": ca.atan(x),
    "atan2": ca.atan2(x, y),
    "sinh": ca.sinh(x),
    "cosh": ca.cosh(x),
    "tanh": ca.tanh(x),
    "asinh": ca.asinh(x),
    "acosh": ca.acosh(x),
    "atanh": ca.atanh(x),
    "exp": ca.exp(x),
    "expm1": ca.expm1(x),
    "log": ca.log(x),
    "log1p": ca.log1p(x),
    "erf": ca.erf(x),
    "pow": x**y,
    "constpow": x**1.7,
    "hypot": ca.hypot(x, y),
    "fmod": ca.fmod(x, y),
    "remainder": ca.remainder(x, y),
    "fabs": ca.fabs(x),
    "sign": ca.sign(x),
    "copysign": ca.copysign(x, y),
    "floor": ca.floor(x),
    "ceil": ca.ceil(x),
    "fmin": ca.fmin(x, y),
    "fmax": ca.fmax(x, y),
    "lt": less,
    "le": x <= y,
    "eq": equal,
    "ne": x != y,
    "not": ca.logic_not(x),
    "and": ca.logic_and(less, y < 2),
    "or": ca.logic_or(less, y < 0),
    "if_else": ca.if_else(less, x, y),
    "if_else_zero": ca.if_else(less, x, 0),
    "if_number": ca.if_else(x, x + 1, y),
    "nested logic": ca.logic_or(ca.logic_and(less, x < 1), ca.logic_not(equal)),
    "bool as number": 2 * less - equal,
    "nested if_else": ca.if_else(less, ca.if_else(x < 0, y, x), ca.if_else(y < 0, x, -y)),
    "sign of a sum": ca.sign(x + y),
    "minus a negative constant": x - ca.SX(-3) * y + ca.cos(-x),
    "clip": ca.fmin(ca.fmax(x, -0.7), 1.2),
    "clip from above": ca.fmax(ca.fmin(x, 1.2), -0.7),
    "clip with bounds": ca.fmax(-1, ca.fmin(x, 3 - ca.fabs(ca.fmin(y, 2)))),
    "cut at zero": ca.fmax(0, x),
    "clip of a clip": ca.fmin(ca.fmax(ca.fmin(x, 2), y), 1),
    "logic as number": ca.fmax(less, y < 2) + ca.fmin(x < 1, equal) * ca.if_else(less, equal, 1),
    "number as logic": ca.if_else(ca.if_else(less, x < 0, 0) * 1, y, ca.if_else(equal, 0, less)),
    "logic of signs": ca.if_else(ca.sign(x) == 0, y, ca.if_else(ca.sign(y) < 0, x, -y)),
    "opposite against zero": (-ca.sin(x) < 0) + 2 * (ca.fabs(y - 1) <= 0),
    "negated": ca.logic_not(ca.logic_and(ca.logic_not(equal), ca.logic_or(less, x < 1))),
    "negated order": ca.if_else(ca.logic_not(less), x, ca.if_else(ca.logic_not(x <= 2), y, 3)),
    "branch": ca.if_else(less, ca.sin(x) / y, ca.if_else(y < 0, ca.exp(-x * x), ca.cos(y))),
    "derivative of fmin": ca.jacobian(ca.fmin(x * x, y) + ca.fmax(x, 0.5), x),
    "infinity": ca.fmin(x, ca.SX.inf()),
}

SPECIAL = [0.0, -0.0, 1.0, -1.0, 0.5, -2.5, 3.0, 1e-300, 1e300, np.inf, -np.inf, np.nan]


PAIRS = np.array([(p, q) for p in SPECIAL for q in SPECIAL])
INPUTS = np.vstack([PAIRS, np.random.default_rng(2).standard_normal((2000, 2)) * [2.0, 3.0]])
NUMBERS = ~np.isnan(INPUTS).any(axis=1)

OTHER_AT_NAN = {"fmin", "fmax", "clip with bounds", "derivative of fmin"}
"""See `logic`: what is not a number stays that in fmin and fmax of two variables."""


def random_trees(count: int, depth: int) -> dict[str, ca.SX]:
    """Sums, differences, products and quotients nested at random: parentheses must be right."""
    random = np.random.default_rng(0)

    def tree(level: int) -> ca.SX:
        if level == 0:
            return [x, y, -x, ca.SX(float(random.integers(2, 9)))][random.integers(4)]
        operation = [add, sub, mul, truediv][random.integers(4)]
        return operation(tree(level - 1), tree(level - int(random.integers(1, level + 1))))

    return {f"tree_{i}": tree(depth) for i in range(count)}


def as_block(expressions) -> Block:
    outputs = {f"o{i}": Output(e, "1") for i, e in enumerate(expressions.values())}
    return Block("operations", inputs=(a, b), outputs=outputs)


def both(block, real, inputs, compiler, folder):
    generated = generate(block, folder, real=real, guards=False)
    (folder / "main.c").write_text(program(block, REALS[real], guards=False))
    parts = [folder / "main.c", generated.source(real)]
    link_program(compiler, parts, folder, folder / "main")
    c = run_c(block, REALS[real], folder / "main", inputs, guards=False)
    return c, run_vm(block, REALS[real], inputs, guards=False)


@pytest.fixture(scope="module")
def special(compiler, tmp_path_factory):
    return both(as_block(OPERATIONS), "double", INPUTS, compiler, tmp_path_factory.mktemp("ops"))


@pytest.mark.parametrize("index", range(len(OPERATIONS)), ids=list(OPERATIONS))
def test_operation_has_the_bits_of_casadi_also_at_special_values(special, index):
    c, vm = (rows[:, index] for rows in special)
    if list(OPERATIONS)[index] in OTHER_AT_NAN:
        assert not np.array_equal(c, vm, equal_nan=True)
        c, vm = c[NUMBERS], vm[NUMBERS]
    assert np.array_equal(c, vm, equal_nan=True)


@pytest.mark.parametrize(
    "name", ["neg", "sign", "floor", "copysign", "fmod", "if_else_zero", "fmin", "fmax", "clip"]
)
def test_operation_keeps_the_sign_of_zero(special, name):
    c, vm = (rows[:, list(OPERATIONS).index(name)] for rows in special)
    zeros = (vm == 0.0) & NUMBERS
    assert zeros.any()
    assert np.array_equal(np.signbit(c[zeros]), np.signbit(vm[zeros]))


def test_every_operation_that_can_be_written_is_tested():
    source = graph(as_block(OPERATIONS).step)
    assert {node.op for node in source.nodes} - LEAVES == set(FORMS) | set(FUNCTIONS) | LOWERED


def test_nested_arithmetic_keeps_the_order_of_operations(compiler, tmp_path):
    inputs = np.random.default_rng(3).standard_normal((200, 2))
    c, vm = both(as_block(random_trees(60, 5)), "double", inputs, compiler, tmp_path)
    assert np.array_equal(c, vm, equal_nan=True)


def test_float_operations_agree_to_single_precision(compiler, tmp_path):
    smooth = {k: OPERATIONS[k] for k in ("add", "mul", "div", "sin", "exp", "pow", "hypot", "tanh")}
    inputs = np.random.default_rng(4).uniform(0.5, 2.0, (500, 2))
    c, vm = both(as_block(smooth), "float", inputs, compiler, tmp_path)
    assert np.abs(c / vm - 1).max() < 5e-7
    assert np.abs(c / vm - 1).max() > 0


def test_operations_without_counterpart_are_refused_all_by_name():
    f = ca.Function("f", [x, y], [ca.erfinv(x) + ca.SX.binary(ca.OP_PRINTME, x, y)])
    with pytest.raises(ValueError, match="operations that C99 has, got erfinv, printme"):
        emit(graph(f), [["a"], ["b"]], [["r = {};"]], DOUBLE)


def lines(expression, real=DOUBLE, names=("a", "b")):
    source = graph(ca.Function("f", [x, y], [expression]))
    return list(emit(source, [[names[0]], [names[1]]], [["r = {};"]], real).lines)


@pytest.mark.parametrize(
    ("expression", "text"),
    [
        (x - (y - 1), "r = a - (b - 1.0);"),
        (x + (y + 1), "r = a + (b + 1.0);"),
        ((x + y) * 3, "r = 3.0 * (a + b);"),
        (x / (y * 2), "r = a / (2.0 * b);"),
        (ca.exp(-(x + y)), "r = SF_EXP(-(a + b));"),
        (ca.fabs(x), "r = fabs(a);"),
        (ca.if_else(x < y, x, 2.5), "r = a < b ? a : 2.5;"),
        (ca.logic_and(x < y, y < 2), "r = a < b && b < 2.0 ? 1.0 : 0.0;"),
    ],
)
def test_formulas_stay_recognisable(expression, text):
    assert lines(expression) == [text]


def test_shared_values_become_constant_locals():
    s = ca.sin(x)
    assert lines(s * y + s) == ["const double t1 = SF_SIN(a);", "r = t1 * b + t1;"]


def test_a_value_that_its_user_writes_twice_becomes_a_constant_local():
    assert lines(ca.sin(x) ** 2) == ["const double t1 = SF_SIN(a);", "r = t1 * t1;"]


def test_shared_conditions_become_bools():
    condition = x < y
    first, second = ca.if_else(condition, x, y), ca.if_else(condition, 1, y)
    assert lines(first * second)[0] == "const bool t1 = a < b;"


def test_float_uses_float_functions_and_literals_only():
    expression = 0.1 * ca.tanh(x) + ca.fmin(x, y) ** 1.5 + ca.sqrt(y)
    text = "const float t1 = 0.1f * SF_TANHF(a) + SF_POWF(b < a ? b : a, 1.5f);"
    assert lines(expression, FLOAT) == [text, "r = t1 + sqrtf(b);"]


def test_locals_never_hide_an_argument():
    s = ca.sin(x)
    assert lines(s * y + s, names=("t1", "b"))[0] == "const double t_1 = SF_SIN(t1);"


def test_long_sums_are_split_into_lines():
    terms = [ca.sin(x + k) for k in range(40)]
    text = lines(reduce(add, terms))
    assert len(text) > 5
    assert max(len(line) for line in text) < 200


def test_counts_calls_and_operations():
    source = graph(ca.Function("f", [x, y], [ca.sin(x) + ca.sin(y) * ca.fabs(x)]))
    code = emit(source, [["a"], ["b"]], [["r = {};"]], DOUBLE)
    assert code.calls == {"sin": 2, "fabs": 1}
    assert code.operations == 5
    assert code.used == {(0, 0), (1, 0)}
