"""Verdicts of simulated fits on the law that made the data, and on another one."""

import numpy as np
import pytest

from identification.data.dataset import Dataset
from identification.data.synthetic import synthetic_drive_data
from identification.fit import Fit
from identification.residuals.closed_loop import ClosedLoop
from identification.residuals.shooting import Shooting
from identification.unknowns.subject import subject
from symfric import GMS, simulate
from symfric.foundation.status import Status
from symfric.integrator import Linear
from symfric.scenes import Drive

LAW = GMS(mu_s=1.2, mu_d=1.0)
NOISE = 2e-7
"""Standard deviation of the position [m]."""


def gms_data() -> Dataset:
    """Pre-sliding loops within loops, then sliding with reversals; 1 kHz, 0.6 s, mass 1 kg."""
    t = np.arange(0.0, 0.6, 1e-3)
    force = 0.9 * np.sin(2 * np.pi * 8 * t) * np.minimum(1, 0.3 + 2 * t)
    force = force + 0.35 * np.sin(2 * np.pi * 41 * t) + 0.9 * (t > 0.45) * np.sin(60 * (t - 0.45))
    run = simulate(
        Drive(LAW, m=1.0, N=1.0).model(), float(t[-1]), t_eval=t, rtol=1e-8,
        u={"force": Linear(t, force)},
    )  # fmt: skip
    x = run["x"] + NOISE * np.random.default_rng(0).standard_normal(t.size)
    return Dataset.of(t=t, x=x, force=force, units={"x": "m", "force": "N"}, name="gms")


def test_the_law_that_made_the_data_is_believed_and_another_one_is_not() -> None:
    data = synthetic_drive_data(speeds=(0.01, 0.05), dwell=0.4, force="command")
    fit = Fit(ClosedLoop(), "stribeck", data, starts=1, fixed={"v_eps": 1e-4}).solve()
    mass = fit.parameters["m"]
    assert fit.status is Status.SOLVED
    assert abs(mass.value - 95.0) < mass.standard_error < 0.02
    other = Fit(ClosedLoop(), "coulomb+viscous", data, starts=1).solve(throw=False)
    assert other.status is Status.DOUBTFUL


@pytest.mark.slow
@pytest.mark.parametrize(("width", "status"), [(1e-4, Status.SOLVED), (8e-5, Status.DOUBTFUL)])
def test_mass_has_no_bias(width: float, status: Status) -> None:
    """Also if the law is held at another width of its step [m/s] than made the data: 1e-4."""
    errors, fixed = list[float](), {"v_eps": width}
    for seed in range(10):
        data = synthetic_drive_data(speeds=(0.004, 0.02, 0.08), seed=seed, force="command")
        fit = Fit(ClosedLoop(), "stribeck", data, starts=1, fixed=fixed).solve(throw=False)
        mass = fit.parameters["m"]
        assert fit.status is status
        errors.append((mass.value - 95.0) / mass.standard_error)
    assert abs(sum(errors)) / len(errors) < 1.0


def test_the_law_that_made_the_data_leaves_their_noise() -> None:
    drive = Drive(LAW, m=1.0, N=1.0)
    made = subject(drive, free=["k_1"], fixed="others")
    found = Shooting(x0="given").prepare(made, gms_data(), {"k_1": 50000.0})
    there = found.at(np.array([50000.0]))
    assert np.std(there.r) == pytest.approx(NOISE, rel=0.1)


@pytest.mark.slow
def test_lugre_fitted_to_generalised_maxwell_slip_is_doubtful() -> None:
    known = {"m": 1.0, "offset": 0.0}
    fit = Fit(Shooting(x0="given"), "lugre", gms_data(), fixed=known).solve()
    assert fit.status is Status.DOUBTFUL
    assert not fit.verdict.good
    assert fit.errors["gms", "x"].rms > 10 * NOISE
