"""Periodic motions for identification: limits, ends, information."""

import numpy as np
import pytest
from crane import LINKS, NAMES, newton_euler, urdf

from identification import Dataset, excitation
from identification.robot.base import base_of
from identification.robot.dynamics import RobotModel


@pytest.fixture(scope="module")
def motion():
    return excitation(urdf(), 8.0, harmonics=4, acceleration=8.0, share=0.9)


def test_the_motion_stays_within_its_limits_between_samples(motion):
    q, v, a = motion.at(np.linspace(0.0, 8.0, 5000))
    low, high, speed, effort = np.array([link.limits for link in LINKS]).T
    middle, half = (low + high) / 2, (high - low) / 2
    assert np.all(np.abs(q - middle) <= 0.9 * half)
    assert np.all(np.abs(v) <= 0.9 * speed)
    assert np.abs(a).max() <= 0.9 * 8.0
    assert np.all(np.abs(newton_euler(q, v, a)) <= effort)


def test_the_motion_is_periodic_and_starts_at_rest(motion):
    t = np.array([0.0, 8.0])
    q, v, a = motion.at(t)
    assert np.allclose(q[0], q[1])
    assert np.abs(v).max() < 1e-9
    assert np.abs(a).max() < 1e-9


def test_velocity_and_acceleration_are_derivatives(motion):
    t = np.linspace(0.0, 8.0, 8001)
    q, v, a = motion.at(t)
    assert np.allclose(np.gradient(q, t, axis=0)[1:-1], v[1:-1], atol=1e-4)
    assert np.allclose(np.gradient(v, t, axis=0)[1:-1], a[1:-1], atol=1e-3)


def test_standard_errors_are_smaller_than_those_of_random_motions(motion):
    model = RobotModel.read(urdf())
    base = list(base_of(model, rotors=False).chosen)
    t = np.linspace(0.0, 8.0, 400)

    def spread(q, v, a):
        columns = model.inertial_columns(q, v, a)[..., base]
        more = [np.sign(v)[:, :, None] * np.eye(3), v[:, :, None] * np.eye(3)]
        A = np.concatenate([columns, *more], axis=2).reshape(-1, columns.shape[2] + 6)
        return np.sqrt(np.diag(np.linalg.inv(A.T @ A)))[-6:]

    rng, worse = np.random.default_rng(0), 0
    ours = spread(*motion.at(t))
    for _ in range(10):
        w = 2 * np.pi / 8 * rng.integers(1, 5, 3)
        low, high, speed, _ = np.array([link.limits for link in LINKS]).T
        size = np.minimum(0.4 * (high - low), 0.9 * speed / w)
        s = np.outer(t, w) + rng.uniform(0, 6, 3)
        q, v, a = (
            (high + low) / 2 + size * np.sin(s),
            size * w * np.cos(s),
            -size * w**2 * np.sin(s),
        )
        worse += np.mean(np.log(spread(q, v, a))) > np.mean(np.log(ours))
    assert worse >= 9


def test_the_file_has_the_columns_of_a_log(motion, tmp_path):
    record = Dataset.read(motion.to_csv(tmp_path / "motion.csv", rate=100.0, periods=2))[0]
    assert record.size == 1601
    assert np.allclose(record["elbow"], motion.at(record.time)[0][:, 1])
    assert all(name in record and f"{name}_velocity" in record for name in NAMES)
    assert len(motion.plot(tmp_path / "motion.png").axes) == 3
