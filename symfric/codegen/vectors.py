"""Test vectors: single steps of a block with CasADi's results.

Each row is an independent step from given states, so rounding errors do not accumulate over the
rows. The first rows come from a run through stick, creep, bursts, reversals and steps of the load;
they contain every outcome of every comparison of the block that occurs in the run. The next rows
change each parameter where the change has the largest effect; with guards, bad numbers follow.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import Block, CBlock
from symfric.codegen.runner import evaluated, in_type, run_vm
from symfric.foundation.graph import Graph, graph, rebuild
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import Variable

Integers = NDArray[np.int64]

STEPS = 800
"""Number of steps of the run that the rows are taken from."""
PLAIN, EACH = 32, 2
"""Numbers of equidistant rows (in addition to those for comparisons) and of rows per changed
parameter."""
PARAMETER_SHARE = 0.25
"""Relative change of a parameter."""
BASE = {4: 1e-5, 8: 1e-12}
"""Tolerance relative to the peak of a signal, by the size of the type. It covers the rounding of
operations, libm and fused multiply-add, which differs between compilers and targets.
"""
ROUNDINGS = 8.0
"""Tolerance relative to the 90 % quantile of the changes of a result when the arguments of a step
(in float, also the result of every operation) are rounded. Rows with larger changes, such as at a
jump, are omitted.
"""
BAD = (np.nan, np.inf, -np.inf)


class Steps(NamedTuple):
    """Independent steps, one per row, all numbers rounded to the type.

    Attributes:
        states: states before the steps, shape (rows, states).
        inputs: inputs during the steps, shape (rows, inputs).
        changed: index of the changed parameter, -1 for none, shape (rows,).
        values: value of that parameter, 0 for none, shape (rows,).
    """

    states: Array
    inputs: Array
    changed: Integers
    values: Array

    def chosen(self, rows: Integers) -> "Steps":
        """Return the steps with the indices `rows`."""
        return Steps(self.states[rows], self.inputs[rows], self.changed[rows], self.values[rows])


class Vectors(NamedTuple):
    """Steps and their results.

    Attributes:
        results: states after the step, outputs, and the states of each further initialisation for
            the inputs, in double precision, shape (rows, results).
        status: status of the guards, 0 without guards, shape (rows,).
        tolerance: absolute tolerance of each result, shape (results,).
    """

    c: CBlock
    steps: Steps
    results: Array
    status: Integers
    tolerance: Array


def vectors(c: CBlock) -> Vectors:
    """Return test vectors of a block in a floating-point type, the same at each call."""
    bare = replace(c, guards=False)
    run = _run(bare)
    results = made(bare, run)
    spread = _spread(bare, run, results)
    peak = np.abs(results).max(axis=0, initial=0.0)
    usual = np.quantile(spread, 0.9, axis=0) if len(spread) else peak
    tolerance = np.maximum(BASE[c.real.size] * np.where(peak > 0, peak, 1.0), ROUNDINGS * usual)
    sound = np.flatnonzero(_is_sound(spread, tolerance))
    sound = sound[_telling(c, run.chosen(sound))]
    parts = [run.chosen(sound)]
    if len(sound):
        count = len(c.block.parameters)
        parts += [_changing(bare, parts[0], results[sound], i, tolerance) for i in range(count)]
        parts += _bad(c.block, parts[0]) if c.guards else ()
    steps = Steps(*map(np.concatenate, zip(*parts, strict=True)))
    found, status = made(c, steps), np.zeros(len(steps.changed), np.int64)
    if c.guards:
        found, status = found[:, :-1], found[:, -1].astype(np.int64)
    return Vectors(c, steps, found, status, tolerance)


def made(c: CBlock, steps: Steps) -> Array:
    """Return CasADi's rows for the steps, see `run_vm`, which makes one more step before them."""
    inputs = np.vstack([np.zeros((1, len(c.block.inputs))), steps.inputs])
    parameters = np.vstack([c.default, _parameters(c, steps)])
    return run_vm(c, inputs, steps.states, parameters)[1:]


def excitation(block: Block) -> Array:
    """Return the inputs of the run, shape (STEPS, inputs)."""
    random = np.random.default_rng(0)
    columns = [_signal(v, random) for v in block.inputs]
    return np.column_stack([np.zeros((STEPS, 0)), *columns])


def _signal(variable: Variable, random: np.random.Generator) -> Array:
    """Return values of an input within its bounds.

    A load (lower bound of 0 or more) jumps; other inputs alternate between stick, creep, slow and
    fast motion.
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


def _run(c: CBlock) -> Steps:
    """Return the steps of the run up to the first number that is not finite."""
    inputs, count = c.real.rounded(excitation(c.block)), len(c.block.states)
    after = run_vm(c, inputs)
    states = c.real.rounded(np.vstack([c.start, after[:-1, :count]]))
    broken = ~(np.isfinite(after).all(axis=1) & np.isfinite(states).all(axis=1))
    end = int(np.argmax(broken)) if broken.any() else len(inputs)
    return Steps(states[:end], inputs[:end], np.full(end, -1, np.int64), np.zeros(end))


def _parameters(c: CBlock, steps: Steps) -> Array:
    """Return the parameters of every step, shape (rows, parameters)."""
    found = np.tile(c.default, (len(steps.changed), 1))
    rows = np.flatnonzero(steps.changed >= 0)
    found[rows, steps.changed[rows]] = steps.values[rows]
    return found


def _is_sound(spread: Array, tolerance: Array) -> NDArray[np.bool_]:
    """Return a mask of rows that no rounding can move out of the tolerance."""
    return np.all(ROUNDINGS / 2 * spread <= tolerance, axis=1)


def _spread(c: CBlock, steps: Steps, results: Array) -> Array:
    """Return changes of the results by rounding of the arguments, shape (rows, results)."""
    random, found = np.random.default_rng(1), np.zeros_like(results)
    unit = float(np.finfo(c.real.kind).eps)
    first, given = np.zeros((1, len(c.block.inputs))), _parameters(c, steps)

    def near(x: Array) -> Array:
        return x * (1.0 + unit * random.choice([-1.0, 1.0], x.shape))

    for _ in range(3):
        parameters = near(np.vstack([c.default, given]))
        inputs = np.vstack([first, near(steps.inputs)])
        other = run_vm(c, inputs, near(steps.states), parameters)[1:]
        found = np.maximum(found, np.abs(other - results))
    if c.real.size == 4:
        arguments = [steps.states, given, steps.inputs]
        rounded = np.hstack([in_type(function, arguments, "f4") for function in c.block.functions])
        found = np.fmax(found, np.abs(rounded - results))
    return found


def _telling(c: CBlock, steps: Steps) -> Integers:
    """Return the indices of rows with each outcome of each comparison, and of equidistant rows."""
    count, seen = len(steps.changed), set[tuple[int, bool]]()
    chosen = set(np.linspace(0, count - 1, min(PLAIN, count)).astype(int).tolist())
    for k, outcomes in enumerate(_outcomes(c, steps).tolist()):
        new = set(enumerate(outcomes)) - seen
        if new:
            seen |= new
            chosen.add(k)
    return np.array(sorted(chosen), np.int64)


COMPARISONS = frozenset({ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT, ca.OP_AND, ca.OP_OR})
SIDES = frozenset({ca.OP_FABS, ca.OP_SIGN, ca.OP_FMIN, ca.OP_FMAX})
"""Operations with two branches in C, chosen by the sign of a number or by the smaller of two."""


def _outcomes(c: CBlock, steps: Steps) -> NDArray[np.bool_]:
    """Return outcomes of the comparisons in a step, shape (rows, comparisons)."""
    step, count = c.block.step, len(steps.changed)
    source = graph(step)
    plain = tuple(i for i, n in enumerate(source.nodes) if n.op in COMPARISONS)
    sides = [(*n.args, n.args[0])[:2] for n in source.nodes if n.op in SIDES]
    if not ((plain or sides) and count):
        return np.zeros((count, 0), bool)
    alone = np.array([a == b for a, b in sides], bool)
    wanted = (plain, tuple(a for a, _ in sides), tuple(b for _, b in sides))
    arguments = [ca.SX.sym("x", *step.size_in(i)) for i in range(3)]
    columns = map(ca.densify, rebuild(Graph(source.nodes, wanted), arguments, {}))
    function = ca.Function("outcomes", arguments, [*columns])
    found = evaluated(function, steps.states, _parameters(c, steps), steps.inputs)
    held, first, second = np.split(found, np.cumsum([len(plain), len(sides)]), axis=1)
    return np.hstack([held != 0, first < np.where(alone, 0.0, second)])


def _changing(c: CBlock, steps: Steps, before: Array, i: int, tolerance: Array) -> Steps:
    """Return steps with parameter `i` changed, in the rows with the largest relative effect."""
    value = float(c.real.rounded(changed_value(c.block.parameters[i])))
    values = np.full(len(steps.changed), value)
    new = steps._replace(changed=np.full(len(values), i, np.int64), values=values)
    after = made(c, new)
    effect = (np.abs(after - before) / tolerance).max(axis=1, initial=0.0)
    fit = np.isfinite(effect) & _is_sound(_spread(c, new, after), tolerance)
    rows = np.argsort(np.where(fit, effect, -1.0))[::-1][:EACH]
    return new.chosen(rows[fit[rows]])


def changed_value(variable: Variable) -> float:
    """Return the default of a parameter plus a quarter; minus a quarter if a bound requires it."""
    start = float(variable.start)
    step = PARAMETER_SHARE * (abs(start) if start else variable.nominal)
    return start + step if start + step <= variable.upper else start - step


def _bad(block: Block, steps: Steps) -> Iterator[Steps]:
    """Yield copies of the last row, each with one bad input, state or parameter."""
    last = steps.chosen(np.array([-1]))

    def spoiled(column: Array) -> Iterator[Array]:
        for i in range(column.shape[1]):
            for value in BAD:
                bad = column.copy()
                bad[0, i] = value
                yield bad

    yield from (last._replace(inputs=inputs) for inputs in spoiled(last.inputs))
    yield from (last._replace(states=states) for states in spoiled(last.states))
    for i in range(len(block.parameters)):
        yield last._replace(changed=np.array([i]), values=np.array([np.nan]))
