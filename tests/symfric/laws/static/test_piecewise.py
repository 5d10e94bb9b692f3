"""Laws made of pieces: exact at their knots, exact slopes, and refusals."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from symfric import Coulomb, Law
from symfric.laws import Ambrosio, BengisuAkay, Benson, Exudyn, Hollars, Step5, VelocityBased

LEVELS = {"mu_s": 1.5, "mu_d": 1.0}
each_form = pytest.mark.parametrize("form", ["smooth", "original"])


def slope(law: Law, v: float) -> float:
    x = ca.SX.sym("x")
    return float(ca.Function("slope", [x], [ca.gradient(law.force(x, 1.0), x)])(v))


@each_form
def test_bengisu_akay_peaks_exactly_and_falls_to_the_dynamic_level(form: str) -> None:
    law = BengisuAkay(**LEVELS, form=form)
    v = np.linspace(0, 0.02, 200_001)
    F = law.force(v, 2.0)
    assert law.force(1e-3, 2.0) == F.max() == 3.0
    assert F[-1] == pytest.approx(2.0, abs=1e-7)
    assert slope(law, 0.0) == pytest.approx(2 * 1.5 / 1e-3)


def test_slope_behind_the_peak_jumps_in_the_original_only() -> None:
    behind = 1e-3 * (1 + 1e-9)
    assert slope(BengisuAkay(**LEVELS, form="original"), behind) == pytest.approx(-500.0, rel=1e-6)
    assert slope(BengisuAkay(**LEVELS), behind) == pytest.approx(0.0, abs=1e-2)


@pytest.mark.parametrize(("form", "steepness"), [("original", 1.5), ("smooth", 1.875)])
def test_velocity_based_meets_both_levels_and_has_the_stated_slope(
    form: str, steepness: float
) -> None:
    law = VelocityBased(**LEVELS, v_s=1e-3, v_d=4e-3, form=form)
    assert law.force(1e-3, 2.0) == pytest.approx(3.0, rel=1e-15)
    assert law.force(np.array([4e-3, 1.0, 1e3]), 2.0) == pytest.approx(2.0, rel=1e-15)
    assert law.force(2.5e-3, 2.0) == pytest.approx(2.5, rel=1e-14), "halfway down"
    assert slope(law, 0.0) == pytest.approx(steepness * 1.5 / 1e-3, rel=1e-14)


@pytest.mark.parametrize("v_d", [1e-3, 5e-4])
def test_velocity_based_refuses_a_fall_before_the_rise(v_d: float) -> None:
    with pytest.raises(ValueError, match=rf"v_s < v_d, got v_s = 0.001 and v_d = {v_d:g}"):
        VelocityBased(v_s=1e-3, v_d=v_d)


@each_form
def test_ambrosio_has_a_dead_zone_and_then_the_level(form: str) -> None:
    law = Ambrosio(0.3, v_0=1e-3, v_1=2e-3, form=form)
    assert not law.force(np.linspace(-1e-3, 1e-3, 11), 5.0).any()
    assert law.force(1.5e-3, 5.0) == pytest.approx(0.75, rel=1e-13)
    assert law.force(-2e-3, 5.0) == pytest.approx(-1.5, rel=1e-15)


@given(v=st.floats(-0.1, 0.1))
def test_ambrosio_without_dead_zone_is_saturated_coulomb(v: float) -> None:
    law = Ambrosio(0.3, v_0=0.0, v_1=2e-3, form="original")
    saturated = Coulomb(0.3, v_eps=2e-3, shape="saturation")
    assert law.force(v, 5.0) == pytest.approx(saturated.force(v, 5.0), rel=1e-14, abs=1e-300)
    assert slope(law, 0.0) == pytest.approx(0.3 / 2e-3, rel=1e-14)


def test_ambrosio_refuses_a_ramp_of_no_width() -> None:
    with pytest.raises(ValueError, match=r"v_0 < v_1, got v_0 = 0.002 and v_1 = 0.001"):
        Ambrosio(v_0=2e-3)


@pytest.mark.parametrize("u_eps", [0.0, 0.1, 0.4])
def test_hollars_loses_the_stated_share_of_its_peak_to_the_rounding(u_eps: float) -> None:
    law = Hollars(**LEVELS, u_eps=u_eps)
    assert law.force(1e-2, 2.0) == pytest.approx(3.0 * (1 - 0.1875 * u_eps), rel=1e-14)
    assert slope(law, 0.0) == pytest.approx((2 * 1.5 - 1.0) / 1e-2, rel=1e-14)


def test_excess_of_hollars_falls_with_the_square_of_the_velocity() -> None:
    law = Hollars(**LEVELS, v_t=1e-3)
    assert [law.force(v, 1.0) - 1.0 for v in (0.1, 1.0)] == pytest.approx([1e-4, 1e-6], rel=2e-4)


def test_exudyn_is_benson_beyond_its_ramp_and_viscous_in_the_end() -> None:
    law, dry = Exudyn(**LEVELS, mu_v=0.2, u_eps=0.0), Exudyn(**LEVELS, u_eps=0.0)
    fall = Benson(**LEVELS, d_c=1e3, v_eps=0.0)
    v = np.array([1e-3, 2e-3, 1e-2])
    assert dry.force(v + 1e-3, 2.0) == pytest.approx(fall.force(v, 2.0), rel=1e-13)
    assert law.force(0.5, 2.0) - dry.force(0.5, 2.0) == pytest.approx(0.2 * 2.0 * 0.499)
    assert slope(law, 0.0) == pytest.approx(1.5 / 1e-3, rel=1e-14)


@pytest.mark.parametrize("u_eps", [0.1, 0.4])
def test_exudyn_loses_the_stated_share_of_its_peak_to_the_rounding(u_eps: float) -> None:
    lost = 0.1875 * u_eps
    expected = 2.0 * (1.0 + 0.5 * np.exp(-lost)) * (1 - lost)
    assert Exudyn(**LEVELS, u_eps=u_eps).force(1e-3, 2.0) == pytest.approx(expected, rel=1e-14)


def test_step5_meets_both_levels_and_is_flat_at_rest() -> None:
    law = Step5(**LEVELS, v_t=1e-3, mu_v=0.2)
    dry = Step5(**LEVELS, v_t=1e-3)
    assert dry.force(1e-3, 2.0) == 3.0
    assert dry.force(np.array([3e-3, 0.5]), 2.0) == pytest.approx(2.0, rel=1e-15)
    assert slope(dry, 0.0) == 0.0
    assert law.force(0.5, 2.0) - dry.force(0.5, 2.0) == pytest.approx(0.2 * 2.0 * 0.5)
