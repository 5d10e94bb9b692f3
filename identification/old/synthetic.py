"""A simulated measurement of a drive with known parameters."""

from collections.abc import Sequence

import numpy as np

from identification.old.data import Array, Dataset
from identification.old.loop import PositionLoop, closed_loop
from symfric.laws import Law, Stribeck
from symfric.scenes import Drive

DRIVE = Drive(
    Stribeck(mu_s=28.0, mu_d=20.0, v_s=0.01, v_eps=1e-4, sigma_2=200.0), m=95.0, N=1.0, offset=-3.0
)
"""A positioning stage with levels like those of EMPS and a stiction peak."""

SPEEDS = (0.002, 0.004, 0.008, 0.015, 0.03, 0.06, 0.12)
"""Speeds of the moves [m/s]."""


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

    Raises:
        ValueError: a law with states, or a parameter outside its bounds.
    """
    if law is not None and law.states:
        raise ValueError(
            f"synthetic_drive_data: expected a static law, got {type(law).__name__} with states"
        )
    drive = Drive(DRIVE.law if law is None else law, m=m, N=normal_force, offset=offset)
    reference = trapezoids(speeds, dwell, ramp, 1 / rate)
    loop = PositionLoop(
        kp=2 * np.pi * 5,
        kv=2 * np.pi * 40 * m,
        gain=1.0,
        limit=1e6 * m,
        reference=reference,
        disturbance=np.zeros(reference.size),
    )
    motion = closed_loop(drive.model(), loop, 1 / rate, 0.0)
    mean = np.append(motion.force[0], (motion.force[1:] + motion.force[:-1]) / 2)
    noise = np.random.default_rng(seed)
    return Dataset(
        f"synthetic drive, seed {seed}",
        motion.t,
        motion.x + position_noise * noise.standard_normal(motion.x.size),
        mean + force_noise * noise.standard_normal(motion.x.size),
        loop=loop,
    )
