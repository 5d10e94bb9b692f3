"""Two-dimensional bristle: exact return, level, no drift, projection."""

from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from symfric.laws import Bristle2D, PlanarSlip

N = 7.848
pair = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)).map(np.array)


@given(v=pair, z=pair)
def test_force_never_leaves_the_disc(v: np.ndarray, z: np.ndarray) -> None:
    F = PlanarSlip(Bristle2D()).force(v, N, 1e-4 * z)
    level = N * (0.1 + 0.05 * np.exp(-(v @ v) / 1e-6))
    assert np.hypot(*F) <= level * (1 + 1e-12)


@given(v=pair)
def test_below_break_away_the_bristle_follows_the_slip_exactly(v: np.ndarray) -> None:
    rate = PlanarSlip(Bristle2D()).rate(1e-4 * v, N, np.array([3e-6, -2e-6]))
    assert rate == pytest.approx(1e-4 * v, abs=1e-15)


def test_sliding_force_has_the_level_against_the_motion() -> None:
    law, v = PlanarSlip(Bristle2D()), 0.1 * np.array([0.6, -0.8])
    run = solve_ivp(
        lambda t, z: law.rate(v, N, z),
        (0, 0.1),
        [5e-6, 5e-6],
        "Radau",
        rtol=1e-10,
        atol=1e-15,
    )
    F = law.force(v, N, run.y[:, -1])
    assert pytest.approx(0.1 * N * np.array([0.6, -0.8]), rel=1e-8) == F


def test_shaking_across_a_load_below_break_away_does_not_creep() -> None:
    """Closed paths bring the bristle back: the rate is the velocity."""
    law, t = PlanarSlip(Bristle2D()), np.linspace(0.0, 1.0, 10_001)
    z, path = np.array([4e-6, 0.0]), np.zeros(2)
    for time in t[:-1]:
        v = 2 * pi * 2e-6 * np.array([sin(2 * pi * time), cos(2 * pi * time)])
        step = law.rate(v, N, z) * 1e-4
        z, path = z + step, path + v * 1e-4
    assert z == pytest.approx(np.array([4e-6, 0.0]) + path, abs=1e-17)


def test_projection_without_rounding_is_exact() -> None:
    law = PlanarSlip(Bristle2D(kappa=0.0))
    F = law.force(np.array([1.0, 0.0]), N, np.array([0.0, 1e-5]))
    trial = np.array([190.0, 1.0])
    assert pytest.approx(0.1 * N * trial / np.hypot(*trial), rel=1e-12) == F
