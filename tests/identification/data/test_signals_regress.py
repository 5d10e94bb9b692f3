"""Linear regression on EMPS and known motions; position and velocity as one velocity."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from tables import sampled

from identification.data.dataset import Dataset
from identification.data.differentiate import Velocity, derivatives, differentiate
from identification.data.filters import Filter, lowpass
from identification.data.record import Record
from identification.data.regression import LinearFit, linear_regression
from identification.data.synthetic import synthetic_drive_data
from symfric.laws import Coulomb, Sum, Viscous

PUBLISHED = {
    "m": (95.1089, 0.1085), "F_v": (203.5034, 1.1460), "F_c": (20.3935, 0.1012),
    "offset": (-3.1648, 0.0444),
}  # fmt: skip
DIRECTIONS = {
    "m": (95.154, 0.083), "F_v_pos": (166.71, 1.23), "F_c_pos": (20.144, 0.109),
    "F_v_neg": (240.42, 1.23), "F_c_neg": (20.628, 0.109),
}  # fmt: skip


@pytest.fixture(scope="module")
def emps(emps_files: Dataset) -> Record:
    return emps_files[0]


def published_procedure(data: Record) -> tuple[np.ndarray, np.ndarray, float]:
    """The reference of the benchmark, written with scipy: estimates, deviations, error [%]."""
    signal = pytest.importorskip("scipy.signal")
    low = signal.butter(4, 0.2)
    thin = signal.cheby1(8, 0.05, 0.08)
    x = signal.filtfilt(*low, data["x"], padlen=12)
    v = np.gradient(x, 1e-3)
    columns = [np.gradient(v, 1e-3), v, np.sign(v), np.ones_like(v), data["force"]]
    rows = [signal.filtfilt(*thin, c[49:], padlen=24)[1::10] for c in columns]
    X, y = np.column_stack(rows[:4]), rows[4]
    beta = np.linalg.lstsq(X, y, rcond=None)[0]
    error = y - X @ beta
    deviation = error.std(ddof=1) * np.sqrt(np.diag(np.linalg.inv(X.T @ X)))
    return beta, deviation, 100 * float(np.linalg.norm(error) / np.linalg.norm(y))


def test_the_record_is_read_as_the_published_estimate_needs_it(emps: Record) -> None:
    beta, deviation, error = published_procedure(emps)
    np.testing.assert_allclose(beta, [v for v, _ in PUBLISHED.values()], atol=6e-5)
    np.testing.assert_allclose(deviation, [s for _, s in PUBLISHED.values()], atol=6e-4)
    assert error == pytest.approx(4.083, abs=1e-3)


@pytest.mark.parametrize(("directions", "published"), [(False, PUBLISHED), (True, DIRECTIONS)])
def test_emps_within_a_published_standard_error(
    emps: Record, directions: bool, published: dict[str, tuple[float, float]]
) -> None:
    found = linear_regression(differentiate(emps, Filter(100.0, 10, v_min=0.0)), directions)
    for name, (value, error) in published.items():
        assert abs(found.values[name] - value) < error, name
        assert found.standard_errors[name] == pytest.approx(error, rel=0.07), name
    assert found.force_relative == pytest.approx(3.112 if directions else 4.083, rel=0.06)


def regression(x: np.ndarray, force: np.ndarray, filter: Filter, *more: Record) -> LinearFit:
    units = {"x": "m", "force": "N"}
    record = Record("motion", 1e-3 * np.arange(x.size), {"x": x, "force": force}, units)
    return linear_regression([differentiate(r, filter) for r in (record, *more)])


def test_parameters_of_a_known_motion_come_back() -> None:
    t, w1, w2 = np.arange(20_000) * 1e-3, 2 * np.pi * 0.7, 2 * np.pi * 0.31
    x = 0.1 * np.sin(w1 * t) + 0.2 * np.cos(w2 * t)
    v = 0.1 * w1 * np.cos(w1 * t) - 0.2 * w2 * np.sin(w2 * t)
    a = -0.1 * w1**2 * np.sin(w1 * t) - 0.2 * w2**2 * np.cos(w2 * t)
    found = regression(x, 3 * a + 11 * v + 7 * np.sign(v) - 2, Filter(100.0, 10))
    expected = {"m": 3.0, "F_v": 11.0, "F_c": 7.0, "offset": -2.0}
    assert found.values == pytest.approx(expected, rel=1e-4)


def test_equations_at_reversals_would_bend_the_mass() -> None:
    law = Coulomb(mu_d=20.0, v_eps=1e-5)
    (record,) = synthetic_drive_data(
        law, speeds=(0.02, 0.1), dwell=0.4, position_noise=0.0, force_noise=0.0
    )
    off = [
        abs(linear_regression(differentiate(record, Filter(100.0, 10, v_min=v))).values["m"] - 95.0)
        for v in (None, 0.0)
    ]
    assert off[0] < 0.01
    assert off[1] > 10 * off[0]


def test_two_records_are_one_regression() -> None:
    t = np.arange(4_000) * 1e-3
    slow = Dataset.of(t=t, x=np.sin(3 * t), force=-18 * np.sin(3 * t))[0]
    both = regression(np.sin(7 * t), -98 * np.sin(7 * t), Filter(50.0, 5), slow)
    assert both.values["m"] == pytest.approx(2.0, rel=1e-3)


def test_one_direction_does_not_separate_the_coulomb_force_from_the_offset() -> None:
    t = np.arange(5_000) * 1e-3
    found = regression(t + 0.02 * np.sin(9 * t), 5 + np.cos(9 * t), Filter(100.0, 10))
    unknown = {n for n, error in found.standard_errors.items() if error is None}
    assert unknown == {"F_c", "offset"}
    assert found.values["F_c"] == pytest.approx(found.values["offset"], rel=1e-6)


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
    reported = Velocity.of(x, v, STEP)
    found = derivatives(x, v, STEP, PLAIN, reported)[1]
    return float(np.std((found - V)[INSIDE])), float(reported.errors(PLAIN, STEP)[0])


def test_the_mixture_is_less_noisy_than_either_and_reports_its_noise() -> None:
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
    """At w h = 0.5 it falls short by (w h)^4 / 30, and not the measured velocity too far."""
    w = 2 * np.pi * 80
    x, v = np.sin(w * T), w * (np.cos(w * T) + 1e-3 * noise(1))
    mixed, alone = (
        float(np.std((derivatives(x, y, STEP, Filter(400.0), Velocity.of(x, y, STEP))[1]
                      - w * np.cos(w * T))[INSIDE]))
        for y in (v, None)
    )  # fmt: skip
    assert alone > 0.9 * w * (w * STEP) ** 4 / 30 / np.sqrt(2)
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
    reported = Velocity.of(None, V + 0.1 * noise(0), STEP)
    assert (reported.weight == 1.0).all()
    assert reported.noise == pytest.approx(0.01, rel=0.1)


@cache
def silent() -> Record:
    law = Sum((Coulomb(mu_d=20.0, v_eps=1e-4), Viscous(sigma_2=200.0)))
    return synthetic_drive_data(law, force_noise=0.0, position_noise=0.0)[0]


@cache
def masses(position: float, velocity: float | None, seeds: int = 6) -> tuple[Array, float]:
    """Estimates of a mass of 95 kg, and their standard error."""
    clean, rate = silent(), np.gradient(silent()["x"], silent().step)
    found, errors = list[float](), list[float]()
    for seed in range(seeds):
        x, force, v = np.random.default_rng(seed).standard_normal((3, clean.size))
        signals = {"x": clean["x"] + position * x, "force": clean["force"] + 0.5 * force}
        if velocity is not None:
            signals["v"] = rate + velocity * v
        fit = linear_regression(differentiate(Dataset.of(signals, t=clean.t)[0]))
        found.append(fit.values["m"])
        errors.append(fit.standard_errors["m"] or 0.0)
    return np.array(found), float(np.mean(errors))


@pytest.mark.parametrize(
    ("position", "velocity"), sampled([(1e-5, 5e-2), (1e-6, 1e-4), (1e-5, 1e-3)], of=3)
)
def test_a_noisy_velocity_never_spoils_the_mass(position: float, velocity: float) -> None:
    alone, _ = masses(position, None)
    both, error = masses(position, velocity)
    assert abs(both.mean() - 95.0) < error
    assert np.sqrt(np.mean((both - 95.0) ** 2)) < 1.1 * np.sqrt(np.mean((alone - 95.0) ** 2))
