import numpy as np
import pytest

from identification.old.choice import choose
from identification.old.coordinates import Coordinates, coordinates
from symfric import law_from_text


def of(text: str, **fixed: float) -> Coordinates:
    choice = choose(law_from_text(text), 0.1, fixed=fixed)
    return coordinates(choice, 20.0, 0.05, 90.0)


VALUES = {"m": 80.0, "offset": -4.0, "mu_s": 31.0, "mu_d": 17.0, "v_s": 0.004, "sigma_2": 210.0}


def test_values_come_back() -> None:
    at = of("stribeck")
    expected = [VALUES[name] for name in at.names]
    np.testing.assert_allclose(at.values(at.of(VALUES)), expected, rtol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_every_point_of_the_box_keeps_the_order(seed: int) -> None:
    at = of("asymmetric(stribeck)")
    low = np.where(np.isfinite(at.lower), at.lower, -3.0)
    high = np.where(np.isfinite(at.upper), at.upper, 3.0)
    p = at.values(np.random.default_rng(seed).uniform(low, high))
    value = dict(zip(at.names, p, strict=True))
    assert value["mu_s_pos"] >= value["mu_d_pos"] >= 0
    assert value["mu_s_neg"] >= value["mu_d_neg"] >= 0
    assert 2e-4 <= value["v_s_pos"] <= 0.1


def test_upper_level_stands_on_a_fixed_lower_one() -> None:
    at = of("stribeck", mu_d=12.0)
    i = at.names.index("mu_s")
    assert at.values(at.lower.clip(-1, 1))[i] == pytest.approx(12.0)


def test_reciprocal_velocity_scale_stays_in_the_range_of_the_data() -> None:
    at = of("self_tuning")
    i = at.names.index("B")
    np.testing.assert_allclose(np.exp([at.lower[i], at.upper[i]]), [1 / 0.1, 1 / 2e-4])


def test_slope_is_the_derivative_of_the_values() -> None:
    at = of("stribeck")
    w = at.of(VALUES)
    for i, step in enumerate(1e-6 * np.eye(w.size)):
        difference = (at.values(w + step) - at.values(w - step)) / 2e-6
        np.testing.assert_allclose(at.slope(w)[:, i], difference, rtol=1e-7, atol=1e-7)
