"""What a record shows about a robot, before the fit: rank, condition, and joints to move."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from identification.data.record import Array
from identification.robot.base import NAMED, SURE, Base, regressor
from identification.robot.dynamics import RobotModel
from identification.robot.estimate import Equations
from identification.robot.friction import JointLaw, coordinates
from identification.robot.motion import RobotMotion
from symfric.foundation.shown import among

ACCURACY = 0.01
"""Least noise of a torque relative to its root mean square."""
HELPS = 0.5
"""Share of the largest effect above which another joint is recommended, too."""


@final
@dataclass(frozen=True)
class Information:
    """Combinations of the inertial parameters that records determine.

    Attributes:
        total: number of base parameters, which are identifiable in principle.
        rank: number of combinations that the records determine, see `base`.
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
    laws: Sequence[JointLaw], rotors: bool,
) -> Information:  # fmt: skip
    """Compare the regressor with the noise of the torques and the scales of the parameters.

    Offsets and friction are estimated with the inertial parameters. The noise is that of the
    spectra of the torques, at least 1 % of the torque.
    """
    n, b = len(model.joints), len(base.labels)
    size = equations.by_joint(equations.tau, n)[equations.joint]
    sigma = np.maximum(np.maximum(equations.noise, ACCURACY * size), 1e-300)
    x = np.concatenate([base.values, np.zeros(n), coordinates(laws)])
    A = equations.linearised(laws, x)[0] / sigma[:, None]
    Q = np.linalg.svd(A[:, b:], full_matrices=False)
    friction = Q[0][:, Q[1] > 1e-9 * Q[1].max(initial=0.0)]
    D = (A[:, :b] - friction @ (friction.T @ A[:, :b])) * base.scales
    _, d, Vt = np.linalg.svd(D, full_matrices=False)
    sure = d > 1 / SURE
    spread = np.sqrt(np.sum((Vt.T / np.sqrt(1 + d**2)) ** 2, axis=1))
    loose = np.argsort(-spread)[: int(np.sum(spread > SURE))]
    rank, condition = int(sure.sum()), float(d[0] / d[sure][-1]) if sure.any() else np.inf
    moves = np.logical_or.reduce([one.moves for one in motions])
    resting = tuple(np.array(model.names)[~moves].tolist())
    text = f"The log determines {rank} of {b} combinations of the inertial parameters"
    text += f" (condition number {condition:.2g})." if sure.any() else "."
    sentences = [text]
    if loose.size:
        names = among([base.labels[k] for k in loose], NAMED)
        sentences.append(f"Not determined, close to the URDF: {names}.")
        sentences.append(_advice(model, motions, base, Vt[~sure], loose, rotors))
    if resting:
        what = f"{', '.join(resting)} {'rests' if len(resting) == 1 else 'rest'} in the log"
        sentences.append(f"{what}: without friction and offset, and their torques are not used.")
    return Information(
        b, rank, condition, tuple(base.labels[k] for k in loose), resting, tuple(sentences)
    )


def _advice(
    model: RobotModel, motions: Sequence[RobotMotion], base: Base, directions: Array,
    loose: Array, rotors: bool,
) -> str:  # fmt: skip
    """Return which joints to move so that undetermined combinations change the torques most.

    Each joint moves alone at random within its limits, about the mean posture of the records.
    """
    n, middle = len(model.joints), np.mean(np.vstack([one.q for one in motions]), axis=0)
    wide = directions if directions.size else np.eye(len(base.labels))[loose]
    along = (wide * base.scales).T
    effect, (q, v, a) = np.zeros(n), model.random_motion(50)
    for k in range(n):
        alone = np.eye(n)[k]
        moved = middle + (q - middle) * alone
        Y = regressor(model, moved, v * alone, a * alone, rotors)[..., base.chosen]
        still = Y.mean(axis=0) if not v[:, k].any() else 0.0
        effect[k] = np.linalg.norm((Y - still) @ along)
    best = [k for k in np.argsort(-effect) if effect[k] > HELPS * effect.max()]
    spans = np.ptp(np.vstack([one.q for one in motions]), axis=0)
    each = [f"{model.names[k]} (range {spans[k]:.2g} {model.units[k]} so far)" for k in best]
    return f"To see them, move {among(each, NAMED)} further and faster."
