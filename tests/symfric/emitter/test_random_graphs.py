"""Random expressions with nested selects: the C has the bits of CasADi's virtual machine."""

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from symfric import Output, Variable
from symfric.codegen import Block, generate
from symfric.codegen.runner import compile_object, link_program, program, run_c, run_vm
from symfric.emitter.c99 import DOUBLE
from symfric.foundation.programs import Compiler

UNARY = [
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
"""Of an input, too, where a compiler would round the function of a constant better than math.h."""
BINARY = [
    lambda x, y: x + y,
    lambda x, y: x - y,
    lambda x, y: x * y,
    lambda x, y: x / (1 + y * y),
    ca.fmin,
    ca.fmax,
    ca.hypot,
]
COMPARED = [
    lambda x, y: x < y,
    lambda x, y: x <= y,
    lambda x, y: x == y,
    lambda x, y: x != y,
]


def random_block(seed: int, operations: int) -> Block:
    """States and outputs that share parts, with conditions that many selects share."""
    random = np.random.default_rng(seed)
    states = tuple(Variable(f"s_{i}", "1", start=0.3 * i - 0.2) for i in range(2))
    inputs = tuple(Variable(f"u_{i}", "1") for i in range(3))
    numbers = [v.symbol for v in (*states, *inputs)]
    numbers += [ca.SX(c) for c in (0.0, 1.0, -2.0, 0.5)]
    conditions = [numbers[0] < numbers[2], numbers[3] <= 0]

    def one_of(pool: list, recent: int = 12):
        """Mostly a recent one, so that graphs grow deep."""
        some = pool[-recent:] if random.random() < 0.7 else pool
        return some[random.integers(len(some))]

    for _ in range(operations):
        kind = random.random()
        if kind < 0.15:
            conditions.append(random.choice(COMPARED)(one_of(numbers), one_of(numbers)))
        elif kind < 0.25:
            pair = one_of(conditions, 4), one_of(conditions, 4)
            joined = [ca.logic_and(*pair), ca.logic_or(*pair), ca.logic_not(pair[0])]
            conditions.append(joined[random.integers(3)])
        elif kind < 0.5:
            condition = one_of(conditions, 3)
            numbers.append(ca.if_else(condition, one_of(numbers), one_of(numbers)))
        elif kind < 0.55:
            numbers.append(one_of(conditions) * one_of(numbers))
        elif kind < 0.6:
            numbers.append(ca.if_else(one_of(numbers), one_of(numbers), one_of(conditions)))
        elif kind < 0.75:
            numbers.append(UNARY[random.integers(len(UNARY))](one_of(numbers), inputs[0].symbol))
        else:
            numbers.append(BINARY[random.integers(len(BINARY))](one_of(numbers), one_of(numbers)))
    numbers = [ca.fmin(ca.fmax(e, -1e30), 1e30) for e in numbers]
    outputs = {f"y_{i}": Output(e, "1") for i, e in enumerate([*numbers[-6:], conditions[-1]])}
    return Block(
        f"random_{seed}",
        states=states,
        inputs=inputs,
        next=ca.vertcat(*(e / (1 + ca.fabs(e)) for e in numbers[-3:-1])),
        outputs=outputs,
    )


def compare(seed: int, operations: int, compiler: Compiler, folder: Path) -> int:
    """Number of selects that became branches; all bits were equal."""
    block = random_block(seed, operations)
    inputs = np.random.default_rng(seed).standard_normal((300, 3))
    inputs[::7, 0] = 0.0
    generated = generate(block, folder, real="double", guards=False)
    source = generated.source("double")
    assert compile_object(compiler, source, folder / "r.o") == []
    (folder / "main.c").write_text(program(block, DOUBLE, guards=False))
    link_program(compiler, [folder / "main.c", folder / "r.o"], folder, folder / "main")
    found = run_c(block, DOUBLE, folder / "main", inputs, guards=False)
    expected = run_vm(block, DOUBLE, inputs, guards=False)
    assert np.array_equal(found, expected), source.read_text()
    text = source.read_text()
    assert "fmin" not in text
    assert "fmax" not in text
    return text.count("if (")


def test_branches_of_random_graphs_keep_all_bits(compiler: Compiler, tmp_path: Path) -> None:
    branches = [compare(seed, 40 + 40 * seed, compiler, tmp_path) for seed in range(5)]
    assert sum(branches) > 12


@pytest.mark.slow
def test_branches_of_many_random_graphs_keep_all_bits(compiler: Compiler, tmp_path: Path) -> None:
    branches = [compare(s, 20 + s % 150, compiler, tmp_path) for s in range(100, 300)]
    assert sum(branches) > 400
