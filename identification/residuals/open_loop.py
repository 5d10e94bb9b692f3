"""The motion of a drive under its measured force, without feedback, by the sampled engine.

What shooting simulates where friction has no states: some 20 times faster than error control, with
exact sensitivities. One call is one window: from a start that is fitted, over its samples.
"""

from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray

from identification.residuals.stepper import (
    Chain,
    Mass,
    Motion,
    given_inputs,
    why_no_motion,
    why_not_sampled,
)
from symfric.foundation import checks
from symfric.model import Model

Array = NDArray[np.float64]
Hold = Literal["linear", "held"]
HOLDS: tuple[Hold, ...] = ("linear", "held")
"""Between two samples an input is linear (the step takes its mean), or held from the first one."""

__all__ = ["HOLDS", "Hold", "sampled_motion", "why_not_sampled"]


def sampled_motion(
    model: Model, t: Array, inputs: Array, p: Array, start: Array,
    *, hold: Hold = "linear", substeps: int = 2,
) -> Motion | str:  # fmt: skip
    """The motion at the instants `t`, with its slopes; a sentence where there is none.

    Args:
        model: two states x' = v and v' = a(x, v, u, p), such as that of a `Drive` with a static
            law (`why_not_sampled` says what is wrong with others); all of `model.p` are free.
        t: instants [s], shape (n,); not necessarily equidistant.
        inputs: of the model at these instants, shape (n, inputs) or (n,).
        p: values of `model.p`.
        start: position and velocity at t[0].
        hold: what inputs do between samples: "linear", or "held" as a digital amplifier does.
        substeps: steps a sample.

    Returns:
        A `Motion`: states (n, 2) and slopes (n, 2, parameters + 2), the last two by the start.

    Raises:
        ValueError: a model that is none of these, or arrays that do not fit.
    """
    checks.choice("sampled_motion: hold", hold, HOLDS)
    chain = _chain(model, substeps)
    u = np.asarray(inputs, dtype=float).reshape(t.size, -1)
    if u.shape[1] != chain.inputs or np.size(p) != len(model.p) or np.size(start) != 2:
        raise ValueError(
            f"sampled_motion of '{model.name}': expected {chain.inputs} inputs, {len(model.p)} "
            f"parameters and a start of 2, got {u.shape[1]}, {np.size(p)} and {np.size(start)}"
        )
    between = u[:-1] if hold == "held" else (u[1:] + u[:-1]) / 2
    rows = np.column_stack([np.diff(t), between])
    start_slopes = np.hstack([np.zeros((2, len(model.p))), np.eye(2)])
    motion = chain(rows, np.asarray(p, dtype=float), np.asarray(start, dtype=float), start_slopes)
    return why_no_motion(motion) or motion


def _chain(model: Model, substeps: int) -> Chain:
    """The chain of a model, built once."""
    key = f"identification.sampled.{substeps}"
    if key not in model.memory:
        mass = Mass.of(model)
        count = len(mass.inputs)
        model.memory[key] = Chain.of(mass, given_inputs(count), row=count, substeps=substeps)
    return cast(Chain, model.memory[key])
