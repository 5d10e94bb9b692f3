"""Newton's method for the shooting equations of a periodic orbit."""

from collections.abc import Mapping

import numpy as np

from symfric.dynamics.shooting import Linear, Shooting
from symfric.foundation.numeric import Array

ITERATIONS, HALVINGS = 30, 6
"""Largest numbers of Newton steps, and of halvings of one step."""
CLOSED = 100.0
"""Largest difference of start and end of an orbit, in multiples of rtol and of the ranges."""
LONGEST = 0.3
"""Largest change of the period in one step, relative to the period."""
DEPENDENT = 1e-12
"""Relative singular value below which corrections are not determined."""


def solved(problem: Shooting, starts: Array, time: float, p: Mapping[str, float]) -> Linear:
    """Return the shooting equations at the orbit near `starts` (m, nx) and the time of a period.

    Raises:
        ValueError: no orbit was found.
    """
    where = f"periodic_orbit: expected an orbit of '{problem.model.name}' near the guess"
    at = tried(problem, starts, time, p)
    if isinstance(at, ValueError):
        raise ValueError(f"{where}, got none: {at}") from at
    before = np.inf
    for _ in range(ITERATIONS):
        now = residual(problem, at)
        if now <= problem.rtol or (now <= CLOSED * problem.rtol and now > before / 4):
            return at
        before, better = now, _improved(problem, at, p)
        if isinstance(better, ValueError):
            if now <= CLOSED * problem.rtol:
                return at
            raise ValueError(f"{where}, got none: {better}; give a run that has settled more")
        at = better
    raise ValueError(f"{where}, got none in {ITERATIONS} steps; give a run that has settled more")


def tried(
    problem: Shooting, starts: Array, time: float, p: Mapping[str, float]
) -> Linear | ValueError:
    """Return the linearised equations, or the error of a run."""
    try:
        return problem.linear(starts, time, p)
    except ValueError as error:
        return error


def residual(problem: Shooting, at: Linear) -> float:
    """Return the largest residual relative to the magnitudes of the states."""
    scales = np.concatenate([problem.scale[chosen] for chosen, _ in at.bases])
    return float(np.abs(at.r / scales).max(initial=0.0))


def moved(problem: Shooting, at: Linear, step: Array) -> tuple[Array, float]:
    """Return the states and the time after a step of the coordinates."""
    starts, k = list[Array](), 0
    for (chosen, directions), segment in zip(at.bases, at.segments, strict=True):
        starts.append(segment.start + directions @ step[k : k + chosen.size])
        k += chosen.size
    return np.array(starts), at.time + (0.0 if problem.driven else float(step[k]))


def _improved(problem: Shooting, at: Linear, p: Mapping[str, float]) -> Linear | ValueError:
    """Return the equations after a damped Newton step, or the reason why there is none."""
    step, now, share = _step(problem, at), residual(problem, at), 1.0
    if not problem.driven:
        share = min(1.0, LONGEST * at.time / max(abs(float(step[-1])), 1e-300))
    found: Linear | ValueError = ValueError("the iteration does not converge")
    for _ in range(HALVINGS):
        found = tried(problem, *moved(problem, at, share * step), p)
        if not isinstance(found, ValueError):
            if residual(problem, found) < (1 - share / 4) * now:
                return found
            found = ValueError("the iteration does not converge")
        share /= 2
    return found


def _step(problem: Shooting, at: Linear) -> Array:
    """Return the Newton step of the coordinates and of the time."""
    rows = np.concatenate([problem.scale[chosen] for chosen, _ in at.bases])
    if problem.driven:
        scaled = at.J * rows / rows[:, None]
        return rows * np.linalg.lstsq(scaled, -at.r / rows, rcond=DEPENDENT)[0].astype(float)
    columns = np.append(rows, at.time)
    phase = at.phase * columns
    scaled = np.vstack([at.J * columns / rows[:, None], phase / np.abs(phase).max()])
    right = np.append(-at.r / rows, 0.0)
    return columns * np.linalg.lstsq(scaled, right, rcond=DEPENDENT)[0].astype(float)
