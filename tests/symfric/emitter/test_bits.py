"""C of every operation, of random graphs, branches and loops has the bits of CasADi.

JavaScript has the numbers of CasADi to 1e-12, since the functions of a browser are its own.
"""

from collections.abc import Callable
from operator import add, mul, sub, truediv

import casadi as ca
import numpy as np
import pytest
from one_program import OneProgram
from scripts import evaluated, in_python, misses, needs_browser, opened
from tables import Names, table

from symfric import Output, Variable
from symfric.codegen import Block
from symfric.codegen.blocks.block import CBlock, ElementArray
from symfric.codegen.runner import run_vm
from symfric.codegen.source import source
from symfric.emitter.c99 import DOUBLE, FORMS, FUNCTIONS
from symfric.emitter.logic import LOWERED
from symfric.foundation.graph import LEAVES, graph

a, b = Variable("a", "1"), Variable("b", "1")
x, y = a.symbol, b.symbol
less, equal = x < y, x == y

UNARY = (
    *("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh"),
    *("acosh", "atanh", "exp", "expm1", "log", "log1p", "erf", "fabs", "sign", "floor", "ceil"),
)
BINARY = ("atan2", "hypot", "fmod", "remainder", "copysign", "fmin", "fmax")
NAMES = Names(globals())
OPERATIONS = {
    **{name: getattr(ca, name)(x) for name in UNARY},
    **{name: getattr(ca, name)(x, y) for name in BINARY},
    **{name: NAMES.value(text) for name, text in table(__file__)["operations"].items()},
}
OTHER_AT_NAN = {"fmin", "fmax", "clip with bounds", "derivative of fmin"}
"""Operations with another result for NaN, see `logic`."""
SPECIAL = [0.0, -0.0, 1.0, -1.0, 0.5, -2.5, 3.0, 1e-300, 1e300, np.inf, -np.inf, np.nan]
PAIRS = np.array([(p, q) for p in SPECIAL for q in SPECIAL])
INPUTS = np.vstack([PAIRS, np.random.default_rng(2).standard_normal((1000, 2)) * [2.0, 3.0]])
NUMBERS = ~np.isnan(INPUTS).any(axis=1)


def as_block(expressions: dict[str, ca.SX]) -> Block:
    outputs = {f"o{i}": Output(e, "1") for i, e in enumerate(expressions.values())}
    return Block("operations", inputs=(a, b), outputs=outputs)


def trees(count: int, depth: int) -> dict[str, ca.SX]:
    """Randomly nested sums, differences, products and quotients, to test parentheses."""
    random = np.random.default_rng(0)

    def tree(level: int) -> ca.SX:
        if level == 0:
            return [x, y, -x, ca.SX(float(random.integers(2, 9)))][random.integers(4)]
        operation = [add, sub, mul, truediv][random.integers(4)]
        return operation(tree(level - 1), tree(level - int(random.integers(1, level + 1))))

    return {f"tree_{i}": tree(depth) for i in range(count)}


def places() -> Block:
    """States that swap their values, in branches that read both."""
    p, q, u = Variable("p", "1", start=0.3), Variable("q", "1", start=-0.4), Variable("u", "1")
    both = ca.vertcat(q.symbol + ca.sin(u.symbol), p.symbol)
    swapped = ca.if_else(u.symbol > 0, both, ca.vertcat(p.symbol, -q.symbol))
    turned = ca.vertcat(swapped[1], ca.cos(p.symbol))
    again = ca.if_else(swapped[0] < swapped[1], turned, swapped)
    outputs = {"y": Output(p.symbol, "1")}
    return Block("places", states=(p, q), inputs=(u,), next=again, outputs=outputs)


ONE: list[Callable[[ca.SX, ca.SX], ca.SX]] = [
    lambda x, u: ca.sin(x + u),
    lambda x, u: ca.exp(-((x + u) ** 2)),
    lambda x, u: ca.tanh(x - u),
    lambda x, u: ca.fabs(x),
    lambda x, u: ca.sign(x),
    lambda x, u: ca.floor(x),
    lambda x, u: ca.sqrt(ca.fabs(x)),
    lambda x, u: -x,
    lambda x, u: x * x,
]
"""Functions include an input, since compilers evaluate functions of constants more precisely."""
TWO = [add, sub, mul, lambda x, y: x / (1 + y * y), ca.fmin, ca.fmax, ca.hypot]
COMPARED = [ca.lt, ca.le, ca.eq, ca.ne]


def nested(seed: int, operations: int) -> Block:
    """States and outputs that share parts, with conditions that many selects share."""
    random = np.random.default_rng(seed)
    states = tuple(Variable(f"s_{i}", "1", start=0.3 * i - 0.2) for i in range(2))
    inputs = tuple(Variable(f"u_{i}", "1") for i in range(3))
    numbers = [v.symbol for v in (*states, *inputs)] + [ca.SX(c) for c in (0.0, 1.0, -2.0, 0.5)]
    conditions = [numbers[0] < numbers[2], numbers[3] <= 0]

    def one_of(pool: list, recent: int = 12):
        """Return mostly a recent one, for deep graphs."""
        some = pool[-recent:] if random.random() < 0.7 else pool
        return some[random.integers(len(some))]

    for _ in range(operations):
        kind, p, q = random.random(), one_of(numbers), one_of(numbers)
        c, d = one_of(conditions, 3), one_of(conditions, 4)
        if kind < 0.15:
            conditions.append(random.choice(COMPARED)(p, q))
        elif kind < 0.25:
            joined = [ca.logic_and(c, d), ca.logic_or(c, d), ca.logic_not(d)]
            conditions.append(joined[random.integers(3)])
        elif kind < 0.6:
            chosen = (ca.if_else(c, p, q), ca.if_else(c, p, q), c * p, ca.if_else(p, q, c))
            numbers.append(chosen[random.integers(4)])
        elif kind < 0.75:
            numbers.append(ONE[random.integers(len(ONE))](p, inputs[0].symbol))
        else:
            numbers.append(TWO[random.integers(len(TWO))](p, q))
    numbers = [ca.fmin(ca.fmax(e, -1e30), 1e30) for e in numbers]
    outputs = {f"y_{i}": Output(e, "1") for i, e in enumerate([*numbers[-6:], conditions[-1]])}
    following = ca.vertcat(*(e / (1 + ca.fabs(e)) for e in numbers[-3:-1]))
    return Block(f"r_{seed}", states=states, inputs=inputs, next=following, outputs=outputs)


N = 6
STEPS = (
    lambda p, q, r: p + q,
    lambda p, q, r: p - q,
    lambda p, q, r: p * q,
    lambda p, q, r: ca.if_else(p < q, r, p),
    lambda p, q, r: ca.if_else(ca.logic_and(p < r, q <= r), q, ca.if_else(p < q, r, q)),
    lambda p, q, r: ca.fabs(p) - q,
    lambda p, q, r: ca.sign(p) * r,
    lambda p, q, r: ca.logic_or(p < q, r < 0),
)


def elements(seed: int, odd: bool) -> Block:
    """Arrays whose elements make the same random steps, except one if `odd`.

    An element takes its own numbers, those of its neighbours, the first or the last, inputs,
    constants and a sum over all; its results are states, and terms of sums.
    """
    random = np.random.default_rng(seed)

    def column(name: str, size: int, start: bool) -> tuple[Variable, ...]:
        values = random.standard_normal(size) if start else np.zeros(size)
        return tuple(Variable(f"{name}_{i}", "1", start=float(s)) for i, s in enumerate(values, 1))

    x, y, k, u = (
        column("x", N, True),
        column("y", N, True),
        column("k", N, True),
        column("u", 3, False),
    )
    p, q, r, w = ([v.symbol for v in of] for of in (x, y, k, u))
    total, constants = (
        sum((r[i] * q[i] for i in range(N)), ca.SX(0)),
        random.choice([0.5, 1, -2], N),
    )
    leaves = random.integers(0, 11, 5)
    steps = [(random.integers(len(STEPS)), random.integers(0, 40, 3)) for _ in range(6)]
    other = (random.integers(len(STEPS)), random.integers(0, 40, 3))
    at, which = (int(random.integers(len(steps))), int(random.integers(N))) if odd else (-1, -1)
    made: list[list[ca.SX]] = []
    for i in range(N):
        known = [p[i], q[i], r[i], p[(i + 1) % N], p[0], r[N - 1], p[i - 1], w[0],
                 ca.SX(constants[i]), ca.SX(0.75), total]  # fmt: skip
        made.append([*(known[leaf] for leaf in leaves), w[1], p[i]])
        for number, step in enumerate(steps):
            operation, of = other if (number, i) == (at, which) else step
            made[i].append(ca.SX(STEPS[operation](*(made[i][o % len(made[i])] for o in of))))
    sums = [
        w[2] + sum((m[-1] for m in made), ca.SX(0)),
        sum((m[-2] for m in made[1:]), made[0][-2]),
    ]
    return Block(
        f"e_{seed}", states=(*x, *y), inputs=u, parameters=k,
        next=ca.vertcat(*(m[-1] for m in made), *(m[-3] for m in made)),
        outputs={f"s_{j}": Output(e, "1") for j, e in enumerate([*sums, total * made[2][-1]])},
        arrays=(ElementArray("state", "x", 0, N), ElementArray("state", "y", N, N),
                ElementArray("param", "k", 0, N)),
    )  # fmt: skip


NESTED = [nested(seed, 40 + 40 * seed) for seed in range(5)]
ARRAYS = [elements(seed, odd=seed % 2 == 1) for seed in range(40)]


@pytest.fixture(scope="module")
def everything(compiler, tmp_path_factory) -> OneProgram:
    blocks = [as_block(OPERATIONS), as_block(trees(40, 5)), places(), *NESTED, *ARRAYS]
    return OneProgram(
        blocks, tmp_path_factory.mktemp("bits"), compiler, guards=False, flags=("-O1",)
    )


def test_operations_have_the_bits_of_casadi_also_at_special_values(everything):
    random = np.random.default_rng(5)
    tree, u = random.standard_normal((200, 2)), random.standard_normal((400, 1))
    jobs = [(0, INPUTS), (1, tree), (2, u)]
    c, *others = everything.run(jobs)
    for k, rows in enumerate(others, start=1):
        assert np.array_equal(rows, run_vm(everything.several[k], jobs[k][1]), equal_nan=True)
    vm = run_vm(everything.several[0], INPUTS)
    zeros = (vm == 0.0) & NUMBERS[:, None]
    for i, name in enumerate(OPERATIONS):
        rows = slice(None)
        if name in OTHER_AT_NAN:
            assert not np.array_equal(c[:, i], vm[:, i], equal_nan=True)
            rows = NUMBERS
        assert np.array_equal(c[rows, i], vm[rows, i], equal_nan=True), name
    for name in ("neg", "sign", "floor", "copysign", "fmod", "if_else_zero", "fmin", "clip"):
        i = list(OPERATIONS).index(name)
        assert zeros[:, i].any()
        assert (np.signbit(c) == np.signbit(vm))[zeros[:, i], i].all()
    nodes = graph(everything.several[0].block.step).nodes
    assert {node.op for node in nodes} - LEAVES == set(FORMS) | set(FUNCTIONS) | LOWERED


@needs_browser
def test_javascript_has_the_numbers_of_casadi_also_at_special_values():
    step = as_block(OPERATIONS).step
    rows = [((), (), pair) for pair in INPUTS]
    with opened() as page:
        off = misses(evaluated(page, step, rows), in_python(step, rows), 1e-12)
        for k, name in enumerate(OPERATIONS):
            assert off[:, k].any() == (name in OTHER_AT_NAN), (name, INPUTS[off[:, k]])
            assert not off[NUMBERS, k].any(), (name, INPUTS[off[:, k]])
        for block in (*NESTED, places(), as_block(trees(40, 5))):
            counts = [block.step.numel_in(i) for i in range(3)]
            random = np.random.default_rng(6)
            rows = [[random.standard_normal(n) for n in counts] for _ in range(200)]
            found, expected = evaluated(page, block.step, rows), in_python(block.step, rows)
            assert not misses(found, expected, 1e-12).any(), block.name


def test_random_graphs_have_the_bits_of_casadi_with_branches(everything):
    equal_bits(everything, range(3, 3 + len(NESTED)))
    texts = [source(c) for c in everything.several[3 : 3 + len(NESTED)]]
    assert sum(text.count("if (") for text in texts) > 12
    assert not any(word in text for word in ("fmin", "fmax") for text in texts)


def equal_bits(program: OneProgram, which: range) -> None:
    for k in which:
        u = np.random.default_rng(k).standard_normal((200, 3))
        u[::7, 0] = 0.0
        (rows,) = program.run([(k, u)])
        assert np.array_equal(rows, run_vm(program.several[k], u)), k


@pytest.mark.slow
def test_many_random_graphs_have_the_bits_of_casadi(compiler, tmp_path):
    blocks = [nested(seed, 20 + seed % 150) for seed in range(100, 300)]
    equal_bits(OneProgram(blocks, tmp_path, compiler, guards=False), range(200))


def test_loops_over_random_elements_have_the_bits_of_casadi(everything):
    first = 3 + len(NESTED)
    looped = ["for (int" in source(CBlock(block, DOUBLE, False)) for block in ARRAYS]
    assert sum(looped[::2]) > 13
    assert sum(looped[1::2]) > 6
    random = np.random.default_rng(7)
    draws: list[Callable[[int, int], np.ndarray]] = [
        lambda n, m: random.standard_normal((n, m)),
        lambda n, m: random.integers(-2, 3, (n, m)).astype(float),
        lambda n, m: random.choice(SPECIAL, (n, m)),
    ]
    shapes = (*zip(draws, (12, 12, 2), strict=True), *[(draws[2], 2)] * 5)
    numbers = range(first, first + len(ARRAYS))
    jobs = [(k, draw(n, 3), draw(n, N)) for k in numbers for draw, n in shapes]
    for (k, u, p), rows in zip(jobs, everything.run(jobs), strict=True):
        expected = run_vm(everything.several[k], u, parameters=p)
        assert np.array_equal(rows, expected, equal_nan=True), k
