"""Information of records about a robot, before the fit: rank, condition, and joints to move.

With s the prior scale of each base parameter (from the file) and sigma the noise of the torques, a
combination of singular value d in

    sigma^-1 Y_1 diag(s) = U D V',

after offsets and friction are projected out, has the standard error 1 / d relative to its scale. It
is determined if this is below one half. Above 10, it does not enter the fit: noise of the torques
and errors of the model would move it far from the file.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from identification.data.record import Array
from identification.robot.base import NAMED, Base, regressor
from identification.robot.dynamics import RobotModel
from identification.robot.estimate import Equations
from identification.robot.friction import JointLaw, coordinates
from identification.robot.motion import RobotMotion
from symfric.foundation.shown import among

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

    def without_faint(self, equations: Equations, base: Base) -> Equations:
        """Return the equations without combinations that only change torques far below noise."""
        V, b = self.Vt[self.d > 1 / FAINT].T, len(base.labels)
        if V.shape[1] == b:
            return equations
        among = V @ V.T
        among[np.abs(among) < ZERO] = 0.0
        Z = equations.Z.copy()
        Z[:, :b] = Z[:, :b] @ (base.scales[:, None] * among / base.scales)
        return equations._replace(Z=Z)


def seen_in(equations: Equations, base: Base, laws: Sequence[JointLaw]) -> Seen:
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
    model: RobotModel, motions: Sequence[RobotMotion], base: Base, equations: Equations,
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
