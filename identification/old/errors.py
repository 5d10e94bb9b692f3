"""How well a drive with identified parameters reproduces a record."""

from dataclasses import asdict, dataclass
from typing import Any, final

import casadi as ca
import numpy as np

from identification.old.data import Array, Dataset
from identification.old.filters import Filter, central_difference, lowpass
from identification.old.loop import closed_loop
from identification.old.problem import inverse_force
from identification.old.signals import MotionSignals, differentiate
from identification.old.stepper import open_loop
from symfric.scenes import Drive

LEFT_OUT = 20
"""Samples at the start that the open-loop error leaves out, as the EMPS benchmark does."""


@final
@dataclass(frozen=True)
class ClosedLoopErrors:
    """Relative errors [%] of the drive simulated under its own controller, norm over norm."""

    x: float
    v: float
    a: float
    force: float


@final
@dataclass(frozen=True)
class Errors:
    """Errors on one record.

    Attributes:
        data: name of the record.
        force_relative: norm of the inverse-model force error over norm of the force [%].
        force_rms: root mean square of that error [N].
        position_rms: root mean square of the position simulated from the measured force over the
            whole record without feedback, first 20 samples left out [m]; any error in force is
            integrated twice, so this is a severe measure.
        closed_loop: errors under the controller, where the record knows it.
    """

    data: str
    force_relative: float
    force_rms: float
    position_rms: float
    closed_loop: ClosedLoopErrors | None = None

    def to_dict(self) -> dict[str, Any]:
        """The fields by name."""
        return asdict(self)


def predicted_force(drive: Drive, v: Array, a: Array) -> Array:
    """The force [N] the drive needs for the motion `v` [m/s], `a` [m/s^2]."""
    model = drive.model()
    force = ca.Function("force", [model.x[1].symbol, model.xdot[1]], [inverse_force(model)])
    return np.asarray(force(v[None, :], a[None, :]).full()).ravel()


def residual_force(drive: Drive, signals: MotionSignals) -> Array:
    """Measured minus predicted force of the decimated equations [N]."""
    return signals.equations(signals.force - predicted_force(drive, signals.v, signals.a))


def evaluate(drive: Drive, data: Dataset, filter: Filter) -> Errors:
    """Force, open-loop and, where the controller is known, closed-loop errors on `data`."""
    signals = differentiate(data, filter)
    error = residual_force(drive, signals)
    force = signals.equations(signals.force)
    return Errors(
        data=data.name,
        force_relative=_relative(force, error),
        force_rms=float(np.sqrt(np.mean(error**2))),
        position_rms=float(
            np.sqrt(np.mean((simulated(drive, data, filter) - data.x)[LEFT_OUT:] ** 2))
        ),
        closed_loop=None if data.loop is None else _closed_loop_errors(drive, data, filter),
    )


def simulated(drive: Drive, data: Dataset, filter: Filter) -> Array:
    """Position [m] simulated from the measured force, starting at the measured state."""
    v0 = central_difference(lowpass(data.x, filter.cutoff, data.step, filter.order), data.step)[0]
    motion = open_loop(drive.model(), data.force, data.step, float(data.x[0]), float(v0))
    return motion.x


def _closed_loop_errors(drive: Drive, data: Dataset, filter: Filter) -> ClosedLoopErrors:
    if data.loop is None:
        raise ValueError(f"data '{data.name}': expected a known controller, got none")
    motion = closed_loop(drive.model(), data.loop, data.step, float(data.x[0]))
    x = lowpass(data.x, filter.cutoff, data.step, filter.order)
    v = central_difference(x, data.step)
    pairs = {
        "x": (x, motion.x),
        "v": (v, motion.v),
        "a": (central_difference(v, data.step), motion.a),
        "force": (data.force, motion.force),
    }
    cut = filter.trim(data.step)
    inside = slice(cut, data.t.size - cut)
    return ClosedLoopErrors(
        **{key: _relative(y[inside], (y - s)[inside]) for key, (y, s) in pairs.items()}
    )


def _relative(signal: Array, error: Array) -> float:
    return 100 * float(np.linalg.norm(error) / np.linalg.norm(signal))
