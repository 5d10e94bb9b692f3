import casadi as ca
import numpy as np
import pytest

from identification import Dataset, Filter, differentiate
from identification.old.choice import choose
from identification.old.coordinates import coordinates
from identification.old.problem import Problem, inverse_force, problem
from symfric import Status, drive, law_from_text

FILTER = Filter(100.0, 10, v_min=1e-3)
LAWS = ["stribeck", "asymmetric(brown_mcphee)", "self_tuning+viscous"]
START = {"m": 90.0, "offset": -2.0, "B": 300.0, "v_s": 0.02, "v_t": 0.003, "sigma_2": 150.0}


def of(stage: Dataset, text: str) -> tuple[Problem, np.ndarray]:
    signals = differentiate(stage, FILTER)
    choice = choose(law_from_text(text), float(np.abs(signals.v).max()))
    at = coordinates(choice, 20.0, 0.05, 90.0)
    levels = {"mu_s": 25.0, "mu_d": 18.0, "mu_v": 150.0}
    stems = {name: name.removesuffix("_pos").removesuffix("_neg") for name in at.names}
    return problem(at, signals, 0.5), at.of({n: (START | levels)[s] for n, s in stems.items()})


def test_inverse_force_undoes_the_equations_of_the_drive() -> None:
    model = drive(law_from_text("stribeck"), m=3.0, N=2.0, offset=0.7)
    force = ca.Function("f", [model.x[1].symbol, model.xdot[1]], [inverse_force(model)])
    rate = model.function("ode")(0, [0.0, 0.4], [], 11.0, [])[1]
    assert float(force(0.4, rate)) == pytest.approx(11.0, rel=1e-13)


@pytest.mark.parametrize("text", LAWS)
def test_gradient_and_hessian_are_exact(stage: Dataset, text: str) -> None:
    task, w = of(stage, text)
    gradient = task.solver.get_function("nlp_grad_f")
    hessian = task.solver.get_function("nlp_hess_l")
    weights = np.random.default_rng(0).uniform(0, 1, task.rows)
    direction = np.random.default_rng(1).standard_normal(w.size)
    upper = np.asarray(hessian(w, weights, 1.0, []).full())
    exact = (upper + np.triu(upper, 1).T) @ direction
    slope = np.asarray(gradient(w, weights)[1].full()).ravel()

    def cost(at: np.ndarray) -> float:
        return 0.5 * float(weights @ (task.residuals(at) / task.scale) ** 2) / task.rows

    assert float(task.solver.get_function("nlp_f")(w, weights)) == pytest.approx(cost(w))

    def error(h: float) -> tuple[float, float]:
        ends = [w + h * direction, w - h * direction]
        slopes = [np.asarray(gradient(e, weights)[1].full()).ravel() for e in ends]
        first = (cost(ends[0]) - cost(ends[1])) / (2 * h) - float(slope @ direction)
        second = (slopes[0] - slopes[1]) / (2 * h) - exact
        return abs(first), float(np.linalg.norm(second))

    coarse, fine = np.array(error(2e-3)), np.array(error(1e-3))
    np.testing.assert_allclose(coarse / fine, 4.0, atol=0.3)


@pytest.mark.parametrize("text", ["stribeck", "brown_mcphee"])
def test_ipopt_agrees_with_scipy(stage: Dataset, text: str) -> None:
    optimize = pytest.importorskip("scipy.optimize")
    task, w = of(stage, text)
    ours = task.solve(w)
    theirs = optimize.least_squares(
        lambda x: task.residuals(x) / task.scale,
        w,
        lambda x: -task.sensitivities(x) / task.scale,
        bounds=(task.coordinates.lower, task.coordinates.upper),
        xtol=1e-14,
        ftol=1e-14,
        gtol=1e-12,
    )
    assert ours.status is Status.SOLVED
    assert ours.cost == pytest.approx(theirs.cost / task.rows, rel=1e-9)
    np.testing.assert_allclose(ours.w, theirs.x, atol=1e-5)


def test_weights_leave_equations_out(stage: Dataset) -> None:
    task, w = of(stage, "stribeck")
    weights = np.ones(task.rows)
    weights[::2] = 0.0
    half = task.solve(w, weights)
    assert half.status is Status.SOLVED
    assert not np.allclose(half.w, task.solve(w).w, atol=1e-6)
