"""Laws with an exponential fall: they are one family, and tend to what they say."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from symfric import Law, LuGre, Stribeck
from symfric.laws import Andersson, Benson, Berger, DuanSingh, SteadyStateLuGre, Tustin

speeds = st.floats(-0.1, 0.1)
LEVELS = {"mu_s": 0.3, "mu_d": 0.2}
SAME: dict[str, tuple[Law, Law]] = {
    "tustin is stribeck with delta 1": (
        Tustin(**LEVELS, v_s=2e-3, sigma_2=0.4),
        Stribeck(**LEVELS, v_s=2e-3, delta=1.0, sigma_2=0.4),
    ),
    "benson is tustin with v_s = 1/d_c": (Benson(**LEVELS, d_c=500.0), Tustin(**LEVELS, v_s=2e-3)),
    "berger is tustin with v_eps = v_t": (
        Berger(**LEVELS, v_s=2e-3, v_t=3e-4),
        Tustin(**LEVELS, v_s=2e-3, v_eps=3e-4),
    ),
    "andersson is stribeck with v_eps = 1/k_t": (
        Andersson(**LEVELS, v_s=2e-3, p=1.5, k_t=5e3, sigma_2=0.4),
        Stribeck(**LEVELS, v_s=2e-3, delta=1.5, v_eps=2e-4, sigma_2=0.4),
    ),
    "duan_singh is andersson with p 1": (
        DuanSingh(**LEVELS, c=500.0, sigma=5e3),
        Andersson(**LEVELS, v_s=2e-3, p=1.0, k_t=5e3),
    ),
    "steady_state_lugre is stribeck in newton": (
        SteadyStateLuGre(F_S=1.5, F_C=1.0, v_s=2e-3, sigma_2=0.4, delta=0.78),
        Stribeck(mu_s=0.3, mu_d=0.2, v_s=2e-3, delta=0.78, v_eps=1e-5, sigma_2=0.4),
    ),
}


@pytest.mark.parametrize("claim", SAME)
@given(v=speeds)
def test_limit_to_another_law(claim: str, v: float) -> None:
    one, other = SAME[claim]
    assert one.force(v, 5.0) == pytest.approx(other.force(v, 5.0), rel=1e-11, abs=1e-15)


@given(v=speeds.filter(lambda v: abs(v) > 1e-9))
def test_steady_state_lugre_is_where_lugre_ends(v: float) -> None:
    law = LuGre(**LEVELS, v_s=2e-3, delta=3.2, sigma_2=0.4, v_eps=0.0)
    steady = SteadyStateLuGre(F_S=1.5, F_C=1.0, v_s=2e-3, sigma_2=0.4, delta=3.2, v_eps=0.0)
    assert steady.force(v, 0.0) == pytest.approx(law.force(v, 5.0, law.steady_state(v, 5.0)))


@pytest.mark.parametrize(
    ("law", "speed", "level"),
    [(SteadyStateLuGre.pilot(), 129, 3.1224), (SteadyStateLuGre.main(), 532, 2.6527)],
)
def test_published_curve_has_its_minimum_where_computed(
    law: Law, speed: float, level: float
) -> None:
    v = np.linspace(10, 800, 79_001) / 60000
    F = law.force(v, 1.0)
    assert v[F.argmin()] * 60000 == pytest.approx(speed, abs=0.6)
    assert F.min() == pytest.approx(level, abs=5.1e-5)


ORIGINALS = [Tustin(**LEVELS), Benson(**LEVELS), SteadyStateLuGre(delta=0.78), Stribeck(**LEVELS)]


@pytest.mark.parametrize("law", ORIGINALS, ids=lambda law: type(law).__name__)
@pytest.mark.parametrize("v", [-3e-3, 1e-4, 5e-4, 2e-3])
def test_smooth_form_tends_to_the_original(law: Law, v: float) -> None:
    exact = replace(law, v_eps=0.0).force(v, 5.0)
    errors = [abs(replace(law, v_eps=e).force(v, 5.0) / exact - 1) for e in (1e-4, 1e-5, 1e-7)]
    assert errors[0] >= errors[1] >= errors[2]
    assert errors[0] > 0 or abs(v) > 1e-3
    assert errors[2] < 5e-4
    assert replace(law, v_eps=0.0).force(0.0, 5.0) == 0.0


def test_peak_of_andersson_is_as_high_as_stated() -> None:
    v = np.linspace(0, 2e-3, 20_001)
    peak = Andersson(mu_s=1.5, mu_d=1.0, k_t=1e4).force(v, 1.0).max()
    assert peak == pytest.approx(0.968 * 1.5, abs=5e-4 * 1.5)


@given(v=speeds)
def test_equal_levels_leave_smooth_coulomb(v: float) -> None:
    law = DuanSingh(mu_s=0.2, mu_d=0.2, sigma=1e3)
    assert law.force(v, 5.0) == pytest.approx(np.tanh(1e3 * v), rel=1e-14)


def test_levels_in_newton_are_ordered_too() -> None:
    with pytest.raises(ValueError, match=r"expected F_C <= F_S, got F_C = 5 and F_S = 4.4861"):
        SteadyStateLuGre(F_C=5.0)
