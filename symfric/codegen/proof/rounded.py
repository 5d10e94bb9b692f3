"""What rounding explains of the results of a block: its operations, rounded to float by chance."""

from collections.abc import Sequence

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import Block
from symfric.codegen.kit.rounding import in_type
from symfric.foundation.graph import SELECT, Graph, graph

Array = NDArray[np.float64]

SAMPLES = 64
"""Times that a step is done, the first rounded to nearest and the others up or down by chance."""

AT_ONCE = 2048
"""Steps that are held in memory together."""

DECISIONS = {ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT, ca.OP_AND, ca.OP_OR, ca.OP_SIGN}
PASSING = {ca.OP_NEG, ca.OP_FABS, ca.OP_SQ, ca.OP_MUL, ca.OP_FMIN, ca.OP_FMAX}


def functions(block: Block) -> list[ca.Function]:
    """What makes the columns of a row: the step and the further initialisations."""
    return [block.step, *(block.reset(name) for name in block.resets)]


def modes(block: Block) -> NDArray[np.bool_]:
    """Which columns hold a mode, shape (columns,): a number that only decisions choose.

    It is the result of a comparison, or one of some constants and modes that comparisons pick.
    A state is one if its next value is, in the step and in every initialisation.
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
    """Which rows of the results only decisions choose, where these of the states are modes."""
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
    """What CasADi's operations make of some steps in float, shape (SAMPLES, steps, columns).

    Args:
        states, parameters, inputs: before and in every step, shape (steps, ...).

    Returns:
        The same at each call; None where NumPy lacks an operation of the block.
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
