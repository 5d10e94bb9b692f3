"""Simulated measurements of a drive with known parameters."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from identification.data.dataset import Dataset
from identification.data.record import Array, PositionLoop, Record
from symfric.foundation import checks
from symfric.integrator.stepper import stepper
from symfric.laws import Law, Stribeck
from symfric.model import Model
from symfric.scenes import Drive

DRIVE = Drive(
    Stribeck(mu_s=28.0, mu_d=20.0, v_s=0.01, v_eps=1e-4, sigma_2=200.0), m=95.0, N=1.0, offset=-3.0
)
"""Positioning stage with friction levels similar to those of EMPS, and a stiction peak."""

SPEEDS = (0.002, 0.004, 0.008, 0.015, 0.03, 0.06, 0.12)
"""Speeds of the moves [m/s]."""
RTOL = 1e-8
"""Tolerance of the simulation; errors are about 1e-13 m and 1e-6 N for the default drive."""
FORCES = ("sensor", "command")


def trapezoids(speeds: Sequence[float], dwell: float, ramp: float, step: float) -> Array:
    """Return a position reference [m] with one stroke out and back at each speed.

    Args:
        speeds: top speeds [m/s].
        dwell: time at constant speed in each stroke [s].
        ramp: time of each velocity ramp [s].
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
    force: Literal["sensor", "command"] = "sensor",
) -> Dataset:
    """Simulate a noisy record of a drive moved back and forth by its position controller.

    The controller is a `PositionLoop` with a bandwidth of 5 Hz in position and 40 Hz in velocity.
    Its force is held between the samples; the motion between them is integrated with adaptive
    steps (`symfric.stepper`). White Gaussian noise is added to the finished record and does not
    enter the loop.

    Args:
        law: friction law, with or without states; default: Stribeck with 28 N static and 20 N
            dynamic friction. States start at the values of the law.
        m, offset, normal_force: mass [kg], constant force [N], N [N].
        speeds, dwell, ramp: see `trapezoids`.
        rate: samples per second.
        position_noise: standard deviation [m].
        force_noise: standard deviation [N].
        seed: seed of the noise; equal seeds give equal records.
        turning: use the same numbers in rad, N m and kg m^2.
        force: recorded force; "sensor": mean of the forces before and after a sample, which
            inverse dynamics compares with the motion at the sample; "command": force held after
            the sample, as a controller records it and `ClosedLoop` expects it.

    Raises:
        ValueError: a parameter is outside its bounds, or `force` is unknown.
        SolveError: the law cannot be simulated.
    """
    checks.choice("synthetic_drive_data: force", force, FORCES)
    drive = Drive(
        DRIVE.law if law is None else law, m=m, N=normal_force, offset=offset, turning=turning
    )
    reference = trapezoids(speeds, dwell, ramp, 1 / rate)
    still = np.zeros(reference.size)
    loop = PositionLoop(2 * np.pi * 5, 2 * np.pi * 40 * m, 1.0, 1e6 * m, reference, still)
    x, held = _simulated(drive.model(), loop, 1 / rate)
    mean = np.append(held[0], (held[1:] + held[:-1]) / 2)
    seen = mean if force == "sensor" else held
    noise = np.random.default_rng(seed)
    signals = {
        "x": x + position_noise * noise.standard_normal(x.size),
        "force": seen + force_noise * noise.standard_normal(x.size),
    }
    name = f"synthetic drive, seed {seed}"
    units = {"x": "rad", "force": "N m"} if turning else {"x": "m", "force": "N"}
    return Dataset((Record(name, np.arange(x.size) / rate, signals, units, loop=loop),))


def _simulated(model: Model, loop: PositionLoop, step: float) -> tuple[Array, Array]:
    """Return the positions [m] at the samples, and the forces [N] held after them.

    The steps on the virtual machine are those of compiled code; one record does not justify
    compilation.
    """
    plant = stepper(model, step, rtol=RTOL, backend="vm")
    push = model.u[0].name
    positions, forces = np.zeros(loop.reference.size), np.zeros(loop.reference.size)
    x = x_last = mean_last = 0.0
    references, disturbances = loop.reference.tolist(), loop.disturbance.tolist()
    for k, (reference, disturbance) in enumerate(zip(references, disturbances, strict=True)):
        mean = (x + x_last) / 2
        command = loop.kp * loop.kv * (reference - x) - loop.kv * (mean - mean_last) / step
        command = min(max(command, -loop.limit), loop.limit)
        positions[k], forces[k] = x, loop.gain * (command + disturbance)
        x_last, mean_last = x, mean
        x = float(plant.step({push: forces[k]})[0])
    return positions, forces
