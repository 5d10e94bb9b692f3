"""Motion of one mass under its measured force by the sampled engine, without feedback.

Shooting uses it if friction has no states: about a hundred times faster than error control, with
exact sensitivities, and as accurate as the samples of the inputs; see `stepper`.
"""

from collections.abc import Callable, Mapping, Sequence
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
from symfric.foundation.numeric import is_number
from symfric.model import Model

Array = NDArray[np.float64]
Hold = Literal["linear", "held"]
HOLDS: tuple[Hold, ...] = ("linear", "held")
"""Between two samples an input is linear (the step uses its mean) or held from the first one."""

KEY = "identification.sampled"
"""Key of the chain in the memory of a model."""

__all__ = ["HOLDS", "Hold", "sampled_motion", "why_not_sampled"]


def sampled_motion(
    model: Model, t: Array, inputs: Array, p: Array, start: Array,
    *, hold: Hold = "linear", substeps: int = 2,
) -> Motion | str:  # fmt: skip
    """Return the motion at the instants `t` with its derivatives, or a message if there is none.

    Args:
        model: two states x' = v and v' = a(x, v, u, p), such as a `Drive` with a static law
            (`why_not_sampled` explains why others are unsuitable); all of `model.p` are free.
        t: instants [s], shape (n,); not necessarily equidistant.
        inputs: of the model at these instants, shape (n, inputs) or (n,).
        p: values of `model.p`.
        start: position and velocity at t[0].
        hold: inputs between samples: "linear", or "held" as by a digital amplifier.
        substeps: equal steps per sample, each with the mean of the input over it.

    Returns:
        A `Motion`: states (n, 2) and slopes (n, 2, parameters + 2), the last two by the start.

    Raises:
        ValueError: an unsuitable model, or arrays of the wrong size.
    """
    checks.choice("sampled_motion: hold", hold, HOLDS)
    chain = _chain(model)
    u = np.asarray(inputs, dtype=float).reshape(t.size, -1)
    if u.shape[1] != chain.inputs or np.size(p) != len(model.p) or np.size(start) != 2:
        raise ValueError(
            f"sampled_motion of '{model.name}': expected {chain.inputs} inputs, {len(model.p)} "
            f"parameters and a start of 2, got {u.shape[1]}, {np.size(p)} and {np.size(start)}"
        )
    instants = refined(t, substeps)
    columns = [means(t, column, instants, hold == "held") for column in u.T]
    between = np.array(columns).reshape(len(columns), instants.size - 1).T
    motion = stepped(model, instants, between, np.asarray(p, float), np.asarray(start, float))
    return motion if isinstance(motion, str) else motion.every(substeps)


def refined(t: Array, substeps: int) -> Array:
    """Return the instants `t` with `substeps` equal steps between consecutive ones."""
    shares = np.arange(substeps) / substeps
    return np.append((t[:-1, None] + np.diff(t)[:, None] * shares).ravel(), t[-1])


def stepped(model: Model, t: Array, between: Array, p: Array, start: Array) -> Motion | str:
    """Return `sampled_motion` for mean inputs from each instant to the next, (n - 1, inputs)."""
    chain = _chain(model)
    rows = np.column_stack([np.diff(t), between])
    start_slopes = np.hstack([np.zeros((2, p.size)), np.eye(2)])
    motion = chain(rows, p, start, start_slopes)
    return why_no_motion(motion) or motion


def means(t: Array, samples: Array, at: Array, held: bool) -> Array:
    """Return the mean of a sampled input from each of the instants `at` to the next one.

    Args:
        t: sample times [s], shape (n,).
        samples: shape (n,); constant before the first and after the last one.
        at: instants [s], shape (k,).
        held: samples are held until the next one; else linear between them.
    """
    k = np.clip(np.searchsorted(t, at, "right") - 1, 0, t.size - 2)
    dt = np.diff(t)
    rise = np.zeros_like(dt) if held else np.diff(samples) / dt
    whole = np.concatenate([[0.0], np.cumsum(dt * (samples[:-1] + rise * dt / 2))])
    s = np.clip(at, t[0], t[-1]) - t[k]
    outside = np.minimum(at - t[0], 0) * samples[0] + np.maximum(at - t[-1], 0) * samples[-1]
    integral = whole[k] + s * (samples[k] + rise[k] * s / 2) + outside
    return np.diff(integral) / np.diff(at)


def _chain(model: Model) -> Chain:
    """Return the chain of a model, built once."""
    if KEY not in model.memory:
        mass = Mass.of(model)
        count = len(mass.inputs)
        model.memory[KEY] = Chain.of(mass, given_inputs(count), row=count, substeps=1)
    return cast(Chain, model.memory[KEY])


SUBSTEPS = (1, 2, 4, 8, 16, 32)
"""Candidate numbers of steps per sample."""
SHARE = 1e-5
"""Tolerable error over the spread of a signal if the engine is requested: laws err more."""


def why_not(model: Model, signals: Sequence[str], inputs: Mapping[str, object]) -> str:
    """Return the reason why the sampled engine does not suit the windows; "" if it does."""
    why = why_not_sampled(model)
    states = [v.name for v in model.x]
    others = [name for name in signals if name not in states]
    if not why and others:
        why = f"expected signals among the states {', '.join(states)}, got {', '.join(others)}"
    odd = [n for n, given in inputs.items() if not isinstance(given, str) and not is_number(given)]
    if not why and odd:
        why = f"expected inputs that are channels or numbers, got another type for {', '.join(odd)}"
    return why


def choose_substeps(
    predicted: Callable[[int], Array | str], tolerable: Sequence[tuple[slice, float]]
) -> int | None:
    """Return the smallest sufficient number of steps per sample.

    None means that the largest number is not sufficient, or that there is no motion.

    Args:
        predicted: steps per sample -> simulated values of all rows.
        tolerable: rows of a channel and their tolerable root mean square error.
    """
    coarse = predicted(SUBSTEPS[0])
    for substeps in SUBSTEPS:
        fine = predicted(2 * substeps)
        if isinstance(coarse, str) or isinstance(fine, str):
            return None
        error = fine - coarse
        if all(np.sqrt(np.mean(error[rows] ** 2)) <= most for rows, most in tolerable):
            return substeps
        coarse = fine
    return None
