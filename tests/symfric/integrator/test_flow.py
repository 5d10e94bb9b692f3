"""The flow of a model as a Function: values, and derivatives of both orders."""

import casadi as ca
import numpy as np
import pytest
from differentiable import oscillator, pendulum, root
from scipy.linalg import expm

from symfric import BrownMcPhee, LuGre, Model, Variable, flow, rabinowicz, simulate
from symfric.integrator.methods.tableaux import METHODS

K, C, START = 4.0, 0.3, np.array([1.0, 0.5])


def exact(t: float, k: float = K) -> np.ndarray:
    return expm(t * np.array([[0.0, 1.0], [-k, -C]])) @ START


def test_arguments_and_result_have_names() -> None:
    step = flow(rabinowicz(LuGre(), free=["mu_s"]))
    assert step.name_in() == ["x0", "u", "p", "T"]
    assert step.name_out() == ["xf"]
    assert step.size_in("u") == (0, 1)
    assert step.size_out("xf") == (3, 1)


@pytest.mark.parametrize("method", METHODS)
def test_flow_of_a_linear_system_is_the_matrix_exponential(method: str) -> None:
    """Pushed by u, it swings about u/k."""
    step = flow(oscillator(), steps=200, method=method)
    center = np.array([1.0 / K, 0.0])
    found = step(x0=START + center, u=1.0, p=[K, C], T=2.0)["xf"].full().ravel() - center
    assert found == pytest.approx(exact(2.0), abs=1e-4 if METHODS[method].order > 1 else 0.06)


def test_time_counts_from_zero() -> None:
    """x' = cos(t)."""
    x, t = Variable("x", "m", start=0.0), ca.SX.sym("t")
    step = flow(Model("swing", x=(x,), ode=ca.cos(t), t=t))
    assert float(step(x0=1.0, T=2.0)["xf"]) == pytest.approx(1.0 + np.sin(2.0), rel=1e-7)


def test_algebraic_variables_are_solved_for() -> None:
    """x = (1 - 2/3 p^(1/3) T)^(3/2), and its derivative by p."""
    p = ca.MX.sym("p")
    xf = flow(root(), steps=40)(x0=1.0, p=p, T=1.0)["xf"]
    value, slope = ca.Function("both", [p], [xf, ca.jacobian(xf, p)])(0.7)
    q = 0.7 ** (1 / 3)
    assert float(value) == pytest.approx((1 - 2 / 3 * q) ** 1.5, rel=1e-7)
    assert float(slope) == pytest.approx(-np.sqrt(1 - 2 / 3 * q) * q / (3 * 0.7), rel=1e-6)


def test_mechanism_flows_on_its_constraints() -> None:
    """From a start off the circle, as it is simulated."""
    x0 = [0.61, -0.8, 0.0, 0.0]
    end = flow(pendulum(), steps=50)(x0=x0, p=1.0, T=1.0)["xf"].full().ravel()
    assert np.hypot(end[0], end[1]) == pytest.approx(1.0, abs=1e-12)
    run = simulate(pendulum(), 1.0, x0={"x": 0.61}, rtol=1e-10, t_eval=[1.0])
    assert end == pytest.approx([run[v][0] for v in ("x", "y", "vx", "vy")], rel=1e-6)


def test_implicit_model_flows() -> None:
    """(1 + r^2) (r + x) = 0 for the rate r."""
    x, r = Variable("x", "m", start=1.0), ca.SX.sym("r")
    model = Model("implicit", x=(x,), xdot=r, residual=(1 + r**2) * (r + x.symbol))
    assert float(flow(model)(x0=2.0, T=1.0)["xf"]) == pytest.approx(2 * np.exp(-1.0), rel=1e-6)


@pytest.mark.parametrize("law", [BrownMcPhee(), LuGre()], ids=["brown_mcphee", "lugre"])
def test_friction_flows_as_it_is_simulated(law: BrownMcPhee | LuGre) -> None:
    """Sticking on the belt, where equal steps are no burden; first derivatives too."""
    model = rabinowicz(law, free=["k"])
    x0 = model.initial_state({"v": 0.1})
    start = dict(zip([v.name for v in model.x], x0, strict=True))
    run = simulate(model, 1.0, x0=start, rtol=1e-10, t_eval=[1.0], sensitivities=["k", "x0.x"])
    step = flow(model, steps=100)
    slopes = step.factory("slopes", step.name_in(), ["xf", "jac:xf:p", "jac:xf:x0"])
    xf, by_p, by_x0 = slopes(x0, [], 2.1, 1.0)
    assert float(xf[0]) == pytest.approx(run["x"][0], rel=1e-8)
    assert float(by_p[0]) == pytest.approx(run.sensitivities["k"]["x"][0], rel=1e-4)
    assert float(by_x0[0, 0]) == pytest.approx(run.sensitivities["x0.x"]["x"][0], rel=1e-6)


def test_derivatives_of_both_orders_meet_the_matrix_exponential() -> None:
    """By k twice, from the exponential of a block triangular matrix, and by T, where x' = A x."""
    k, T = ca.MX.sym("k"), ca.MX.sym("T")
    x = flow(oscillator(), steps=100)(x0=START, u=0.0, p=ca.vertcat(k, C), T=T)["xf"][0]
    first = ca.gradient(x, k)
    functions = ca.Function("f", [k, T], [first, ca.jacobian(x, T), ca.jacobian(first, k)])
    by_k, by_T, by_kk = (float(value) for value in functions(K, 2.0))
    A, by = np.array([[0.0, 1.0], [-K, -C]]), np.array([[0.0, 0.0], [-1.0, 0.0]])
    none = np.zeros((2, 2))
    tower = expm(2.0 * np.block([[A, by, none], [none, A, by], [none, none, A]]))
    assert by_k == pytest.approx((tower[:2, 2:4] @ START)[0], rel=1e-6)
    assert by_kk == pytest.approx(2 * (tower[:2, 4:] @ START)[0], rel=1e-5)
    assert by_T == pytest.approx(exact(2.0)[1], rel=1e-6)
