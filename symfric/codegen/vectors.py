"""Test vectors: single steps of a block with CasADi's results.

Each row is an independent step from its own states, so rounding errors do not accumulate over the
rows. Rows are taken from a run through stick, creep, bursts, reversals and steps of the load, so
that both outcomes of every comparison in the block occur if they do in that run; then every
parameter is changed, in the rows in which that matters most; with guards, bad inputs follow.
"""

from dataclasses import dataclass
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import Block
from symfric.codegen.rounding import in_type
from symfric.codegen.runner import run_vm
from symfric.emitter.c99 import Real
from symfric.foundation.graph import Graph, graph, rebuild
from symfric.foundation.parameters import Variable

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

STEPS = 800
"""Steps of the run that rows are taken from."""
PLAIN, EACH = 32, 2
"""Number of equidistant rows, in addition to those for comparisons, and rows per changed
parameter."""
PARAMETER_SHARE = 0.25
"""Relative change of a parameter."""
BASE = {4: 1e-5, 8: 1e-12}
"""Tolerance relative to the peak of a signal, by the size of the type: rounding of some operations,
of libm and of fused multiply-add, which differ between compilers and targets.
"""
ROUNDINGS = 8.0
"""Tolerance in units of the rounding changes in most rows: of the inputs, and in float of every
operation, as in differences of large numbers. The tenth of the rows in which a result may change by
more, such as at a jump, is left out.
"""
BAD = (np.nan, np.inf, -np.inf)


@final
@dataclass(frozen=True, eq=False)
class Steps:
    """Independent steps, one per row, all numbers rounded to the type.

    Attributes:
        states, inputs: before and during the steps, shapes (rows, states) and (rows, inputs).
        changed: number of the changed parameter, -1 for none, shape (rows,).
        values: of that parameter, 0 for none, shape (rows,).
    """

    states: Array
    inputs: Array
    changed: Integers
    values: Array

    def __len__(self) -> int:
        return len(self.changed)

    def chosen(self, rows: Integers) -> "Steps":
        """Return some of the rows."""
        return Steps(self.states[rows], self.inputs[rows], self.changed[rows], self.values[rows])


@final
@dataclass(frozen=True, eq=False)
class Vectors:
    """Steps and their results.

    Attributes:
        results: states after the step, outputs, and the states of each further initialisation for
            the inputs, in double precision, shape (rows, results).
        status: of the guards, 0 without them, shape (rows,).
        tolerance: of each result, shape (results,).
    """

    block: Block
    real: Real
    steps: Steps
    results: Array
    status: Integers
    tolerance: Array


def vectors(block: Block, real: Real, guards: bool) -> Vectors:
    """Return test vectors of a block in a floating point type, the same at each call."""
    run = _run(block, real)
    results, _ = made(block, real, run, guards=False)
    spread = _spread(block, real, run, results)
    peak = np.abs(results).max(axis=0, initial=0.0)
    usual = np.quantile(spread, 0.9, axis=0) if len(spread) else peak
    tolerance = np.maximum(BASE[real.size] * np.where(peak > 0, peak, 1.0), ROUNDINGS * usual)
    sound = np.flatnonzero(_is_sound(spread, tolerance))
    sound = sound[_telling(block, real, run.chosen(sound))]
    parts = [run.chosen(sound)]
    parts += [
        _changing(block, real, parts[0], results[sound], i, tolerance)
        for i in range(len(block.parameters))
        if len(sound)
    ]
    if guards and len(sound):
        parts.append(_bad(block, parts[0]))
    steps = _joined(parts)
    found, status = made(block, real, steps, guards=guards)
    return Vectors(block, real, steps, found, status, tolerance)


def made(block: Block, real: Real, steps: Steps, *, guards: bool) -> tuple[Array, Integers]:
    """Return results and status of steps by CasADi; `run_vm` makes one step before them."""
    first, given = np.zeros((1, len(block.inputs))), _parameters(block, real, steps)
    parameters, inputs = (
        np.vstack([_defaults(block, real), given]),
        np.vstack([first, steps.inputs]),
    )
    found = run_vm(block, real, inputs, steps.states, parameters, guards=guards)[1:]
    if not guards:
        return found, np.zeros(len(steps), np.int64)
    return found[:, :-1], found[:, -1].astype(np.int64)


def excitation(block: Block) -> Array:
    """Return inputs of a run, shape (STEPS, inputs)."""
    random = np.random.default_rng(0)
    columns = [_signal(v, random) for v in block.inputs]
    return np.column_stack([np.zeros((STEPS, 0)), *columns])


def _signal(variable: Variable, random: np.random.Generator) -> Array:
    """Return steps of a load; stick, creep, slow and fast motion of other inputs; within the
    bounds.
    """
    k = np.arange(STEPS)
    if variable.lower >= 0.0:
        levels = np.array([1.0, 0.3, 2.0, 0.7, 0.1, 3.0])
        shape = levels[(k // 37) % levels.size] * (1.0 + 0.2 * np.sin(0.05 * k))
    else:
        signs = random.choice([-1.0, 1.0], STEPS)
        pieces = [
            0.05 * np.sin(0.1 * k),
            np.clip(random.standard_normal(STEPS), -2.0, 2.0),
            10.0 ** random.uniform(-12.0, -3.0, STEPS) * signs,
            0.1 * np.sign(np.sin(0.3 * k)),
            1e-3 * np.sin(0.2 * k),
            np.zeros(STEPS),
        ]
        turn = np.repeat(random.integers(0, len(pieces), STEPS // 20 + 1), 20)[:STEPS]
        shape = np.choose(turn, pieces)
    return np.clip(variable.nominal * shape, variable.lower, variable.upper)


def _run(block: Block, real: Real) -> Steps:
    """Return the steps of a run, as far as it is finite."""
    inputs, count = real.rounded(excitation(block)), len(block.states)
    after = run_vm(block, real, inputs, guards=False)
    start = np.array([[float(v.start) for v in block.states]])
    states = real.rounded(np.vstack([start, after[:-1, :count]]))
    broken = ~(np.isfinite(after).all(axis=1) & np.isfinite(states).all(axis=1))
    end = int(np.argmax(broken)) if broken.any() else len(inputs)
    none = np.full(end, -1, np.int64)
    return Steps(states[:end], inputs[:end], none, np.zeros(end))


def _defaults(block: Block, real: Real) -> Array:
    return real.rounded([float(v.start) for v in block.parameters])


def _parameters(block: Block, real: Real, steps: Steps) -> Array:
    """Return the parameters of every step, shape (rows, parameters)."""
    found = np.tile(_defaults(block, real), (len(steps), 1))
    rows = np.flatnonzero(steps.changed >= 0)
    found[rows, steps.changed[rows]] = steps.values[rows]
    return found


def _is_sound(spread: Array, tolerance: Array) -> NDArray[np.bool_]:
    """Return a mask of rows that no rounding can move out of the tolerance."""
    return np.all(ROUNDINGS / 2 * spread <= tolerance, axis=1)


def _spread(block: Block, real: Real, steps: Steps, results: Array) -> Array:
    """Return changes of the results by rounding of the inputs, shape (rows, results)."""
    random, found = np.random.default_rng(1), np.zeros_like(results)
    unit = float(np.finfo(f"f{real.size}").eps)
    first, given = np.zeros((1, len(block.inputs))), _parameters(block, real, steps)

    def near(x: Array) -> Array:
        return x * (1.0 + unit * random.choice([-1.0, 1.0], x.shape))

    for _ in range(3):
        parameters = near(np.vstack([_defaults(block, real), given]))
        inputs = np.vstack([first, near(steps.inputs)])
        other = run_vm(block, real, inputs, near(steps.states), parameters, guards=False)[1:]
        found = np.maximum(found, np.abs(other - results))
    if real.size == 4:
        found = np.fmax(found, np.abs(_in_float(block, steps, given, results) - results))
    return found


def _in_float(block: Block, steps: Steps, parameters: Array, results: Array) -> Array:
    """Return results with every operation in float; NaN if unknown."""
    arguments = [steps.states, parameters, steps.inputs]
    parts: list[Array] = []
    for function in (block.step, *(block.reset(name) for name in block.resets)):
        rows = in_type(function, arguments, "f4")
        parts.append(np.full_like(results, np.nan) if rows is None else rows)
    found = np.hstack(parts)
    return found if found.shape == results.shape else np.full_like(results, np.nan)


def _telling(block: Block, real: Real, steps: Steps) -> Integers:
    """Return rows with each outcome of each comparison, and some equidistant ones."""
    seen: set[tuple[int, bool]] = set()
    chosen = set(np.linspace(0, len(steps) - 1, min(PLAIN, len(steps))).astype(int).tolist())
    for k, outcomes in enumerate(_outcomes(block, real, steps).astype(bool).tolist()):
        new = set(enumerate(outcomes)) - seen
        if new:
            seen |= new
            chosen.add(k)
    return np.array(sorted(chosen), np.int64)


COMPARISONS = frozenset({ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT, ca.OP_AND, ca.OP_OR})
SIDES = frozenset({ca.OP_FABS, ca.OP_SIGN, ca.OP_FMIN, ca.OP_FMAX})
"""Operations that have two branches in C: by the sign of a number, or by which one is smaller."""


def _outcomes(block: Block, real: Real, steps: Steps) -> Array:
    """Return outcomes of the comparisons in a step, shape (rows, comparisons)."""
    source = graph(block.step)
    asked = [(i, n) for i, n in enumerate(source.nodes) if n.op in COMPARISONS | SIDES]
    if not (asked and len(steps)):
        return np.zeros((len(steps), 0))
    plain = tuple(i for i, n in asked if n.op in COMPARISONS)
    sides = [(*n.args, n.args[0])[:2] for _, n in asked if n.op in SIDES]
    alone = np.array([a == b for a, b in sides], bool)
    wanted = (plain, tuple(a for a, _ in sides), tuple(b for _, b in sides))
    arguments = [ca.SX.sym("x", *block.step.size_in(i)) for i in range(3)]
    columns = rebuild(Graph(source.nodes, wanted), arguments, {})
    function = ca.Function("outcomes", arguments, columns).map(len(steps))
    p = np.tile(_defaults(block, real)[:, None], (1, len(steps)))
    found = function(steps.states.T, p, steps.inputs.T)
    held, first, second = (column.full().T for column in found)
    return np.hstack([held != 0, first < np.where(alone, 0.0, second)])


def _changing(
    block: Block, real: Real, steps: Steps, before: Array, i: int, tolerance: Array
) -> Steps:
    """Return the rows in which changing parameter `i` changes most, relative to the tolerance."""
    value = float(real.rounded(changed_value(block.parameters[i])))
    changed = np.full(len(steps), i, np.int64)
    new = Steps(steps.states, steps.inputs, changed, np.full(len(steps), value))
    after, _ = made(block, real, new, guards=False)
    effect = (np.abs(after - before) / tolerance).max(axis=1, initial=0.0)
    fit = np.isfinite(effect) & _is_sound(_spread(block, real, new, after), tolerance)
    rows = np.argsort(np.where(fit, effect, -1.0))[::-1][:EACH]
    return new.chosen(rows[fit[rows]])


def changed_value(variable: Variable) -> float:
    """Return a parameter's default increased by a quarter, or decreased if a bound requires it."""
    start = float(variable.start)
    step = PARAMETER_SHARE * (abs(start) if start else variable.nominal)
    return start + step if start + step <= variable.upper else start - step


def _bad(block: Block, steps: Steps) -> Steps:
    """Return the last row with each input, state and parameter bad, one at a time."""
    last = steps.chosen(np.array([len(steps) - 1]))
    found: list[Steps] = []
    for i in range(len(block.inputs)):
        for value in BAD:
            inputs = last.inputs.copy()
            inputs[0, i] = value
            found.append(Steps(last.states, inputs, last.changed, last.values))
    for i in range(len(block.states)):
        for value in BAD:
            states = last.states.copy()
            states[0, i] = value
            found.append(Steps(states, last.inputs, last.changed, last.values))
    for i in range(len(block.parameters)):
        found.append(Steps(last.states, last.inputs, np.array([i]), np.array([np.nan])))
    return _joined(found) if found else last


def _joined(parts: list[Steps]) -> Steps:
    """Concatenate steps."""
    names = ("states", "inputs", "changed", "values")
    return Steps(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))
