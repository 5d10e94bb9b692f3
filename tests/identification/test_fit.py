"""One question to data: points and motions, bad arguments, other processes, what is kept."""

import os
import subprocess
import sys
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.special import stdtrit

from identification.data.dataset import Dataset
from identification.data.synthetic import synthetic_drive_data
from identification.fit import Fit
from identification.residuals.inverse import InverseDynamics
from identification.residuals.points import Points
from identification.residuals.shooting import Shooting
from identification.solving.task import Point
from identification.unknowns.spec import above, log, tied
from identification.verdict.covariance import bend
from symfric import Model, Variable, contact, simulate
from symfric.foundation.status import SolveError, Status
from symfric.laws import Coulomb, Dahl, Stribeck, Sum, Viscous
from symfric.laws.composed.populations import steady_force

TRUTH = {"mu_s": 3.0, "mu_d": 2.0, "v_s": 0.01, "sigma_2": 4.0}
NOISE = 0.02


def points(seed: int = 0, **other: float) -> Dataset:
    law = Stribeck(**(TRUTH | other), v_eps=1e-5)
    speeds = np.geomspace(1e-4, 0.3, 60)
    v = np.concatenate([speeds, -speeds])
    F = np.array([float(law.force(x, 1.0)) for x in v])
    noise = NOISE * np.random.default_rng(seed).standard_normal(v.size)
    return Dataset.of(v=v, F=F + noise, points=True)


def test_points_give_the_curve_back_within_their_noise() -> None:
    fit = Fit(Points(), "stribeck", points()).solve()
    assert fit.status is Status.SOLVED
    for name, value in TRUTH.items():
        found = fit.parameters[name]
        assert abs(found.value - value) < 4 * found.standard_error
    assert fit.noise["F"] == pytest.approx(NOISE, rel=0.2)
    assert isinstance(fit.law, Stribeck) and fit.law.mu_s >= fit.law.mu_d
    slowest = np.quantile(np.abs(points()[0]["v"]), 0.01)  # narrows the smoothing
    assert fit.parameters["v_eps"].value == pytest.approx(0.1 * slowest, rel=1e-12)


def test_the_band_of_a_linear_law_is_that_of_the_regression() -> None:
    v = np.concatenate([np.linspace(0.01, 0.3, 30), np.linspace(-0.2, -0.01, 20)])
    X = np.column_stack([np.sign(v), v])
    F = X @ [0.5, 2.0] + NOISE * np.random.default_rng(0).standard_normal(v.size)
    found = Fit(Points(), "coulomb+viscous", Dataset.of(v=v, F=F, points=True)).solve().curve
    _, left, *_ = np.linalg.lstsq(X, F, rcond=None)
    C = left[0] / (v.size - 2) * np.linalg.inv(X.T @ X)
    assert found is not None
    fast = np.abs(found.law.t) > 0.01
    x = np.column_stack([np.sign(found.law.t), found.law.t])[fast]
    wanted = stdtrit(v.size - 2, 0.975) * np.sqrt(np.einsum("ij,jk,ik->i", x, C, x))
    np.testing.assert_allclose(found.half[fast], wanted, rtol=1e-6)


def test_a_wrong_law_is_doubtful_and_no_error() -> None:
    fit = Fit(Points(), "coulomb+viscous", points()).solve()
    assert fit.status is Status.DOUBTFUL
    assert "measured velocity" not in fit.message


def test_specs_reach_the_result() -> None:
    data = points()
    fixed = Fit(Points(), "stribeck", data, fixed={"sigma_2": 4.0}, starts=1).solve()
    assert fixed.parameters["sigma_2"].fixed
    bound = Fit(Points(), "stribeck", data, free={"mu_s": (2.0, 2.5)}, starts=1).solve()
    assert bound.parameters["mu_s"].value == pytest.approx(2.5, rel=1e-3)
    rule = tied(lambda p: 1.5 * p["mu_d"])
    held = Fit(Points(), "stribeck", data, free={"mu_s": rule}, starts=1).solve()
    assert held.parameters["mu_s"].value == pytest.approx(1.5 * held.parameters["mu_d"].value)
    free = {"mu_s": above("mu_d"), "delta": log(0.5, 5)}
    ordered = Fit(Points(), "stribeck", data, free=free, starts=1).solve()
    assert ordered.parameters["delta"].value == pytest.approx(2.0, rel=0.1)


def test_progress_is_reported_after_each_start() -> None:
    """A linear law has one minimum, and needs one start."""

    def reported(law: str) -> list[tuple[str, float]]:
        found = list[tuple[str, float]]()
        Fit(Points(), law, points(), starts=4).solve(
            progress=lambda text, done: found.append((text, done)), throw=False
        )
        return found

    found = reported("stribeck")
    assert {("start 1 of 4", 0.25), ("start 2 of 4, evaluation 2", 0.25)} <= {*found}
    assert [done for _, done in found] == sorted(done for _, done in found)
    found = reported("coulomb+viscous")
    assert found[0] == ("start 1 of 1, evaluation 2", 0.0)
    assert ("start 1 of 1", 1.0) in found and found[-1] == ("verdict and intervals", 1.0)


def motion(law: Any, m: float = 2.0) -> Dataset:
    """A drive under a chirp of force, its motion by its own inverse: exact but for sampling."""
    t = np.arange(0, 4, 1e-3)
    x = 0.05 * np.sin(2 * np.pi * 0.7 * t) + 0.02 * np.sin(2 * np.pi * 1.9 * t)
    v, a = np.gradient(x, t), np.gradient(np.gradient(x, t), t)
    F = np.array([float(law.force(float(s), 1.0)) for s in v])
    noise = 0.02 * np.random.default_rng(1).standard_normal(t.size)
    return Dataset.of(t=t, x=x, force=m * a + F + noise)


def test_inverse_dynamics_finds_mass_and_friction() -> None:
    truth = Sum((Coulomb(mu_d=1.5, v_eps=1e-3), Viscous(sigma_2=2.0)))
    fit = Fit(InverseDynamics(), "coulomb+viscous", motion(truth)).solve(throw=False)
    assert fit.parameters["m"].value == pytest.approx(2.0, rel=0.01)
    assert fit.parameters["mu_d"].value == pytest.approx(1.5, rel=0.02)
    assert fit.parameters["sigma_2"].value == pytest.approx(2.0, rel=0.05)


def test_what_the_kind_takes_out_of_free() -> None:
    fit = Fit(Shooting(), "lugre", motion(Coulomb(mu_d=1.0)), free={"x0": "given"})
    assert fit.prepared().task.unknowns.nuisance == ()


def test_a_fit_without_convergence_reports_it_and_returns_its_best_point() -> None:
    with pytest.raises(SolveError) as caught:
        Fit(Points(), "stribeck", points(), start="law", starts=1, evaluations=2).solve()
    assert caught.value.status is Status.MAX_ITERATIONS
    assert caught.value.partial.parameters["mu_d"].value > 0


def test_a_static_level_that_no_point_comes_near_is_not_identifiable() -> None:
    """Points from twice the Stribeck velocity on: the level is read off a curve far beyond them."""
    v = np.linspace(0.02, 0.2, 200)
    v = np.concatenate([-v, v])
    for mu_s, note in ((5.0, "not identifiable: far above all forces"), (0.15, "")):
        F = steady_force(Stribeck(mu_s=mu_s, mu_d=0.1, v_s=0.01), v, 1.0)
        F = F + 1e-4 * np.random.default_rng(0).standard_normal(v.size)
        data = Dataset.of(v=v, F=F, points=True, units={"v": "m/s", "F": "N"})
        fit = Fit(Points(), "stribeck", data).solve()
        found = fit.parameters["mu_s"]
        assert found.note == note
        assert (found.standard_error is None) == bool(note)
        assert ("mu_s is not identifiable: no friction force" in str(fit)) == bool(note)
        assert fit.parameters["mu_d"].standard_error


def test_outliers_that_the_loss_allows_for_do_not_make_given_noise_too_small() -> None:
    rng = np.random.default_rng(0)
    v = np.tile(np.linspace(0.01, 0.2, 100), 2) * np.repeat([1.0, -1.0], 100)
    F = 5.0 * np.sign(v) + 8.0 * v + 0.05 * rng.standard_normal(v.size)
    F[rng.choice(v.size, 20, replace=False)] += rng.choice([-2.0, 2.0], 20)
    data = Dataset.of(v=v, F=F, units={"v": "m/s", "F": "N"}, points=True)
    for loss, status in (("huber", Status.SOLVED), ("squares", Status.DOUBTFUL)):
        fit = Fit(Points(), "coulomb+viscous", data, noise={"F": 0.05}, loss=loss)
        assert fit.solve(throw=False).status is status, loss


def test_a_fit_of_bristles_at_the_measured_velocity_recommends_simulation() -> None:
    data = synthetic_drive_data(seed=1, rate=250.0, speeds=(0.01, 0.05))  # a peak, no states
    fit = Fit(InverseDynamics(), Dahl(), data, free=["mu_d"], starts=1).solve(throw=False)
    assert fit.status is Status.DOUBTFUL
    assert "The states of Dahl follow the measured velocity" in fit.message
    assert "Fit(Shooting(windows=1.0), ...)" in fit.message


SCRIPT = """
from identification import Filter, Fit, InverseDynamics, synthetic_drive_data
kind = InverseDynamics(filter=Filter(100.0, 1), dead_time=None)
data = synthetic_drive_data(speeds=(0.05,), rate=500.0)
fit = Fit(kind, "stribeck", data, starts=1).solve(throw=False)
print(" ".join(e.value.hex() for e in fit.parameters.values()))
print(" ".join((e.standard_error or 0.0).hex() for e in fit.parameters.values()))
print(" ".join(s.hex() for s in fit.noise.values()), fit.evaluations)
"""


@pytest.mark.slow
def test_processes_side_by_side_agree_to_the_bit(capsys: pytest.CaptureFixture[str]) -> None:
    """Whatever the number of threads of BLAS, which divides sums of more than 10 000 rows only."""
    exec(SCRIPT)
    here = capsys.readouterr().out
    threads = {"OPENBLAS_NUM_THREADS": "2", "OMP_NUM_THREADS": "2"}
    there = subprocess.run(
        [sys.executable, "-c", SCRIPT], env=os.environ | threads, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    assert here == there.stdout and here.strip()


@pytest.mark.parametrize(("N", "mu_s", "v_s", "rate"), [(50, 0.2, 0.05, 1000), (9, 0.3, 0.1, 600)])
def test_intervals_of_simulated_records_contain_the_truth(
    N: float, mu_s: float, v_s: float, rate: int
) -> None:
    """The acceleration jumps at reversals, where the static level is determined."""
    law = Stribeck(mu_s=mu_s, mu_d=0.15, v_s=v_s)
    x, v, force = Variable("x", "m"), Variable("v", "m/s"), Variable("force", "N")
    guide = contact("guide", law, v, N)
    stage = Model(
        "stage", x=(x, v), u=(force,), ode=ca.vertcat(v, (force - guide.force) / 3.0),
        contacts=(guide,),
    )  # fmt: skip
    push = {"force": lambda t: N * (0.4 * ca.sin(6 * t) + 0.3 * ca.sin(17 * t))}
    run = simulate(stage, 5.0, u=push, samples=5 * rate + 1)
    data = Dataset.of(t=run.t, x=run["x"], v=run["v"], force=run["force"])
    fit = Fit(InverseDynamics(), "stribeck", data, normal_force=N).solve()
    assert fit.status is Status.SOLVED
    for name, value in {"m": 3.0, "mu_s": mu_s, "mu_d": 0.15, "v_s": v_s}.items():
        found = fit.parameters[name]
        assert found.low is not None and found.high is not None
        assert found.low <= value <= found.high
        assert found.value == pytest.approx(value, rel=0.01)


def test_an_interval_beyond_the_range_of_a_scale_is_not_linear() -> None:
    made = Fit(Points(), "stribeck", points()).prepared()
    point = made.task.at(made.centre)
    assert isinstance(point, Point)
    names = made.task.unknowns.fitted
    for name, leaves in {"v_s": True, "sigma_2": False}.items():
        step = 20.0 * (np.array(names) == name)  # a factor of e^20 of a velocity
        assert np.isinf(bend(made.task, point, step)) == leaves
