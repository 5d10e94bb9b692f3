from typing import Any

import numpy as np
import pytest
from tables import sampled

from identification.data.synthetic import synthetic_drive_data, trapezoids
from symfric import Hold, law_from_text, simulate
from symfric.scenes import Drive


def test_reference_returns_and_reaches_its_speeds() -> None:
    x = trapezoids((0.02, 0.1), 0.5, 0.2, 1e-3)
    v = np.diff(x) / 1e-3
    assert x[-1] == pytest.approx(0.0, abs=1e-12)
    assert x.max() == pytest.approx(0.1 * (0.5 + 0.2))
    assert (v.max(), v.min()) == pytest.approx((0.1, -0.1))
    assert np.isclose(v, 0.02).sum() == pytest.approx(500, abs=2)


def test_drive_follows_its_reference() -> None:
    record = synthetic_drive_data(speeds=(0.02,), dwell=0.2)[0]
    error = record["x"] - record.loop.reference
    assert np.abs(error).max() < 0.2 * np.ptp(record["x"])


def test_a_turning_drive_has_the_same_numbers() -> None:
    slides, turns = (
        synthetic_drive_data(speeds=(0.02,), dwell=0.1, turning=turns) for turns in (False, True)
    )
    np.testing.assert_array_equal(slides[0]["x"], turns[0]["x"])
    assert (turns[0].unit("x"), turns[0].unit("force")) == ("rad", "N m")
    assert turns.rotary and not slides.rotary


def test_noise_is_seeded_and_of_the_requested_size() -> None:
    def record(seed: int, noise: float = 0.5) -> np.ndarray:
        short: Any = {"speeds": (0.05,), "dwell": 0.2, "ramp": 0.1}
        return synthetic_drive_data(seed=seed, force_noise=noise, **short)[0]["force"]

    np.testing.assert_array_equal(record(3), record(3))
    difference = record(3) - record(3, 0.0)
    assert difference.std() == pytest.approx(0.5, rel=0.1)
    assert np.abs(record(3) - record(4)).max() > 0.5


def test_forces_of_a_sensor_are_means_of_commands() -> None:
    sensor, command = (
        synthetic_drive_data(speeds=(0.05,), dwell=0.1, force_noise=0.0, force=force)[0]["force"]
        for force in ("sensor", "command")
    )
    np.testing.assert_array_equal(sensor[1:], (command[1:] + command[:-1]) / 2)
    assert sensor[0] == command[0]


@pytest.mark.parametrize("law", sampled(["lugre", "stribeck"], of=2))
def test_motion_is_that_of_the_recorded_command(law: str) -> None:
    """One simulation over the whole record, by another method, finds the same positions."""
    friction = law_from_text(law)
    record = synthetic_drive_data(
        friction, normal_force=20.0, speeds=(0.02,), dwell=0.2, force="command",
        position_noise=0.0, force_noise=0.0,
    )[0]  # fmt: skip
    model = Drive(friction, m=95.0, N=20.0, offset=-3.0).model()
    held = {"force": Hold(record.time, record["force"])}
    motion = simulate(
        model, record.time[-1], u=held, t_eval=record.time, rtol=1e-9, method="radau5"
    )
    np.testing.assert_allclose(motion["x"], record["x"], atol=2e-10)


def test_controller_sees_the_motion() -> None:
    """The command is that of `PositionLoop` for the recorded positions."""
    quiet: Any = {"position_noise": 0.0, "force_noise": 0.0}
    record = synthetic_drive_data(speeds=(0.05,), dwell=0.1, force="command", **quiet)[0]
    loop, x = record.loop, record["x"]
    mean = (x + np.append(0.0, x[:-1])) / 2
    rate = np.diff(mean, prepend=0.0) / record.step
    command = loop.kp * loop.kv * (loop.reference - x) - loop.kv * rate
    np.testing.assert_allclose(record["force"], command, atol=1e-9)
