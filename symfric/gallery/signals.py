"""Quantities of runs and signals that the figures of the gallery compare."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric import Trajectory

Array = NDArray[np.float64]


def acceleration(run: Trajectory, rate: str, times: ArrayLike | None = None) -> Array:
    """Derivative of the state `rate`, by the equations of its model."""
    model = run.model
    if model.ode is None:
        raise ValueError(f"acceleration: expected explicit equations, got '{model.name}'")
    return run.of(model.ode[[v.name for v in model.x].index(rate)], times)


def rms(difference: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(difference))))


def largest(difference: Array) -> float:
    """Largest magnitude."""
    return float(np.abs(difference).max())


def spread(x: Array) -> float:
    """The S x 100 [m] of Jing and Mi: 100 times the standard deviation of positions."""
    return 100 * float(np.std(x, ddof=1))
