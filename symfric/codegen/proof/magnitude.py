"""How large what a signal is made of is: what the rounding errors of its float are relative to.

A signal that is the small difference of large numbers, such as the stroke between two bodies, has
the rounding errors of those. Its magnitude m is that of its terms: m(a + b) is the larger of m(a)
and m(b), m(-a) = m(|a|) = m(a), m(a^2) = m(a)^2, m(sqrt(a)) = sqrt(m(a)), and of anything else it
is the absolute value. What is left of closing equations is judged by all that went into it: there
m(a b) is the larger of m(a) |b| and |a| m(b), m(a / b) = m(a) / |b|, too.
"""

from collections.abc import Sequence
from collections.abc import Set as AbstractSet

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import Block
from symfric.foundation.graph import SELECT, Graph, graph, rebuild
from symfric.model.kinds import CONSTRAINTS

Array = NDArray[np.float64]

SAMPLES = 1000
"""Steps that are looked at."""

SUMS = {ca.OP_ADD, ca.OP_SUB}
SAME = {ca.OP_NEG, ca.OP_FABS}
PASSES = {*SUMS, *SAME, ca.OP_TWICE, ca.OP_SQ, ca.OP_SQRT, SELECT}
PRODUCTS = {ca.OP_MUL, ca.OP_DIV}


def terms(block: Block) -> ca.Function:
    """(state, param, in) of a step -> the magnitudes of its states and outputs, a column."""
    source = graph(block.step)
    arguments = [ca.SX.sym("x", len(g)) for g in (block.states, block.parameters, block.inputs)]
    everything = Graph(source.nodes, (tuple(range(len(source.nodes))),))
    values = ca.vertsplit(rebuild(everything, arguments, {})[0])
    states, outputs = source.results
    kinds = [output.kind for output in block.outputs.values()]
    residuals = [i for i, kind in zip(outputs, kinds, strict=True) if kind == CONSTRAINTS]
    plain = _found(source, values, [*states, *outputs], PASSES)
    deep = _found(source, values, residuals, PASSES | PRODUCTS)
    rows = [plain[i] for i in states] + [deep.get(i, plain[i]) for i in outputs]
    return ca.Function("terms", arguments, [ca.vertcat(ca.SX(0, 1), *rows)])


def _found(
    source: Graph, values: Sequence[ca.SX], results: Sequence[int], passes: AbstractSet[int]
) -> dict[int, ca.SX]:
    """Magnitudes of the nodes between `results` and what does not pass on those of its parts."""
    reached = set(results)
    for i in reversed(range(len(source.nodes))):
        if i in reached and source.nodes[i].op in passes:
            reached.update(source.nodes[i].args)
    found: dict[int, ca.SX] = {}
    for i in sorted(reached):
        op, args = source.nodes[i].op, source.nodes[i].args
        if op not in passes:
            found[i] = ca.fabs(values[i])
        else:
            own, m = [values[j] for j in args], [found[j] for j in args]
            found[i] = _passed(op, own, m)
    return found


def _passed(op: int, own: Sequence[ca.SX], m: Sequence[ca.SX]) -> ca.SX:
    """The magnitude of an operation on numbers `own` of the magnitudes `m`."""
    if op == SELECT:
        return ca.if_else(own[0], m[1], m[2])
    if op in SUMS:
        return ca.fmax(m[0], m[1])
    if op == ca.OP_MUL:
        return ca.fmax(m[0] * ca.fabs(own[1]), ca.fabs(own[0]) * m[1])
    if op == ca.OP_DIV:
        return m[0] / ca.fabs(own[1])
    if op == ca.OP_SQRT:
        return ca.sqrt(m[0])
    return m[0] if op in SAME else 2 * m[0] if op == ca.OP_TWICE else m[0] * m[0]


def magnitudes(
    of: ca.Function, block: Block, states: Array, parameters: Array, inputs: Array
) -> Array:
    """The largest magnitude of every state and output over some steps, shape (states + outputs,).

    Of states at least the nominal value.

    Args:
        of: `terms` of the block.
        states, inputs: before and in every step, shape (steps, ...).
        parameters: of every step, shape (steps, parameters), or of all, shape (parameters,).
    """
    every = max(1, len(inputs) // SAMPLES)
    given = (states, np.broadcast_to(parameters, (len(inputs), len(block.parameters))), inputs)
    found = of(*(ca.DM(np.ascontiguousarray(column[::every].T)) for column in given)).full()
    largest = np.where(np.isfinite(found), found, 0.0).max(axis=1, initial=0.0)
    return np.maximum(largest, [v.nominal for v in block.states] + [0.0] * len(block.outputs))
