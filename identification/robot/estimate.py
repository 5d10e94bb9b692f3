"""Least squares of the torques of a robot: ordinary, weighted by joint, or robust.

    tau_j = Y_j x + offset_j + F_j(q_j', theta_j),    weights 1 / sigma_j

sigma_j is the standard deviation of the residuals of joint j, which is estimated together with the
values (iteratively reweighted least squares). Nonlinear laws are linearised (Gauss and Newton). The
covariance includes the autocorrelation of the residuals of each joint, see `Sandwich`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.data.record import Array
from identification.residuals.evaluation import Channel
from identification.robot.base import Base, regressor
from identification.robot.dynamics import RobotModel
from identification.robot.friction import JointLaw, coordinates
from identification.robot.motion import RobotMotion
from identification.verdict.minimum import Minimum
from symfric.foundation.shown import brief

METHODS = ("ordinary", "weighted", "robust")
ROUNDS = 40
"""Largest number of iterations."""
CLOSE = 1e-6
"""Relative change of the weighted residuals below which the iteration ends."""
HUBER = 1.345
"""Residual in standard deviations above which Huber's weight decreases."""
HALVINGS = 8
"""Largest number of halvings of a step of a nonlinear law."""


@final
@dataclass(frozen=True, eq=False)
class Equations:
    """Rows of the joints that move, in order of record, joint and time.

    Attributes:
        Z: columns of base parameters and offsets, shape (rows, b + n).
        v, tau: velocity of the joint, measured torque, shape (rows,).
        joint: index of the joint, shape (rows,).
        channels: rows of each record and joint.
        noise: standard deviation of the noise of the torque by its spectrum, shape (rows,).
    """

    Z: Array
    v: Array
    tau: Array
    joint: NDArray[np.int64]
    channels: tuple[Channel, ...]
    noise: Array

    __repr__ = brief

    @classmethod
    def of(
        cls, model: RobotModel, motions: Sequence[RobotMotion], base: Base, rotors: bool
    ) -> "Equations":
        """Evaluate the regressor over all records."""
        blocks, v, tau, joint = list[Array](), list[Array](), list[Array](), list[int]()
        channels, noise, n = list[Channel](), list[Array](), len(model.joints)
        for record, one in enumerate(motions):
            Y = regressor(model, one.q, one.v, one.a, rotors)[..., base.chosen]
            for k in np.flatnonzero(one.kept.any(axis=0)).tolist():
                kept, count = one.kept[:, k], int(one.kept[:, k].sum())
                rows = slice(len(joint), len(joint) + count)
                blocks.append(np.hstack([Y[kept, k], np.tile(np.eye(n)[k], (count, 1))]))
                v.append(one.v[kept, k])
                tau.append(one.tau[kept, k])
                noise.append(np.full(count, one.noise[k]))
                joint += [k] * count
                name, unit = model.names[k], model.forces[k]
                channels.append(Channel(record, name, unit, rows, one.t[kept], tau[-1], {}))
        return cls(
            np.vstack(blocks), np.concatenate(v), np.concatenate(tau), np.array(joint),
            tuple(channels), np.concatenate(noise),
        )  # fmt: skip

    def at(self, rows: NDArray[np.bool_]) -> "Equations":
        """Return some of the rows."""
        channels, first = list[Channel](), 0
        for c in self.channels:
            here = rows[c.rows]
            last = first + int(here.sum())
            if last > first:
                t, tau = c.t[here], c.measured[here]
                channels.append(Channel(c.record, c.signal, c.unit, slice(first, last), t, tau, {}))
            first = last
        one = (y[rows] for y in (self.Z, self.v, self.tau, self.joint))
        return Equations(*one, tuple(channels), self.noise[rows])

    def linearised(self, laws: Sequence[JointLaw], x: Array) -> tuple[Array, Array]:
        """Return all columns (rows, p) at the values x, and the predicted torques (rows,)."""
        sizes = [len(law.names) for law in laws]
        friction = np.zeros((self.tau.size, sum(sizes)))
        first, theta = self.Z.shape[1], self.Z.shape[1]
        predicted = self.Z @ x[:first]
        for k, (law, size) in enumerate(zip(laws, sizes, strict=True)):
            on, part = self.joint == k, slice(theta - first, theta - first + size)
            F, J = law.at(self.v[on], x[theta : theta + size])
            friction[on, part] = J
            predicted[on] += F
            theta += size
        return np.hstack([self.Z, friction]), predicted

    def by_joint(self, values: Array, n: int) -> Array:
        """Return the root mean square of values by joint; NaN for joints without rows, (n,)."""
        sums, counts = (np.bincount(self.joint, w, n) for w in (values**2, None))
        return np.sqrt(np.divide(sums, counts, out=np.full(n, np.nan), where=counts > 0))


@final
@dataclass(frozen=True, eq=False)
class Estimated:
    """Estimate of p values: base parameters, offsets and coordinates of the laws.

    Attributes:
        equations: the rows.
        x: values, shape (p,).
        A: columns at x, shape (rows, p).
        residuals: predicted - measured, shape (rows,).
        sigma: standard deviation of the residuals of each joint, shape (n,).
        weights: weights of the rows, shape (rows,).
    """

    equations: Equations
    x: Array
    A: Array
    residuals: Array
    sigma: Array
    weights: Array

    __repr__ = brief

    def minimum(self, names: Sequence[str]) -> Minimum:
        """Return the weighted problem, whose `sandwich` is the covariance of the values."""
        p, size = self.x.size, 1 / self.sigma[self.equations.joint]
        return Minimum(
            channels=self.equations.channels, unknowns=(), names=tuple(names), values=self.x,
            slope=np.eye(p), held=np.zeros(p, dtype=bool), r=self.residuals * size * self.weights,
            J=self.A * size[:, None], gain=np.where(self.weights < 1.0, 0.0, 1.0),
            raw=self.residuals, noise={}, change=lambda values: 0.0,
        )  # fmt: skip


def estimate(equations: Equations, laws: Sequence[JointLaw], base: Base, method: str) -> Estimated:
    """Return the estimate by one of `METHODS`."""
    n, start = len(laws), coordinates(laws)
    x = np.concatenate([base.values, np.zeros(n), start])
    scales = np.concatenate([base.scales, np.ones(n), np.ones(start.size)])
    linear = all(law.linear for law in laws)
    sigma = weights = np.ones(equations.tau.size)
    A, predicted = equations.linearised(laws, x)
    cost, spread = np.inf, np.ones(n)
    for _ in range(ROUNDS):
        w = np.sqrt(weights) / sigma
        goal = equations.tau - predicted + A @ x
        there = _least_squares(A * w[:, None], goal * w, scales)
        step, before = there - x, float(np.sum(((equations.tau - predicted) * w) ** 2))
        for _ in range(1 if linear else HALVINGS):
            there = x + step
            A, predicted = equations.linearised(laws, there)
            if float(np.sum(((equations.tau - predicted) * w) ** 2)) <= before:
                break
            step = step / 2
        x, left = there, predicted - equations.tau
        spread = _spreads(equations, left, x.size, n)
        if method == "ordinary" and linear:
            break
        if method != "ordinary":
            sigma = spread[equations.joint]
        if method == "robust":
            large = np.abs(left) / sigma
            weights = np.minimum(1.0, HUBER / np.maximum(large, 1e-300))
        now = float(np.sum(np.log(spread[np.isfinite(spread)]))) + float(np.sum(1 - weights))
        if abs(now - cost) < CLOSE:
            break
        cost = now
    spread = np.where(np.isfinite(spread), spread, 1.0)
    if method == "ordinary":
        sigma_j = np.full(n, float(np.sqrt(np.mean((predicted - equations.tau) ** 2))))
        return Estimated(equations, x, A, predicted - equations.tau, sigma_j, weights)
    return Estimated(equations, x, A, predicted - equations.tau, spread, weights)


def _spreads(equations: Equations, left: Array, p: int, n: int) -> Array:
    """Return the standard deviations of the residuals by joint, corrected for p values, (n,)."""
    rows = max(1, equations.tau.size)
    found = equations.by_joint(left, n) / np.sqrt(max(0.1, 1 - p / rows))
    return np.maximum(found, 1e-9 * equations.by_joint(equations.tau, n))


def _least_squares(A: Array, b: Array, scales: Array) -> Array:
    """Return the solution of least norm in units of the scales, shape (p,)."""
    size = np.linalg.norm(A, axis=0)
    size = np.where(size > 0, size, 1.0)
    return np.linalg.lstsq(A / size, b, rcond=1e-10)[0] / size
