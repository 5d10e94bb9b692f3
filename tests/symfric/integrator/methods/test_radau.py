"""Radau IIA: coefficients, Newton iterations, and what it does where they fail."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from closed_forms import assemble, observed_order, smooth_dae, smooth_ode

from symfric import BrownMcPhee, LuGre, Model, Variable, rabinowicz, simulate, simulate_many
from symfric.integrator.methods.families import eigenbasis
from symfric.integrator.methods.tableaux import RADAU5, through
from symfric.integrator.step.attempt import KAPPA, build_fixed, build_step, converged
from symfric.integrator.step.layout import Given, State
from symfric.scenes import SliderCrank

x = Variable("x", "1", start=1.0)
S6 = np.sqrt(6.0)


def test_matrix_is_the_one_of_the_book() -> None:
    """Hairer and Wanner, table IV.5.6."""
    book = [
        [(88 - 7 * S6) / 360, (296 - 169 * S6) / 1800, (-2 + 3 * S6) / 225],
        [(296 + 169 * S6) / 1800, (88 + 7 * S6) / 360, (-2 - 3 * S6) / 225],
        [(16 - S6) / 36, (16 + S6) / 36, 1 / 9],
    ]
    assert pytest.approx(np.array(book), abs=1e-14) == RADAU5.A


def test_eigenvalues_are_those_of_the_book() -> None:
    """Of the inverse: roots of z^3 - 9 z^2 + 36 z - 60."""
    basis = eigenbasis(RADAU5.A)
    roots = np.roots([1.0, -9.0, 36.0, -60.0])
    assert basis.gamma == pytest.approx(float(roots.real[np.argmin(np.abs(roots.imag))]))
    pair = roots[np.argmax(roots.imag)]
    assert (basis.alpha, basis.beta) == pytest.approx((pair.real, pair.imag))
    blocks = np.linalg.inv(basis.T) @ np.linalg.inv(RADAU5.A) @ basis.T
    assert blocks[1:, 1:] == pytest.approx(
        np.array([[basis.alpha, basis.beta], [-basis.beta, basis.alpha]])
    )
    assert blocks[0] == pytest.approx([basis.gamma, 0.0, 0.0], abs=1e-13)
    assert blocks[1:, 0] == pytest.approx([0.0, 0.0], abs=1e-13)


def test_cubic_goes_through_the_increments() -> None:
    """theta^3, theta^2 and theta are reproduced."""
    c = RADAU5.c
    H = through(c)
    theta = np.linspace(0, 1, 9)
    for power in (1, 2, 3):
        d = H @ c**power
        found = theta * (1 + (1 - theta) * (d[0] + theta * d[1]))
        assert found == pytest.approx(theta**power, abs=1e-14)


def test_linear_equations_need_one_iteration() -> None:
    """exp(-z) is then Pade's (1 + 2z/5 + z^2/20) / (1 - 3z/5 + 3z^2/20 - z^3/60) at -z."""
    once = replace(RADAU5, iterations=1)
    step = build_fixed(assemble(Model("decay", x=(x,), ode=-x.symbol)), once)
    z = -0.7
    pade = (1 + 2 * z / 5 + z**2 / 20) / (1 - 3 * z / 5 + 3 * z**2 / 20 - z**3 / 60)
    assert float(step(1.0, 0.7, [])) == pytest.approx(pade, rel=1e-14)


@pytest.mark.parametrize("case", [smooth_ode, smooth_dae])
def test_enough_iterations_solve_the_collocation_equations(case: object) -> None:
    """Those of the method agree with many more to the order of the method."""
    problem = case()  # pyright: ignore[reportCallIssue]
    system = assemble(problem.model)
    few, many = (build_fixed(system, replace(RADAU5, iterations=k)) for k in (3, 12))
    y = problem.exact(0.0)
    gaps = [float(ca.norm_inf(few(y, 1 / n, []) - many(y, 1 / n, []))) for n in (4, 8, 16)]
    order = 7 if case is smooth_ode else 5  # h^2 an iteration, h in algebraic unknowns
    assert observed_order([4, 8, 16], gaps) == pytest.approx(order, abs=0.5)


def test_work_counts_one_more_iteration_with_algebraic_unknowns() -> None:
    assert RADAU5.work(assemble(smooth_ode().model)) == (7, 1, 2)
    assert RADAU5.work(assemble(smooth_dae().model)) == (10, 1, 2)


@pytest.mark.parametrize(
    ("before", "last", "enough"),
    [
        (1.0, 0.9 * KAPPA, True),  # small
        (0.8, 0.2, True),  # a quarter each: a third of the last one is still to come
        (0.3, 0.27, False),  # too slow
        (0.1, 0.2, False),  # diverges
        (0.0, 0.0, True),
    ],
)
def test_newton_is_done_when_what_is_to_come_is_small(
    before: float, last: float, enough: bool
) -> None:
    assert bool(converged(ca.DM(before**2), ca.DM(last**2))) == enough


@pytest.mark.parametrize("kind", [ca.SX, ca.MX], ids=["flat", "blocks"])
def test_failed_iteration_is_rejected_and_the_step_halved(kind: type) -> None:
    """x' = -1000 (x - 1)^3 from 2: a Jacobian at the start says little about the end."""
    model = Model("cubic", x=(x,), ode=-1000 * (x.symbol - 1) ** 3)
    step = build_step(assemble(model), RADAU5, kind)
    R = Given.of(1.0, 0.05, 1.0, [0.05], [])  # an error of this size would be allowed
    after = step(State.at(0.0, 0.01, [2.0]), R)[0].full().ravel()
    assert after[State.Y].tolist() == [2.0]
    assert after[State.H] == pytest.approx(0.005)


@pytest.mark.parametrize("law", [BrownMcPhee(), LuGre()], ids=["brown_mcphee", "lugre"])
def test_no_slip_is_lost_at_loose_tolerance(law: BrownMcPhee | LuGre) -> None:
    """At rtol = 1e-3 Rodas5P is off by several parts in a thousand, Radau by less than 3e-4."""
    model, t = rabinowicz(law), np.linspace(0.1, 20.0, 200)
    start = {"v": np.linspace(-0.1, 0.1, 40)}
    exact = simulate_many(model, 20.0, x0=start, rtol=1e-10, t_eval=t)["x"]
    with pytest.warns(UserWarning, match="stick phases"):
        found = simulate_many(model, 20.0, x0=start, rtol=1e-3, t_eval=t)["x"]
    assert np.abs(found - exact).max() < 5e-4 * np.abs(exact).max()


def test_multipliers_that_a_projection_leaves_over_are_no_error_of_the_next_step() -> None:
    """A fast crank in absolute coordinates: the step once shrank to nothing after 2 ms."""
    law = BrownMcPhee(mu_s=0.1, mu_d=0.08, v_t=0.01)
    model = SliderCrank(law).mechanism().build(formulation="absolute")
    run = simulate(model, 0.01, rtol=1e-5, method="radau5")
    exact = simulate(SliderCrank(law).model(), 0.01, rtol=1e-10)
    assert run["energy"] == pytest.approx(exact["energy"], rel=1e-4)
    assert run.statistics.steps < 200
