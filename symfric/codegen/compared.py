"""Comparison of generated C and CasADi: largest differences, and whether rounding explains them.

Rounding errors of float are relative to the magnitude of the terms of a signal. A signal that is
the small difference of large numbers, such as the stroke between two bodies, has the rounding
errors of those. Its magnitude m is that of its terms: m(a + b) is the larger of m(a) and m(b),
m(-a) = m(|a|) = m(a), m(a^2) = m(a)^2, m(sqrt(a)) = sqrt(m(a)), and of any other operation it is
the absolute value. Residuals of closing equations are judged by all their terms: there m(a b) is
the larger of m(a) |b| and |a| m(b), and m(a / b) = m(a) / |b|.
"""

from collections.abc import Callable, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from functools import cached_property
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import Block
from symfric.codegen.generated import Generated
from symfric.codegen.guards import STEP_SIZE, Status, parameter_range, range_of
from symfric.codegen.rounding import modes, rounded
from symfric.codegen.runner import GuardModel, signals
from symfric.emitter.c99 import Real
from symfric.foundation.graph import SELECT, Graph, graph, rebuild
from symfric.foundation.parameters import Variable
from symfric.model.kinds import CONSTRAINTS

Array = NDArray[np.float64]

OVERFLOWS = 1e18
"""Numbers above this have no square in float."""

TOLERANCE = 1e-5
"""Largest error of float, relative to the magnitude of each signal."""

RARE = 0.01
"""Largest fraction of steps in which modes may differ by ties; with more, none is accepted."""


@final
@dataclass(frozen=True, eq=False)
class Run:
    """One sequence of inputs, run by C and by CasADi.

    Attributes:
        inputs: as given, shape (steps, inputs).
        parameters: of every step, shape (steps, parameters); None: the defaults.
        rows, expected: results of C and CasADi, see `run_c`.
        terms: of the block, see `magnitude`, built on demand.
    """

    generated: Generated
    real: Real
    inputs: Array
    parameters: Array | None
    rows: Array
    expected: Array
    terms: Callable[[], ca.Function]

    @property
    def block(self) -> Block:
        """Block that was generated."""
        return self.generated.block

    @cached_property
    def relative(self) -> Array:
        """Differences relative to the magnitude of each signal, shape (steps, columns), no ties."""
        with np.errstate(invalid="ignore"):
            difference = np.abs(self.rows - self.expected)
        if not difference.any():
            return difference
        difference[self._overflows] = 0.0
        difference[self.tied] = 0.0
        ratio = np.where(difference == 0.0, 0.0, difference / self._scale)
        return np.where(np.isnan(ratio), np.inf, ratio)

    @cached_property
    def tied(self) -> NDArray[np.bool_]:
        """Mask of modes that differ in float because their decision ties, shape (steps, columns).

        A tie means that CasADi's own operations give the mode of the C when each is rounded to
        float, to nearest or randomly up or down. Other differences in that step are not accepted.
        """
        found = np.zeros(self.rows.shape, bool)
        if self.real.size == 8:
            return found
        of = np.flatnonzero(modes(self.block))
        rows = np.flatnonzero((self.rows != self.expected)[:, of].any(axis=1))
        if 0 < rows.size <= RARE * len(self.rows):
            places, made = np.ix_(rows, of), self._rounded(rows)
            if made is not None:
                as_c = (made[:, :, of] == self.rows[places]).any(axis=0)
                found[places] = as_c & (self.rows != self.expected)[places]
        return found

    def _rounded(self, rows: NDArray[np.int64]) -> Array | None:
        """Return results of CasADi's operations in float for some of the steps, see `rounded`."""
        states, parameters, inputs = self._arguments
        own = np.broadcast_to(parameters, (len(inputs), parameters.shape[-1]))
        return rounded(self.block, states[rows], own[rows], inputs[rows])

    @property
    def _overflows(self) -> NDArray[np.bool_]:
        """Steps in which float overflows, as reported by the status of the C, but double does
        not.
        """
        if self.real.size == 8 or not self.generated.guards:
            return np.zeros(len(self.rows), bool)
        said = (self.rows[:, -1].astype(int) & int(Status.OUTPUT)) != 0
        return said & (np.abs(self.expected).max(axis=1) > OVERFLOWS)

    @cached_property
    def error(self) -> float:
        """Largest relative difference."""
        return float(self.relative.max(initial=0.0))

    @property
    def worst(self) -> str:
        """Signal with the largest difference, "" without a difference."""
        names = signals(self.block, guards=self.generated.guards)
        return names[self._place[1]] if self.error else ""

    @property
    def rounding(self) -> float | None:
        """Largest change of the worst signal by rounding to float in the worst step, see `rounded`.

        None if it is not known.
        """
        row, column = self._place
        made = self._rounded(np.array([row]))
        if made is None or column == made.shape[-1]:  # the status
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
        """States before every step, parameters and inputs, as arguments of the step."""
        block, model = self.block, GuardModel(self.block, self.real)
        start, inputs = model.start, self.real.rounded(self.inputs)
        states = np.vstack([start, self.rows[:-1, : len(block.states)]])
        parameters = (
            model.default if self.parameters is None else self.real.rounded(self.parameters)
        )
        if self.generated.guards:
            inputs, _ = model.inputs(inputs)
            states = np.where([[model.lost(x)] for x in states], start, states)
        return states, parameters, inputs

    @cached_property
    def _scale(self) -> Array:
        """Magnitude of every column: of its terms, its nominal value or its peak."""
        count = len(self.block.states)
        found = magnitudes(self.terms(), self.block, *self._arguments)
        found = np.concatenate([found, *(found[:count] for _ in self.block.resets)])
        if self.generated.guards:
            found = np.append(found, 1.0)  # the status
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
    """Return integers in the order of the floats, neighbours one apart, both zeros 0."""
    bits = np.ascontiguousarray(values).view(np.int64)
    return np.where(bits < 0, np.iinfo(np.int64).min - bits, bits)


SAMPLES = 1000
"""Number of steps examined."""

SUMS = {ca.OP_ADD, ca.OP_SUB}
SAME = {ca.OP_NEG, ca.OP_FABS}
PASSES = {*SUMS, *SAME, ca.OP_TWICE, ca.OP_SQ, ca.OP_SQRT, SELECT}
PRODUCTS = {ca.OP_MUL, ca.OP_DIV}


def terms(block: Block) -> ca.Function:
    """Return (state, param, in) of a step -> the magnitudes of its states and outputs, a column."""
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
    """Return magnitudes of the nodes between `results` and nodes that do not pass on their
    terms.
    """
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
    """Return the magnitude of an operation on numbers `own` of the magnitudes `m`."""
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
    """Return the largest magnitude of every state and output over some steps.

    The shape is (states + outputs,); states have at least the nominal value.

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


STRETCH = 100
"""Number of consecutive steps with one type of motion, or of load."""

LOADS = (1.0, 10.0, 0.1, 1.5, 0.0, 1.0, 1e-3, 6.0, 0.5, 0.0, 100.0, 1.0)
"""Loads in units of the nominal value, in a random order with jumps and zeros."""

BAD = (np.nan, np.inf, -np.inf, 1e300, -1e300, 1e9, -1e9, 1e-310, -1.0)
"""Bad values of an input, in units of its nominal value."""


def excitation(block: Block, steps: int) -> Array:
    """Return valid inputs of every step, shape (steps, inputs), the same at each call.

    An input with a lower bound of 0 or more, such as a load, fluctuates about levels between which
    it jumps by factors up to 1e5, including zero; the others get in turn, in units of their nominal
    value, slow sines, bursts up to 2, tiny values of 1e-12 ... 1e-3, a hundred zeros and abrupt
    reversals. All stay within their bounds.
    """
    random = np.random.default_rng(0)
    columns = [_signal(variable, steps, random) for variable in block.inputs]
    return np.column_stack([np.zeros((steps, 0)), *columns])


def _signal(variable: Variable, steps: int, random: np.random.Generator) -> Array:
    k, stretches = np.arange(steps), -(-steps // STRETCH)
    if variable.lower >= 0.0:
        levels = np.repeat(random.choice(LOADS, stretches), STRETCH)[:steps]
        wavering = 1.0 + 0.5 * np.sin(0.003 * k + random.uniform(0.0, 6.0))
        return _within(variable, variable.nominal * levels * wavering)
    tiny = 10.0 ** random.uniform(-12.0, -3.0, steps) * random.choice([-1.0, 1.0], steps)
    pieces = [
        0.05 * np.sin(0.008 * k),
        np.clip(random.standard_normal(steps), -2.0, 2.0),
        tiny,
        0.1 * np.sign(np.sin(0.03 * k)),
        np.zeros(steps),
    ]
    turn = np.repeat(random.integers(0, len(pieces), stretches), STRETCH)[:steps]
    return _within(variable, variable.nominal * np.choose(turn, pieces))


def _within(variable: Variable, values: Array) -> Array:
    limits = range_of(variable)
    return np.clip(values, limits.low, limits.high)


def spoiled(block: Block, inputs: Array) -> Array:
    """Return the inputs with a twentieth of the values not finite or out of range."""
    random = np.random.default_rng(1)
    nominal = np.array([v.nominal for v in block.inputs])
    bad = random.choice(BAD, inputs.shape) * nominal
    return np.where(random.uniform(size=inputs.shape) < 0.05, bad, inputs)


def varied(block: Block, steps: int, longest: float) -> Array:
    """Return parameters of every step, shape (steps, parameters), constant over `STRETCH` steps.

    The step size passes through three decades up to `longest` times its default, the others through
    +-20 %, or from 0 to a tenth if they are 0, within their bounds.
    """
    random = np.random.default_rng(2)
    stretches = -(-steps // STRETCH)
    columns = [np.zeros((stretches, 0))]
    for variable in block.parameters:
        start, limits = float(variable.start), parameter_range(variable)
        if variable.name == STEP_SIZE:
            values = start * longest * 10.0 ** random.uniform(-3.0, 0.0, stretches)
        elif start == 0.0:
            values = random.uniform(0.0, 0.1, stretches)
        else:
            values = start * random.uniform(0.8, 1.2, stretches)
        columns.append(np.clip(values, limits.low, limits.high))
    return np.repeat(np.column_stack(columns), STRETCH, axis=0)[:steps]
