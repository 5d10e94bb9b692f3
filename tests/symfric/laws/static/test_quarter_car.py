"""Quarter-car friction: linkage, sticking, and what its printed form does wrong."""

from math import degrees, pi, radians, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from symfric import Law
from symfric.laws import QuarterCarGeneral, QuarterCarSimple, Tustin
from symfric.laws.composed.populations import cost
from symfric.laws.static.machines import tilt


@pytest.mark.parametrize(("x_rel", "angle"), [(6.9e-3, 0.7075), (-6.9e-3, -0.6905), (0.0, 0.0)])
def test_linkage_turns_by_the_computed_angle(x_rel: float, angle: float) -> None:
    assert degrees(tilt(x_rel, pi / 4, 0.4)) == pytest.approx(angle, abs=5.1e-5)


@pytest.mark.parametrize("theta", [radians(30), pi / 4, radians(70)])
@pytest.mark.parametrize("x_rel", [-0.05, 0.02])
def test_tilt_closes_the_triangle_of_the_linkage(theta: float, x_rel: float) -> None:
    """Law of sines: the strut of length L turns as its end moves by x across the angle theta."""
    shortened = 0.4 - x_rel * sin(theta)
    across = x_rel * sin(pi / 2 - theta)
    assert shortened * sin(tilt(x_rel, theta, 0.4)) == pytest.approx(across, rel=1e-12)


@given(x_rel=st.floats(-0.0066, 0.0066))
def test_body_at_rest_is_held_up_to_the_break_away_force(x_rel: float) -> None:
    law = QuarterCarGeneral()
    assert law.force(0.0, 0.0, x_rel=x_rel) == 28900.0 * x_rel


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_spring_beyond_the_break_away_force_is_not_held(sign: float) -> None:
    smooth, printed = QuarterCarGeneral(), QuarterCarGeneral(form="as_printed")
    assert smooth.force(0.0, 0.0, x_rel=sign * 0.01) == pytest.approx(sign * 193.8)
    assert printed.force(0.0, 0.0, x_rel=sign * 0.01) == pytest.approx(sign * 289.0)


@given(v=st.floats(2e-3, 1.0), x_rel=st.floats(-0.05, 0.05))
def test_without_coulomb_part_it_is_the_simple_law(v: float, x_rel: float) -> None:
    law = QuarterCarGeneral(mu=0.0)
    simple = QuarterCarSimple(v_eps=0.0)
    assert law.force(v, 0.0, x_rel=x_rel) == pytest.approx(simple.force(v, 0.0), rel=1e-13)


def test_without_coulomb_part_no_angle_is_computed() -> None:
    assert cost(QuarterCarGeneral(mu=0.0)).value < cost(QuarterCarGeneral()).value - 8


def least_power(law: Law) -> float:
    v, x = np.meshgrid(np.linspace(-1.0, 1.0, 200), np.linspace(-0.05, 0.05, 21))
    outside = np.abs(v) > 1e-3
    return float((law.force(v, 0.0, x_rel=x, v_rel=0.0) * v)[outside].min())


def test_printed_form_drives_the_body_and_the_corrected_one_never_does() -> None:
    weak = {"C_e": 10.0, "sigma_v": 5.0}
    assert least_power(QuarterCarGeneral(**weak, form="as_printed")) < 0
    assert least_power(QuarterCarGeneral(**weak)) > 0


@given(v=st.floats(-1.0, 1.0))
def test_simple_law_is_tustin_without_dynamic_level(v: float) -> None:
    law = QuarterCarSimple(C_e=180.0, e_1=0.02, sigma_v=30.0, v_eps=1e-3)
    same = Tustin(mu_s=180.0, mu_d=0.0, v_s=0.02, v_eps=1e-3, sigma_2=30.0)
    assert law.force(v, 0.0) == pytest.approx(same.force(v, 1.0), rel=1e-13, abs=1e-300)


def test_growing_exponential_of_the_paper_is_refused() -> None:
    with pytest.raises(ValueError, match=r"QuarterCarSimple: e_1: expected .* got -0.01"):
        QuarterCarSimple(e_1=-0.01)
