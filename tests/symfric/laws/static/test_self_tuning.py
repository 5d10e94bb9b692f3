"""The self-tuning law: the shape factor fixes peak and asymptote, whatever the stiffness."""

from math import atan, inf, pi, sin, tan

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from symfric import SelfTuning, symbolise
from symfric.laws import BrittleSelfTuning
from symfric.laws.static.self_tuning import brittleness, corrected_shape_factor, shape_factor

ratios = st.floats(0.0, 0.999)


@given(ratio=st.floats(0.3, 0.95), B=st.floats(1.0, 1e4), E=st.sampled_from([-5.0, 0.0, 0.5]))
def test_peak_is_the_static_level_and_the_asymptote_the_dynamic_one(
    ratio: float, B: float, E: float
) -> None:
    law = SelfTuning(mu_s=0.4, mu_d=0.4 * ratio, B=B, E=E)
    v = np.geomspace(1e-3, 1e3, 40_001) / B
    peak = law.force(v, 5.0).max()
    assert peak <= 2.0
    assert peak == pytest.approx(2.0, rel=1e-6)
    assert law.force(1e12 / B, 5.0) == pytest.approx(2.0 * ratio, rel=1e-9)


@given(ratio=st.floats(0.0, 0.99), v_p=st.floats(1e-5, 1.0))
def test_peak_lies_exactly_at_the_velocity_asked_for(ratio: float, v_p: float) -> None:
    law = SelfTuning.from_peak_velocity(v_p, mu_s=0.4, mu_d=0.4 * ratio)
    assert law.force(v_p, 5.0) == pytest.approx(2.0, rel=1e-15)
    assert law.force(0.99 * v_p, 5.0) < 2.0
    assert law.force(1.01 * v_p, 5.0) < 2.0


@given(ratio=st.floats(0.1, 0.9), y_p=st.floats(1.1, 3.0))
def test_curvature_factor_moves_the_peak_as_published(ratio: float, y_p: float) -> None:
    """Stiffness and peak velocity given: E = (B v_p - tan(pi/2C)) / (B v_p - atan(B v_p))."""
    peak = tan(pi / (2 * shape_factor(ratio)))
    E = (y_p - peak) / (y_p - atan(y_p))
    assume(E < 0.99)
    law = SelfTuning(mu_s=0.4, mu_d=0.4 * ratio, B=200.0, E=E)
    assert law.force(y_p / 200.0, 5.0) == pytest.approx(2.0, rel=1e-14)


@pytest.mark.parametrize(("rho", "expected"), [(0.5, 1.376), (0.8, 2.036), (0.9, 2.736)])
def test_stiffness_for_a_peak_velocity_has_the_published_values(
    rho: float, expected: float
) -> None:
    law = SelfTuning.from_peak_velocity(1.0, mu_s=1.0, mu_d=rho)
    assert pytest.approx(expected, abs=5.1e-4) == law.B


@pytest.mark.parametrize(("rho", "C"), [(0.0, 2.0), (2 / 3, 1.5354), (0.8, 1.4097), (1.0, 1.0)])
def test_closed_form_has_known_values(rho: float, C: float) -> None:
    assert shape_factor(rho) == pytest.approx(C, abs=5e-5)
    assert pytest.approx(C, abs=5e-5) == SelfTuning(mu_s=0.3, mu_d=0.3 * rho).C


@given(ratio=ratios)
def test_iterative_correction_equals_the_closed_form(ratio: float) -> None:
    # towards ratio 1 the root becomes double: a residual of 1e-12 leaves 1e-12/sqrt(1 - ratio^2)
    C, _ = corrected_shape_factor(ratio)
    assert pytest.approx(shape_factor(ratio), abs=1e-12 / (1 - ratio**2) ** 0.5 + 1e-14) == C


@pytest.mark.parametrize(
    ("rho", "iterations"), [(0.3, 4), (0.5, 4), (0.8, 5), (0.9, 5), (0.99, 7), (1.0, 20)]
)
def test_iterations_are_as_published(rho: float, iterations: int) -> None:
    assert corrected_shape_factor(rho)[1] == iterations


def test_correction_at_a_finite_velocity_meets_the_dynamic_level_there() -> None:
    B, v_d, rho = 200.0, 0.05, 0.5
    C, _ = corrected_shape_factor(rho, theta=atan(B * v_d))
    assert pytest.approx(1.7796, abs=5e-5) == C
    assert sin(C * atan(B * v_d)) == pytest.approx(rho, abs=1e-12)
    assert sin(C * pi / 2) == pytest.approx(0.679 * rho, abs=5e-4)


@pytest.mark.parametrize("ratio", [-0.1, 1.1])
def test_impossible_ratio_is_refused(ratio: float) -> None:
    with pytest.raises(
        ValueError, match=r"expected 0 <= mu_d/mu_s <= 1, got -?[01]\.1; the dynamic"
    ):
        corrected_shape_factor(ratio)


def test_angle_for_which_friction_would_reverse_is_refused() -> None:
    """C = 2.18 was returned for theta = 1.2: friction that drives at high speed."""
    for theta in (1.2, 0.0, -1.0, 2.0):
        with pytest.raises(ValueError, match=r"expected 1\.309 <= theta <= pi/2 .* got"):
            corrected_shape_factor(0.5, theta=theta)
    assert corrected_shape_factor(0.5, theta=1.309)[0] <= 2.0
    assert sin(corrected_shape_factor(0.5, theta=1.31)[0] * pi / 2) > 0


def test_missing_convergence_is_reported_with_the_closed_form() -> None:
    with pytest.raises(ValueError, match=r"within 3 iterations, got residual .* C = 1\.40967"):
        corrected_shape_factor(0.8, max_iterations=3)


def test_equal_levels_are_monotone_without_a_peak() -> None:
    F = SelfTuning(mu_s=0.2, mu_d=0.2).force(np.geomspace(1e-6, 1e3, 1001), 5.0)
    assert (np.diff(F) > 0).all()
    assert F[-1] < 1.0


def test_gradient_in_the_levels_is_infinite_where_they_meet_as_stated() -> None:
    law, (mu_d,) = symbolise(SelfTuning(mu_s=0.2, mu_d=0.1), "mu_d")
    slope = ca.Function("slope", [mu_d.symbol], [ca.gradient(law.C, mu_d.symbol)])
    assert float(slope(0.2)) == -inf


@given(v=st.floats(1e-6, 1.0), E=st.floats(-5.0, 0.99))
def test_slope_at_rest_does_not_depend_on_the_curvature_factor(v: float, E: float) -> None:
    law = SelfTuning(E=E)
    assert law.force(1e-12, 1.0) / 1e-12 == pytest.approx(0.15 * 1000.0 * law.C, rel=1e-6)


@pytest.mark.parametrize(("N", "B"), [(5.0, 0.186), (10.0, 0.263), (50.0, 0.669), (200.0, 0.984)])
def test_brittleness_has_the_tabulated_values(N: float, B: float) -> None:
    """In s/mm, as tabulated with 0.1 ... 1."""
    assert brittleness(N, 0.05) / 1000 == pytest.approx(B, abs=5.1e-4)


def test_brittleness_serves_as_a_stiffness_with_a_symbolic_load() -> None:
    N = ca.SX.sym("N")
    law = SelfTuning(B=brittleness(N, 0.05))
    v_p = ca.Function("peak", [N], [tan(pi / (2 * law.C)) / law.B])
    assert float(v_p(200.0)) < float(v_p(5.0))


@given(ratio=st.floats(0.3, 0.95), v_p=st.floats(1e-4, 1.0), E=st.floats(-5.0, 0.9))
def test_peak_lies_at_the_chosen_velocity_for_any_curvature(
    ratio: float, v_p: float, E: float
) -> None:
    law = SelfTuning.from_peak_velocity(v_p, mu_s=0.4, mu_d=0.4 * ratio, E=E)
    assert law.force(v_p, 5.0) == pytest.approx(2.0, rel=1e-14)
    assert law.force(0.9 * v_p, 5.0) < law.force(v_p, 5.0) > law.force(1.1 * v_p, 5.0)


@pytest.mark.parametrize("E", [0.0, 0.5, -2.0])
def test_slope_at_rest_is_the_chosen_one_for_any_curvature(E: float) -> None:
    law = SelfTuning.from_slope(3e3, 5.0, mu_s=0.4, mu_d=0.3, E=E)
    assert law.force(1e-12, 5.0) / 1e-12 == pytest.approx(3e3, rel=1e-6)


def test_slope_may_hold_symbols_and_a_curved_peak_may_not() -> None:
    mu_s = ca.SX.sym("mu_s")
    assert isinstance(SelfTuning.from_slope(3e3, 5.0, mu_s=mu_s).B, ca.SX)
    assert isinstance(SelfTuning.from_peak_velocity(1e-3, mu_s=mu_s).B, ca.SX)
    with pytest.raises(ValueError, match="expected numbers for mu_s, mu_d and E, got symbols"):
        SelfTuning.from_peak_velocity(1e-3, mu_s=mu_s, E=0.5)
    with pytest.raises(ValueError, match="E: expected E < 1, got 1"):
        SelfTuning.from_peak_velocity(1e-3, E=1.0)


@pytest.mark.parametrize(("N", "B"), [(5.0, 186), (10.0, 263), (50.0, 669), (200.0, 984)])
def test_brittle_law_has_the_stiffness_factor_computed_for_its_load(N: float, B: float) -> None:
    law = BrittleSelfTuning(mu_s=0.15, mu_d=0.1)
    assert brittleness(N, 0.05) == pytest.approx(B, abs=0.5)
    same = SelfTuning(mu_s=0.15, mu_d=0.1, B=brittleness(N, 0.05))
    assert law.force(1e-3, N) == pytest.approx(same.force(1e-3, N), rel=1e-12)


@pytest.mark.parametrize("N", [1e-9, 5.0, 1e4])
def test_levels_of_the_brittle_law_do_not_depend_on_its_stiffness(N: float) -> None:
    law = BrittleSelfTuning(mu_s=0.4, mu_d=0.3, E=0.5)
    F = law.force(np.geomspace(1e-6, 1.0, 100_001), N)
    assert F.max() == pytest.approx(0.4 * N, rel=1e-7)
    assert law.force(1e9, N) == pytest.approx(0.3 * N, rel=1e-6)


def test_brittle_law_refuses_a_stiffness_that_falls_with_the_load() -> None:
    with pytest.raises(ValueError, match=r"B_0 <= B_max, got B_0 = 5000 and B_max = 1000"):
        BrittleSelfTuning(B_0=5000.0)
