"""C99 statements for the graph of a CasADi function, in single static assignment form.

A shared value becomes a constant local; a value that is used once is written where it is used, so
that formulas stay recognisable. The order of the operations is CasADi's, so that double precision
gives the same bits.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from re import fullmatch

import casadi as ca

from symfric.emitter.c99 import (
    ATOM,
    EQUAL,
    FORMS,
    FUNCTIONS,
    LOGIC,
    SIGN,
    TERNARY,
    Real,
    form,
    operation_name,
)
from symfric.foundation.graph import LEAVES, Graph

LONGEST = 5
"""Operations of an operand beyond which it becomes a local."""


@dataclass(frozen=True)
class Code:
    """Statements of a function body.

    Attributes:
        used: (argument, row) of the inputs that occur.
        lines: C, one statement a line.
        calls: function of math.h (double's name) -> number of calls.
        operations: number of operations, calls included.
    """

    used: frozenset[tuple[int, int]]
    lines: tuple[str, ...]
    calls: Counter[str]
    operations: int


@dataclass(frozen=True)
class _Expression:
    text: str
    binds: int
    weight: int = 0
    logical: bool = False

    def within(self, least: int) -> str:
        """The text, in parentheses where it binds less tightly than `least`."""
        return self.text if self.binds >= least else f"({self.text})"


def emit(
    source: Graph, names: Sequence[Sequence[str]], targets: Sequence[Sequence[str]], real: Real
) -> Code:
    """Write `source` as C statements.

    Args:
        source: the graph of the function.
        names: the C identifiers that hold the rows of each argument.
        targets: a pattern for every row of every result, such as "state->z = {};". No statement
            before the targets writes anything, so arguments and results may share memory.
        real: floating point type.

    Raises:
        ValueError: operations that have no counterpart in C99, all by name, or constants that do
            not fit the type.
    """
    unsupported = {node.op for node in source.nodes} - LEAVES - set(FORMS) - set(FUNCTIONS)
    if unsupported:
        got = ", ".join(sorted(map(operation_name, unsupported)))
        raise ValueError(f"codegen: expected operations that C99 has, got {got}")
    stem = _stem([name for group in names for name in group])
    uses, last = _uses(source), {i for row in source.results for i in row}
    lines: list[str] = []
    found: list[_Expression] = []
    for i, node in enumerate(source.nodes):
        expression = _expression(source, i, found, names, real)
        long = expression.weight > LONGEST and i not in last
        if node.op not in LEAVES and (uses[i] > 1 or long):
            name = f"{stem}{len(lines) + 1}"
            kind = "bool" if expression.logical else real.name
            lines.append(f"const {kind} {name} = {expression.text};")
            expression = _Expression(name, ATOM, logical=expression.logical)
        found.append(expression)
    for row, patterns in zip(source.results, targets, strict=True):
        for i, pattern in zip(row, patterns, strict=True):
            lines.append(pattern.format(_number(found[i], real).text))
    return Code(
        frozenset(node.entry for node in source.nodes if node.op == ca.OP_INPUT),
        tuple(lines),
        Counter(FUNCTIONS[node.op] for node in source.nodes if node.op in FUNCTIONS),
        source.operations,
    )


def _stem(names: Sequence[str]) -> str:
    """A beginning of the locals' names that no argument has."""
    stem = "t"
    while any(fullmatch(stem + r"\d+", name) for name in names):
        stem += "_"
    return stem


def _uses(source: Graph) -> Counter[int]:
    """How often each node is written out by the others."""
    found = Counter(i for row in source.results for i in row)
    for node in source.nodes:
        repeats = FORMS[node.op].pattern.count("{0}") if node.op in FORMS else 0
        for i in node.args:
            found[i] += max(repeats, 1)
    return found


def _expression(
    source: Graph,
    number: int,
    found: Sequence[_Expression],
    names: Sequence[Sequence[str]],
    real: Real,
) -> _Expression:
    node = source.nodes[number]
    if node.op == ca.OP_INPUT:
        argument, row = node.entry
        return _Expression(names[argument][row], ATOM)
    if node.op == ca.OP_CONST:
        text = real.literal(node.value)
        return _Expression(text, SIGN if text.startswith("-") else ATOM)
    how = form(node.op, len(node.args), real)
    operands = [
        (_condition if k < how.conditions else _number)(found[i], real)
        for k, i in enumerate(node.args)
    ]
    text = how.pattern.format(
        *(operand.within(least) for operand, least in zip(operands, how.needs, strict=True)),
        zero=real.literal(0.0),
        one=real.literal(1.0),
        two=real.literal(2.0),
    )
    weight = 1 + sum(operand.weight for operand in operands)
    return _Expression(text, how.binds, weight, how.logical)


def _number(value: _Expression, real: Real) -> _Expression:
    """A bool as the number 1 or 0 that CasADi means."""
    if not value.logical:
        return value
    text = f"{value.within(LOGIC)} ? {real.literal(1.0)} : {real.literal(0.0)}"
    return _Expression(text, TERNARY, value.weight)


def _condition(value: _Expression, real: Real) -> _Expression:
    """A number as the bool that it is where CasADi expects one."""
    if value.logical:
        return value
    return _Expression(
        f"{value.within(EQUAL + 1)} != {real.literal(0.0)}", EQUAL, value.weight, True
    )
