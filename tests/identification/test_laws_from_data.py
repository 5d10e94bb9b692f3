"""Friction curves without a formula, fitted to made-up and measured data, against formulas."""

from pathlib import Path

import numpy as np
import pytest

import symfric as sf
from identification import Dataset, Fit, Fitted, InverseDynamics, Points

EMPS = Path(__file__).resolve().parents[3] / "shared" / "data" / "EMPS" / "DATA_EMPS.mat"
NOISE = 0.02
UNITS = ((1.0, 1.0), (1e3, 1e-3), (1e-3, 1e2), (50.0, 1e-6))
"""Units of force [N] and velocity [m/s] of the data."""


def true(force: float, speed: float) -> sf.Law:
    """Return Tustin friction that falls to a half and rises again."""
    levels = {"mu_s": 0.3 * force, "mu_d": 0.15 * force, "sigma_2": 0.1 * force / speed}
    return sf.Tustin(**levels, v_s=0.01 * speed, v_eps=1e-9 * speed)


def sweep(seed: int, force: float, speed: float) -> Dataset:
    v = np.repeat(np.geomspace(1e-3, 1.0, 40), 4) * speed
    noise = 1 + NOISE * np.random.default_rng(seed).standard_normal(v.size)
    return Dataset.of(v=v, F=np.asarray(true(force, speed).force(v, 1.0)) * noise, points=True)


def falling(speed: float) -> sf.Law:
    return sf.Sum((sf.Spline.over(1e-3 * speed, speed, 8, shape="falling"), sf.Viscous()))


def error_of(fit: Fitted, law: sf.Law, speed: float) -> float:
    """Return the root mean square relative error of the curve."""
    v = np.geomspace(1e-3, 1.0, 200) * speed
    assert fit.law is not None
    ratio = np.asarray(fit.law.force(v, 1.0)) / np.asarray(law.force(v, 1.0))
    return float(np.sqrt(np.mean((ratio - 1) ** 2)))


def test_curve_is_found_at_once_as_well_as_by_the_true_formula_in_all_units() -> None:
    errors, inside = list[tuple[float, float]](), list[float]()
    for seed in range(3):
        alike: list[float] = []
        for force, speed in UNITS if seed == 0 else UNITS[:1]:
            data, law = sweep(seed, force, speed), true(force, speed)
            fit = Fit(Points(), falling(speed), data).solve()
            assert len(fit.starts) == 1
            assert fit.starts[0].evaluations <= 10
            by_formula = Fit(Points(), "tustin", data).solve()
            alike.append(error_of(fit, law, speed))
            errors.append((alike[-1], error_of(by_formula, law, speed)))
            assert fit.curve is not None
            v, y = fit.curve.law.t, fit.curve.law.y
            measured = np.abs(v) >= 1e-3 * speed
            apart = np.abs(y - np.asarray(law.force(v, 1.0)))
            inside.append(float((apart <= fit.curve.half)[measured].mean()))
        assert alike == pytest.approx([alike[0]] * len(alike), rel=1e-2)
    spline, formula = np.mean(errors, axis=0)
    assert spline < 0.4 * NOISE
    assert spline < 2.5 * formula
    assert np.mean(inside) > 0.85


def test_a_wrong_formula_predicts_worse_than_a_spline() -> None:
    data, law = sweep(4, 1.0, 1.0), true(1.0, 1.0)
    free = Fit(Points(), sf.Spline.over(1e-3, 1.0, 12), data).solve(throw=False)
    gaussian = Fit(Points(), "stribeck", data).solve(throw=False)
    assert error_of(free, law, 1.0) < 0.3 * error_of(gaussian, law, 1.0)


@pytest.mark.parametrize(("count", "starts"), [(1, 2), pytest.param(2, 12, marks=pytest.mark.slow)])
def test_a_trained_network_is_near_the_true_curve_in_all_units(count: int, starts: int) -> None:
    """Without an interval for a weight that the data do not determine, and then without a band."""
    for force, speed in UNITS[1:2] if count == 1 else UNITS:
        law, made = true(force, speed), sf.Network.over(1e-3 * speed, speed, count)
        data = sweep(0, force, speed)
        fit = Fit(Points(), made, data, free=made.weights, starts=starts).solve(throw=False)
        assert error_of(fit, law, speed) < (0.012 if count == 1 else 0.008)
        weights = [e for n, e in fit.parameters.items() if n in made.weights]
        assert fit.curve is not None
        unknown = [e for e in weights if e.high is None and not e.fixed]
        assert not (unknown and fit.curve.half.size) or count == 1


def test_coefficients_without_data_are_reported() -> None:
    fit = Fit(Points(), sf.Spline.over(1e-6, 1.0, 14), sweep(0, 1.0, 1.0)).solve(throw=False)
    assert fit.parameters["c_1"].high is None
    assert "c_1" in str(fit)
    assert fit.status.name == "DOUBTFUL"


@pytest.mark.slow
def test_a_measured_drive_is_predicted_as_well_as_by_brown_mcphee() -> None:
    if not EMPS.is_file():
        pytest.skip("the EMPS records are not on this machine (../shared/data/EMPS)")
    data = Dataset.read(str(EMPS))

    def left(law: sf.Law) -> float:
        fit = Fit(InverseDynamics(), law, data).solve(throw=False)
        return next(iter(fit.errors.values())).relative

    bm, spline = sf.BrownMcPhee(mu_v=1.0), sf.Spline.over(0.015, 0.11, 6)
    assert left(spline) < 1.02 * left(bm)
    assert left(sf.Asymmetric(spline, spline)) < left(sf.Asymmetric(bm, bm))
