"""Smooth laws that meet the static level."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from symfric.laws import MakkarDixon, SimscapeBreakaway, Specker

LEVELS = {"mu_s": 1.5, "mu_d": 1.0}


def test_simscape_peaks_at_the_breakaway_velocity() -> None:
    v = np.linspace(0.9e-3, 1.1e-3, 200_001)
    F = SimscapeBreakaway(**LEVELS).force(v, 1.0)
    assert v[F.argmax()] == pytest.approx(1e-3, abs=2e-9)
    assert 1.5 - F.max() == pytest.approx(4.1e-9, rel=0.1)


def test_excess_of_simscape_is_gone_at_ten_breakaway_velocities() -> None:
    one, other = (SimscapeBreakaway(mu_s=s, mu_d=1.0).force(1e-2, 1.0) for s in (1.0, 1.5))
    assert abs(other - one) < 1e-15


def test_slope_of_simscape_at_rest_is_as_stated() -> None:
    slope = SimscapeBreakaway(**LEVELS).force(1e-12, 2.0) / 1e-12
    assert slope == pytest.approx(2.0 * (1.6487 * 0.5 + 10 * 1.0) / 1e-3, rel=1e-5)


@given(v=st.floats(-0.1, 0.1))
def test_specker_with_a_tenth_is_simscape_to_the_stated_digits(v: float) -> None:
    one = Specker(**LEVELS, v_sp=1e-3, v_t=1e-4).force(v, 1.0)
    assert one == pytest.approx(SimscapeBreakaway(**LEVELS).force(v, 1.0), abs=4.2e-9)


@pytest.mark.parametrize("sigma_2", [0.0, 100.0])
def test_specker_meets_the_static_level_exactly_with_viscous_friction_too(sigma_2: float) -> None:
    law = Specker(**LEVELS, v_sp=1e-3, v_t=5e-4, sigma_2=sigma_2)
    assert law.force(1e-3, 2.0) == pytest.approx(3.0, rel=1e-15)


def test_specker_refuses_a_transition_behind_its_peak() -> None:
    with pytest.raises(ValueError, match=r"v_t < v_sp, got v_t = 0.001 and v_sp = 0.001"):
        Specker(v_t=1e-3)


def test_peak_of_makkar_dixon_stays_below_the_sum_of_its_levels() -> None:
    v = np.linspace(0, 5e-3, 100_001)
    assert MakkarDixon().force(v, 1.0).max() == pytest.approx(0.905 * 1.5, abs=5e-4 * 1.5)


def test_makkar_dixon_tends_to_its_dynamic_level_plus_viscous_friction() -> None:
    law = MakkarDixon(gamma_4=2.0, gamma_6=0.3)
    assert law.force(10.0, 1.0) == pytest.approx(2.0 + 3.0, rel=1e-15)


def test_makkar_dixon_refuses_steepnesses_in_the_wrong_order() -> None:
    with pytest.raises(ValueError, match=r"gamma_3 < gamma_2, got gamma_3 = 1000 and gamma_2 = 10"):
        MakkarDixon(gamma_2=10.0)
