"""Controllers against Riccati's equation, another solver, and a reference of the generated C."""

import csv
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from backends import needs_compiler
from receding import controller, linear_model, positioning, rubbing

from ocp.formulation.expressions import at_end, effort, track
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.mpc.closed_loop import ClosedLoopRun, Optimality
from ocp.mpc.controller import Controller, controller_of
from ocp.mpc.design import CycleData, CycleStatus
from ocp.problems import cart_pendulum
from symfric import ExactCoulomb, LuGre, drive
from symfric.foundation.programs import CompileError, find_compiler
from symfric.model import Model

pytestmark = needs_compiler
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


# --- closed loops -------------------------------------------------------------------------------

BRISTLES = LuGre(mu_s=6.0, mu_d=4.0, v_s=1e-2, sigma_0=1e5, sigma_1=300.0, sigma_2=0.0)
PLANTS = {
    "sharper": lambda: rubbing(1e-4),
    "LuGre": lambda: drive(BRISTLES, m=1.0, N=1.0),
    "exact": lambda: drive(ExactCoulomb(mu_s=6.0, mu_d=4.0), m=1.0, N=1.0),
}


def loop(plant: Model, t_end: float = 0.6) -> ClosedLoopRun:
    return controller().simulate(plant, t_end, {"goal": 0.1})


@pytest.mark.parametrize("plant", PLANTS)
def test_drive_reaches_its_goal_and_reports_failures(plant: str) -> None:
    found = loop(PLANTS[plant]())
    assert found["x"][-1] == pytest.approx(0.1, abs=1e-3)
    assert found["x"].max() < 0.102
    assert found.unreported == 0
    assert found.unconverged <= 6
    assert np.abs(found["force"]).max() <= 20.0
    assert found.t.size == 60


def test_second_opinion_is_the_residual_and_finds_wrong_claims() -> None:
    found = loop(rubbing(), 0.1)
    np.testing.assert_allclose(found.checked, found.residual, rtol=1e-5, atol=1e-8)
    found.status[0], found.checked[0] = CycleStatus.CONVERGED, 1.0
    assert found.unreported == 1


def test_run_has_a_table_a_plot_and_a_file(tmp_path: Path) -> None:
    found, again = (
        controller().simulate(rubbing(), 0.03, {"goal": lambda t: 0.1 * np.sin(t)}, x0={"x": 0.02},
                              noise={"v": 1e-3}, check=False)
        for _ in range(2)
    )  # fmt: skip
    assert found["x"].tolist() == again["x"].tolist()
    assert np.isnan(found.checked).all()
    assert "unreported      0" in found.table()
    assert found.to_dict()["cycles"] == 3
    found.to_csv(tmp_path / "loop.csv")
    rows = list(csv.reader((tmp_path / "loop.csv").read_text().splitlines()))
    assert rows[0][:2] == ["t [s]", "x [m]"]
    assert len(rows) == 4
    found.plot("x", "force", path=tmp_path / "loop.png")
    assert (tmp_path / "loop.png").stat().st_size > 1000


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
def test_pendulum_is_balanced_on_a_cart_with_sharper_friction() -> None:
    made = controller_of(upright(cart(2e-2)), 0.02, steps=4)
    found = made.simulate(cart(1e-4), 3.0, {"goal": 0.3}, x0={"theta": np.pi - 0.3}, check=False)
    assert found.unreported == 0
    assert found["theta"][-1] == pytest.approx(np.pi, abs=0.01)
    assert found["x"][-1] == pytest.approx(0.3, abs=0.02)
    assert np.abs(found["x"]).max() < 1.0


def test_weights_may_be_parameters() -> None:
    """A controller with named weights equals one with these numbers, also if they change."""
    named = track("x", "goal", "stiff") + effort("force", "cost")
    names = Problem(
        Phase(rubbing(), T=0.2), named, bounds={"force": (-20.0, 20.0)},
        p={"goal": 0.1, "stiff": 900.0, "cost": 1e-2},
    )  # fmt: skip
    session = controller_of(names, 0.01, tolerance=1e-6).start()
    for stiff, cost in ((900.0, 1e-2), (400.0, 3e-2)):
        number = track("x", "goal", stiff) + effort("force", cost)
        problem = Problem(
            Phase(rubbing(), T=0.2), number, bounds={"force": (-20.0, 20.0)}, p={"goal": 0.1}
        )
        expected = controller_of(problem, 0.01, tolerance=1e-6).start().step([0.0, 0.2])
        session.forget()
        found = session.step([0.0, 0.2], {"stiff": stiff, "cost": cost})
        assert found.converged and expected.converged
        assert found.controls["force"] == pytest.approx(expected.controls["force"], rel=1e-4)
    with pytest.raises(ValueError, match="track: weight"):
        track("x", 0.0, -1.0)


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
    model = drive(BRISTLES, m=1.0, N=1.0)
    made = controller_of(
        positioning(model), 0.01, method="backward_euler", steps=4, measured=["x", "v"]
    )
    found = made.simulate(model, 0.5, {"goal": 0.1}, check=False)
    assert found["x"][-1] == pytest.approx(0.1, abs=1e-3)
    assert found.unconverged == 0


# --- generated C --------------------------------------------------------------------------------


def check(made: Controller, folder: Path, most: float) -> None:
    """Check files, residual and status of each plan, and the mean number of programs."""
    found = made.to_c(folder).verify(6)
    assert (found.warnings, found.ok, not found.foreign) == ((), True, True)
    assert found.difference < 1e-5
    design, session, random = made.design, made.start(), np.random.default_rng(0)
    h, second_opinion = design.horizon, Optimality(design)
    own = list(design.measured)
    nominal, limits = h.model.nominal("x")[own], (design.settings.tolerance, 20)
    measured, goals, programs = design.x0[own], design.r0, list[int]()
    for k in range(61):
        if k % 25 == 0:
            goals = design.r0 + random.normal(size=design.r0.size)
        if k % 60 == 39:
            measured = 10.0 * nominal * random.normal(size=nominal.size)
        if k % 60 == 59:
            measured = np.full(nominal.size, np.nan)
        t = h.step * (k + np.arange(h.count + 1.0))
        data = CycleData(np.tile(goals, (h.count + 1, 1)), t, design.p0, design.bounds)
        action, plan = session.cycle(measured, data, *limits), session.plan
        if k % 60 == 59:
            assert action.status is CycleStatus.BAD_INPUT
        else:
            expected = second_opinion.residual(plan, data)
            assert action.residual == pytest.approx(expected, rel=1e-2, abs=1e-4)
            assert action.converged is (action.residual <= limits[0])
            assert plan.X[0, own].tolist() == measured.tolist()
            programs.append(action.iterations if action.converged else limits[1])
        measured = plan.X[1, own] + 0.01 * nominal * random.normal(size=nominal.size)
    assert np.mean(programs) < most


def test_drive(tmp_path: Path) -> None:
    check(controller(), tmp_path, 3.6)
    text = (tmp_path / "drive_mpc.c").read_text() + (tmp_path / "drive_mpc.h").read_text()
    assert "malloc" not in text
    assert "static const" in text


@pytest.mark.parametrize("ends", [False, True])
def test_parts_that_are_absent_are_left_out(ends: bool, tmp_path: Path) -> None:
    """Conditions at the end, or rows and rates."""
    cost = track("x", "far", 3.0) + effort("a", 0.1) + effort("b", 0.1)
    bounds, rates = {"a": (None, 1.0), "w": (-1.0, 2.0)}, {"b": (-9.0, 9.0)}
    more = {} if ends else {"bounds": bounds, "rates": rates}
    phase = Phase(linear_model(), T=0.3, end={"x": 1.0} if ends else {})
    check(controller_of(Problem(phase, cost, p={"far": 0.0}, **more), 0.1), tmp_path, 2.2)


def test_missing_compiler_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = controller_of(positioning(), 0.01, name="uncompiled")
    monkeypatch.setenv("PATH", "")
    monkeypatch.setenv("CC", "")
    with pytest.raises(CompileError, match=r"start: expected a C compiler .* install gcc or clang"):
        made.start()
    found = made.to_c(tmp_path).verify()
    assert not found.ok
    assert "no C compiler found" in found.status


def test_wrong_residual_or_control_in_the_files_is_found(tmp_path: Path) -> None:
    generated = controller().to_c(tmp_path)
    text = generated.files[1].read_text()
    for old, new in (
        ("larger(found, fabs(S[i]", "larger(found, 0.9 * fabs(S[i]"),
        ("    u = m->u[0][0];", "    u = m->u[1][0];"),
    ):
        assert text.count(old) == 1
        text = text.replace(old, new)
    generated.files[1].write_text(text)
    status = generated.verify(30).status
    assert "differs by" in status and "understates residuals 1.1 times" in status


def test_c_is_c_plus_plus_too(tmp_path: Path) -> None:
    files = controller().to_c(tmp_path).files
    compiler = find_compiler()
    assert compiler is not None
    command = ("-x", "c++", "-Wall", "-Wextra", "-fsyntax-only", str(files[1]))
    assert compiler.run(*command) == ""
