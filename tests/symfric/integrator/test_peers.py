"""Gradients through SUNDIALS: silently wrong by CasADi's defaults (casadi#4383), right by ours."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from symfric import Model, Variable
from symfric.integrator.by_peer import Peer, peer
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.system import system
from symfric.integrator.running.run import Tolerances


def hats(count: int, algebraic: bool) -> Model:
    """x' = sum_i p_i hat_i(t), the hats t and 1 - t by turns: dx(1)/dp_i = 1/2."""
    x, t = Variable("x", "m", start=0.0), ca.SX.sym("t")
    p = tuple(Variable(f"p{i}", "m/s", start=1.0) for i in range(count))
    rate = sum((v.symbol * (t if i % 2 else 1 - t) for i, v in enumerate(p)), start=ca.SX(0))
    if not algebraic:
        return Model("hats", x=(x,), p=p, ode=rate, t=t)
    z = Variable("z", "m/s")
    return Model("hats", x=(x,), z=(z,), p=p, ode=z.symbol, alg=z.symbol - rate, t=t)


def problem(count: int, backend: str, algebraic: bool, rtol: float) -> Peer:
    model = hats(count, algebraic)
    inputs = input_data(model, None, 0.0, 1.0)
    whole = system(model, inputs)
    tolerances = Tolerances(rtol, rtol * whole.nominal, 0.0, 100_000)
    return peer(whole, inputs, model.values("p"), tolerances, backend)


def backward_gradient(of: Peer, count: int) -> np.ndarray:
    """dx(1)/dp by one adjoint."""
    solver, _ = of.over(np.array([0.0, 1.0]))
    p = ca.MX.sym("p", count)
    x = solver(x0=ca.DM.zeros(solver.size1_in("x0")), p=p)["xf"][0]
    return ca.Function("J", [p], [ca.gradient(x, p)])(np.ones(count)).full().ravel()


@pytest.mark.parametrize("count", [1, 3, 6])
@pytest.mark.parametrize(
    ("backend", "algebraic", "rtol", "error"),
    [
        ("sundials", False, 1e-10, 1e-8),
        ("sundials", True, 1e-7, 1e-3),
        ("rosenbrock", False, 1e-10, 1e-8),
    ],
    ids=["cvodes", "idas", "rosenbrock"],
)
def test_gradients_by_our_options_are_right(
    backend: str, algebraic: bool, rtol: float, error: float, count: int
) -> None:
    of = problem(count, backend, algebraic, rtol)
    assert backward_gradient(of, count) == pytest.approx(np.full(count, 0.5), abs=error)
    if (backend, algebraic, count) == ("sundials", False, 3):  # the reason for the option
        careless = {k: v for k, v in of.options.items() if k != "quad_err_con"}
        wrong = np.abs(backward_gradient(replace(of, options=careless), 3) - 0.5).max()
        assert wrong > 0.1, "CasADi computes adjoints right now: drop the option"
