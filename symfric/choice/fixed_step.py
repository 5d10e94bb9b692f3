"""The largest step at which a machine in fixed steps, as in its C block, follows the motion.

The plant block of `symfric.codegen` steps from the start to the end of the motion, inputs held at
their value in the middle of each step. A step size holds if the positions are finite and within
`share` of the size of the motion of the adaptive run of the same law, at every step. The largest
of 1, 2, 5 times a power of ten that holds, with the power below it holding, too, is what is found:
whole powers first, from large to small, then 2 and 5 times the one that holds.
Limits: steps across the fold of a falling law hold or do not by the eighth digit of a parameter.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil, floor, log10
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.choice.machine import Machine
from symfric.codegen.blocks.block import Block
from symfric.codegen.blocks.from_model import plant_block
from symfric.figures.motion import sampled
from symfric.integrator.equations.inputs import Input
from symfric.model import Model

Array = NDArray[np.float64]
WORK = 100_000_000
"""CasADi instructions that one step size may take: what a small step is worth."""
FEWEST = 100
"""Whole powers are tried that make so many steps at least."""
CHUNK = 1000
"""Steps between looks whether the motion still is one."""


@final
@dataclass(frozen=True, eq=False)
class Motion:
    """Motion that fixed steps must follow: names of positions, values over times, sizes."""

    names: tuple[str, ...]
    t: Array
    values: Array
    size: Array


def largest(
    machine: Machine, model: Model, method: str, motion: Motion, share: float
) -> tuple[float | None, str]:
    """The largest step [s] of `method` that holds; None, and why, where none was found."""
    try:
        block = plant_block(model, method=method)
    except ValueError as problem:
        return None, str(problem).partition("; ")[0]
    step = _step(block)
    least = machine.t_end * step.n_instructions() / WORK
    first = floor(log10(machine.t_end / FEWEST))
    for power in range(first, floor(log10(least)) - 1, -1):
        tried = 10.0**power
        if tried < least:
            break
        if _holds(step, tried, block, machine, motion, share):
            return _refined(step, tried, block, machine, motion, share), ""
    return None, f"below {max(least, 1e-12):.0e} s, if any: smaller steps were not tried"


def _refined(
    step: ca.Function, h: float, block: Block, machine: Machine, motion: Motion,
    share: float,
) -> float:  # fmt: skip
    """The larger ones between h, which holds, and ten times that."""
    for factor in (5.0, 2.0):
        if _holds(step, factor * h, block, machine, motion, share):
            return factor * h
    return h


def _step(block: Block) -> ca.Function:
    """(states, [inputs; h]) -> states after a step."""
    x = ca.SX.sym("x", len(block.states))
    u = ca.SX.sym("u", len(block.inputs))
    h = ca.SX.sym("h")
    p = [h if v.name == "h" else ca.SX(float(v.start)) for v in block.parameters]  # pyright: ignore[reportArgumentType]
    after = block.step(x, ca.vertcat(ca.SX(0, 1), *p), u)[0]
    return ca.Function("step", [x, ca.vertcat(u, h)], [after])


def _holds(
    step: ca.Function, h: float, block: Block, machine: Machine, motion: Motion,
    share: float,
) -> bool:  # fmt: skip
    """Test for a motion in steps of `h` that is finite and follows."""
    count = ceil(machine.t_end / h - 1e-9)
    names = [v.name for v in block.states]
    rows = [names.index(name) for name in motion.names]
    x = np.array([float(v.start) for v in block.states])  # pyright: ignore[reportArgumentType]
    many = step.mapaccum("many", min(CHUNK, count))
    for begin in range(0, count, CHUNK):
        k = np.arange(begin, begin + min(CHUNK, count))
        middle: Array = np.multiply(k + 0.5, h, dtype=np.float64)
        u = _inputs(block, machine.u or {}, middle)
        found = many(x, np.vstack([u, np.full(k.size, h)])).full()
        t = (k + 1) * h
        seen = t <= machine.t_end * (1 + 1e-9)
        wanted = np.array([np.interp(t, motion.t, row) for row in motion.values])
        off = np.abs(found[rows] - wanted)[:, seen] / motion.size[:, None]
        if not (off <= share).all():  # NaN is not, either
            return False
        x = found[:, -1]
    return True


def _inputs(block: Block, given: Mapping[str, Input], t: Array) -> Array:
    """The inputs at the times `t`, shape (inputs, times); start values where none are given."""
    rows = [sampled(given.get(v.name, float(v.start)), t) for v in block.inputs]  # pyright: ignore[reportArgumentType]
    return np.array(rows).reshape(len(rows), t.size)
