"""Least squares of the torques of a robot, and the parameters that its records determine.

    tau_j = Y_j x + offset_j + F_j(q_j', theta_j),    weights 1 / sigma_j

sigma_j is the standard deviation of the residuals of joint j, which is estimated together with the
values (iteratively reweighted least squares). Nonlinear laws are linearised (Gauss and Newton). The
covariance includes the autocorrelation of the residuals of each joint, see `Sandwich`.

`information` states before the fit which parameters the records determine. With s the scale of each
base parameter in the file and sigma the noise of the torques, a combination of singular value d in

    sigma^-1 Y_1 diag(s) = U D V',

after offsets and friction are projected out, has the standard error 1 / d relative to its scale. It
is determined if this is below one half. Above 10, it does not enter the fit: noise of the torques
and errors of the model would move it far from the file.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple, cast, final

import numpy as np
from numpy.typing import NDArray

from identification.data.record import Array
from identification.residuals.evaluation import Channel
from identification.robot.base import NAMED, Base, regressor
from identification.robot.dynamics import RobotModel
from identification.robot.friction import JointLaw, coordinates
from identification.robot.motion import RobotMotion
from identification.verdict.minimum import Minimum, Sandwich
from symfric.foundation.shown import among

METHODS = ("ordinary", "weighted", "robust")
ROUNDS = 20
"""Largest number of iterations."""
CLOSE = 1e-6
"""Change of the logarithms of all sigma below which the iteration ends."""
HUBER = 1.345
"""Residual in standard deviations above which Huber's weight decreases."""
HALVINGS = 4
"""Largest number of halvings of a step of a nonlinear law."""
NEAR = np.array([0.5, 3.0])
"""Bounds of a velocity of a law, relative to the slowest and the fastest speeds."""
NONE = np.zeros(0)
LEAP = 2.0
"""Largest change of the logarithm of a parameter in one step."""


class JointRows(NamedTuple):
    """Rows of the joints that move, in order of record, joint and time.

    Attributes:
        Z: columns of base parameters and offsets, shape (rows, b + n).
        v, tau: velocity of the joint, measured torque, shape (rows,).
        joint, record: indices, shape (rows,).
        t: times [s], shape (rows,).
        noise: standard deviation of the noise of the torque by its spectrum, shape (rows,).
    """

    Z: Array
    v: Array
    tau: Array
    joint: NDArray[np.int64]
    record: NDArray[np.int64]
    t: Array
    noise: Array

    @classmethod
    def of(
        cls, model: RobotModel, motions: Sequence[RobotMotion], base: Base, rotors: bool,
        every: bool = False,
    ) -> "JointRows":  # fmt: skip
        """Return the rows of all records without reversals, or `every` row."""
        blocks = list[tuple[Any, ...]]()
        for record, one in enumerate(motions):
            columns = regressor(model, one.q, one.v, one.a, rotors)[..., base.chosen]
            for k, offset in enumerate(np.eye(len(model.joints))):
                on = np.ones_like(one.kept[:, k]) if every else one.kept[:, k]
                n = int(on.sum())
                blocks.append((
                    np.hstack([columns[on, k], np.tile(offset, (n, 1))]), one.v[on, k],
                    one.tau[on, k], np.full(n, k), np.full(n, record), one.t[on],
                    np.full(n, one.noise[k]),
                ))  # fmt: skip
        joined = cast(Any, [np.concatenate(part) for part in zip(*blocks, strict=True)])
        return cls(*joined)

    def at(self, rows: NDArray[np.bool_]) -> "JointRows":
        """Return some of the rows."""
        return JointRows(*(column[rows] for column in cast(Any, self)))

    def linearised(self, laws: Sequence[JointLaw], x: Array) -> tuple[Array, Array]:
        """Return all columns (rows, p) at the values x, and the predicted torques (rows,)."""
        first = self.Z.shape[1]
        predicted, blocks = self.Z @ x[:first], [self.Z]
        for k, law in enumerate(laws):
            on, last = self.joint == k, first + len(law.names)
            columns = np.zeros((self.tau.size, last - first))
            force, columns[on] = law.at(self.v[on], x[first:last])
            predicted[on] += force
            blocks.append(columns)
            first = last
        return np.hstack(blocks), predicted

    def one_way(self, n: int) -> NDArray[np.bool_]:
        """Return a mask of the joints that rest or move in one direction, shape (n,)."""
        moved = [np.sign(self.v[self.joint == k]) for k in range(n)]
        return np.array([abs(side.sum()) == side.size for side in moved])

    def by_joint(self, values: Array, n: int) -> Array:
        """Return the root mean square of values by joint; NaN for joints without rows, (n,)."""
        sums, counts = (np.bincount(self.joint, w, n) for w in (values**2, None))
        return np.sqrt(np.divide(sums, counts, out=np.full(n, np.nan), where=counts > 0))


SURE = 0.5
"""Largest standard error of a determined parameter, relative to its scale."""
ZERO = 1e-9
"""Entry of a projection that is due to rounding."""
ACCURACY = 0.01
"""Least noise of a torque relative to its root mean square."""
FAINT = 10.0
"""Standard error, relative to the scale, of a combination that does not enter the fit."""
HELPS = 0.5
"""Part of the largest effect above which a joint is also recommended."""


class Seen(NamedTuple):
    """Singular values d (k,) and right singular vectors V' (k, b) of the scaled columns."""

    d: Array
    Vt: Array

    def without_faint(self, equations: JointRows, base: Base) -> JointRows:
        """Return the equations without combinations that only change torques far below noise."""
        V, b = self.Vt[self.d > 1 / FAINT].T, len(base.labels)
        if V.shape[1] == b:
            return equations
        among = V @ V.T
        among[np.abs(among) < ZERO] = 0.0
        Z = equations.Z.copy()
        Z[:, :b] = Z[:, :b] @ (base.scales[:, None] * among / base.scales)
        return equations._replace(Z=Z)


def seen_in(equations: JointRows, base: Base, laws: Sequence[JointLaw]) -> Seen:
    """Compare the regressor with the noise of the torques, which is at least 1 % of a torque."""
    n, b = len(laws), len(base.labels)
    size = equations.by_joint(equations.tau, n)[equations.joint]
    sigma = np.maximum(np.maximum(equations.noise, ACCURACY * size), 1e-300)
    x = np.concatenate([base.values, np.zeros(n), coordinates(laws)])
    columns = equations.linearised(laws, x)[0] / sigma[:, None]
    U, s, _ = np.linalg.svd(columns[:, b:], full_matrices=False)
    along = U[:, s > 1e-9 * s.max(initial=0.0)]
    alone = (columns[:, :b] - along @ (along.T @ columns[:, :b])) * base.scales
    return Seen(*np.linalg.svd(alone, full_matrices=False)[1:])


@final
@dataclass(frozen=True)
class Information:
    """Combinations of the inertial parameters that records determine.

    Attributes:
        total: number of base parameters, which are identifiable in principle.
        rank: number of combinations that the records determine.
        condition: ratio of the largest and the smallest singular value of these.
        undetermined: base parameters that are not determined.
        resting: joints that do not move in any record.
        sentences: these facts, and the joints to move, in words.
    """

    total: int
    rank: int
    condition: float
    undetermined: tuple[str, ...]
    resting: tuple[str, ...]
    sentences: tuple[str, ...]

    def __str__(self) -> str:
        return "\n".join(self.sentences)


def information(
    model: RobotModel, motions: Sequence[RobotMotion], base: Base, equations: JointRows,
    seen: Seen, rotors: bool,
) -> Information:  # fmt: skip
    """Return the combinations that are determined, and the joints to move, in words."""
    n, b, (d, Vt) = len(model.joints), len(base.labels), seen
    known = d > 1 / SURE
    error = np.sqrt(np.sum((Vt.T / np.maximum(d, 1e-300)) ** 2, axis=1))
    loose = [int(k) for k in np.argsort(-error) if error[k] > SURE]
    moves = np.logical_or.reduce([one.moves for one in motions])
    resting = tuple(joint for joint, on in zip(model.names, moves, strict=True) if not on)
    rank, condition = int(known.sum()), float(d[0] / d[known][-1]) if known.any() else np.inf
    sentences = [
        f"The log determines {rank} of {b} combinations of the inertial parameters "
        f"(condition number {condition:.2g})."
    ]
    if rank < b or loose:
        names = among([base.labels[k] for k in loose], NAMED)
        sentences += [f"Not determined, close to the URDF: {names}."] * bool(loose)
        directions = Vt[~known] if rank < b else np.eye(b)[loose]
        sentences.append(_advice(model, motions, base, directions, moves, rotors))
    for joint in resting:
        sentences.append(f"{joint} rests: it has no friction here, and its torque is not used.")
    one_way = [j for j, on in zip(model.names, equations.one_way(n) & moves, strict=True) if on]
    if one_way:
        what = f"The friction level and the offset of {', '.join(one_way)} are not separable"
        sentences.append(f"{what}: move both ways.")
    undetermined = tuple(base.labels[k] for k in loose)
    return Information(b, rank, condition, undetermined, resting, tuple(sentences))


def _advice(
    model: RobotModel, motions: Sequence[RobotMotion], base: Base, directions: Array,
    moves: NDArray[np.bool_], rotors: bool,
) -> str:  # fmt: skip
    """Return which joints to move so that undetermined combinations change the torques most.

    Each joint moves alone at random within its limits, about the mean posture of the records. Only
    torques of joints that move count.
    """
    every = np.vstack([one.q for one in motions])
    middle, (q, v, a) = np.mean(every, axis=0), model.random_motion(50)
    effect = list[float]()
    for alone in np.eye(len(model.joints)):
        moved = middle + (q - middle) * alone
        columns = regressor(model, moved, v * alone, a * alone, rotors)[..., base.chosen]
        seen = columns[:, moves | (alone > 0)] @ (directions * base.scales).T
        effect.append(float(np.linalg.norm(seen)))
    best = [k for k in np.argsort(effect)[::-1].tolist() if effect[k] > HELPS * max(effect)]
    ranges = np.ptp(every, axis=0)
    each = [f"{model.names[k]} (range {ranges[k]:.2g} {model.units[k]} so far)" for k in best]
    return f"To see them, move {among(each, NAMED)} further and faster."


class Estimated(NamedTuple):
    """Estimate of p values: base parameters, offsets and coordinates of the laws.

    Attributes:
        equations: the rows.
        x: values, shape (p,).
        A: columns at x, shape (rows, p).
        residuals: predicted - measured, shape (rows,).
        sigma: standard deviation of the residuals of each joint, shape (n,).
        weights: weights of the rows relative to 1 / sigma^2, shape (rows,).
    """

    equations: JointRows
    x: Array
    A: Array
    residuals: Array
    sigma: Array
    weights: Array

    @property
    def unlikely(self) -> float:
        """Negative logarithm of the likelihood up to a constant."""
        return float(np.sum(np.log(self.sigma[self.equations.joint])))

    @property
    def dissipation(self) -> float:
        """Sum of the power of friction over all rows."""
        e, first = self.equations, self.equations.Z.shape[1]
        return float(e.v @ (e.tau + self.residuals - e.Z @ self.x[:first]))

    def covariance(self) -> Sandwich:
        """Return the covariance of the values."""
        e, p, size = self.equations, self.x.size, 1 / self.sigma[self.equations.joint]
        same = (np.diff(e.joint) == 0) & (np.diff(e.record) == 0)
        ends = [0, *(np.flatnonzero(~same) + 1).tolist(), e.tau.size]
        channels = [
            Channel(0, "", "", slice(i, j), e.t[i:j], e.tau[i:j], {}) for i, j in pairwise(ends)
        ]
        return Minimum(
            channels=channels, unknowns=(), names=("",) * p, values=self.x, slope=np.eye(p),
            held=np.zeros(p, dtype=bool), r=self.residuals * size * self.weights,
            J=self.A * size[:, None], gain=np.where(self.weights < 1.0, 0.0, 1.0),
            raw=self.residuals, noise={}, change=lambda values: 0.0,
        ).sandwich  # fmt: skip

    def refitted(self, x: Array, count: int) -> Array:
        """Return `x` with all values after the first `count` adapted to these, to first order."""
        weight = np.sqrt(self.weights) / self.sigma[self.equations.joint]
        change = (self.A[:, :count] @ (x - self.x)[:count]) * weight
        rest = self.x[count:] - _least_squares(self.A[:, count:] * weight[:, None], change)
        return np.append(x[:count], rest)


def estimate(equations: JointRows, laws: Sequence[JointLaw], base: Base, method: str) -> Estimated:
    """Return the estimate by one of `METHODS`."""
    n, tau = len(laws), equations.tau
    x = np.concatenate([base.values, np.zeros(n), coordinates(laws)])
    linear = all(law.linear for law in laws)
    low, high, leap = _ends(equations, laws, x.size)
    x = np.clip(x, low, high)
    least = 1e-9 * np.nan_to_num(equations.by_joint(tau, n), nan=1.0) + 1e-300
    sigma, weights = np.ones(n), np.ones(tau.size)
    columns, predicted = equations.linearised(laws, x)
    for _ in range(ROUNDS):
        w = np.sqrt(weights) / sigma[equations.joint]
        ends = np.maximum(low - x, -leap), np.minimum(high - x, leap)
        step = _bounded(columns * w[:, None], (tau - predicted) * w, base.scales, *ends)
        before = np.linalg.norm((tau - predicted) * w)
        for _ in range(HALVINGS):
            columns, predicted = equations.linearised(laws, x + step)
            if linear or np.linalg.norm((tau - predicted) * w) <= before:
                break
            step = step / 2
        x, left = x + step, predicted - tau
        spread = equations.by_joint(left, n) / np.sqrt(max(0.1, 1 - x.size / tau.size))
        spread = np.maximum(np.nan_to_num(spread, nan=1.0), least)
        if method == "ordinary":
            spread = np.full(n, np.linalg.norm(left) / np.sqrt(tau.size))
        if method == "robust":
            size = np.maximum(np.abs(left) / spread[equations.joint], HUBER)
            weights = HUBER / size
        change = np.abs(np.log(spread / sigma)).max()
        sigma = spread
        if change < CLOSE:
            break
    return Estimated(equations, x, columns, predicted - tau, sigma, weights)


def _ends(equations: JointRows, laws: Sequence[JointLaw], size: int) -> tuple[Array, Array, Array]:
    """Return bounds of all values and of their steps; values of linear laws have none, (p,) each.

    Velocities of a law are near those of the record; levels are at most three times the torque.
    """
    low, high, leap = np.full(size, -np.inf), np.full(size, np.inf), np.full(size, np.inf)
    first = size - sum(len(law.names) for law in laws)
    for k, law in enumerate(laws):
        part = slice(first, first + len(law.names))
        first, on = part.stop, equations.joint == k
        if on.any() and not law.linear:
            speeds = np.log(np.quantile(np.abs(equations.v[on]), [0.01, 1.0]) * NEAR)
            largest = 3 * float(np.abs(equations.tau[on]).max())
            level = np.array([unit in ("N", "N m") for unit in law.units])
            low[part] = np.where(law.logarithmic, speeds[0], 0.0)
            high[part] = np.where(law.logarithmic, speeds[1], np.where(level, largest, np.inf))
            leap[part] = np.where(law.logarithmic, LEAP, np.inf)
    return low, high, leap


def _bounded(columns: Array, values: Array, scales: Array, low: Array, high: Array) -> Array:
    """Return the least squares solution; entries beyond a bound are held there, shape (p,)."""
    step = _least_squares(columns, values, scales)
    out = (step < low) | (step > high)
    if out.any():
        step = np.where(out, np.clip(step, low, high), 0.0)
        step += _least_squares(columns * ~out, values - columns @ step, scales) * ~out
    return step


def _least_squares(columns: Array, values: Array, scales: Array = NONE) -> Array:
    """Return the solution that is least in units of its scales, shape (p,).

    Args:
        columns, values: shapes (rows, p) and (rows,).
        scales: prior scales of the first values; others have the inverse length of their column.
    """
    size = np.linalg.norm(columns, axis=0)
    size = np.where(size > 0, size, 1.0)
    first = slice(0, len(scales))
    size[first] = max(np.max(size[first] * scales, initial=0.0), 1e-300) / scales
    return np.linalg.lstsq(columns / size, values, rcond=1e-10)[0] / size
