"""Nonlinear programs for solvers of the user, and Functions of the user as equations."""

import casadi as ca
import numpy as np
import pytest
from carts import CART, F, V, X, move
from phases import solve_once

from ocp import Phase, Problem, Shooting, integral, nlp_of
from symfric import Model


def test_program_is_solved_by_a_solver_of_the_user() -> None:
    """sqpmethod with the derivatives of the program, and with derivatives by CasADi alone."""
    program, found = nlp_of(move(limit=8.5), intervals=20), solve_once(move(limit=8.5), 20)
    quiet = {"qpsol": "qrqp", "print_header": False, "print_iteration": False, "print_time": False,
             "print_status": False, "qpsol_options": {"print_iter": False, "print_header": False,
             "print_info": False}}  # fmt: skip
    result = ca.nlpsol("own", "sqpmethod", program.symbols, quiet)(**program.arguments)
    np.testing.assert_allclose(float(result["f"]), found.cost, rtol=1e-6)
    np.testing.assert_allclose(program.motion(result["x"])["x"], found["x"], atol=1e-6)
    w, p = program.arguments["x0"], program.arguments["p"]
    functions, symbols = program.functions, program.symbols
    for name in ("f", "g"):
        plain = ca.Function("plain", [symbols["x"], symbols["p"]],
                            [ca.jacobian(symbols[name], symbols["x"])])  # fmt: skip
        exact = functions[{"f": "nlp_grad_f", "g": "nlp_jac_g"}[name]](w, p)[1]
        np.testing.assert_allclose(ca.vec(ca.densify(exact)), ca.vec(ca.densify(plain(w, p))))
    assert functions["nlp_f"](w, p) == functions["nlp_grad_f"](w, p)[0]
    unknowns, rows = program.names
    assert (len(unknowns), len(rows)) == (w.size, functions["nlp_g"].size1_out(0))
    assert unknowns[:3] == ["x at t = 0 s", "v at t = 0 s", "a at t = 0 s"]
    assert rows[0] == "the continuity of x at t = 0.05 s"


def test_bad_programs_are_refused() -> None:
    program = nlp_of(move(), intervals=2, scheme=Shooting("rodas5p", 1))
    with pytest.raises(ValueError, match=r"motion: expected 8 values of w, got 2"):
        program.motion([0.0, 1.0])
    with pytest.raises(ValueError, match="nlp_of: expected a problem, such as"):
        nlp_of(CART)  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", [ca.SX, ca.MX])
def test_functions_of_the_user_are_equations(kind: type) -> None:
    """A double integrator, J = 12 (1 - 1 / N^2)^-1, from a Function of SX or MX."""
    x, u = kind.sym("x", 2), kind.sym("u")
    ode = ca.Function("ode", [x, u], [ca.vertcat(x[1], u)])
    made = Model("own", x=(X, V), u=(F,), ode=ode(ca.vertcat(X.symbol, V.symbol), F.symbol))
    ends = {"x": 0.0, "v": 0.0}
    problem = Problem(
        Phase(made, 1.0, start=ends, end=ends | {"x": 1.0}), integral(lambda s: s.a**2)
    )
    np.testing.assert_allclose(solve_once(problem, 10).cost, 12 / (1 - 1e-2), rtol=1e-7)
