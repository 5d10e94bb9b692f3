"""Closed forms of lubricated friction, and a bearing by other formulations."""

from math import pi, sqrt

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import symfric as sf

CASES = [(1e-2, 1e-3, 1e-6, 1e-10, 3e-7, 0.5), (0.1, 0.05, 1e-3, 1e-8, 2e-5, 40.0),
         (0.3, 2.0, 0.4, 1e-6, 5e-4, 1e5)]  # fmt: skip
"""mu_b, eta, A, H_m, h and a load, from a watch to a ship."""


def law(mu_b: float, eta: float, A: float, H_m: float, h: float) -> sf.MixedLubrication:
    return sf.MixedLubrication(mu_b, eta, A, H_m, h, v_eps=0.0, N_eps=0.0)


def test_friction_at_points_of_the_curve_is_known() -> None:
    for mu_b, eta, A, H_m, h, N in CASES:
        lubricated = law(mu_b, eta, A, H_m, h)
        v_m = H_m * N / (A * eta)
        for u in (-30.0, -1.0, -1e-3, 1e-6, 0.5, 1.0, 7.0):
            expected = N * (np.sign(u) * mu_b / (1 + u * u) + u * H_m / h)
            assert lubricated.force(u * v_m, N) == pytest.approx(expected, rel=1e-13)
        assert lubricated.static_level(N) == pytest.approx(mu_b * N)
        thousand = lubricated.force(1e6 * v_m, N)
        assert thousand == pytest.approx(eta * A / h * 1e6 * v_m, rel=1e-6)


def test_equal_hersey_numbers_give_equal_coefficients() -> None:
    """Viscosity, speed, load and area enter mu by H only, which the Stribeck curve states."""
    rng = np.random.default_rng(3)
    for mu_b, eta, A, H_m, h, N in CASES:
        for _ in range(20):
            a, b, c = 10 ** rng.uniform(-2, 2, 3)
            v = H_m * N / (A * eta) * 10 ** rng.uniform(-2, 1)
            other = law(mu_b, a * eta, c * A, H_m, h).force(b * v, a * b * c * N)
            expected = float(law(mu_b, eta, A, H_m, h).force(v, N)) / N
            assert other / (a * b * c * N) == pytest.approx(expected, rel=1e-12)


def test_the_minimum_exists_above_the_stated_film_thickness_only() -> None:
    """2 u / (1 + u^2)^2, which the slope of the film has to equal, is at most 9 / (8 sqrt(3))."""
    bound = 9 / (8 * sqrt(3)) * 0.1
    u = np.geomspace(1e-3, 1e2, 4001)
    for thickness in (0.99 / bound, 1.01 / bound):
        F = law(0.1, 1.0, 1.0, 1e-8, thickness * 1e-8).force(u * 1e-8, 1.0)
        assert (np.diff(F) > 0).all() == (thickness * bound < 1)
    assert 1 / bound == pytest.approx(1.54 / 0.1, rel=1e-3)


def test_a_fast_plain_bearing_obeys_petroff() -> None:
    """Torque of shear in the full gap: wall speed over clearance times area times radius."""
    r, L, c, eta, omega, N = 0.02, 0.03, 4e-5, 0.03, 300.0, 200.0
    bearing = sf.MixedLubrication(0.12, eta, A=2 * r * L, H_m=1e-9, h_0=c / pi)
    shear = eta * omega * r / c
    torque = shear * (2 * pi * r * L) * r
    assert r * float(bearing.force(omega * r, N)) == pytest.approx(torque, rel=2e-2)
    assert float(
        sf.MixedLubrication(0.0, eta, 2 * r * L, 1e-9, c / pi).force(omega * r, N)
    ) * r == (pytest.approx(torque, rel=1e-12))


def test_warm_oil_moves_the_minimum_and_keeps_its_friction() -> None:
    lubricated = sf.MixedLubrication(v_eps=1e-9)

    def least(T: float) -> tuple[float, float]:
        warm = sf.TemperatureDependent(lubricated, T=T, k_wet=0.04)

        def force(x: float) -> float:
            return float(warm.force(np.exp(x), 50.0))

        found = minimize_scalar(force, bounds=(-12, 3), options={"xatol": 1e-9})
        return float(np.exp(found.x)), float(found.fun)

    (cold, one), (hot, other) = least(293.15), least(333.15)
    assert hot / cold == pytest.approx(np.exp(0.04 * 40.0), rel=1e-6)
    assert other == pytest.approx(one, rel=1e-9)


def test_an_unloaded_contact_is_a_film() -> None:
    lubricated = sf.MixedLubrication()
    for v in (-1.0, 0.0, 1e-9, 2.0):
        assert lubricated.force(v, 0.0) == pytest.approx(0.05 * 1e-3 / 2e-5 * v)
