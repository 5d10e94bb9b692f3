"""Position and measured velocity as one velocity: least noise, and never worse for a second one."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.data.differentiate import derivatives, differentiate, linear_regression
from identification.data.filters import Filter, Velocity, lowpass
from identification.data.record import Record
from identification.data.synthetic import synthetic_drive_data
from symfric import law_from_text
from symfric.foundation.parameters import with_values

Array = NDArray[np.float64]

STEP = 1e-3
T = STEP * np.arange(8001)
W = 2 * np.pi * 1.5
X, V = np.sin(W * T), W * np.cos(W * T)
PLAIN = Filter(100.0)
INSIDE = slice(100, -100)


def noise(seed: int) -> Array:
    return np.random.default_rng(seed).standard_normal(T.size)


def off(x: Array, v: Array | None) -> tuple[float, float]:
    """Root mean square error of the velocity, and the standard deviation that is stated."""
    told = Velocity.of(x, v, STEP)
    found = derivatives(x, v, STEP, PLAIN, told)[1]
    return float(np.std((found - V)[INSIDE])), told.deviation(PLAIN, STEP)


def test_the_mixture_is_less_noisy_than_either_and_says_how_noisy() -> None:
    x, v = X + 1e-4 * noise(0), V + 0.03 * noise(1)
    both, stated = off(x, v)
    alone = off(x, None)[0]
    measured = float(np.std((lowpass(v, PLAIN.cutoff, STEP) - V)[INSIDE]))
    assert both < 0.9 * min(alone, measured)
    assert stated == pytest.approx(both, rel=0.15)


@pytest.mark.parametrize(
    "v", [1.3 * V, W * np.cos(W * (T - 5e-3)), V + 0.2], ids=["scale", "late", "offset"]
)
def test_a_velocity_that_contradicts_the_position_does_not_count(v: Array) -> None:
    x = X + 1e-5 * noise(0)
    assert off(x, v + 1e-3 * noise(1))[0] < 1.1 * off(x, None)[0]


def test_of_a_fast_motion_the_difference_of_positions_is_not_believed() -> None:
    """At w h = 0.19 it falls short by (w h)^2 / 6, and not the measured velocity too far."""
    w = 2 * np.pi * 30
    x, v = np.sin(w * T), w * (np.cos(w * T) + 1e-3 * noise(1))
    mixed, alone = (
        float(np.std((derivatives(x, y, STEP, Filter(200.0), Velocity.of(x, y, STEP))[1]
                      - w * np.cos(w * T))[INSIDE]))
        for y in (v, None)
    )  # fmt: skip
    assert alone > 0.9 * w * (w * STEP) ** 2 / 6 / np.sqrt(2)
    assert mixed < 0.3 * alone


def test_a_velocity_made_from_the_position_is_as_noisy() -> None:
    x = X + 1e-5 * noise(0)
    v = np.convolve(np.gradient(x, STEP), np.ones(5) / 5, mode="same")
    assert off(x, v)[1] > 0.5 * off(x, None)[1]


def test_an_exact_velocity_does_without_the_position() -> None:
    assert off(X + 1e-3 * noise(0), V)[0] < 1e-4 * W


@pytest.mark.parametrize("level", [1e-3, 0.5])
def test_a_second_measurement_does_not_narrow_the_band(level: float) -> None:
    x, v = X + 1e-6 * noise(0), V + level * noise(1)
    alone = Velocity.of(x, None, STEP).band(x, None, STEP)
    assert Velocity.of(x, v, STEP).band(x, v, STEP) >= alone


def test_velocity_alone() -> None:
    told = Velocity.of(None, V + 0.1 * noise(0), STEP)
    assert (told.weight == 1.0).all()
    assert told.noise == pytest.approx(0.01, rel=0.1)
    with pytest.raises(ValueError, match="expected a position or a velocity"):
        Velocity.of(None, None, STEP)


@cache
def masses(position: float, velocity: float | None, seeds: int = 8) -> tuple[Array, float]:
    """Estimates of a mass of 95 kg, and their standard error."""
    law = with_values(
        law_from_text("coulomb+viscous"), {"mu_d": 20.0, "sigma_2": 200.0, "v_eps": 1e-4}
    )
    clean = synthetic_drive_data(law, force_noise=0.0, position_noise=0.0)[0]
    rate = np.gradient(clean["x"], clean.step)
    found: list[float] = []
    errors: list[float] = []
    for seed in range(seeds):
        random = np.random.default_rng(seed)
        x, force, v = random.standard_normal((3, clean.size))
        signals = {"x": clean["x"] + position * x, "force": clean["force"] + 0.5 * force}
        if velocity is not None:
            signals["v"] = rate + velocity * v
        units = {"x": "m", "force": "N", "v": "m/s"}
        record = Record("drive", clean.t, signals, {n: units[n] for n in signals})
        fit = linear_regression(differentiate(record))
        found.append(fit.values["m"])
        errors.append(fit.standard_errors["m"] or 0.0)
    return np.array(found), float(np.mean(errors))


@pytest.mark.parametrize("velocity", [1e-4, 1e-3, 5e-2])
@pytest.mark.parametrize("position", [1e-6, 1e-5])
def test_a_noisy_velocity_never_spoils_the_mass(position: float, velocity: float) -> None:
    alone, _ = masses(position, None)
    both, error = masses(position, velocity)
    assert abs(both.mean() - 95.0) < error
    assert np.sqrt(np.mean((both - 95.0) ** 2)) < 1.1 * np.sqrt(np.mean((alone - 95.0) ** 2))
