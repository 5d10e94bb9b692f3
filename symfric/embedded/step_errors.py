"""Errors of fixed steps of a plant, against a simulation with adaptive steps."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf
from typing import final

import numpy as np

from symfric.codegen.blocks.block import Block, CBlock
from symfric.codegen.blocks.from_model import ModelSource, plant_block
from symfric.codegen.guards import STEP_SIZE
from symfric.codegen.runner import run_vm
from symfric.emitter.c99 import DOUBLE
from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.integrator import Input, simulate
from symfric.model import Model

FACTORS = (4.0, 2.0, 1.0, 0.5, 0.25)
"""Step sizes to compare, relative to the chosen one."""
MOST = 100_000
"""Largest number of steps; it limits the duration of a comparison."""
RTOL = 1e-9
"""Relative tolerance of the simulation with adaptive steps."""


@final
@dataclass(frozen=True)
class StepError:
    """Largest error of all states x over `duration` [s] with steps of h [s].

    Attributes:
        error: largest difference relative to the peak of its state; inf if the steps diverge.
        state: name of this state.
    """

    h: float
    duration: float
    error: float
    state: str

    def __str__(self) -> str:
        return (
            f"The largest error of steps of {self.h:g} s is {self.error:.1g} of the peak of "
            f"{self.state}, over {self.duration:g} s of the scene with its default inputs."
        )


def step_errors(
    machine: Model | ModelSource,
    h: float,
    t_end: float,
    *,
    u: Mapping[str, Input] | None = None,
    method: str = "auto",
) -> tuple[StepError, ...]:
    """Compare fixed steps of `plant_block` with `simulate`, for step sizes around h.

    The plant holds each input at its value in the middle of a step. The error includes shifts in
    time: it grows with the duration in stick-slip, and is large in chaotic motion at any h.

    Args:
        machine: model or scene, with its default parameters.
        h: step size [s]; it is compared with 4, 2, 1/2 and 1/4 times its value.
        t_end: duration [s]; shorter if it needs more than `MOST` steps of h/4.
        u: inputs, as for `simulate`.
        method: method of the plant.

    Raises:
        ValueError: numbers that are not positive; see also `plant_block` and `simulate`.
        SolveError: the simulation with adaptive steps fails.
    """
    checks.number("step_errors: h", h, unit="s", above=0.0)
    checks.number("step_errors: t_end", t_end, unit="s", above=h)
    block, t_end = plant_block(machine, method=method), min(t_end, MOST * h / 4)
    model = machine if isinstance(machine, Model) else machine.model()
    sizes = [h * factor for factor in FACTORS if h * factor <= t_end]
    return tuple(_error(model, block, size, t_end, u) for size in sizes)


def _error(
    model: Model, block: Block, h: float, t_end: float, u: Mapping[str, Input] | None
) -> StepError:
    steps = int(t_end / h + 1e-9)
    times = h / 2 * np.arange(2 * steps + 1)  # ends and middles of the steps
    exact = simulate(model, times[-1], u=u, rtol=RTOL, t_eval=times)
    held = np.column_stack([np.zeros((steps, 0)), *(exact[v.name][1::2] for v in block.inputs)])
    parameters = (replace(v, start=h) if v.name == STEP_SIZE else v for v in block.parameters)
    c = CBlock(replace(block, parameters=tuple(parameters)), DOUBLE, guards=False)
    with np.errstate(all="ignore"):
        rows = run_vm(c, held)
        errors = {
            v.name: _relative(rows[:, k], exact[v.name][2::2])
            for k, v in enumerate(block.states) if v.name in {x.name for x in model.x}
        }  # fmt: skip
    worst = max(errors, key=errors.__getitem__)
    return StepError(h, float(times[-1]), errors[worst], worst)


def _relative(x: Array, exact: Array) -> float:
    error = float(np.abs(x - exact).max()) / (float(np.abs(exact).max()) or 1.0)
    return error if error < 1e6 else inf
