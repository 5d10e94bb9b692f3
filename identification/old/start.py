"""Start values: linear regression, then a scan over the velocity scale of the law."""

from collections.abc import Collection

import numpy as np

from identification.old.choice import VELOCITIES, Choice, is_coefficient, is_velocity, parts
from identification.old.coordinates import Coordinates
from identification.old.data import Array
from identification.old.problem import Problem
from identification.old.regress import LinearFit
from symfric.foundation.parameters import Parameter, parameters

SCALES = 12
"""Velocity scales tried, spaced by equal factors."""
STEPS = 2
"""Linear least-squares steps at each; one is exact for laws that are linear in their levels."""


def start_values(choice: Choice, linear: LinearFit, problem: Problem) -> Array:
    """Coordinates of the best start found.

    At each velocity scale between 0.4 % and half of the largest speed all levels (mass, offset,
    friction and viscous coefficients) come from linear least squares; the scale with the smallest
    residual wins. A law without a velocity scale needs one point only.
    """
    known = parameters(choice.drive)
    scanned = [n for n in choice.free if _is_scanned(known[n])]
    scales = np.geomspace(4e-3, 0.5, SCALES if scanned else 1) * choice.v_max
    upper = {high for part in parts(choice.drive) for _, high in type(part).ordered}
    best: tuple[float, Array] | None = None
    for scale in scales:
        N = float(choice.drive.N)
        guess = {n: _guess(known[n], linear, N, scale, upper) for n in choice.free}
        cost, w = _levels(problem, problem.coordinates.of(guess))
        if best is None or cost < best[0]:
            best = cost, w
    if best is None or not np.isfinite(best[0]):
        return problem.coordinates.of({n: float(known[n].value) for n in choice.free})
    return best[1]


def _is_scanned(parameter: Parameter) -> bool:
    return is_velocity(parameter) and parameter.role != "width"


def _guess(
    parameter: Parameter, linear: LinearFit, N: float, scale: float, upper: Collection[str]
) -> float:
    """Start of one parameter: from the regression by its role, or the velocity scale."""
    level = max(abs(linear.values["F_c"]), linear.force_rms)
    if parameter.role in ("mass", "offset"):
        return linear.values["m" if parameter.role == "mass" else "offset"]
    if is_coefficient(parameter) or (parameter.role, parameter.unit) == ("level", "N"):
        per = N if is_coefficient(parameter) else 1.0
        return level / per * (1.2 if parameter.field in upper else 1.0)
    if parameter.role == "viscous" and parameter.unit in ("N s/m", "s/m"):
        return max(linear.values["F_v"], 0.0) / (N if parameter.unit == "s/m" else 1.0)
    if _is_scanned(parameter):
        return scale if parameter.unit in VELOCITIES else 1 / scale
    return float(parameter.value)


def _levels(problem: Problem, w: Array) -> tuple[float, Array]:
    """Sum of squares and coordinates after linear least squares in the levels alone."""
    at: Coordinates = problem.coordinates
    linear = at.linear.astype(bool)
    cost = _cost(problem, w)
    for _ in range(STEPS):
        J = problem.sensitivities(w)[:, linear]
        r = problem.residuals(w)
        if not (np.isfinite(J).all() and np.isfinite(r).all()):
            break
        trial = w.copy()
        trial[linear] += np.linalg.lstsq(J, r, rcond=1e-8)[0]
        trial = at.inside(trial)
        found = _cost(problem, trial)
        if not found < cost * (1 - 1e-6):
            break
        cost, w = found, trial
    return cost, w


def _cost(problem: Problem, w: Array) -> float:
    cost = float(np.sum(problem.residuals(w) ** 2))
    return cost if np.isfinite(cost) else np.inf
