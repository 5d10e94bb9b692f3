"""The position controller of a drive experiment, and the drive under it."""

from dataclasses import dataclass
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.old.stepper import Motion, motion_of, plant
from symfric.model import Model

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class PositionLoop:
    """A sampled cascade of position and velocity feedback with its reference.

        command = clip(kp kv (reference - x) - kv dx, +-limit)
        force = gain (command + disturbance)

    dx is the difference of the mean of the last two positions. The command is held for one sample.

    Attributes:
        kp: position gain [1/s].
        kv: velocity gain [command s/m].
        gain: force per command [N per command unit].
        limit: largest command.
        reference: position reference at the samples [m], shape (n,).
        disturbance: added to the command, shape (n,).
    """

    kp: float
    kv: float
    gain: float
    limit: float
    reference: Array
    disturbance: Array


def closed_loop(model: Model, loop: PositionLoop, step: float, x0: float) -> Motion:
    """The drive under its controller, starting at rest at `x0` [m]: one mapped CasADi Function."""
    reference, disturbance = ca.SX.sym("reference"), ca.SX.sym("disturbance")
    x, v, x_last, mean_last = (ca.SX.sym(n) for n in ("x", "v", "x_last", "mean_last"))
    mean = (x + x_last) / 2
    command = loop.kp * loop.kv * (reference - x) - loop.kv * (mean - mean_last) / step
    command = ca.fmin(ca.fmax(command, -loop.limit), loop.limit)
    force = loop.gain * (command + disturbance)
    new = plant(model, step)(x, v, force)
    sample = ca.Function(
        "sample",
        [ca.vertcat(x, v, x_last, mean_last), ca.vertcat(reference, disturbance)],
        [ca.vertcat(*new, x, mean), force],
    )
    inputs = np.vstack([loop.reference, loop.disturbance])
    start = np.array([x0, 0.0, x0, x0])
    states, forces = sample.mapaccum(loop.reference.size)(start, inputs)
    all_states = np.column_stack([start[:2], np.asarray(states.full())[:2]])
    return motion_of(all_states, np.asarray(forces.full()).ravel(), step)
