"""The estimator equals dense least squares on linear models, and estimates bristles and loads."""

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import lsq_linear

from ocp import Estimate, estimate
from symfric import BrownMcPhee, Contact, LuGre, Model, Output, SolveError, Variable, simulate
from symfric.integrator import Hold

STEP = 0.05
RATES = np.array([[0.0, 1.0, 0.0], [-4.0, -0.3, 1.0], [0.0, 0.0, 0.0]])
"""Of position, velocity and load of a mass with spring and damper."""
NOISE = {"x": 0.1, "v": 0.2, "load": 0.5}
WALK = np.array([0.03, 0.2, 0.5])


def oscillator(loads: int = 1) -> Model:
    x, v, f = Variable("x", "m"), Variable("v", "m/s"), Variable("f", "N")
    w = [Variable(name, "N") for name in ("load", "other")[:loads]]
    force = f.symbol + sum(a.symbol for a in w) - 4.0 * x.symbol - 0.3 * v.symbol
    seen = {"seen": Output(x.symbol, "m")}
    return Model("oscillator", x=(x, v), u=(f, *w), ode=ca.vertcat(v.symbol, force), outputs=seen)


def rows_of(f: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return matrix and right side of the least-squares problem in all states."""
    n = y.size
    whole = expm(STEP * np.block([[RATES, np.array([[0.0], [1.0], [0.0]])], [np.zeros((1, 4))]]))
    A, b = whole[:3, :3], whole[:3, 3]
    rows, right = np.zeros((3 + 3 * (n - 1) + n, 3 * n)), np.zeros(3 + 3 * (n - 1) + n)
    rows[:3, :3] = np.eye(3)
    for k in range(n - 1):
        here, weight = slice(3 + 3 * k, 6 + 3 * k), 1 / (WALK * np.sqrt(STEP))[:, None]
        rows[here, 3 * k : 3 * k + 3] = -weight * A
        rows[here, 3 * k + 3 : 3 * k + 6] = weight * np.eye(3)
        right[here] = weight[:, 0] * b * f[k]
    for k in np.flatnonzero(np.isfinite(y)):
        rows[3 * n + k, 3 * k], right[3 * n + k] = 1 / NOISE["x"], y[k] / NOISE["x"]
    return rows, right


def dense(f: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return all states (n, 3) of the least-squares problem, and the deviations of the last one."""
    n, (rows, right) = y.size, rows_of(f, y)
    inverse = np.linalg.inv(rows.T @ rows)
    return (inverse @ rows.T @ right).reshape(n, 3), np.sqrt(np.diag(inverse)[-3:])


def measured(n: int) -> tuple[np.ndarray, np.ndarray]:
    y = 0.1 * np.random.default_rng(2).standard_normal(n) + 0.3
    y[[4, 5, n - 2]] = np.nan
    return np.sin(np.arange(n)), y


def estimated(f: np.ndarray, y: np.ndarray, horizon: int) -> Estimate:
    noise = {"seen": NOISE["x"], "x": 0.03, "v": 0.2, "load": 0.5}
    data = {"f": f, "seen": y}
    return estimate(
        oscillator(), data, step=STEP, horizon=horizon, noise=noise, unknown=["load"]
    )  # fmt: skip


def test_bounds_are_those_of_bounded_least_squares() -> None:
    """The whole horizon against a dense solver with bounds; the load is at most 0.2 N."""
    f, y = measured(12)
    n, loads = y.size, slice(2, None, 3)
    A, b = rows_of(f, y)
    low, high = np.full(3 * n, -np.inf), np.full(3 * n, np.inf)
    high[loads] = 0.2
    dense_states = lsq_linear(A, b, (low, high), tol=1e-12, method="bvls").x.reshape(n, 3)
    noise = {"seen": NOISE["x"], "x": 0.03, "v": 0.2, "load": 0.5}
    given = {"step": STEP, "horizon": n, "noise": noise, "unknown": ["load"]}
    found = estimate(
        oscillator(), {"f": f, "seen": y}, bounds={"load": (None, 0.2)}, **given
    )  # fmt: skip
    free = estimate(oscillator(), {"f": f, "seen": y}, **given)
    assert free.smooth["load"].max() > 0.25
    assert (found["load"] <= 0.2).all()
    for i, name in enumerate(("x", "v", "load")):
        np.testing.assert_allclose(found.smooth[name], dense_states[:, i], atol=1e-4)
        np.testing.assert_allclose(found.deviations[name], free.deviations[name])
    with pytest.raises(ValueError, match=r"expected bounds of 'load' as \(lower, upper\)"):
        estimate(oscillator(), {"f": f, "seen": y}, bounds={"load": (2.0, 1.0)}, **given)


def test_a_whole_horizon_is_the_least_squares_solution() -> None:
    f, y = measured(25)
    states, deviations = dense(f, y)
    found = estimated(f, y, horizon=25)
    for i, name in enumerate(("x", "v", "load")):
        assert found.smooth[name] == pytest.approx(states[:, i], abs=1e-6)
        assert found.deviations[name][-1] == pytest.approx(deviations[i], rel=1e-6)
    assert found.unconverged == 0


def test_each_estimate_is_that_of_all_data_so_far() -> None:
    """The arrival cost keeps what left the horizon."""
    f, y = measured(25)
    found = estimated(f, y, horizon=4)
    for k in (1, 6, 13, 24):
        states, deviations = dense(f[: k + 1], y[: k + 1])
        got = [found[name][k] for name in ("x", "v", "load")]
        assert got == pytest.approx(states[-1].tolist(), abs=1e-6)
        assert found.deviations["load"][k] == pytest.approx(deviations[2], rel=1e-6)
    assert found.smooth["x"].size == 4


def test_an_estimate_draws_its_signals_with_units() -> None:
    found = estimated(*measured(9), horizon=4)
    axes = found.plot("x", "load").axes
    assert [axis.get_ylabel() for axis in axes] == ["x [m]", "load [N]"]
    assert axes[1].lines[0].get_ydata() == pytest.approx(found["load"])
    assert len(repr(found)) < 1000


@pytest.mark.slow
def test_bristles_and_a_load_are_estimated_from_positions() -> None:
    x, v = Variable("x", "m", nominal=0.1), Variable("v", "m/s", nominal=0.1)
    motor, load = Variable("motor", "N"), Variable("load", "N")
    law = LuGre(mu_s=6.0, mu_d=4.0, v_s=0.05, sigma_0=1e4, sigma_1=200.0, sigma_2=0.5)
    guide = Contact("guide", v, 1.0, law)
    ode = ca.vertcat(v, motor - load - guide.force)
    plant = Model("axis", x=(x, v), u=(motor, load), ode=ode, contacts=(guide,))
    t = 0.01 * np.arange(110)
    push, weight = 10.0 * np.sin(4.0 * t), 2.0 * (t > 0.5)
    true = simulate(plant, t[-1], u={"motor": Hold(t, push), "load": Hold(t, weight)}, t_eval=t)
    errors, late = [], t > 0.7
    for seed in range(2):
        seen = true["x"] + 1e-5 * np.random.default_rng(seed).standard_normal(t.size)
        found = estimate(
            plant, {"motor": push, "x": seen}, step=0.01, horizon=8, unknown=["load"],
            noise={"x": 1e-5, "load": 5.0}, spread={"x": 1e-4, "v": 1e-3, "guide_z": 1e-4},
        )  # fmt: skip
        assert (found.unconverged, found.unobservable) == (0, ())
        errors.append((found["load"] - weight)[late] / found.deviations["load"][late])
        assert np.abs(found["guide_z"] - true["guide_z"])[late].max() < 0.02 * 6e-4
        assert np.abs(found["v"] - true["v"])[late].max() < 0.02
    assert 0.1 < np.sqrt(np.mean(np.square(errors))) < 1.5


def axis(mass: float, v_t: float) -> Model:
    x, v = Variable("x", "m", nominal=0.1), Variable("v", "m/s", nominal=0.1)
    motor, load = Variable("motor", "N"), Variable("load", "N")
    guide = Contact("guide", v, 1.0, BrownMcPhee(mu_s=4.0, mu_d=3.0, v_t=v_t))
    ode = ca.vertcat(v, (motor - load - guide.force) / mass)
    return Model("axis", x=(x, v), u=(motor, load), ode=ode, contacts=(guide,))


@pytest.mark.parametrize(
    ("mass", "v_t", "holds"),
    [(1.0, 0.01, True), (1.5, 0.01, False), pytest.param(1.0, 1e-4, False, marks=pytest.mark.slow)],
)
def test_deviations_hold_unless_the_verdict_says_that_they_do_not(
    mass: float, v_t: float, holds: bool
) -> None:
    """Reversals of a regularised law, from positions; then a heavier mass, and a sharper law."""
    t, random = 0.01 * np.arange(80 if holds else 120), np.random.default_rng(0)
    plant, believed = axis(mass, v_t), axis(1.0, 0.01)
    push = (8 + 4 * random.random()) * np.sin((3 + 2 * random.random()) * t)
    load = 0.1 * np.cumsum(random.standard_normal(t.size))
    u = {"motor": Hold(t, push), "load": Hold(t, load)}
    true = simulate(plant, t[-1], u=u, t_eval=t)
    data = {"motor": push, "x": true["x"] + 1e-5 * random.standard_normal(t.size)}
    found = estimate(
        believed, data, step=0.01, horizon=8, unknown=["load"],
        noise={"x": 1e-5, "load": 1.0}, spread={"x": 1e-4, "v": 1e-2, "load": 1.0},
    )  # fmt: skip
    assert (found.inconsistent.size == 0) == holds, found.verdict
    assert ("do not hold" in found.verdict) == (not holds)
    if holds:  # deviations contain the errors of the integration, which are not small
        errors = np.abs(found["v"] - true["v"]) / found.deviations["v"]
        assert 1e-4 < found.step_errors["v"] < 0.1
        assert np.mean(errors < 2) > 0.9 and errors.max() < 6


def test_a_parameter_that_drifts_is_estimated_like_an_unknown_input() -> None:
    """The load as a parameter, which starts at its value in `p`."""
    f, y = measured(15)
    given: dict[str, Any] = {"step": STEP, "horizon": 5, "noise": {"x": 0.01, "load": 0.1}}
    model = oscillator()
    push, load = model.u
    wear = replace(model, u=(push,), p=(load,))
    wanted = estimate(model, {"f": f, "x": y}, unknown=["load"], start={"load": 0.7}, **given)
    found = estimate(wear, {"f": f, "x": y}, unknown=["load"], p={"load": 0.7}, **given)
    assert found["load"] == pytest.approx(wanted["load"], rel=1e-12)
    assert found.deviations["load"] == pytest.approx(wanted.deviations["load"], rel=1e-12)
    known = estimate(wear, {"f": f, "x": y}, p={"load": 0.7}, **given | {"noise": {"x": 0.01}})
    assert "load" not in known.signals


def test_combinations_that_data_do_not_determine_are_reported() -> None:
    f, y = measured(20)
    noise = {"x": 0.01, "load": 0.1, "other": 0.1}
    found = estimate(
        oscillator(2), {"f": f, "x": y}, step=STEP, horizon=5, noise=noise,
        unknown=("load", "other"),
    )  # fmt: skip
    (text,) = found.unobservable
    assert text in ("1 load - 1 other", "- 1 load + 1 other")
    sum_of_both = estimate(
        oscillator(), {"f": f, "x": y}, step=STEP, horizon=5, noise={"x": 0.01, "load": 0.1},
        unknown=("load",),
    )  # fmt: skip
    assert sum_of_both.unobservable == ()


def test_the_verdict_claims_no_more_than_the_samples_show() -> None:
    given: dict[str, Any] = {"step": STEP, "horizon": 3, "unknown": ["load"]}
    given |= {"noise": {"x": 0.1, "load": 0.5}}
    zero, none = np.zeros(9), np.full(9, np.nan)
    missing = estimate(oscillator(), {"f": zero, "x": none}, **given)
    assert (missing.samples, missing.verdict) == (0, "There is no sample to compare with the model")
    exact = estimate(oscillator(), {"f": zero, "x": zero}, **given)
    assert exact.samples == 9 and "no sample" not in exact.verdict
    assert "at 2 of 9 samples" in replace(exact, unconverged=2).verdict
    quiet = replace(exact, unobservable=())
    assert quiet.verdict == "The innovations do not exceed those of the noise"


def test_a_motion_that_becomes_infinite_is_an_error() -> None:
    x = Variable("x", "m")
    model = Model("runaway", x=(x,), ode=x.symbol**3)
    with pytest.raises(SolveError, match="became infinite"):
        estimate(model, {"x": np.full(9, 1e3)}, step=10.0, horizon=3, noise={"x": 1e-3}, steps=20)
