"""Nonlinear least squares inside a box, with an end that says what was reached.

    minimise 1/2 r'r,   step s: the smallest |r + J s| with |s| <= radius

The radius of trust grows where the fall of the cost was what the derivatives promised, and shrinks
where it was not. Whether the end is a minimum is judged by what a whole Gauss-Newton step would
still gain, never by the size of a short one:

    fall = max over s of  r'r - |r + J s|^2     in the coordinates that no bound holds

Source: J. Nocedal, S. J. Wright, Numerical Optimization, 2nd ed., 2006, chapters 4 and 10.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from identification.old.data import Array
from symfric.foundation.status import Status

START, NOWHERE = 1.0, 1e-12
"""Radius of trust at the start, and below which there is no step."""
POOR, GOOD = 0.25, 0.75
"""Shares of the promised fall below which the radius shrinks, above which it grows."""
GAIN = 1e-10
"""Fall of the cost, relative to it, below which nothing is left to gain."""
NEAR = 0.1
"""Length of the last step, in standard errors, that is near enough where no trial does better."""
FAR = 15.0
"""Longest step that is believed in: of a logarithmic coordinate a factor of three million."""
AT_BOUND = 1e-9
"""Distance to a bound below which a coordinate stands there."""


@final
@dataclass(frozen=True, eq=False)
class Point:
    """Where the residuals are known.

    Attributes:
        w: coordinates, shape (n,).
        r: residuals, shape (rows,).
        J: their derivatives by w, shape (rows, n).
        run: what the residuals were taken from.
    """

    w: Array
    r: Array
    J: Array
    run: Any

    @property
    def cost(self) -> float:
        """Sum of squares r'r."""
        return float(self.r @ self.r)


Evaluate = Callable[[Array], Point | str]
"""w -> the residuals there, or why there are none."""


@final
@dataclass(frozen=True, eq=False)
class Descent:
    """How a descent ended: where, with which status, after how many steps, and why no further."""

    point: Point
    status: Status
    steps: int
    why: str = ""


def descend(
    at: Evaluate, start: Point, low: Array, high: Array, rounding: float, steps: int
) -> Descent:
    """Go from `start` to a minimum.

    Args:
        at: residuals and derivatives.
        start: first point, inside the box.
        low, high: bounds of w, shape (n,).
        rounding: norm of the error that residuals carry from their computation; falls of the cost
            that it can hide are not asked for.
        steps: allowed.
    """
    point, radius = start, START
    for count in range(steps + 1):
        free = ~_held(point, low, high)
        fall = remaining(point, free)
        if fall <= GAIN * point.cost or np.sqrt(point.cost) <= rounding:
            return Descent(point, Status.SOLVED, count)
        if count == steps:
            break
        found = _lower(at, point, free, (low, high), radius)
        if isinstance(found, str):
            return Descent(point, *_verdict(point, fall, rounding, count, found))
        point, radius = found
    return Descent(point, Status.MAX_ITERATIONS, steps)


def remaining(point: Point, free: NDArray[np.bool_]) -> float:
    """Fall of r'r that a Gauss-Newton step in the `free` coordinates promises.

    The step goes no further than `FAR` in any principal direction: beyond, derivatives promise
    nothing, and a coordinate that has lost its influence would have to go further than any.
    """
    u, s, _ = np.linalg.svd(point.J[:, free], full_matrices=False)
    part = np.abs(u.T @ point.r)
    reached = np.minimum(part, FAR * s)
    return float(((2 * part - reached) * reached).sum())


def _verdict(
    point: Point, fall: float, rounding: float, count: int, why: str
) -> tuple[Status, int, str]:
    """What it means that no trial lowers the cost."""
    hidden = 2 * np.sqrt(point.cost) * rounding + rounding**2
    if fall <= hidden:
        return Status.SOLVED, count, ""
    freedom = max(1, point.r.size - point.w.size)
    if fall <= NEAR**2 * point.cost / freedom:
        return Status.ACCEPTABLE, count, ""
    return Status.NO_DESCENT, count, why


def _lower(
    at: Evaluate,
    point: Point,
    free: NDArray[np.bool_],
    box: tuple[Array, Array],
    radius: float,
) -> tuple[Point, float] | str:
    """The next point with its radius of trust; why there is none."""
    failed, tried, why = 0, 0, ""
    parts = np.linalg.svd(point.J[:, free], full_matrices=False)
    while radius > NOWHERE:
        step = np.zeros(point.w.size)
        step[free] = _step(*parts, point.r, radius)
        w = np.clip(point.w + step, *box)
        taken = w - point.w
        length = float(np.linalg.norm(taken))
        if not length:
            break
        trial, tried = at(w), tried + 1
        if isinstance(trial, str):
            failed, why, radius = failed + 1, trial, length / 4
            continue
        promised = point.cost - float(np.sum((point.r + point.J @ taken) ** 2))
        kept = (point.cost - trial.cost) / promised if promised > 0 else 0.0
        if not kept > POOR:
            radius = length / 4
        elif kept > GOOD and length > 0.9 * radius:
            radius = min(2 * radius, FAR)
        if trial.cost < point.cost:
            return trial, radius
    if not why:
        return f"all {tried} trials fit worse, so the derivatives do not describe the motion there"
    return f"{failed} of {tried} trials could not be simulated, the last because {why}"


def _step(u: Array, s: Array, vt: Array, r: Array, radius: float) -> Array:
    """The s that makes |r + J s| smallest with |s| <= radius, for J = u diag(s) vt."""
    part, size = u.T @ r, np.maximum(s, 1e-300)

    def length(damping: float) -> float:
        return float(np.linalg.norm(part * size / (size**2 + damping)))

    whole = s > 1e-14 * float(s.max(initial=0.0))
    if float(np.linalg.norm((part / size)[whole])) <= radius:
        return -vt.T @ np.where(whole, part / size, 0.0)
    low, high = 0.0, float(np.linalg.norm(part * size)) / radius
    for _ in range(60):
        middle = (low + high) / 2 if low == 0.0 else float(np.sqrt(low * high))
        low, high = (middle, high) if length(middle) > radius else (low, middle)
        if high - low < 1e-3 * high:
            break
    return -vt.T @ (part * size / (size**2 + high))


def _held(point: Point, low: Array, high: Array) -> NDArray[np.bool_]:
    """Coordinates at a bound beyond which the cost would fall."""
    g = point.J.T @ point.r
    return ((point.w - low < AT_BOUND) & (g > 0)) | ((high - point.w < AT_BOUND) & (g < 0))
