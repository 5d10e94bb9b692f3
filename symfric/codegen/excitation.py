"""What generated C is fed with: a controller's day, and what must not happen in it."""

import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import Block
from symfric.codegen.guards import STEP_SIZE, parameter_range, range_of
from symfric.foundation.parameters import Variable

Array = NDArray[np.float64]

STRETCH = 100
"""Steps of one kind of motion, or of load, in a row."""

LOADS = (1.0, 10.0, 0.1, 1.5, 0.0, 1.0, 1e-3, 6.0, 0.5, 0.0, 100.0, 1.0)
"""Of a load, in units of its nominal value, in a random order: it jumps, and is gone."""

BAD = (np.nan, np.inf, -np.inf, 1e300, -1e300, 1e9, -1e9, 1e-310, -1.0)
"""In the place of an input, in units of its nominal value."""


def excitation(block: Block, steps: int) -> Array:
    """Valid inputs of every step, shape (steps, inputs), the same at each call.

    An input with a lower bound of 0 or more, such as a load, wavers about levels between which it
    jumps by factors up to 1e5, zero among them; the others see in turn, in units of their nominal
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
    """The same inputs with what is not finite or out of range in a twentieth of the places."""
    random = np.random.default_rng(1)
    nominal = np.array([v.nominal for v in block.inputs])
    bad = random.choice(BAD, inputs.shape) * nominal
    return np.where(random.uniform(size=inputs.shape) < 0.05, bad, inputs)


def varied(block: Block, steps: int, longest: float) -> Array:
    """Parameters of every step, shape (steps, parameters), that stay for `STRETCH` of them.

    The step size passes through three decades up to `longest` times its default, the others through
    +-20 %, or from 0 to a tenth where they are 0, within their bounds.
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
