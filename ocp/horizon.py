"""Gauss-Newton estimates of the states of one horizon.

The unknowns are weights l_i of the noise of each sample:

    x_0 = m + P l_0,   x_i+1 = f(x_i, u_i) + Q_i l_i+1
    minimise sum l_i' Q_i l_i + sum |y_i - h(x_i, u_i)|^2_R,   l_0 with P

so that Q_i may be singular, and every iterate is a motion of the model. A Gauss-Newton step is a
Kalman filter and a Rauch-Tung-Striebel smoother of the linearised model. A step that does not
reduce the cost is halved. Values outside their bounds are measured at the bound.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import pinvh

from symfric.foundation.numeric import Array
from symfric.foundation.status import SolveError, Status

ITERATIONS, HALVINGS, TOLERANCE = 20, 8, 1e-6
"""Largest number of Gauss-Newton steps and of their halvings; last step in units of the spread."""
PINNED = 1e-4
"""Deviation of a value that is held at its bound, in units of the spread."""
DIVERGED = (
    "estimate: the motion became infinite; take more `steps`, a smaller `spread` at the start, or "
    "less noise of states"
)


class HorizonFunctions(NamedTuple):
    """Functions of (xi, u, scale, p), their last arguments, covariances, variances and bounds.

    xi are states, loads and drifting parameters in units of their `scale`.

    Attributes:
        after: -> next xi and its Jacobian.
        ahead: -> next xi.
        finer: -> next xi, by twice as many integration steps.
        seen: -> measured signals and their Jacobian.
        fixed: scale and p.
        Q: covariance of the noise of one sampling interval.
        R: variances of the measured signals.
        lower, upper: bounds.
    """

    after: ca.Function
    ahead: ca.Function
    finer: ca.Function
    seen: ca.Function
    fixed: tuple[Array, Array]
    Q: Array
    R: Array
    lower: Array
    upper: Array

    def inside(self, xi: Array) -> Array:
        """Return values in columns, moved to their bounds if they are outside."""
        return np.clip(xi, self.lower[:, None], self.upper[:, None])

    def at(self, f: ca.Function, xi: Array, u: Array) -> list[Array]:
        """Return values in columns of a function, and its Jacobians side by side, if it has any."""
        count = xi.shape[1]
        found = f.map(count).call([xi, u, *(np.tile(row[:, None], count) for row in self.fixed)])
        return [value.full() for value in found]


@final
@dataclass(frozen=True, eq=False)
class Found:
    """Estimate over a horizon.

    Attributes:
        smooth: estimates in columns, from all data of the horizon.
        weights: weights of the noise in columns.
        filtered: covariance of each sample from the data up to it.
        predicted: mean and covariance before the data of each sample, and after the last one.
        slopes: Jacobian of each step.
        innovations: square of the innovation of each sample, |y - h|^2_S with the covariance S of
            y - h before the sample; its mean is the number of signals if the model holds.
        converged: True if the last step is below the tolerance.
    """

    smooth: Array
    weights: Array
    filtered: list[Array]
    predicted: list[tuple[Array, Array]]
    slopes: list[Array]
    innovations: list[float]
    converged: bool = False


@final
@dataclass(frozen=True, eq=False)
class Window:
    """Data of a horizon.

    Attributes:
        functions: functions and covariances of the model.
        y, u: measured signals (NaN if missing) and inputs in columns.
        errors: covariance of the error of the model in each step, added to its noise.
        prior: mean and covariance before the first sample.
    """

    functions: HorizonFunctions
    y: Array
    u: Array
    errors: Array
    prior: tuple[Array, Array]

    def solved(self, weights: Array) -> Found:
        """Return the estimate, from start values of the weights.

        Raises:
            SolveError: the motion of the start values becomes infinite.
        """
        xi, cost = self._motion(weights)
        if not np.isfinite(cost):
            raise SolveError(DIVERGED, Status.NOT_FINITE)
        pins = xi != self.functions.inside(xi)
        found = self._passed(xi, pins)
        for _ in range(ITERATIONS):
            moved = self._searched(found.weights, weights, xi, cost, pins)
            if moved is None:
                break
            change = float(np.abs(moved[1] - xi).max())
            weights, xi, cost = moved
            before, pins = pins, xi != self.functions.inside(xi)
            if change <= TOLERANCE and np.array_equal(pins, before):
                found = replace(found, converged=True)
                break
            found = self._passed(xi, pins)
        if pins.any():  # covariances and innovations ignore bounds
            free = self._passed(xi, np.zeros_like(pins))
            pairs = zip(found.predicted, free.predicted, strict=True)
            predicted = [(mean, spread) for (mean, _), (_, spread) in pairs]
            found = replace(free, predicted=predicted, converged=found.converged)
        return replace(found, smooth=xi, weights=weights)

    def step_error(self, found: Found) -> Array:
        """Return the covariance of the error of the model in the step after the last sample.

        The error r_i = g(m + s_i) - (f(m) + A s_i) is that of the linearised model f against g
        with twice as many integration steps, at the 2 n points s_i of a third-degree cubature rule
        for the covariance of the estimate m; the result is the mean of r_i r_i'. Source:
        Arasaratnam and Haykin, IEEE Trans. Autom. Control 54, 2009, 1254-1269.
        """
        functions, m = self.functions, self.functions.inside(found.smooth)[:, -1:]
        n = m.size
        variances, axes = np.linalg.eigh(found.filtered[-1])
        shifts = axes * np.sqrt(n * np.maximum(variances, 0.0))
        points = functions.inside(m + np.hstack([shifts, -shifts]))
        (finer,) = functions.at(functions.finer, points, np.tile(self.u[:, -1:], 2 * n))
        (linear,) = functions.at(functions.ahead, m, self.u[:, -1:])
        errors = finer - linear - found.slopes[-1] @ (points - m)
        return errors @ errors.T / (2 * n)

    def _searched(
        self, goal: Array, weights: Array, xi: Array, cost: float, pins: NDArray[np.bool_]
    ) -> tuple[Array, Array, float] | None:
        """Return weights, motion and cost after a step towards `goal`; None if no step improves."""
        limits = self.functions.inside(xi)
        present = cost + _outside(xi, limits, pins)
        for halving in range(HALVINGS):
            trial = weights + 0.5**halving * (goal - weights)
            motion, cost = self._motion(trial)
            small = np.abs(motion - xi).max() <= TOLERANCE
            if small or cost + _outside(motion, limits, pins) < present:
                return trial, motion, cost
        return None

    def _motion(self, weights: Array) -> tuple[Array, float]:
        """Return the motion in columns with given weights of the noise, and its cost."""
        functions, (mean, spread) = self.functions, self.prior
        noise = [spread @ weights[:, 0]]
        noise += [
            (functions.Q + e) @ w for e, w in zip(self.errors, weights[:, 1:].T, strict=False)
        ]
        xi = [mean + noise[0]]
        for u, w in zip(self.u.T, noise[1:], strict=False):
            xi.append(functions.ahead(xi[-1], u, *functions.fixed).full()[:, 0] + w)
        motion = np.array(xi).T
        rest = self.y - functions.at(functions.seen, motion, self.u)[0]
        cost = np.sum(weights.T * noise)
        cost += np.sum(np.where(np.isnan(self.y), 0.0, rest**2 / functions.R[:, None]))
        return motion, float(cost) if np.isfinite(cost) else np.inf

    def _passed(self, xi: Array, pins: NDArray[np.bool_]) -> Found:
        """Filter and smooth the model that is linearised at the columns of `xi`.

        Values with `pins`, a mask of the shape of `xi`, are held at the nearest bound.
        """
        functions, every, count = self.functions, np.eye(xi.shape[0]), xi.shape[1]
        limits = functions.inside(xi)
        after, slopes = functions.at(functions.after, xi, self.u)
        seen, rows = functions.at(functions.seen, xi, self.u)
        A, C = np.split(slopes, count, axis=1), np.split(rows, count, axis=1)
        predicted, means, covariances = [self.prior], list[Array](), list[Array]()
        innovations = list[float]()
        for k in range(count):
            m, spread = predicted[-1]
            there, pinned = np.isfinite(self.y[:, k]), pins[:, k]
            H = np.vstack([C[k][there], every[pinned]])
            R = np.diag([*functions.R[there], *np.full(pinned.sum(), PINNED**2)])
            S = H @ spread @ H.T + R
            gain = np.linalg.solve(S, H @ spread).T
            rest = [*(self.y[there, k] - seen[there, k]), *(limits[pinned, k] - xi[pinned, k])]
            rest -= H @ (m - xi[:, k])
            innovations.append(float(rest @ np.linalg.solve(S, rest)))
            m = m + gain @ rest
            keep = every - gain @ H
            P = _symmetric(keep @ spread @ keep.T + gain @ R @ gain.T)
            means.append(m)
            covariances.append(P)
            ahead = after[:, k] + A[k] @ (m - xi[:, k])
            after_step = _symmetric(A[k] @ P @ A[k].T + functions.Q + self.errors[k])
            predicted.append((ahead, after_step))
        return replace(_smoothed(means, covariances, predicted, A), innovations=innovations)


def _smoothed(
    means: Sequence[Array], covariances: list[Array], predicted: list[tuple[Array, Array]],
    slopes: list[Array],
) -> Found:  # fmt: skip
    """Return the smoothed states of a filter, and the weights of its noise."""
    smooth, weights = [means[-1]], list[Array]()
    for k in reversed(range(len(means))):
        expected, spread = predicted[k]
        weights.append(pinvh(spread) @ (smooth[-1] - expected))
        if k:
            smooth.append(means[k - 1] + covariances[k - 1] @ slopes[k - 1].T @ weights[-1])
    columns = [np.array(rows[::-1]).T for rows in (smooth, weights)]
    return Found(columns[0], columns[1], covariances, predicted, slopes, [])


def _outside(xi: Array, limits: Array, pins: NDArray[np.bool_]) -> float:
    """Return the cost of the values that are held at their limits."""
    return float(np.sum(((xi - limits)[pins] / PINNED) ** 2))


def _symmetric(P: Array) -> Array:
    """Return the symmetric part of a covariance."""
    return (P + P.T) / 2
