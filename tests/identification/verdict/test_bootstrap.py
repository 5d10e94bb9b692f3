"""Errors of a design against differences, and of the bootstrap against the linear theory."""

from concurrent.futures import ThreadPoolExecutor
from math import log

import casadi as ca
import numpy as np
import pytest
from tables import sampled

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.points import Points
from identification.result.fitted import Fitted
from identification.verdict.design import expected_errors, informative
from symfric import Stribeck, simulate
from symfric.scenes import Drive


def fitted(colour: float) -> Fitted:
    """Coulomb and viscous friction with noise of a given autocorrelation."""
    random = np.random.default_rng(0)
    t = 1e-2 * np.arange(600)
    v = 0.1 * np.sin(1.7 * t) + 0.07 * np.sin(0.6 * t)
    noise = random.standard_normal(t.size)
    for k in range(1, t.size):
        noise[k] += colour * noise[k - 1]
    F = 5 * np.tanh(v / 1e-4) + 20 * v + 0.2 * noise
    data = Dataset.of(t=t, v=v, F=F, units={"v": "m/s", "F": "N"})
    return Fit(Points(), "coulomb+viscous", data, starts=1).solve(throw=False)


@pytest.mark.parametrize("colour", sampled([0.7, 0.0], of=2))
def test_errors_are_those_of_the_sandwich_also_with_coloured_residuals(colour: float) -> None:
    fit = fitted(colour)
    found = fit.bootstrap(60)
    for name, error in found.standard_errors.items():
        assert error == pytest.approx(fit.parameters[name].standard_error, rel=0.35)
        low, high = found.interval(name)
        assert low < fit.parameters[name].value < high
    assert found.failed == 0
    assert (found.blocks["F"] > 12) == (colour > 0)
    assert "sigma_2" in str(found)


def test_an_executor_gives_the_same_bits() -> None:
    fit = fitted(0.0)
    with ThreadPoolExecutor(2) as pool:
        both = [fit.bootstrap(6, executor=executor).samples for executor in (None, pool)]
    np.testing.assert_array_equal(*both)


def test_bad_arguments_are_refused() -> None:
    fit = fitted(0.0)
    with pytest.raises(ValueError, match="bootstrap: count: expected a whole number >= 2"):
        fit.bootstrap(1)
    with pytest.raises(ValueError, match="interval: expected one of mu_d, sigma_2, got mu"):
        fit.bootstrap(2).interval("mu")
    with pytest.raises(ValueError, match="interval: level"):
        fit.bootstrap(2).interval("mu_d", 2.0)


FREE = ("m", "mu_d", "sigma_2")
DRIVE = Drive(Stribeck(mu_s=6.0, mu_d=4.0, v_s=0.1, v_eps=2e-2, sigma_2=8.0), m=2.0, N=1.0)
MODEL = DRIVE.model(free=FREE)
T = np.linspace(0.0, 1.0, 2001)


def run(p: dict[str, float] | None = None) -> np.ndarray:
    u = {"force": lambda t: 15 * ca.cos(12 * t)}
    return np.asarray(simulate(MODEL, 1.0, u=u, p=p or {}, t_eval=T, rtol=1e-10)["x"])


def test_information_is_that_of_differences() -> None:
    rich = informative(MODEL, FREE, {"x": 1e-4}, step=5e-4)
    u = {"force": lambda t: 15 * ca.cos(12 * t)}
    motion = simulate(rich, 1.0, u=u, t_eval=T, rtol=1e-8)
    start, h = {v.name: float(v.start) for v in MODEL.p}, 1e-5
    Y = np.column_stack(
        [(run({n: p * (1 + h)}) - run({n: p * (1 - h)})) / (2 * h) for n, p in start.items()]
    )
    np.testing.assert_allclose(motion["S_x_m"], Y[:, 0], atol=1e-4 * np.abs(Y).max())
    information = Y[1:].T @ Y[1:] / 1e-8 + np.eye(3)
    assert motion["information"][-1] == pytest.approx(log(np.linalg.det(information)) / 3, abs=1e-2)
    errors = expected_errors(FREE, motion)
    expected = np.sqrt(np.diag(np.linalg.inv(information)))
    np.testing.assert_allclose(list(errors.values()), expected, rtol=1e-2)
