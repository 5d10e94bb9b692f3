"""Sensitivities and information along a motion, against differences and sums of samples."""

from math import log

import casadi as ca
import numpy as np
import pytest

from identification.verdict.design import expected_errors, informative
from symfric import Stribeck, simulate
from symfric.scenes import Drive

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
