"""Comparison of generated C and CasADi: largest differences, and whether rounding explains them.

Rounding errors of float are relative to the magnitude of the terms of a signal. A signal that is
the small difference of large numbers, such as the stroke between two bodies, has the rounding
errors of these numbers. Its magnitude m is that of its terms: m(a + b) is the larger of m(a) and
m(b), m(-a) = m(|a|) = m(a), m(a^2) = m(a)^2, m(sqrt(a)) = sqrt(m(a)), and for any other operation
m is the absolute value of the result. Residuals of closing equations also pass on the terms of
products: m(a b) is the larger of m(a) |b| and |a| m(b), and m(a / b) = m(a) / |b|.
"""

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import Block, CBlock
from symfric.codegen.guards import Status
from symfric.codegen.runner import GuardModel, evaluated, in_type
from symfric.foundation.graph import SELECT, Graph, graph, rebuild
from symfric.foundation.numeric import Array
from symfric.model.kinds import CONSTRAINTS

OVERFLOWS = 1e18
"""Numbers above this have no square in float."""

TOLERANCE = 1e-5
"""Largest error of float, relative to the magnitude of each signal."""

RARE = 0.01
"""Largest fraction of steps in which ties may change modes; above it, no tie is accepted."""


@final
@dataclass(frozen=True, eq=False)
class ComparedRun:
    """One sequence of inputs, run by C and by CasADi.

    Attributes:
        inputs: inputs of every step, shape (steps, inputs).
        parameters: parameters of every step, shape (steps, parameters); None for the defaults.
        rows, expected: results of C and CasADi, see `run_c`.
    """

    c: CBlock
    inputs: Array
    parameters: Array | None
    rows: Array
    expected: Array

    @cached_property
    def relative(self) -> Array:
        """Differences divided by the magnitude of each signal, (steps, columns); 0 for ties."""
        with np.errstate(invalid="ignore"):
            difference = np.abs(self.rows - self.expected)
        if not difference.any():
            return difference
        if self.c.real.size == 4 and self.c.guards:  # float overflows and reports it, double not
            reported = (self.rows[:, -1].astype(int) & int(Status.OUTPUT)) != 0
            difference[reported & (np.abs(self.expected).max(axis=1) > OVERFLOWS)] = 0.0
        difference[self.tied] = 0.0
        ratio = np.where(difference == 0.0, 0.0, difference / self._scale)
        return np.where(np.isnan(ratio), np.inf, ratio)

    @cached_property
    def tied(self) -> NDArray[np.bool_]:
        """Mask of modes that differ in float because their decision ties, shape (steps, columns).

        A tie means that CasADi's operations give the mode of the C if each result is rounded to
        float, to nearest or randomly up or down. Other differences in that step are not accepted.
        """
        found = np.zeros(self.rows.shape, bool)
        if self.c.real.size == 8:
            return found
        of = np.flatnonzero(modes(self.c.block))
        rows = np.flatnonzero((self.rows != self.expected)[:, of].any(axis=1))
        if 0 < rows.size <= RARE * len(self.rows):
            places = np.ix_(rows, of)
            as_c = (self._rounded(rows)[:, :, of] == self.rows[places]).any(axis=0)
            found[places] = as_c & (self.rows != self.expected)[places]
        return found

    def _rounded(self, rows: NDArray[np.int64]) -> Array:
        """Return results of CasADi's operations in float for the steps `rows`, see `rounded`."""
        states, parameters, inputs = self._arguments
        own = np.broadcast_to(parameters, (len(inputs), parameters.shape[-1]))
        return rounded(self.c.block, states[rows], own[rows], inputs[rows])

    @cached_property
    def error(self) -> float:
        """Largest relative difference."""
        return float(self.relative.max(initial=0.0))

    @property
    def worst(self) -> str:
        """Signal with the largest difference; "" if there is none."""
        return self.c.signals[self._place[1]] if self.error else ""

    @property
    def rounding(self) -> float | None:
        """Largest relative change of the worst signal in the worst step by rounding to float.

        See `rounded`. None if the worst signal is the status.
        """
        row, column = self._place
        made = self._rounded(np.array([row]))
        if column == made.shape[-1]:
            return None
        finite = made[:, 0, column][np.isfinite(made[:, 0, column])]
        moved = np.abs(finite - self.expected[row, column]).max(initial=0.0)
        return float(moved / self._scale[column])

    @cached_property
    def _place(self) -> tuple[int, int]:
        """Step and column of the largest difference."""
        row, column = np.unravel_index(int(np.argmax(self.relative)), self.relative.shape)
        return int(row), int(column)

    @cached_property
    def _arguments(self) -> tuple[Array, Array, Array]:
        """States before every step, parameters and inputs, as arguments of the step function."""
        count, model = len(self.c.block.states), GuardModel(self.c)
        inputs, parameters = self.c.real.rounded(self.inputs), self.c.default
        if self.parameters is not None:
            parameters = self.c.real.rounded(self.parameters)
        states = np.vstack([self.c.start, self.rows[:-1, :count]])
        if self.c.guards:
            inputs, _ = model.inputs(inputs)
            states = np.where(model.lost(states)[:, None], self.c.start, states)
        return states, parameters, inputs

    @cached_property
    def _scale(self) -> Array:
        """Magnitude of every column: the largest of its terms, its nominal value and its peak."""
        block = self.c.block
        found = magnitudes(block, *self._arguments)
        states = found[: len(block.states)]
        found = np.concatenate([found, *[states] * len(block.resets), *[[1.0]] * self.c.guards])
        finite = np.where(np.isfinite(self.expected), np.abs(self.expected), 0.0)
        found = np.maximum(found, finite.max(axis=0, initial=0.0))
        return np.where(found > 0.0, found, 1.0)


def ulp(a: Array, b: Array) -> int:
    """Return the largest distance in units in the last place; the largest integer if not finite."""
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        return np.iinfo(np.int64).max
    distance = np.abs(_ordered(a) - _ordered(b))
    return int(distance.max(initial=0))


def _ordered(values: Array) -> NDArray[np.int64]:
    """Return integers that sort like the floats; neighbours differ by 1, and both zeros are 0."""
    bits = np.ascontiguousarray(values).view(np.int64)
    return np.where(bits < 0, np.iinfo(np.int64).min - bits, bits)


SAMPLES = 1000
"""Number of steps that `magnitudes` examines."""

SUMS = {ca.OP_ADD, ca.OP_SUB}
SAME = {ca.OP_NEG, ca.OP_FABS}
PASSES = {*SUMS, *SAME, ca.OP_TWICE, ca.OP_SQ, ca.OP_SQRT, SELECT}
PRODUCTS = {ca.OP_MUL, ca.OP_DIV}


@lru_cache(maxsize=4)
def terms(block: Block) -> ca.Function:
    """Return the function (state, param, in) -> magnitudes of next states and outputs (column)."""
    source = graph(block.step)
    arguments = [ca.SX.sym("x", len(group)) for group in block.groups.values()]
    everything = Graph(source.nodes, (tuple(range(len(source.nodes))),))
    values = ca.vertsplit(rebuild(everything, arguments, {})[0])
    states, outputs = source.results
    kinds = [output.kind for output in block.outputs.values()]
    residuals = [i for i, kind in zip(outputs, kinds, strict=True) if kind == CONSTRAINTS]
    plain = _found(source, values, [*states, *outputs], PASSES)
    deep = _found(source, values, residuals, PASSES | PRODUCTS)
    rows = [plain[i] for i in states] + [deep.get(i, plain[i]) for i in outputs]
    return ca.Function("terms", arguments, [ca.densify(ca.vertcat(ca.SX(0, 1), *rows))])


def _found(
    source: Graph, values: Sequence[ca.SX], results: Sequence[int], passes: AbstractSet[int]
) -> dict[int, ca.SX]:
    """Return the magnitudes of `results` and of the nodes that they reach through `passes`."""
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
    """Return the magnitude of the result of `op` on operands `own` with magnitudes `m`."""
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


def magnitudes(block: Block, states: Array, parameters: Array, inputs: Array) -> Array:
    """Return the largest magnitude of every state and output over some steps.

    The shape is (states + outputs,); the magnitude of a state is at least its nominal value.

    Args:
        states, inputs: states before and inputs in every step, shape (steps, ...).
        parameters: one set for every step, shape (steps, parameters), or for all, (parameters,).
    """
    every = max(1, len(inputs) // SAMPLES)
    given = (states, np.broadcast_to(parameters, (len(inputs), len(block.parameters))), inputs)
    found = evaluated(terms(block), *(column[::every] for column in given))
    largest = np.where(np.isfinite(found), found, 0.0).max(axis=0, initial=0.0)
    return np.maximum(largest, [v.nominal for v in block.states] + [0.0] * len(block.outputs))


REPETITIONS = 64
"""Number of repetitions of a step; the first rounds to nearest, the others randomly."""

AT_ONCE = 2048
"""Number of steps in memory at once, repetitions included."""

DECISIONS = {ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT, ca.OP_AND, ca.OP_OR, ca.OP_SIGN}
PASSING = {ca.OP_NEG, ca.OP_FABS, ca.OP_SQ, ca.OP_MUL, ca.OP_FMIN, ca.OP_FMAX}


def modes(block: Block) -> NDArray[np.bool_]:
    """Return a mask of the columns that hold a mode, shape (columns,).

    Only decisions determine a mode: it is the result of a comparison, or a constant or mode that
    comparisons select. A state is a mode if the step and every initialisation set it to a mode.
    """
    sources, count = [graph(function) for function in block.functions], len(block.states)
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


def rounded(block: Block, states: Array, parameters: Array, inputs: Array) -> Array:
    """Return results of CasADi's operations in float, shape (REPETITIONS, steps, columns).

    Args:
        states, parameters, inputs: arguments of every step, shape (steps, ...).

    Returns:
        The results; each call with the same arguments returns the same numbers.
    """
    random, parts = np.random.default_rng(0), list[Array]()
    size = max(1, AT_ONCE // REPETITIONS)
    for first in range(0, len(inputs), size):
        given = [a[first : first + size].astype("f4") for a in (states, parameters, inputs)]
        many = [np.tile(a, (REPETITIONS - 1, 1)) for a in given]
        columns = [
            np.vstack([in_type(function, given, "f4"), in_type(function, many, "f4", random)])
            for function in block.functions
        ]
        parts.append(np.hstack(columns).reshape(REPETITIONS, len(given[0]), -1))
    return np.concatenate(parts, axis=1)
