"""Stribeck friction against the laws it contains."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from symfric import Coulomb, Stribeck, Sum, Viscous


@given(v=st.floats(-1.0, 1.0), delta=st.floats(0.1, 10.0))
def test_without_static_excess_it_is_coulomb_plus_viscous(v: float, delta: float) -> None:
    law = Stribeck(mu_s=0.2, mu_d=0.2, delta=delta, v_eps=1e-3, sigma_2=0.4)
    parts = Sum((Coulomb(mu_d=0.2, v_eps=1e-3), Viscous(sigma_2=0.4)))
    assert law.force(v, 5.0) == pytest.approx(parts.force(v, 5.0), rel=1e-14, abs=1e-300)


def test_peak_is_as_high_as_the_docstring_says() -> None:
    v = np.linspace(0, 2e-3, 20001)
    peak = Stribeck(mu_s=1.5, mu_d=1.0, v_s=1e-3, v_eps=1e-4).force(v, 1.0).max()
    assert peak == pytest.approx(0.968 * 1.5, abs=5e-4 * 1.5)


def test_peak_tends_to_the_static_level_as_the_smoothing_shrinks() -> None:
    v = np.geomspace(1e-9, 1e-2, 20001)
    short = [
        1.5 - Stribeck(mu_s=1.5, mu_d=1.0, v_eps=e).force(v, 1.0).max() for e in (1e-4, 1e-5, 1e-6)
    ]
    assert short[0] > 10 * short[1] > 100 * short[2] > 0


def test_force_falls_beyond_the_peak_and_rises_again_with_viscous_friction() -> None:
    law = Stribeck(mu_s=1.5, mu_d=1.0, sigma_2=5.0)
    slow, middle, fast = (law.force(v, 1.0) for v in (3e-4, 3e-3, 0.1))
    assert slow > middle < fast
