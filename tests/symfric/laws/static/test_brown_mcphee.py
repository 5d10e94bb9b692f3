"""Brown-McPhee friction: peak and tail as the paper's expression has them."""

from math import tanh

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from symfric import BrownMcPhee, Coulomb


def test_peak_lies_just_above_the_transition_velocity_and_just_below_the_static_level() -> None:
    x = np.linspace(0.9, 1.1, 200_001)
    F = BrownMcPhee(mu_s=1.5, mu_d=1.0, v_t=1.0).force(x, 1.0)
    assert x[F.argmax()] == pytest.approx(1.0068, abs=5e-5)
    assert F.max() / 1.5 == pytest.approx(0.99957, abs=5e-6)


@pytest.mark.parametrize(("mu_s", "mu_d"), [(1.5, 1.0), (0.3, 0.05)])
def test_force_at_the_transition_velocity_misses_the_static_level_by_the_stated_part(
    mu_s: float, mu_d: float
) -> None:
    F = BrownMcPhee(mu_s=mu_s, mu_d=mu_d, v_t=0.02).force(0.02, 1.0)
    assert mu_s - F == pytest.approx(6.7e-4 * mu_d, rel=2e-3)


def test_excess_falls_with_the_third_power_of_the_velocity() -> None:
    law = BrownMcPhee(mu_s=1.5, mu_d=1.0, v_t=1e-3)
    excess = [(law.force(v, 1.0) - 1.0) / 0.5 for v in (0.1, 1.0)]
    assert excess == pytest.approx([16e-6, 16e-9], rel=1e-3)


@given(v=st.floats(-0.1, 0.1))
def test_without_static_excess_it_is_smooth_coulomb_of_a_quarter_width(v: float) -> None:
    law = BrownMcPhee(mu_s=0.2, mu_d=0.2, v_t=4e-3)
    expected = Coulomb(mu_d=0.2, v_eps=1e-3).force(v, 5.0)
    assert law.force(v, 5.0) == pytest.approx(expected, rel=1e-14, abs=1e-300)


def test_slope_at_rest_is_as_stated() -> None:
    law = BrownMcPhee(mu_s=1.5, mu_d=1.0, v_t=1e-3)
    assert law.force(1e-12, 2.0) / 1e-12 == pytest.approx(2.0 * (4 + 16 / 9 * 0.5) / 1e-3)


def test_viscous_part_fades_with_the_load() -> None:
    wet, dry = BrownMcPhee(mu_v=0.4, N_t=2.0), BrownMcPhee()
    assert wet.force(0.3, 0.5) - dry.force(0.3, 0.5) == pytest.approx(0.12 * tanh(1.0))
    assert wet.force(0.3, 0.0) == 0.0
