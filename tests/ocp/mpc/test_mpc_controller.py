"""Controllers against Riccati's equation and a solver of CasADi; bounds, references, errors."""

import casadi as ca
import numpy as np
import pytest
from receding import controller, linear_model, positioning, rubbing

from ocp.formulation.expressions import at_end, effort, integral, track
from ocp.formulation.phase import Free, Phase
from ocp.formulation.problem import Problem
from ocp.mpc.controller import controller_of
from ocp.mpc.design import CycleStatus
from symfric import ExactCoulomb, drive

Q, R = np.diag([3.0, 1.0, 2.0]), np.diag([0.1, 0.2])


def quadratic(**more: object) -> Problem:
    cost = track("x", 0.0, 3.0) + track("v", 0.0, 1.0) + track("w", 0.0, 2.0)
    cost += effort("a", 0.1) + effort("b", 0.2)
    return Problem(Phase(linear_model(), T=1.0), cost, **more)


def linear_map(h: float) -> tuple[np.ndarray, np.ndarray]:
    """Exact A, B of held inputs, by the series of the matrix exponential."""
    model = linear_model()
    A, B = (ca.DM(ca.jacobian(model.ode, model.vector(letter))).full() for letter in ("x", "u"))
    whole = np.zeros((5, 5))
    whole[:3, :3], whole[:3, 3:] = A, B
    term, found = np.eye(5), np.eye(5)
    for k in range(1, 25):
        term = term @ whole * h / k
        found = found + term
    return found[:3, :3], found[:3, 3:]


def regulator(N: int, h: float) -> np.ndarray:
    """Gain of the first interval by Riccati's recursion."""
    A, B = linear_map(h)
    P = h * Q
    for k in range(N):
        K = np.linalg.solve(h * R + B.T @ P @ B, B.T @ P @ A)
        P = (h * Q if k < N - 1 else 0) + A.T @ P @ A - A.T @ P @ B @ K
    return K


def test_linear_quadratic_problem_is_the_regulator() -> None:
    made = controller_of(quadratic(), 0.05)
    K = regulator(20, 0.05)
    session = made.start()
    for x in np.random.default_rng(1).normal(size=(3, 3)):
        action = session.step(x)
        np.testing.assert_allclose([action.controls["a"], action.controls["b"]], -K @ x, rtol=1e-7)
        assert action.converged
        assert action.iterations == 1
        assert action.program_iterations == 0


def test_active_bounds_are_those_of_another_solver() -> None:
    bounds = {"a": (-1.0, 0.4), "b": (-2.0, 2.0)}
    action = controller_of(quadratic(bounds=bounds), 0.05, tolerance=1e-7).start().step([2, 1, 0.3])
    A, B = linear_map(0.05)
    U = ca.MX.sym("U", 2, 20)
    x, cost = ca.DM([2.0, 1.0, 0.3]), 0
    for k in range(20):
        x = A @ x + B @ U[:, k]
        cost += 0.05 * (ca.bilin(Q, x) + ca.bilin(R, U[:, k]))
    solver = ca.qpsol(
        "other", "qrqp", {"x": ca.vec(U), "f": cost}, {"print_iter": False, "print_header": False}
    )
    found = solver(lbx=np.tile([-1.0, -2.0], 20), ubx=np.tile([0.4, 2.0], 20))["x"].full().ravel()
    np.testing.assert_allclose(list(action.controls.values()), found[:2], atol=1e-5)
    assert action.program_iterations > 0


def test_soft_bound_is_kept_where_it_can_be_and_priced_where_not() -> None:
    made = controller_of(quadratic(bounds={"v": (-0.5, 0.5)}), 0.05)
    session = made.start()
    kept = session.step([1.0, 0.0, 0.0])
    assert kept.converged
    assert kept.violation < 1e-6
    assert session.plan.X[1:, 1].min() == pytest.approx(-0.5, abs=1e-5)
    session.forget()
    bounded = controller_of(quadratic(bounds={"v": (-0.5, 0.5), "a": (-1, 1), "b": (-1, 1)}), 0.05)
    priced = bounded.start().step([0.0, 3.0, 0.0])
    assert priced.converged
    assert priced.violation > 1.0


def test_end_of_the_phase_is_met() -> None:
    phase = Phase(linear_model(), T=1.0, end={"x": 0.2, "v": (None, 0.0)})
    session = controller_of(Problem(phase, effort("a") + effort("b")), 0.05).start()
    assert session.step([1.0, 0.0, 0.0]).converged
    last = session.plan.X[-1]
    assert last[0] == pytest.approx(0.2, abs=1e-5)
    assert last[1] < 1e-5


def test_reference_over_the_horizon_is_known_ahead() -> None:
    session = controller().start()
    ahead = np.where(np.arange(21) < 3, 0.0, 0.1)
    early = session.step([0.0, 0.0], {"goal": ahead})
    session.forget()
    late = session.step([0.0, 0.0], {"goal": 0.0})
    assert early.controls["force"] > 1.0
    assert abs(late.controls["force"]) < 1e-9
    assert late.iterations == 0


def test_rated_input_is_continuous_and_its_state_is_not_measured() -> None:
    made = controller_of(positioning(rates={"force": (-200.0, 200.0)}), 0.01)
    assert made.measured == ("x", "v")
    session = made.start()
    forces = [session.step([0.0, 0.0], {"goal": 0.1}).controls["force"] for _ in range(5)]
    assert forces[0] == pytest.approx(1.0, abs=1e-3)
    assert np.diff(forces).max() <= 2.0 + 1e-3


def test_plan_continues_if_numbers_are_not_finite() -> None:
    session = controller().start()
    session.step([0.0, 0.0], {"goal": 0.1})
    planned = session.plan.U[1, 0]
    for bad in ({"x": [np.nan, 0.0]}, {"references": {"goal": np.inf}}):
        action = session.step(**({"x": [0.0, 0.0], "references": {"goal": 0.1}} | bad))
        assert action.status is CycleStatus.BAD_INPUT
        assert not action.converged
        assert action.controls["force"] == min(planned, 20.0)
        planned = session.plan.U[1, 0]


def test_bounds_at_run_time_hold() -> None:
    session = controller().start()
    action = session.step([0.0, 0.0], {"goal": 0.1}, bounds={"force_upper": 9.0})
    assert action.controls["force"] == pytest.approx(9.0, abs=1e-6)
    crossed = session.step([0.0, 0.0], {"goal": 0.1}, bounds={"force_upper": -30.0})
    assert not crossed.converged


def phase(**changes: object) -> Phase:
    return Phase(**({"model": rubbing(), "T": 0.2} | changes))


@pytest.mark.parametrize(
    ("problem", "message"),
    [
        (lambda: Problem(phase(T=Free(0.1, 1.0)), effort("force")), "a fixed duration T"),
        (lambda: Problem(phase(T=0.205), effort("force")), "whole number of steps"),
        (lambda: Problem(phase() >> phase(), effort("force")), "one phase"),
        (lambda: Problem(phase()), "a cost"),
        (lambda: Problem(phase(end={"force": 0.0}), effort("force")), "no values of inputs"),
        (lambda: Problem(phase(), integral(lambda s: s.force**4)), "second derivative"),
        (lambda: Problem(phase(), at_end(lambda s: -(s.x**2))), "convex"),
        (lambda: positioning(drive(ExactCoulomb())), "events"),
        (lambda: Problem(phase(via={0.5: {"x": 0.1}}), effort("force")), "via points"),
    ],
)  # fmt: skip
def test_unsupported_problems_are_refused(problem: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        controller_of(problem(), 0.01)


def test_wrong_names_and_sizes_are_refused() -> None:
    session = controller().start()
    with pytest.raises(ValueError, match="all of x, v, got none for v"):
        session.step({"x": 0.0})
    with pytest.raises(ValueError, match="expected one of goal, got gaol; did you mean goal"):
        session.step([0.0, 0.0], {"gaol": 1.0})
    with pytest.raises(ValueError, match="expected 1 number or 21"):
        session.step([0.0, 0.0], {"goal": np.zeros(5)})
