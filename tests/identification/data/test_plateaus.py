import numpy as np
import pytest

from identification.data.dataset import Dataset
from identification.data.differentiate import plateaus
from symfric.laws import Stribeck

LEVELS = (0.02, 0.05, 0.1, 0.2, -0.2, -0.1, -0.05, -0.02)
LAW = Stribeck(mu_s=3.0, mu_d=2.0, v_s=0.03, sigma_2=5.0, v_eps=1e-6)


def staircase(noise: float = 0.05, rotary: bool = False) -> Dataset:
    """A second at each speed, ramps of 0.2 s, a rest at the end."""
    corners, values = [0.0], [0.0]
    for level in (*LEVELS, 0.0):
        corners += [corners[-1] + 0.2, corners[-1] + 1.2]
        values += [level, level]
    t = np.arange(0.0, corners[-1], 1e-3)
    v = np.interp(t, corners, values)
    a = np.gradient(v, t)
    rng = np.random.default_rng(0)
    x = np.cumsum(v) * 1e-3 + 1e-6 * rng.standard_normal(t.size)
    force = 2 * a + LAW.force(v, 1.0) + noise * rng.standard_normal(t.size)
    units = {"x": "rad", "force": "N m"} if rotary else {"x": "m", "force": "N"}
    return Dataset.of(t=t, x=x, force=force, units=units)


def test_each_step_of_a_staircase_is_a_point_of_the_curve() -> None:
    (found,) = plateaus(staircase())
    assert found.t is None
    np.testing.assert_allclose(found["v"], LEVELS, rtol=2e-3)
    expected = LAW.force(np.array(LEVELS), 1.0)
    np.testing.assert_array_less(np.abs(found["F"] - expected), 4 * 0.05 / np.sqrt(found["n"]))
    np.testing.assert_allclose(found["spread"], 0.05, rtol=0.15)


def test_units_turn_with_the_machine() -> None:
    (found,) = plateaus(staircase(rotary=True))
    assert (found.unit("v"), found.unit("F")) == ("rad/s", "N m")


def test_a_record_without_plateaus_is_refused() -> None:
    t = np.arange(0.0, 3.0, 1e-3)
    data = Dataset.of(t=t, x=np.sin(3 * t), force=np.cos(t), units={"x": "m", "force": "N"})
    with pytest.raises(ValueError, match="expected at least two stretches"):
        plateaus(data)
