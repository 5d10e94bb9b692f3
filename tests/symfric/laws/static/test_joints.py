"""Joints, servo drives and belts."""

from math import exp, expm1, pi

import casadi as ca
import pytest
from hypothesis import given
from hypothesis import strategies as st

from symfric import Coulomb, Stribeck, with_values
from symfric.laws import BAM, Bittencourt, Capstan


@given(v=st.floats(-100.0, 100.0), N=st.floats(0.0, 5.0))
def test_bittencourt_at_one_temperature_is_two_stribeck_curves(v: float, N: float) -> None:
    law = Bittencourt(T=40.0, F_eps=0.0)
    loaded = Stribeck(mu_s=0.149, mu_d=0.023, v_s=9.2, delta=1.3, v_eps=0.1)
    free = Stribeck(mu_s=0.07, mu_d=0.031, v_s=15.0, delta=1.3, v_eps=0.1)
    viscous = (1.3e-3 + 1.3e-3 * exp(-40 / 20.7)) * v
    expected = loaded.force(v, N) + free.force(v, 1.0) + viscous
    assert law.force(v, N) == pytest.approx(expected, rel=1e-13, abs=1e-300)


def test_static_excess_never_turns_negative_in_the_cold() -> None:
    cold = Bittencourt(T=5.0, v_s0=10.0, F_eps=0.0)
    assert cold.force(0.1, 0.0) == with_values(cold, {"F_s0": 0.0, "F_sT": 0.0}).force(0.1, 0.0)
    smooth = Bittencourt(T=5.0, v_s0=10.0)
    assert smooth.force(0.1, 0.0) >= cold.force(0.1, 0.0)


def test_temperature_at_which_the_stribeck_velocity_vanishes_is_refused() -> None:
    with pytest.raises(ValueError, match=r"v_s0 \+ v_sT T > 0, got -5 rad/s at T = 20"):
        Bittencourt(T=20.0)


def test_temperature_may_be_a_symbol() -> None:
    T = ca.SX.sym("T")
    F = Bittencourt(T=T).force(50.0, 1.0)
    slope = ca.Function("slope", [T], [ca.gradient(F, T)])
    step = (Bittencourt(T=31.0).force(50.0, 1.0) - Bittencourt(T=29.0).force(50.0, 1.0)) / 2
    assert float(slope(30.0)) == pytest.approx(step, rel=1e-3)


WITHOUT_LOAD = {"K_e": 0.0, "K_m": 0.0, "K_es": 0.0, "K_ms": 0.0}


@given(v=st.floats(-5.0, 5.0))
def test_second_model_of_bam_is_stribeck_friction(v: float) -> None:
    law = BAM(**WITHOUT_LOAD)
    same = Stribeck(mu_s=0.1, mu_d=0.05, v_s=0.2, delta=1.35, v_eps=0.01, sigma_2=0.1)
    assert law.force(v, 99.0) == pytest.approx(same.force(v, 1.0), rel=1e-13, abs=1e-300)


def test_bam_asks_for_torques_only_where_a_coefficient_does() -> None:
    assert BAM(**WITHOUT_LOAD).inputs == ()
    assert [i.name for i in BAM(**{**WITHOUT_LOAD, "K_m": 0.1}).inputs] == ["tau_m", "tau_e"]
    assert BAM(**WITHOUT_LOAD, K_s=ca.SX.sym("K_s")).inputs == ()


@pytest.mark.parametrize(("tau_m", "tau_e"), [(0.9, -0.4), (0.9, 0.4), (0.3, -0.4), (0.3, 0.4)])
def test_quadratic_part_acts_only_while_the_torques_oppose(tau_m: float, tau_e: float) -> None:
    torques = {"tau_m": tau_m, "tau_e": tau_e}
    plain, full = BAM(tau_eps=1e-4), BAM(Q_e=0.01, Q_m=0.02, tau_eps=1e-4)
    v = 1e-1
    weight = exp(-(0.5**1.35))
    extra = (full.force(v, 1.0, **torques) - plain.force(v, 1.0, **torques)) / weight
    opposed = 0.01 * tau_e**2 if tau_m > abs(tau_e) else 0.02 * tau_m**2
    assert extra == pytest.approx(opposed if tau_e < 0 else 0.0, rel=0.05, abs=1e-12)


def test_equal_coefficients_see_the_torque_through_the_gear_alone() -> None:
    law = BAM(tau_eps=1e-9)
    one = law.force(0.5, 1.0, tau_m=0.7, tau_e=0.2)
    assert one == pytest.approx(law.force(0.5, 1.0, tau_m=0.1, tau_e=-0.4), rel=1e-12)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_ratio_of_the_tensions_is_that_of_euler(direction: float) -> None:
    law = Capstan(mu_d=0.3, beta=2 * pi, v_eps=0.0)
    tension = 50.0 + law.force(0.1 * direction, 50.0)
    assert tension / 50.0 == pytest.approx(exp(direction * 0.3 * 2 * pi), rel=1e-13)


def test_small_wrap_is_coulomb_friction() -> None:
    law, beta = Capstan(mu_d=0.3, beta=1e-6), 1e-6
    expected = Coulomb(mu_d=0.3 * beta).force(5e-4, 50.0)
    assert law.force(5e-4, 50.0) == pytest.approx(expected, rel=1e-6)
    assert Capstan(0.3, 1e-6, 0.0).force(1.0, 1.0) == pytest.approx(expm1(3e-7), rel=1e-14)
