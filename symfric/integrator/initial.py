"""Consistent start values: algebraic variables that satisfy their equations, a first step size."""

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.system import System

Array = NDArray[np.float64]


def consistent(system: System, where: str, y: Array, d: Array) -> Array:
    """`y` with its algebraic unknowns solved for, by Newton's method from the given guess.

    Raises:
        ValueError: no solution near the guess.
    """
    columns = system.algebraic[1]
    if not columns:
        return y
    known = [i for i in range(system.n) if i not in columns]
    try:
        found = system.constraints(y[columns], np.concatenate([y[known], d])).full().ravel()
    except RuntimeError:
        names = ", ".join(system.names[i] for i in columns)
        raise ValueError(
            f"{where}: expected consistent start values, found no solution of the algebraic "
            f"equations for {names} near their start values; give better ones"
        ) from None
    y = y.copy()
    y[columns] = found
    return y


def first_step(span: float) -> float:
    """A first step [s] so small that the controller decides: it grows eightfold per step."""
    return 1e-8 * span
