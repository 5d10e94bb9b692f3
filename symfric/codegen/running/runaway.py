"""Plants that run away because their fixed step is too long for them."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import Block
from symfric.codegen.running.runner import run_vm, signals
from symfric.codegen.writing.guards import HUGE, Status
from symfric.emitter.c99 import REALS

Array = NDArray[np.float64]
SHORTER = (0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3)


def runs_away(block: Block, rows: Array) -> int | None:
    """The first step after which a state is huge or not finite, or restarts; None if there is none.

    Args:
        rows: what `run_vm` returned.
    """
    scale = np.array([v.nominal for v in block.states])
    lost = ~(np.abs(rows[:, : scale.size]) <= HUGE * scale).all(axis=1)
    if rows.shape[1] == len(signals(block)):
        lost |= (rows[:, -1].astype(int) & int(Status.STATE | Status.OUTPUT)) != 0
    return int(np.argmax(lost)) + 1 if lost.any() else None


def step_size(block: Block) -> float | None:
    """The step size [s] of a block that has one, as a parameter or as a constant."""
    starts = {v.name: float(v.start) for v in block.parameters}
    return starts.get("h", block.constants.get("h"))


def longest_step(block: Block, inputs: Array, below: float) -> float | None:
    """The longest step size [s] of a few below one that is too long, with which none runs away.

    Args:
        block: with its step size h as a parameter; of any other nothing is found.
        inputs: of every step, shape (steps, inputs).
        below: the step size that is too long [s].
    """
    if all(v.name != "h" for v in block.parameters):
        return None
    for part in SHORTER:
        h = float(f"{part * below:.3g}")
        shorter = replace(
            block,
            parameters=tuple(replace(v, start=h) if v.name == "h" else v for v in block.parameters),
        )
        if runs_away(block, run_vm(shorter, REALS["double"], inputs, guards=False)) is None:
            return h
    return None
