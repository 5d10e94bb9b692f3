"""The reconstruction of the Rui-Wang law against the law that modifies it."""

from math import pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from symfric import SelfTuning
from symfric.laws import RuiWang


@given(v=st.floats(-1.0, 1.0), E=st.floats(-1.0, 0.9))
def test_it_is_the_self_tuning_law_with_a_constant_peak(v: float, E: float) -> None:
    tuned = SelfTuning(mu_s=0.3, mu_d=0.2, B=500.0, E=E)
    law = RuiWang(D=1.5, C=tuned.C, B=500.0, E=E)
    assert law.force(v, 77.0) == pytest.approx(tuned.force(v, 5.0), rel=1e-13, abs=1e-300)


@pytest.mark.parametrize("C", [0.5, 1.0, 1.7])
def test_fast_sliding_tends_to_the_stated_level(C: float) -> None:
    assert RuiWang(D=2.0, C=C).force(1e9, 1.0) == pytest.approx(2.0 * sin(C * pi / 2), rel=1e-9)
