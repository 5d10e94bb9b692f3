"""Stiffness from reversals, Maxwell-slip elements and break-away against records made of them."""

import numpy as np
import pytest
from tables import sampled

from identification.starts.experiments import break_away
from identification.starts.maxwell_slip import SlipElements, _merged, fit_elements, stretches
from identification.starts.measured import Measured, hysteresis, turning_points

T = 0.015 * np.arange(1000)
X = 8e-6 * np.sin(0.63 * T) + 5e-6 * np.sin(2.3 * T) + 15e-6 * np.sin(0.9 * T)
V = np.gradient(X, T)


def dahl(x: np.ndarray, sigma_0: float, level: float) -> np.ndarray:
    """Force of a bristle along a path, exact for each increment."""
    F = np.zeros(x.size)
    for i, dx in enumerate(np.diff(x)):
        side = np.sign(dx)
        F[i + 1] = side * level + (F[i] - side * level) * np.exp(-sigma_0 * abs(dx) / level)
    return F


def test_turning_points_ignore_what_is_within_the_dead_band() -> None:
    x = np.array([0.0, 0.5, 1.0, 0.95, 2.0, 1.5, 1.0, 1.02, 0.0, 1.0])
    assert turning_points(x, 0.1) == [4, 8]


def test_stiffness_of_a_bristle_and_of_an_elastic_element_with_noise() -> None:
    found = hysteresis(Measured(V, dahl(X, 2e5, 1.0), X, T))
    assert abs(found.bristle / 2e5 - 1) < 0.05
    noise = 0.02 * np.random.default_rng(0).standard_normal(T.size)
    F = stretches(X, np.array([2e-6]))[0] @ np.array([3e5]) + noise
    assert abs(hysteresis(Measured(V, F, X, T)).elastic / 3e5 - 1) < 0.1
    assert hysteresis(Measured(V, np.sign(V))) is None


@pytest.mark.parametrize("noise", sampled([0.0, 0.02], of=2))
def test_elements_are_found_with_their_radii(noise: float) -> None:
    radii, k = np.array([3e-7, 1.1e-6, 2.9e-6, 8e-6]), np.array([9e5, 3e5, 8e4, 3e4])
    F = stretches(X, radii)[0] @ k
    error = noise * np.random.default_rng(0).standard_normal(T.size)
    measured = Measured(V, F + error, X, T)
    found = fit_elements(measured, 4)
    rms = float(np.sqrt(np.mean((found.force(measured) - F) ** 2)))
    assert rms < (1e-3 if noise == 0 else 0.2 * noise)
    assert np.allclose(found.radii, radii, rtol=1e-3 if noise == 0 else 0.1)
    assert np.isclose(found.shares.sum(), 1.0)


def test_merged_neighbours_keep_their_stiffness_and_their_level() -> None:
    k, radii = np.array([9e5, 8e4, 8e4, 1e4]), np.array([3e-7, 2.9e-6, 3.1e-6, 9e-6])
    merged = _merged(SlipElements(k, radii, 0.0, 0.0, 0, 0.0), 3)
    np.testing.assert_allclose(merged, [3e-7, 3e-6, 9e-6])


def test_slopes_of_the_stretches_by_differences() -> None:
    radii, h = np.array([4e-7, 3.1e-6]), 1e-11
    up, down = stretches(X, radii + h)[0], stretches(X, radii - h)[0]
    error = np.abs((up - down) / (2 * h) - stretches(X, radii)[1])
    assert np.mean(error > 1e-3) < 1e-3  # at corners alone


def ramps(rates: list[float], level: float, per_decade: float) -> Measured:
    """Force ramps from rest, each followed by a slide and by a rest."""
    h, F, v = 1e-3, list[float](), list[float]()
    for rate in rates:
        top = level + per_decade * np.log10(rate)
        up = np.arange(0.0, top, rate * h)
        F += [*up, top, *np.full(50, 0.6 * top), *np.zeros(50)]
        v += [*np.zeros(up.size + 1), *np.full(50, 0.1), *np.zeros(50)]
    return Measured(np.array(v), np.array(F), t=h * np.arange(len(F)))


def test_break_away_of_ramps_and_how_it_depends_on_their_rate() -> None:
    found = break_away(ramps([1.0, 3.0, 10.0, 30.0], 2.0, -0.2))
    assert [e.rate for e in found.events] == pytest.approx([1, 3, 10, 30], rel=1e-6)
    assert found.per_decade == pytest.approx(-0.2, abs=1e-9)
    assert "decreases" in found.note
    equal = ramps([2.0, 2.0, 2.0], 2.0, 0.0)
    creeping = Measured(np.maximum(equal.v, 5e-3), equal.F + 0.5, t=equal.t)
    for same in (break_away(equal), break_away(creeping, rest=0.1, offset=0.5)):
        assert same.per_decade is None and same.level == pytest.approx(2.0, abs=1e-12)


@pytest.mark.parametrize("loaded", sampled([-1, 1], of=2))
def test_a_record_may_begin_with_all_elements_slipping(loaded: int) -> None:
    radii, k = np.array([3e-7, 2.9e-6]), np.array([9e5, 8e4])
    measured = Measured(V, stretches(X, radii, loaded)[0] @ k, X, T)
    found = fit_elements(measured, 2, offset=False, viscous=False)
    assert found.loaded == loaded
    assert np.allclose(found.radii, radii, rtol=1e-3)


def test_only_the_last_rise_determines_the_rate_of_a_ramp() -> None:
    """The force rises, gives way to a quarter, and rises again at another rate."""
    h = 1e-3
    rises = [*np.arange(0.0, 1.2, 50 * h), *np.arange(0.4, 2.0, 2 * h)]
    F = np.array([*rises, *[1.2] * 50])
    v = np.array([0.0] * len(rises) + [0.1] * 50)
    t = h * np.arange(F.size, dtype=np.float64)
    (event,) = break_away(Measured(v, F, t=t)).events
    assert event.rate == pytest.approx(2.0, rel=1e-6)
