"""Backward Euler: what Newton's method finds, and that it stays bounded."""

from dataclasses import replace

import numpy as np
import pytest
from closed_forms import assemble, smooth_dae

from symfric import BrownMcPhee, Model, Variable, rabinowicz
from symfric.integrator.methods.tableaux import BACKWARD_EULER
from symfric.integrator.step.attempt import build_fixed

x = Variable("x", "1", start=1.0)


@pytest.mark.parametrize("h", [0.01, 1.0, 100.0])
def test_step_solves_its_equation(h: float) -> None:
    """x_1 + h x_1^2 = x_0."""
    step = build_fixed(assemble(Model("square", x=(x,), ode=-(x.symbol**2))), BACKWARD_EULER)
    enough = replace(BACKWARD_EULER, iterations=12)
    exactly = build_fixed(assemble(Model("square", x=(x,), ode=-(x.symbol**2))), enough)
    root = (np.sqrt(1 + 4 * h) - 1) / (2 * h)
    assert float(exactly(1.0, h, [])) == pytest.approx(root, rel=1e-14)
    assert float(step(1.0, h, [])) == pytest.approx(root, rel=1e-14 if h < 0.1 else 0.1)


def test_newton_converges_quadratically() -> None:
    model, errors = Model("square", x=(x,), ode=-(x.symbol**2)), []
    for k in (1, 2, 3):
        step = build_fixed(assemble(model), replace(BACKWARD_EULER, iterations=k))
        errors.append(abs(float(step(1.0, 0.5, [])) - (np.sqrt(3.0) - 1)))
    # Newton for x + x^2/2 - 1: e+ = e^2 / (2 (1 + x))
    assert errors[1] / errors[0] ** 2 == pytest.approx(1 / (2 * np.sqrt(3.0)), rel=0.1)
    assert errors[2] / errors[1] ** 2 == pytest.approx(1 / (2 * np.sqrt(3.0)), rel=0.1)


def test_algebraic_unknowns_end_on_their_equations() -> None:
    problem = smooth_dae()
    X, Y, Z = build_fixed(assemble(problem.model), BACKWARD_EULER)(
        problem.exact(0.0), 0.1, []
    ).full().ravel()  # fmt: skip
    assert pytest.approx(X + Y, rel=1e-12) == Z * (1 + Y)


@pytest.mark.parametrize("v_t", [1e-3, 1e-5])
@pytest.mark.parametrize("h", [0.1, 0.01, 0.001])
def test_it_stays_bounded_where_the_step_resolves_nothing(h: float, v_t: float) -> None:
    model = rabinowicz(BrownMcPhee(v_t=v_t))
    step = build_fixed(assemble(model), BACKWARD_EULER).mapaccum(2000)
    x = step(model.initial_state(), h, []).full()[0]
    assert np.abs(x).max() < 2.0  # the spring balances static friction at 0.57 m
