import numpy as np
import pytest

from identification.data.synthetic import synthetic_drive_data, trapezoids
from symfric import LuGre


def test_reference_returns_and_reaches_its_speeds() -> None:
    x = trapezoids((0.02, 0.1), 0.5, 0.2, 1e-3)
    v = np.diff(x) / 1e-3
    assert x[-1] == pytest.approx(0.0, abs=1e-12)
    assert x.max() == pytest.approx(0.1 * (0.5 + 0.2))
    assert (v.max(), v.min()) == pytest.approx((0.1, -0.1))
    assert np.isclose(v, 0.02).sum() == pytest.approx(500, abs=2)


def test_drive_follows_its_reference() -> None:
    record = synthetic_drive_data(speeds=(0.02, 0.05))[0]
    assert record.loop is not None
    error = record["x"] - record.loop.reference
    assert np.abs(error).max() < 0.2 * np.ptp(record["x"])


def test_a_turning_drive_has_the_same_numbers() -> None:
    slides, turns = (synthetic_drive_data(speeds=(0.02,), turning=turns) for turns in (False, True))
    np.testing.assert_array_equal(slides[0]["x"], turns[0]["x"])
    assert (turns[0].unit("x"), turns[0].unit("force")) == ("rad", "N m")
    assert turns.rotary and not slides.rotary


def test_noise_is_seeded_and_of_the_size_asked_for() -> None:
    def record(seed: int, noise: float = 0.5) -> np.ndarray:
        return synthetic_drive_data(speeds=(0.05,), seed=seed, force_noise=noise)[0]["force"]

    np.testing.assert_array_equal(record(3), record(3))
    difference = record(3) - record(3, 0.0)
    assert difference.std() == pytest.approx(0.5, rel=0.05)
    assert np.abs(record(3) - record(4)).max() > 0.5


def test_dynamic_laws_are_refused() -> None:
    with pytest.raises(ValueError, match="expected a static law, got LuGre with states"):
        synthetic_drive_data(LuGre())
