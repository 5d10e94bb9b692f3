"""Derivatives of records, and points of constant velocity."""

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.differentiate import Velocity, differentiate
from identification.data.filters import Filter, lowpass
from identification.data.record import Record
from identification.data.regression import plateaus
from symfric.laws import Stribeck

T = np.arange(4001) * 1e-3
W = 2 * np.pi * 1.5
UNITS = {"x": "m", "force": "N", "v": "m/s"}


def record(**signals: np.ndarray) -> Record:
    t = signals.pop("t", T)
    return Record("wave", t, signals, {name: UNITS[name] for name in signals})


WAVE = record(x=np.sin(W * T), force=np.cos(W * T))


def test_velocity_and_acceleration_of_a_sine() -> None:
    found = differentiate(WAVE, Filter(100.0, 5))
    assert (found.t[0], found.t[-1]) == (T[50], T[-51])  # five filter times are cut off
    np.testing.assert_allclose(found.v, W * np.cos(W * found.t), atol=1e-4 * W)
    np.testing.assert_allclose(found.a, -(W**2) * np.sin(W * found.t), atol=1e-3 * W**2)


def test_acceleration_falls_short_by_a_twelfth_of_the_square() -> None:
    """Of a sine with w h = 0.2: 1 - (w h)^2 / 12; a difference of differences loses a third."""
    w = 200.0
    fast = differentiate(record(x=np.sin(w * T), force=WAVE["force"]), Filter(400.0))
    size = np.sqrt(2 * np.mean(fast.a**2)) / w**2
    assert 1 - size == pytest.approx(0.2**2 / 12, rel=0.1)


def test_equations_that_touch_slow_samples_are_left_out() -> None:
    kept = differentiate(WAVE, Filter(100.0, 5, v_min=0.5))
    every = differentiate(WAVE, Filter(100.0, 5, v_min=0.0))
    assert 0 < kept.kept.size < every.kept.size
    width = kept.decimation.taps.size // 2 * 1e-3
    nearest = [np.abs(time - kept.t[np.abs(kept.v) < 0.5]).min() for time in kept.times]
    lost = np.setdiff1d(every.times, kept.times)
    reached = [np.abs(time - kept.t[np.abs(kept.v) < 0.5]).min() for time in lost]
    assert min(nearest) > width >= max(reached) - 1e-9


def test_reversals_are_left_out_by_the_data() -> None:
    found = differentiate(WAVE, Filter(100.0, 5))
    turns = found.t[1:][np.diff(np.sign(found.v)) != 0]
    assert turns.size >= 10
    reach = (found.decimation.taps.size // 2 + 5) * 1e-3
    assert min(np.abs(found.times - turn).min() for turn in turns) > reach - 1.5e-3


def test_noise_of_the_velocity_is_that_of_the_filtered_noise() -> None:
    noise: NDArray[np.float64] = 1e-6 * np.random.default_rng(0).standard_normal(T.size)
    x: NDArray[np.float64] = np.sin(W * T) + noise
    filter = Filter(100.0)
    expected = np.gradient(lowpass(noise, 100.0, 1e-3), 1e-3)[50:-50].std()
    found = Velocity.of(x, None, 1e-3).errors(filter, 1e-3)[0]
    assert found == pytest.approx(expected, rel=0.15)
    measured = Velocity.of(None, np.cos(W * T) + noise, 1e-3).errors(filter, 1e-3)[0]
    assert measured == pytest.approx(lowpass(noise, 100.0, 1e-3).std(), rel=0.15)


LEVELS = (0.02, 0.05, 0.1, 0.2, -0.2, -0.1, -0.05, -0.02)
LAW = Stribeck(mu_s=3.0, mu_d=2.0, v_s=0.03, sigma_2=5.0, v_eps=1e-6)


def staircase(noise: float = 0.05, rotary: bool = False) -> Dataset:
    """A second at each speed, ramps of 0.2 s, a rest at the end."""
    corners, values = [0.0], [0.0]
    for level in (*LEVELS, 0.0):
        corners += [corners[-1] + 0.2, corners[-1] + 1.2]
        values += [level, level]
    t = np.arange(0.0, corners[-1], 1e-3)
    v = np.interp(t, corners, values)
    a = np.gradient(v, t)
    rng = np.random.default_rng(0)
    x = np.cumsum(v) * 1e-3 + 1e-6 * rng.standard_normal(t.size)
    force = 2 * a + LAW.force(v, 1.0) + noise * rng.standard_normal(t.size)
    units = {"x": "rad", "force": "N m"} if rotary else {"x": "m", "force": "N"}
    return Dataset.of(t=t, x=x, force=force, units=units)


@pytest.mark.parametrize("rotary", [False, True])
def test_each_step_of_a_staircase_is_a_point_of_the_curve(rotary: bool) -> None:
    (found,) = plateaus(staircase(rotary=rotary))
    assert found.t is None
    np.testing.assert_allclose(found["v"], LEVELS, rtol=2e-3)
    expected = LAW.force(np.array(LEVELS), 1.0)
    np.testing.assert_array_less(np.abs(found["F"] - expected), 4 * 0.05 / np.sqrt(found["n"]))
    np.testing.assert_allclose(found["spread"], 0.05, rtol=0.15)
    assert (found.unit("v"), found.unit("F")) == (("rad/s", "N m") if rotary else ("m/s", "N"))
