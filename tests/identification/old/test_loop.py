import numpy as np
import pytest

from identification.old.loop import PositionLoop, closed_loop
from symfric import Coulomb, Sum, Viscous, drive

N = 1500
REFERENCE = 0.02 * np.sin(2 * np.pi * np.arange(N) * 1e-3)
LOOP = PositionLoop(60.0, 200.0, 30.0, 10.0, REFERENCE, np.where(np.arange(N) == 700, 3.0, 0.0))
MODEL = drive(Sum((Coulomb(20.0, 1e-8), Viscous(200.0))), m=95.0, N=1.0, offset=-3.0)


def by_hand(substeps: int = 100) -> tuple[np.ndarray, np.ndarray]:
    """The same loop step by step, with the impulse clamp of dry friction."""
    x = v = 0.0
    x_last = mean_last = 0.0
    h = 1e-3 / substeps
    positions, forces = [], []
    for k in range(N):
        mean = (x + x_last) / 2
        u = LOOP.kp * LOOP.kv * (REFERENCE[k] - x) - LOOP.kv * (mean - mean_last) / 1e-3
        x_last, mean_last = x, mean
        force = LOOP.gain * (float(np.clip(u, -10, 10)) + LOOP.disturbance[k])
        positions.append(x)
        forces.append(force)
        for _ in range(substeps):
            free = v + h * (force + 3.0 - 200.0 * v) / 95.0
            v = np.sign(free) * max(abs(free) - h * 20.0 / 95.0, 0.0)
            x += h * v
    return np.array(positions), np.array(forces)


def test_closed_loop_agrees_with_the_impulse_clamp() -> None:
    motion = closed_loop(MODEL, LOOP, 1e-3, 0.0)
    x, force = by_hand()
    assert np.abs(motion.x - x).max() < 2e-3 * np.ptp(x)
    assert np.linalg.norm(motion.force - force) < 0.02 * np.linalg.norm(force)


def test_disturbance_enters_after_the_limit() -> None:
    motion = closed_loop(MODEL, LOOP, 1e-3, 0.0)
    quiet = np.delete(motion.force, 700)
    assert np.abs(quiet).max() <= 300.0 + 1e-9
    assert motion.force[700] - motion.force[699] == pytest.approx(90.0, abs=15.0)
