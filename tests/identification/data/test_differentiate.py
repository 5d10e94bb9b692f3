"""Filters, derivatives of records, and points of constant velocity."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.differentiate import Velocity, differentiate, position_noise
from identification.data.filters import (
    Decimation,
    Filter,
    bandwidth,
    central_difference,
    choose_filter,
    lowpass,
    position_band,
    smoothed,
    spectrum,
)
from identification.data.record import Record
from identification.data.regression import plateaus
from symfric.laws import Stribeck


@pytest.mark.parametrize(("cutoff", "order"), [(100.0, 4), (30.0, 2), (200.0, 3)])
def test_lowpass_equals_filtfilt_of_scipy(cutoff: float, order: int) -> None:
    signal = pytest.importorskip("scipy.signal")
    t = np.arange(4000) * 1e-3
    x = np.cumsum(np.random.default_rng(0).standard_normal(t.size)) + 3 * t
    b, a = signal.butter(order, cutoff, fs=1000.0)
    # with a reflection longer than the impulse response the ends agree too
    expected = signal.filtfilt(b, a, x, padlen=3000)
    ours = lowpass(x, cutoff, 1e-3, order)
    np.testing.assert_allclose(ours, expected, atol=1e-9 * np.ptp(x))


def test_lowpass_halves_the_amplitude_at_the_cutoff_without_phase_and_keeps_lines() -> None:
    wave, inside = np.sin(2 * np.pi * 50e-3 * np.arange(5000)), slice(500, -500)
    np.testing.assert_allclose(lowpass(wave, 50.0, 1e-3)[inside], wave[inside] / 2, atol=1e-3)
    line = np.linspace(3.0, -2.0, 777)
    np.testing.assert_allclose(lowpass(line, 10.0, 1e-3), line, atol=1e-13)


def test_central_difference_is_of_second_order() -> None:
    def error(n: int) -> float:
        t = np.linspace(0, 1, n)
        slope = central_difference(np.sin(5 * t), t[1])
        return float(np.abs(slope - 5 * np.cos(5 * t))[1:-1].max())

    errors = np.array([error(n) for n in (101, 201, 401)])
    np.testing.assert_allclose(errors[:-1] / errors[1:], 4.0, rtol=0.02)


def test_decimation_keeps_lines_and_their_times() -> None:
    D, t = Decimation(1000, 10), np.arange(1000.0)
    np.testing.assert_allclose(D(2 * t + 1), 2 * D.centres(t) + 1, rtol=1e-12)


def test_decimation_removes_what_would_alias() -> None:
    D = Decimation(5000, 10)
    t = np.arange(5000) * 1e-3
    assert np.abs(D(np.sin(2 * np.pi * 80 * t))).max() < 1e-2
    assert np.abs(D(np.sin(2 * np.pi * 20.3 * t))).max() == pytest.approx(1.0, abs=2e-2)


def test_decimation_of_columns_is_that_of_each() -> None:
    for samples, factor in ((500, 7), (400, 1), (100, 10)):
        D = Decimation(samples, factor)
        signals = np.random.default_rng(1).standard_normal((samples, 3))
        expected = np.column_stack([D(column) for column in signals.T])
        np.testing.assert_allclose(D.columns(signals), expected, atol=1e-14)


def test_rows_that_touch_a_sample_are_those_it_changes() -> None:
    D = Decimation(400, 7)
    marked = np.zeros(400, bool)
    marked[[90, 201]] = True
    changed = np.flatnonzero(np.abs(D(marked.astype(float))) > 0)
    assert set(changed) <= set(np.flatnonzero(D.touched(marked)))
    assert D.touched(marked).sum() <= changed.size + 4


def test_bandwidth_is_the_frequency_that_carries_the_force_not_its_noise() -> None:
    t = np.arange(10_000) * 1e-3
    force = np.sin(2 * np.pi * 3 * t) + 0.2 * np.sin(2 * np.pi * 17 * t)
    noisy = force + 0.3 * np.random.default_rng(0).standard_normal(t.size)
    assert bandwidth(5.0 + force, 1e-3) == pytest.approx(17.0, abs=0.1)
    assert bandwidth(noisy, 1e-3) == pytest.approx(17.0, abs=3.0)


def test_the_motion_ends_where_its_noise_begins() -> None:
    t = np.arange(10_000) * 1e-3
    noise = np.random.default_rng(0).standard_normal(t.size)
    x = np.sin(2 * np.pi * 1.3 * t) + 1e-3 * np.sin(2 * np.pi * 30 * t)
    assert position_band(x + 1e-7 * noise, 1e-3) > 29.0
    assert position_band(x + 1e-1 * noise, 1e-3) < 5.0


def test_peaks_of_noise_do_not_widen_the_band() -> None:
    t = np.arange(6000) * 2e-3
    for seed in range(40):
        noise = np.random.default_rng(seed).standard_normal(t.size)
        assert position_band(np.sin(2 * np.pi * t) + 1e-4 * noise, 2e-3) < 30.0


def test_noise_of_the_position_narrows_the_filter() -> None:
    t = np.arange(20_000) * 1e-3
    noise = np.random.default_rng(0).standard_normal(t.size)
    force, x = np.sin(2 * np.pi * 20 * t), np.sin(2 * np.pi * 2 * t)
    wide, narrow = (
        choose_filter(force, 1e-3, [position_band(x + s * noise, 1e-3)]) for s in (0.0, 1e-2)
    )
    assert (wide.cutoff, wide.decimation) == (250.0, 10)  # motion is known up to Nyquist / 2
    assert narrow.cutoff < wide.cutoff
    assert narrow.decimation > wide.decimation


def test_the_smoothing_spline_is_the_solution_of_the_dense_problem() -> None:
    n, cutoff = 60, 0.03
    u = np.random.default_rng(0).standard_normal(n)
    D = np.diff(np.eye(n), 2, axis=0)
    dense = np.eye(n) + D.T @ D / (2 * np.sin(np.pi * cutoff)) ** 4
    once = np.linalg.solve(dense, u)
    twice = once + np.linalg.solve(dense, u - once)
    np.testing.assert_allclose(smoothed(u, cutoff), twice, atol=1e-12)
    np.testing.assert_allclose(smoothed(3.0 + 0.1 * np.arange(n), cutoff), 3.0 + 0.1 * np.arange(n))


def test_a_line_of_a_coarse_encoder_does_not_widen_the_band() -> None:
    """At 1 um per sample and counts of 5 um, a line lies at 200 Hz, far above the motion."""
    t = np.arange(10_000) * 1e-3
    x = 5e-3 * np.sin(2 * np.pi * 1.3 * t) * (t < 5) + 1e-3 * np.maximum(t - 5, 0)
    assert position_band(5e-6 * np.round(x / 5e-6), 1e-3) < 60.0


@pytest.mark.parametrize("rate", [np.gradient, lambda x: np.diff(x, append=0.0), None])
def test_noise_of_a_differenced_position_is_recognised(rate: Any) -> None:
    noise = 2e-3 * np.random.default_rng(0).standard_normal(20_000)
    found = position_noise(spectrum(noise if rate is None else rate(noise)))
    assert (found is None) == (rate is None)
    assert found is None or np.sqrt(found[0]) == pytest.approx(2e-3, rel=0.1)


def test_a_spectrum_without_its_line_is_that_of_the_rest() -> None:
    n = np.arange(1000)
    wave = np.sin(np.pi / 111 * n)
    np.testing.assert_allclose(spectrum(wave + 0.2 * n - 3.0, line=True), spectrum(wave), atol=1e-9)


def test_band_of_a_position_sampled_slower_than_once_a_second() -> None:
    """An average over 1 Hz is wider than the whole spectrum then."""
    for step in (1.0, 1e3):
        assert 0 < position_band(np.sin(0.01 * np.arange(500)), step) <= 0.5 / step


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


def test_acceleration_falls_short_by_the_fourth_power() -> None:
    """Of a sine with w h = 0.4: 1 - (w h)^4 / 90."""
    w = 400.0
    fast = differentiate(record(x=np.sin(w * T), force=WAVE["force"]), Filter(400.0))
    wave = np.sin(w * fast.t)
    size = -float(fast.a @ wave / (wave @ wave)) / w**2
    assert 1 - size == pytest.approx(0.4**4 / 90, rel=0.1)


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
