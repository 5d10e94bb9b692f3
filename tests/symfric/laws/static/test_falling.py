"""Laws with a rational fall."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from symfric.laws import Lorentzian, PoppStelter


def test_lorentzian_is_halfway_between_the_levels_at_the_stribeck_velocity() -> None:
    law = Lorentzian(mu_s=0.3, mu_d=0.1, v_s=2e-3, v_eps=0.0)
    assert law.force(-2e-3, 5.0) == pytest.approx(-1.0, rel=1e-14)


def test_excess_of_lorentzian_falls_with_the_square_of_the_velocity() -> None:
    law = Lorentzian(mu_s=0.3, mu_d=0.1, v_s=1e-3)
    excess = [law.force(v, 1.0) - 0.1 for v in (0.1, 1.0)]
    assert excess == pytest.approx([0.2e-4, 0.2e-6], rel=2e-4)


def test_popp_stelter_falls_to_the_share_that_remains() -> None:
    law = PoppStelter(mu_s=0.3, eta=0.4, d=1e6, v_eps=0.0)
    assert law.force(1e-12, 5.0) == pytest.approx(1.5, rel=1e-5)
    assert law.force(1e3, 5.0) == pytest.approx(0.4 * 1.5, rel=1e-8)


@given(v=st.floats(-1.0, 1.0), N=st.floats(0.0, 100.0))
def test_quadratic_rise_of_popp_stelter_is_part_of_the_coefficient(v: float, N: float) -> None:
    rise = [PoppStelter(kappa=0.3).force(v, L) - PoppStelter().force(v, L) for L in (1.0, N)]
    assert rise[1] == pytest.approx(N * rise[0], abs=1e-11)
    assert abs(PoppStelter(kappa=0.3, v_eps=0.0).force(2.0, 5.0)) > 5.0 * 0.3 * 4.0


def test_nothing_falls_when_everything_remains() -> None:
    law = PoppStelter(mu_s=0.3, eta=1.0, v_eps=0.0)
    assert law.force(0.5, 5.0) == pytest.approx(1.5, rel=1e-15)
