"""Consistent start values: algebraic variables that satisfy their equations, a first step size."""

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.system import System

Array = NDArray[np.float64]
ITERATIONS = 50
NEAR, CONVERGED = 1e-4, 1e-10
"""Relative Newton steps below which no damping is needed, and below which it is done."""


def consistent(system: System, where: str, y: Array, d: Array) -> Array:
    """`y` with its algebraic unknowns solved for, by damped Newton from the given guess.

    Raises:
        ValueError: no solution near the guess.
    """
    columns = system.algebraic[1]
    if not columns:
        return y
    y, last = y.copy(), np.inf
    for _ in range(ITERATIONS):
        step = _newton_step(system, y, d)
        size = float(np.max(np.abs(step) / (np.abs(y[columns]) + 1e-14)))
        if not np.isfinite(size):
            break
        if size < NEAR:
            y[columns] -= step
            if size < CONVERGED or size > last / 2:  # no longer quadratic: rounding
                return y
        elif not _descend(system, y, d, step):
            break
        last = size
    names = ", ".join(system.names[i] for i in columns)
    raise ValueError(
        f"{where}: expected consistent start values, found no solution of the algebraic "
        f"equations for {names} near their start values; give better ones"
    )


def _newton_step(system: System, y: Array, d: Array) -> Array:
    """Full step of Newton's method, NaN where the derivatives are singular."""
    g, J = (m.full() for m in system.constraints.call([y, d]))
    try:
        return np.linalg.solve(J, g[:, 0])
    except np.linalg.LinAlgError:
        return np.full(g.shape[0], np.nan)


def _descend(system: System, y: Array, d: Array, step: Array) -> bool:
    """Go along `step`, in place, as far as the residual shrinks; whether it does at all."""
    columns = system.algebraic[1]
    before, start = _residual(system, y, d), y[columns].copy()
    for part in 0.5 ** np.arange(12):
        y[columns] = start - part * step
        if _residual(system, y, d) < before:
            return True
    return False


def _residual(system: System, y: Array, d: Array) -> float:
    return float(np.linalg.norm(system.constraints(y, d)[0].full()))


def first_step(span: float) -> float:
    """A first step [s] so small that the controller decides: it grows eightfold per step."""
    return 1e-8 * span
