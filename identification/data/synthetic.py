"""A simulated measurement of a drive with known parameters."""

from collections.abc import Sequence

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.loop import PositionLoop
from identification.data.record import Record
from symfric.laws import Law, Stribeck
from symfric.model import Model
from symfric.scenes import Drive

Array = NDArray[np.float64]

DRIVE = Drive(
    Stribeck(mu_s=28.0, mu_d=20.0, v_s=0.01, v_eps=1e-4, sigma_2=200.0), m=95.0, N=1.0, offset=-3.0
)
"""A positioning stage with levels like those of EMPS and a stiction peak."""

SPEEDS = (0.002, 0.004, 0.008, 0.015, 0.03, 0.06, 0.12)
"""Speeds of the moves [m/s]."""
SUBSTEPS, ITERATIONS = 4, 8


def trapezoids(speeds: Sequence[float], dwell: float, ramp: float, step: float) -> Array:
    """Position reference [m]: out and back once at each speed, with linear ramps of velocity.

    Args:
        speeds: top speeds [m/s].
        dwell: time at constant speed of one stroke [s].
        ramp: time of each ramp [s].
        step: sample interval [s].
    """
    corners, levels = [0.0], [0.0]
    for speed in speeds:
        for direction in (speed, -speed):
            for length, level in ((ramp, direction), (dwell, direction), (ramp, 0.0)):
                corners.append(corners[-1] + length)
                levels.append(level)
    t = step * np.arange(round(corners[-1] / step) + 1)
    v = np.interp(t, corners, levels)
    return np.concatenate([[0.0], np.cumsum(step * (v[1:] + v[:-1]) / 2)])


def synthetic_drive_data(
    law: Law | None = None,
    *,
    m: float = 95.0,
    offset: float = -3.0,
    normal_force: float = 1.0,
    speeds: Sequence[float] = SPEEDS,
    dwell: float = 0.6,
    ramp: float = 0.25,
    rate: float = 1000.0,
    position_noise: float = 1e-7,
    force_noise: float = 0.5,
    seed: int = 0,
    turning: bool = False,
) -> Dataset:
    """A record of a drive moved back and forth by its position controller, with noise.

    The controller is that of `PositionLoop` with a bandwidth of 5 Hz in position and 40 Hz in
    velocity. Its force is held between the samples; the record has the mean of the two forces that
    meet at a sample, as a force sensor sees it. White Gaussian noise is added to the finished
    record; it does not enter the loop.

    Args:
        law: a static friction law; default Stribeck with 28 N static and 20 N dynamic friction.
        m, offset, normal_force: mass [kg], constant force [N], N [N].
        speeds, dwell, ramp: see `trapezoids`.
        rate: samples per second.
        position_noise: standard deviation [m].
        force_noise: standard deviation [N].
        seed: of the noise; equal seeds give equal records.
        turning: the same numbers in rad, N m and kg m^2.

    Raises:
        ValueError: a law with states, or a parameter outside its bounds.
    """
    if law is not None and law.states:
        raise ValueError(
            f"synthetic_drive_data: expected a static law, got {type(law).__name__} with states"
        )
    drive = Drive(
        DRIVE.law if law is None else law, m=m, N=normal_force, offset=offset, turning=turning
    )
    reference = trapezoids(speeds, dwell, ramp, 1 / rate)
    loop = PositionLoop(
        kp=2 * np.pi * 5,
        kv=2 * np.pi * 40 * m,
        gain=1.0,
        limit=1e6 * m,
        reference=reference,
        disturbance=np.zeros(reference.size),
    )
    x, force = _simulated(drive.model(), loop, 1 / rate)
    mean = np.append(force[0], (force[1:] + force[:-1]) / 2)
    noise = np.random.default_rng(seed)
    signals = {
        "x": x + position_noise * noise.standard_normal(x.size),
        "force": mean + force_noise * noise.standard_normal(x.size),
    }
    name = f"synthetic drive, seed {seed}"
    units = {"x": "rad", "force": "N m"} if turning else {"x": "m", "force": "N"}
    return Dataset((Record(name, np.arange(x.size) / rate, signals, units, loop=loop),))


def _simulated(model: Model, loop: PositionLoop, step: float) -> tuple[Array, Array]:
    """Positions [m] at the samples, and the forces [N] held after them: one mapped Function.

    A friction law that takes power out never turns the velocity round by itself: of each implicit
    step v1 = v0 + h a(v1, force) the new velocity lies between 0 and that without friction, where
    a guarded Newton iteration finds it.
    """
    reference, disturbance = ca.SX.sym("reference"), ca.SX.sym("disturbance")
    x, v, x_last, mean_last = (ca.SX.sym(n) for n in ("x", "v", "x_last", "mean_last"))
    mean = (x + x_last) / 2
    command = loop.kp * loop.kv * (reference - x) - loop.kv * (mean - mean_last) / step
    command = ca.fmin(ca.fmax(command, -loop.limit), loop.limit)
    force = loop.gain * (command + disturbance)
    motion = ca.Function("a", [model.x[1].symbol, model.u[0].symbol], [_slopes(model)[1]])
    new, h = _implicit_velocity(motion, step / SUBSTEPS), step / SUBSTEPS
    x_end, v_end = x, v
    for _ in range(SUBSTEPS):
        v_new = new(v_end, force)
        x_end, v_end = x_end + h * (v_end + v_new) / 2, v_new
    sample = ca.Function(
        "sample",
        [ca.vertcat(x, v, x_last, mean_last), ca.vertcat(reference, disturbance)],
        [ca.vertcat(x_end, v_end, x, mean), force],
    )
    inputs = np.vstack([loop.reference, loop.disturbance])
    states, forces = sample.mapaccum(loop.reference.size)(np.zeros(4), inputs)
    return np.append(0.0, np.asarray(states.full())[0, :-1]), np.asarray(forces.full()).ravel()


def _slopes(model: Model) -> ca.SX:
    if model.ode is None:
        raise ValueError(f"model '{model.name}': expected explicit equations, got implicit ones")
    return model.ode


def _implicit_velocity(motion: ca.Function, h: float) -> ca.Function:
    """(v0, force) -> v1 with v1 = v0 + h a(v1, force), bracketed by 0 and the frictionless v."""
    v0, force, v1 = ca.SX.sym("v0"), ca.SX.sym("force"), ca.SX.sym("v1")
    gap = v1 - v0 - h * motion(v1, force)
    residual = ca.Function("residual", [v1, v0, force], [gap, ca.jacobian(gap, v1)])
    free = v0 + h * motion(0, force)
    low, high = ca.fmin(free, 0), ca.fmax(free, 0)
    guess = ca.fmin(ca.fmax(v0, low), high)
    for _ in range(ITERATIONS):
        value, slope = residual(guess, v0, force)
        low = ca.if_else(value < 0, guess, low)
        high = ca.if_else(value > 0, guess, high)
        newton = guess - value / slope
        inside = ca.logic_and(newton >= low, newton <= high)
        guess = ca.if_else(inside, newton, (low + high) / 2)
    return ca.Function("implicit", [v0, force], [guess])
