"""Start values: linear regression, then a scan over the velocity scale of the law."""

import numpy as np

from identification.choice import Choice, is_coefficient, is_smoothing
from identification.coordinates import Coordinates
from identification.data import Array
from identification.problem import Problem
from identification.regress import LinearFit
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
    scanned = [n for n in choice.free if not _is_level(known[n]) and _is_velocity(known[n])]
    scales = np.geomspace(4e-3, 0.5, SCALES if scanned else 1) * choice.v_max
    best: tuple[float, Array] | None = None
    for scale in scales:
        guess = {n: _guess(known[n], linear, float(choice.drive.N), scale) for n in choice.free}
        cost, w = _levels(problem, problem.coordinates.of(guess))
        if best is None or cost < best[0]:
            best = cost, w
    if best is None or not np.isfinite(best[0]):
        return problem.coordinates.of({n: float(known[n].value) for n in choice.free})
    return best[1]


def _is_velocity(parameter: Parameter) -> bool:
    return parameter.unit in ("m/s", "s/m") and not is_smoothing(parameter.name)


def _is_level(parameter: Parameter) -> bool:
    return parameter.unit in ("kg", "N", "N s/m") or is_coefficient(parameter)


def _guess(parameter: Parameter, linear: LinearFit, N: float, scale: float) -> float:
    """Start of one parameter: from the regression by its unit, or the velocity scale."""
    level = max(abs(linear.values["F_c"]), linear.force_rms)
    if parameter.name in ("m", "offset"):
        return linear.values[parameter.name]
    if is_coefficient(parameter):
        return level / N * (1.2 if parameter.name.startswith("mu_s") else 1.0)
    if parameter.unit == "N s/m":
        return max(linear.values["F_v"], 0.0)
    if _is_velocity(parameter):
        return scale if parameter.unit == "m/s" else 1 / scale
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
