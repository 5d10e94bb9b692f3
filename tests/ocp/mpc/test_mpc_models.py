"""Controllers of an unstable machine, of one with two inputs, and of one with bristles."""

import numpy as np
import pytest
from receding import linear_model, positioning

from ocp.formulation.expressions import at_end, effort, track
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.mpc.controller import controller_of
from ocp.problems import cart_pendulum
from symfric import LuGre, drive
from symfric.model import Model


def cart(v_t: float) -> Model:
    return cart_pendulum(v_t).spans[0].model


def upright(model: Model) -> Problem:
    cost = track("x", "goal", 10.0) + track("theta", np.pi, 50.0) + effort("force", 1e-2)
    cost += track("x_rate", 0.0, 1.0) + track("theta_rate", 0.0, 1.0)
    cost += at_end(lambda s: 100 * (s.theta - np.pi) ** 2 + 20 * (s.x - s.goal) ** 2)
    cost += at_end(lambda s: 20 * s.x_rate**2 + 20 * s.theta_rate**2)
    bounds = {"force": (-20.0, 20.0), "x": (-1.0, 1.0)}
    return Problem(Phase(model, T=0.8), cost, bounds=bounds, p={"goal": 0.0})


@pytest.mark.slow
def test_pendulum_stands_on_a_cart_with_sharper_friction() -> None:
    made = controller_of(upright(cart(2e-2)), 0.02, steps=4)
    found = made.simulate(cart(1e-4), 3.0, {"goal": 0.3}, x0={"theta": np.pi - 0.3}, check=False)
    assert found.unreported == 0
    assert found["theta"][-1] == pytest.approx(np.pi, abs=0.01)
    assert found["x"][-1] == pytest.approx(0.3, abs=0.02)
    assert np.abs(found["x"]).max() < 1.0


def test_two_inputs_hold_an_unstable_mode_within_their_bounds() -> None:
    cost = track("x", "far", 10.0) + track("v", 0.0, 1.0) + track("w", 0.0, 1.0)
    cost += effort("a", 0.01) + effort("b", 0.01)
    bounds = {"a": (-3.0, 3.0), "b": (-1.0, 1.0)}
    problem = Problem(Phase(linear_model(), T=2.0), cost, bounds=bounds, p={"far": 0.0})
    made = controller_of(problem, 0.1, steps=1)
    found = made.simulate(linear_model(), 6.0, {"far": 0.5}, x0={"w": 0.3}, noise={"x": 1e-4})
    assert found.unreported == 0
    assert found.unconverged == 0
    assert found["x"][-1] == pytest.approx(0.5, abs=0.02)
    assert abs(found["w"][-1]) < 0.02
    assert np.abs(found["b"]).max() == pytest.approx(1.0, abs=1e-6)


def test_bristles_are_predicted_not_measured() -> None:
    law = LuGre(mu_s=6.0, mu_d=4.0, v_s=1e-2, sigma_0=1e5, sigma_1=300.0, sigma_2=0.0)
    model = drive(law, m=1.0, N=1.0)
    made = controller_of(
        positioning(model), 0.01, method="backward_euler", steps=4, measured=["x", "v"]
    )
    found = made.simulate(model, 0.5, {"goal": 0.1}, check=False)
    assert found["x"][-1] == pytest.approx(0.1, abs=1e-3)
    assert found.unconverged == 0
