"""Inputs under which steps are measured: what a drive does in a day, in some hundred steps."""

import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import Block
from symfric.foundation.parameters import Variable

Array = NDArray[np.float64]

STRETCH = 20
"""Steps of one kind of motion in a row."""

LOADS = (1.0, 1.5, 0.5, 1.0, 0.1, 10.0)
"""Of a load, in units of its nominal value, one after the other: steps up to a hundredfold."""


def day(block: Block, steps: int) -> Array:
    """Inputs of every step, shape (steps, inputs), the same at each call.

    In stretches of 20 steps, in units of the nominal value: a slow sine through zero, bursts up to
    2, values of 1e-12 ... 1e-3 of either sign, reversals between -0.1 and 0.1, rest: a fifth each,
    shuffled. A load (lower bound 0 or more) wavers by a tenth around levels that jump between the
    stretches by factors up to 100.
    """
    random = np.random.default_rng(0)
    columns = [np.zeros((steps, 0)), *(_signal(v, steps, random) for v in block.inputs)]
    values = np.column_stack(columns)
    lower = np.array([v.lower for v in block.inputs])
    upper = np.array([v.upper for v in block.inputs])
    return np.clip(values, lower, upper)


def _signal(variable: Variable, steps: int, random: np.random.Generator) -> Array:
    k = np.arange(steps)
    count = -(-steps // STRETCH)
    if variable.lower >= 0.0:
        levels = np.resize(LOADS, count).repeat(STRETCH)[:steps]
        return variable.nominal * levels * (1.0 + 0.1 * np.sin(0.3 * k + random.uniform(0.0, 6.0)))
    tiny = 10.0 ** random.uniform(-12.0, -3.0, steps) * random.choice([-1.0, 1.0], steps)
    pieces = [
        0.05 * np.sin(0.15 * k),
        np.clip(random.standard_normal(steps), -2.0, 2.0),
        tiny,
        0.1 * np.sign(np.sin(0.6 * k + 0.1)),
        np.zeros(steps),
    ]
    turns = np.resize(np.arange(len(pieces)), count)
    random.shuffle(turns)
    return variable.nominal * np.choose(turns.repeat(STRETCH)[:steps], pieces)
