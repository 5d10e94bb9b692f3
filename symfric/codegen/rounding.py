"""Rounding to a type: the operations of a block in NumPy, one by one, in that type."""

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import Block
from symfric.emitter.c99 import FUNCTIONS
from symfric.foundation.graph import SELECT, Graph, graph

Array = NDArray[Any]


def _twice(x: Array) -> Array:
    return x + x


LACKS = {"erf", "remainder"}
"""Functions of C99 that NumPy lacks, or defines differently."""
NUMPY = {"pow": "power"} | {
    f"a{name}": f"arc{name}" for name in ("sin", "cos", "tan", "tan2", "sinh", "cosh", "tanh")
}
"""Functions with other names in NumPy than in C99."""

OPERATIONS: dict[int, Callable[..., Any]] = {
    ca.OP_ADD: np.add,
    ca.OP_SUB: np.subtract,
    ca.OP_MUL: np.multiply,
    ca.OP_DIV: np.divide,
    ca.OP_NEG: np.negative,
    ca.OP_SQ: np.square,
    ca.OP_TWICE: _twice,
    ca.OP_INV: np.reciprocal,
    ca.OP_SIGN: np.sign,
    ca.OP_LT: np.less,
    ca.OP_LE: np.less_equal,
    ca.OP_EQ: np.equal,
    ca.OP_NE: np.not_equal,
    ca.OP_NOT: np.logical_not,
    ca.OP_AND: np.logical_and,
    ca.OP_OR: np.logical_or,
    ca.OP_FMIN: np.fmin,
    ca.OP_FMAX: np.fmax,
    **{
        op: getattr(np, NUMPY.get(name, name))
        for op, name in FUNCTIONS.items()
        if name not in LACKS
    },
}
"""Functions of C99 that NumPy has, by CasADi's numbers."""


def in_type(
    function: ca.Function,
    arguments: list[Array],
    kind: str,
    random: np.random.Generator | None = None,
) -> Array | None:
    """Return the results of a function, below each other, with every operation rounded to a type.

    Args:
        function: of SX, with dense arguments and results.
        arguments: rows of numbers, shape (rows, size of the argument).
        kind: NumPy's name of the type, such as "f4".
        random: rounds each inexact result randomly to one of its two neighbours, instead of to the
            nearest. Differences between runs are rounding errors.
            Source: Vignes, Mathematics and Computers in Simulation 35 (1993), CESTAC.

    Returns:
        Shape (rows, results), in double; None if NumPy lacks an operation (erf, remainder).
    """
    source, found = graph(function), list[Array]()
    count = len(arguments[0])
    with np.errstate(all="ignore"):
        for node in source.nodes:
            given = [found[i] for i in node.args]
            if node.op == ca.OP_INPUT:
                value = arguments[node.entry[0]][:, node.entry[1]]
            elif node.op == ca.OP_CONST:
                value = np.full(count, node.value)
            elif node.op in (SELECT, ca.OP_IF_ELSE_ZERO):
                value = np.where(given[0] != 0, given[1], given[2] if len(given) > 2 else 0.0)
            elif node.op not in OPERATIONS:
                return None
            elif random is None:
                value = OPERATIONS[node.op](*given)
            else:
                exact = np.asarray(OPERATIONS[node.op](*(x.astype(float) for x in given)), float)
                value = _up_or_down(exact, kind, random)
            found.append(np.asarray(value).astype(kind))
    return np.column_stack([found[i] for row in source.results for i in row]).astype(float)


def _up_or_down(exact: Array, kind: str, random: np.random.Generator) -> Array:
    """Return a random neighbour of the type for each number, or the number itself if exact.

    The double nearest to a result of an operation on floats stands for the result itself.
    """
    nearest = exact.astype(kind)
    beyond = np.where(exact > nearest, np.inf, -np.inf).astype(kind)
    other = (exact != nearest) & (random.random(exact.shape) < 0.5)
    return np.where(other, np.nextafter(nearest, beyond), nearest)


SAMPLES = 64
"""Repetitions of a step, the first rounded to nearest and the others randomly."""

AT_ONCE = 2048
"""Number of steps in memory at once."""

DECISIONS = {ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT, ca.OP_AND, ca.OP_OR, ca.OP_SIGN}
PASSING = {ca.OP_NEG, ca.OP_FABS, ca.OP_SQ, ca.OP_MUL, ca.OP_FMIN, ca.OP_FMAX}


def functions(block: Block) -> list[ca.Function]:
    """Return the Functions of the columns of a row: the step and the further initialisations."""
    return [block.step, *(block.reset(name) for name in block.resets)]


def modes(block: Block) -> NDArray[np.bool_]:
    """Return a mask of the columns that hold a mode, shape (columns,): a number from decisions
    only.

    It is the result of a comparison, or one of some constants and modes selected by comparisons. A
    state is a mode if its next value is one, in the step and in every initialisation.
    """
    sources, count = [graph(function) for function in functions(block)], len(block.states)
    states = np.ones(count, bool)
    while True:
        found = [_discrete(source, states) for source in sources]
        left = states & np.all([columns[:count] for columns in found], axis=0)
        if (left == states).all():
            return np.concatenate(found)
        states = left


def _discrete(source: Graph, states: Sequence[bool] | NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return a mask of the rows that only decisions determine, given the states that are modes."""
    found: list[bool] = []
    for node in source.nodes:
        if node.op == ca.OP_INPUT:
            found.append(node.entry[0] == 0 and bool(states[node.entry[1]]))
        elif node.op in (SELECT, ca.OP_IF_ELSE_ZERO):
            found.append(all(found[i] for i in node.args[1:]))
        else:
            known = node.op in DECISIONS or node.op == ca.OP_CONST
            found.append(known or (node.op in PASSING and all(found[i] for i in node.args)))
    return np.array([found[i] for row in source.results for i in row], bool)


def rounded(block: Block, states: Array, parameters: Array, inputs: Array) -> Array | None:
    """Return results of CasADi's operations in float, shape (SAMPLES, steps, columns).

    Args:
        states, parameters, inputs: before and in every step, shape (steps, ...).

    Returns:
        The same at each call; None if NumPy lacks an operation of the block.
    """
    random, parts = np.random.default_rng(0), list[Array]()
    size = max(1, AT_ONCE // SAMPLES)
    for first in range(0, len(inputs), size):
        given = [a[first : first + size].astype("f4") for a in (states, parameters, inputs)]
        many = [np.tile(a, (SAMPLES - 1, 1)) for a in given]
        columns: list[Array] = []
        for function in functions(block):
            nearest, others = in_type(function, given, "f4"), in_type(function, many, "f4", random)
            if nearest is None or others is None:
                return None
            columns.append(np.vstack([nearest, others]))
        parts.append(np.hstack(columns).reshape(SAMPLES, len(given[0]), -1))
    return np.concatenate(parts, axis=1)
