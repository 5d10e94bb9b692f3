"""Tests of residuals: false alarms, and what they find; records that begin loaded."""

from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from linear_fits import ar1, coulomb, fitted, motion
from tables import sampled

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.points import Points
from identification.verdict.colour import positions, whiteness
from identification.verdict.judge import ALARM, judge
from symfric import LuGre
from symfric.foundation.status import Status

TRUTH = [2.0, 3.0, 1.0, 0.5]


@pytest.mark.parametrize(("n", "rho"), [(300, 0.0), (1000, 0.9)])
def test_right_models_are_seldom_doubted(n: int, rho: float) -> None:
    J = coulomb(n)
    right = J @ TRUTH
    noise = [ar1(n, rho, seed) for seed in range(16)]
    assert sum(not judge(fitted(J, right + e)).good for e in noise) <= 1


@pytest.mark.parametrize("rho", [0.0, 0.9])
@pytest.mark.parametrize(
    ("missing", "named"),
    [
        (lambda m: np.sign(m["v"]) * np.exp(-np.abs(m["v"] / 0.1)), "speed"),  # Stribeck
        (lambda m: np.cos(2 * np.pi * m["x"] / np.ptp(m["x"]) * 2), "position"),  # ripple
        (lambda m: np.roll(m["force"], 8), "force"),  # a delay
        (lambda m: np.abs(coulomb(m["v"].size) @ TRUTH) / 4, "predicted force"),  # a gain
    ],
)
def test_what_is_missing_is_named(
    missing: Callable[[dict[str, np.ndarray]], np.ndarray], named: str, rho: float
) -> None:
    m = motion(2000)
    J = coulomb(2000)
    found = judge(fitted(J, 3 * J @ TRUTH + ar1(2000, rho, 1) + 1.5 * missing(m)))
    assert not found.good
    failed = [t for t in found.tests if t.decides and not t.passed]
    assert any(named in t.name for t in failed)
    assert failed[0].p < ALARM


def test_noise_of_the_acceleration_is_no_model_error() -> None:
    """Past accelerations explain residuals that contain their noise, but also a true lag."""
    n, m = 2000, motion(2000)
    known = 5.0 * (m["v"] - np.roll(m["v"], 1))
    noise = 0.3 * np.random.default_rng(5).standard_normal(n)
    J = np.column_stack([coulomb(n), known + noise])
    for lag, good in ((0.0, True), (2.0, False)):
        late = lag * np.roll(noise, 16) + 0.01 * ar1(n, 0.0, 2)
        found = fitted(
            J, J @ [*TRUTH, 1.0] + late + np.roll(noise, 8), regressors={"a": known + noise}
        )
        (channel,) = found.channels
        level = replace(channel, motion_noise=float(np.std(noise)))
        assert not judge(found).good
        assert judge(replace(found, channels=(level,))).good is good


def test_rounding_is_no_model_error() -> None:
    """Of noise-free data what is left depends on everything, and means nothing."""
    J, v = coulomb(1000), motion(1000)["v"]
    right = J @ TRUTH
    assert judge(fitted(J, right + 1e-4 * np.sign(v) * v**2)).good
    assert not judge(fitted(J, right + 1.0 * np.sign(v) * v**2)).good
    assert judge(fitted(J, np.round(right, 2))).good
    assert judge(fitted(J, right)).good


def test_noise_that_was_given_is_a_yardstick() -> None:
    J = coulomb(500)
    e = J @ TRUTH + ar1(500, 0.0, 2)
    assert judge(fitted(J, e, noise={"force": 1.0})).good
    found = judge(fitted(J, e, noise={"force": 0.5}))
    assert [t.name for t in found.tests if t.decides and not t.passed] == ["size"]


def test_whiteness_keeps_its_level_in_short_records() -> None:
    """Forty samples, eight unknowns: without moments of the projection a third is rejected."""
    n, k, rejected = 40, 8, 0
    J = np.cos(np.outer(np.arange(n), np.arange(k)) * 0.2)
    channel = fitted(J, ar1(n, 0.0, 0), regressors={}).channels[0]
    for seed in range(200):
        r = fitted(J, ar1(n, 0.0, seed), regressors={}).r
        rejected += whiteness(r, J, positions(channel)).p < 0.05
    assert rejected <= 24
    coloured = fitted(J, ar1(n, 0.9, 1), regressors={}).r
    assert whiteness(ar1(400, 0.5, 1), np.ones((400, 1)), np.arange(400)).p < 1e-6
    assert whiteness(coloured, J, np.zeros(n, dtype=int)).lags.size == 0


def test_coloured_residuals_are_as_large_as_their_noise() -> None:
    """The mean square of 400 samples of AR(1) 0.9 scatters as that of few independent ones."""
    J, level = coulomb(400)[:, :1], 1 / np.sqrt(1 - 0.9**2)
    failed = 0
    for seed in range(8):
        found = judge(fitted(J, ar1(400, 0.9, seed), noise={"force": level}))
        failed += any(t.name == "size" and not t.passed for t in found.tests)
    assert failed <= 1


LAW = LuGre(mu_s=0.3, mu_d=0.2, v_s=0.01, sigma_0=1e4, sigma_1=30.0, sigma_2=0.5)
STEP, PARTS = 1e-3, 10


def record(z: float) -> Dataset:
    """Slow first, then back and forth; the bristle begins bent by `z` [m] (midpoint rule)."""
    t = STEP * np.arange(1500)
    v = 0.03 * np.sin(2 * np.pi * 0.7 * t) * t / (t + 0.2)
    a, b, bent = (ca.SX.sym(name) for name in ("a", "b", "z"))
    rate = ca.Function("rate", [a, bent], [ca.SX(LAW.rate(a, 1.0, bent))])
    force = ca.Function("force", [a, bent], [ca.SX(LAW.force(a, 1.0, bent))])
    end, h = bent, STEP / PARTS
    for k in range(PARTS):
        speed = a + (b - a) * (k + 0.5) / PARTS
        end = end + h * rate(speed, end + h / 2 * rate(speed, end))
    step = ca.Function("step", [bent, a, b], [end])
    path = step.mapaccum(t.size - 1)(z, v[:-1], v[1:]).full().ravel()
    F = force(v[None, :], np.append(z, path)[None, :]).full().ravel()
    noise = 2e-3 * np.random.default_rng(0).standard_normal(t.size)
    return Dataset.of(t=t, v=v, F=F + noise, units={"v": "m/s", "F": "N"})


@pytest.mark.parametrize("load", sampled([-1.0, 0.0, 0.4], of=2))
def test_the_load_at_the_begin_of_a_record_is_estimated(load: float) -> None:
    fit = Fit(Points(), "lugre", record(load * 0.2 / 1e4), starts=1).solve(throw=False)
    assert fit.status is Status.SOLVED
    assert fit.parameters["preload[0]"].value == pytest.approx(load, abs=0.06)
