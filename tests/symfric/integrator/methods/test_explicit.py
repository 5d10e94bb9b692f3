"""The explicit pair against SciPy's, and what it costs where it should not be used."""

import numpy as np
import pytest
from closed_forms import assemble, smooth_ode
from numpy.typing import NDArray
from scipy.integrate import RK45

from symfric import LuGre, rabinowicz, simulate
from symfric.integrator.methods.tableaux import DOPRI5
from symfric.integrator.running.record import Dense
from symfric.integrator.step.attempt import build_dense_step, build_fixed

H = 0.2


def rates(_: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([-3 * y[0] + y[1] ** 2, y[0] - y[1] - y[1] ** 2])


def by_scipy() -> RK45:
    """One step of H of the same pair, without error control."""
    solver = RK45(
        rates, 0.0, [1.0, 1.0], 1.0, first_step=H, max_step=H, rtol=1.0, atol=1.0,
    )  # fmt: skip
    solver.step()
    return solver


def test_step_is_that_of_scipy() -> None:
    found = build_fixed(assemble(smooth_ode().model), DOPRI5)([1.0, 1.0], H, [])
    assert found.full().ravel() == pytest.approx(by_scipy().y, rel=1e-14)


def test_dense_output_is_that_of_scipy() -> None:
    rows = build_dense_step(assemble(smooth_ode().model), DOPRI5)([1.0, 1.0], H, [])
    rows = rows.full().reshape(-1, 2)
    ends = np.array([0.0]), np.array([H])
    dense = Dense(*ends, np.ones((1, 2)), rows[:1], rows[None, 1:])
    t = np.linspace(0.0, H, 7)
    assert dense(t) == pytest.approx(by_scipy().dense_output()(t), rel=1e-12)


def test_bristles_cost_it_many_times_the_steps_of_an_implicit_method() -> None:
    explicit, implicit = (
        simulate(rabinowicz(LuGre()), 10.0, method=method).statistics
        for method in ("dopri5", "rodas5p")
    )
    assert explicit.steps > 20 * implicit.steps
    assert (explicit.jacobians, explicit.factorisations) == (0, 0)
    assert explicit.evaluations == 7 * (explicit.steps + explicit.rejections)
