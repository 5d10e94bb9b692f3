"""The self-tuning law: the shape factor fixes peak and asymptote, whatever the stiffness."""

from math import atan, inf, pi, tan

import casadi as ca
import numpy as np
import pytest

from symfric import SelfTuning, symbolise
from symfric.laws import BrittleSelfTuning
from symfric.laws.static.self_tuning import brittleness, shape_factor

N = 5.0
RATIOS = (0.0, 0.3, 0.55, 0.8, 0.95)


def rest_slope(law: SelfTuning, load: float = N) -> float:
    return float(law.force(1e-12, load)) / 1e-12


def test_peak_is_the_static_level_and_the_asymptote_the_dynamic_one() -> None:
    for ratio in RATIOS[1:]:
        for B, E in ((1.0, -5.0), (200.0, 0.0), (1e4, 0.5)):
            law = SelfTuning(mu_s=0.4, mu_d=0.4 * ratio, B=B, E=E)
            peak = np.max(law.force(np.geomspace(1e-3, 1e3, 40_001) / B, N))
            assert 2.0 * (1 - 1e-6) <= peak <= 2.0
            assert law.force(1e12 / B, N) == pytest.approx(2.0 * ratio, rel=1e-9)
            assert rest_slope(law) == pytest.approx(2.0 * B * law.C, rel=1e-6)
            brittle = BrittleSelfTuning(mu_s=0.4, mu_d=0.4 * ratio, E=E)
            for load in (1e-9, N, 1e4):
                F = brittle.force(np.geomspace(1e-6, 1.0, 20_001), load)
                assert np.max(F) == pytest.approx(0.4 * load, rel=1e-6)
                assert brittle.force(1e12, load) == pytest.approx(0.4 * ratio * load, rel=1e-6)
    F = SelfTuning(mu_s=0.2, mu_d=0.2).force(np.geomspace(1e-6, 1e3, 1001), N)
    assert (np.diff(F) > 0).all(), "equal levels have no peak"
    assert F[-1] < 1.0


def test_peak_and_slope_are_the_chosen_ones() -> None:
    for ratio in RATIOS:
        for v_p in (1e-5, 3e-3, 1.0):
            for E in (-5.0, 0.0, 0.9) if ratio else (0.0,):
                law = SelfTuning.from_peak_velocity(v_p, mu_s=0.4, mu_d=0.4 * ratio, E=E)
                near = [float(law.force(share * v_p, N)) for share in (0.99, 1.0, 1.01)]
                assert near[1] == pytest.approx(2.0, rel=1e-14)
                assert near[0] < near[1] > near[2]
        for E in (0.0, 0.5, -2.0):
            law = SelfTuning.from_slope(3e3, N, mu_s=0.4, mu_d=0.4 * ratio, E=E)
            assert rest_slope(law) == pytest.approx(3e3, rel=1e-6)
    for rho, stiffness in ((0.5, 1.376), (0.8, 2.036), (0.9, 2.736)):  # as published
        found = SelfTuning.from_peak_velocity(1.0, mu_s=1.0, mu_d=rho).B
        assert found == pytest.approx(stiffness, abs=5.1e-4)
    for ratio, y_p in ((0.1, 1.2), (0.5, 1.1), (0.5, 1.5), (0.9, 2.95)):
        # stiffness and peak velocity given: E = (B v_p - tan(pi/2C)) / (B v_p - atan(B v_p))
        E = (y_p - tan(pi / (2 * shape_factor(ratio)))) / (y_p - atan(y_p))
        law = SelfTuning(mu_s=0.4, mu_d=0.4 * ratio, B=200.0, E=E)
        assert law.force(y_p / 200.0, N) == pytest.approx(2.0, rel=1e-14)


def test_symbols_give_stiffnesses_except_of_a_curved_peak() -> None:
    mu_s, load = ca.SX.sym("mu_s"), ca.SX.sym("N")
    assert isinstance(SelfTuning.from_slope(3e3, N, mu_s=mu_s).B, ca.SX)
    assert isinstance(SelfTuning.from_peak_velocity(1e-3, mu_s=mu_s).B, ca.SX)
    brittle = SelfTuning(B=brittleness(load, 0.05))
    v_p = ca.Function("peak", [load], [tan(pi / (2 * brittle.C)) / brittle.B])
    assert float(v_p(200.0)) < float(v_p(N))
    law, (mu_d,) = symbolise(SelfTuning(mu_s=0.2, mu_d=0.1), "mu_d")
    slope = ca.Function("slope", [mu_d.symbol], [ca.gradient(law.C, mu_d.symbol)])
    assert float(slope(0.2)) == -inf, "where the levels meet"


def test_shape_factor_has_known_values() -> None:
    for rho, C in ((0.0, 2.0), (2 / 3, 1.5354), (0.8, 1.4097), (1.0, 1.0)):
        assert shape_factor(rho) == pytest.approx(C, abs=5e-5)
        assert pytest.approx(C, abs=5e-5) == SelfTuning(mu_s=0.3, mu_d=0.3 * rho).C


def test_brittleness_has_the_tabulated_values() -> None:
    for load, B in ((5.0, 186), (10.0, 263), (50.0, 669), (200.0, 984)):
        assert brittleness(load, 0.05) == pytest.approx(B, abs=0.51)
        law = BrittleSelfTuning(mu_s=0.15, mu_d=0.1)
        same = SelfTuning(mu_s=0.15, mu_d=0.1, B=brittleness(load, 0.05))
        assert law.force(1e-3, load) == pytest.approx(same.force(1e-3, load), rel=1e-12)
