"""Radau IIA: coefficients against exact arithmetic and books, iterations, and stick-slip."""

from dataclasses import replace
from fractions import Fraction
from math import comb, perm

import casadi as ca
import numpy as np
import pytest
from closed_forms import ClosedForm, assemble, observed_order, smooth_dae, smooth_ode

import symfric as sf
from symfric.integrator.methods.attempt import build_fixed
from symfric.integrator.methods.tableaux import (
    RADAU5,
    RADAU9,
    Radau,
    collocation,
    eigenbasis,
    error_weights,
    nodes,
    through,
)

x = sf.Variable("x", "1", start=1.0)


def of_stages(s: int) -> Radau:
    """Radau IIA with s stages and enough iterations to solve its equations."""
    A = collocation(nodes(s))
    return replace(RADAU9, A=A, E=error_weights(nodes(s), A), H=through(nodes(s)), iterations=12)


@pytest.mark.parametrize("s", [1, 3, 5, 7])
def test_collocation_matrices_are_those_of_exact_arithmetic(s: int) -> None:
    """b_j and c_j also satisfy sum_j b_j c_j^k = 1 / (k + 1) up to k = 2 s - 2, and not beyond."""
    c = nodes(s)
    exact = np.empty((s, s))
    for j, node in enumerate(map(Fraction, c)):
        basis = [Fraction(1)]  # coefficients of the Lagrange polynomial of the node
        for other in map(Fraction, np.delete(c, j)):
            by_x, by_one = [Fraction(0), *basis], [*basis, Fraction(0)]
            pairs = zip(by_x, by_one, strict=True)
            basis = [(a - other * b) / (node - other) for a, b in pairs]
        for i, end in enumerate(map(Fraction, c)):
            integral = (a * end ** (k + 1) / (k + 1) for k, a in enumerate(basis))
            exact[i, j] = float(sum(integral))
    A = collocation(c)
    assert pytest.approx(exact, rel=5e-15, abs=1e-16) == A
    moments = [float(A[-1] @ c**k) - 1 / (k + 1) for k in range(2 * s)]
    assert np.abs(moments[:-1]).max() < 2e-15
    assert abs(moments[-1]) > 1e-10


@pytest.mark.parametrize("s", [3, 5, 7])
def test_error_weights_and_linear_steps_of_any_number_of_stages(s: int) -> None:
    """One iteration solves x' = -x: R(z) is Pade's of degrees (s - 1, s), exp(z) to order 2 s - 1.

    The error estimate is of order s + 1.
    """
    method = of_stages(s)
    system = assemble(sf.Model("decay", x=(x,), ode=-x.symbol))
    step = build_fixed(system, replace(method, iterations=1))
    h = ca.SX.sym("h")
    estimate = ca.Function("e", [h], [method.trials(system)(ca.SX(1.0), h, ca.SX(0, 1)).error])
    z = -0.7
    tops, bottoms = ([comb(s - e, k) / perm(2 * s - 1, k) * (1, -1)[1 - e] ** k
                      for k in range(s + 1 - e)] for e in (1, 0))  # fmt: skip
    top, bottom = (sum(a * z**k for k, a in enumerate(rows)) for rows in (tops, bottoms))
    assert float(step(1.0, -z, [])) == pytest.approx(top / bottom, rel=1e-13)
    sizes = [abs(float(estimate(h))) for h in (0.8, 0.4, 0.2)]  # above rounding
    assert observed_order([1, 2, 4], sizes) == pytest.approx(s + 1, abs=0.6)


def test_error_weights_are_those_of_hairer_and_wanner_for_three_stages() -> None:
    assert error_weights(nodes(3), RADAU5.A) == pytest.approx(RADAU5.E, rel=1e-14)
    assert collocation(nodes(3)) == pytest.approx(RADAU5.A, rel=1e-14)


def test_eigenbasis_makes_blocks_of_the_inverse_matrix_of_radau() -> None:
    """Its eigenvalues are the roots of z^3 - 9 z^2 + 36 z - 60 (Hairer and Wanner)."""
    basis = eigenbasis(RADAU5.A)
    (alpha,), (beta,) = basis.alpha, basis.beta
    expected = [[basis.gamma, 0, 0], [0, alpha, beta], [0, -beta, alpha]]
    blocks = np.linalg.inv(basis.T) @ np.linalg.inv(RADAU5.A) @ basis.T
    assert blocks == pytest.approx(np.array(expected), abs=1e-13)
    assert np.poly(blocks) == pytest.approx([1.0, -9.0, 36.0, -60.0])


def test_linear_equations_need_one_iteration_of_radau() -> None:
    """exp(-z) is then Pade's (1 + 2z/5 + z^2/20) / (1 - 3z/5 + 3z^2/20 - z^3/60) at -z."""
    once = replace(RADAU5, iterations=1)
    step = build_fixed(assemble(sf.Model("decay", x=(x,), ode=-x.symbol)), once)
    z = -0.7
    pade = (1 + 2 * z / 5 + z**2 / 20) / (1 - 3 * z / 5 + 3 * z**2 / 20 - z**3 / 60)
    assert float(step(1.0, 0.7, [])) == pytest.approx(pade, rel=1e-14)


@pytest.mark.parametrize(("case", "order"), [(smooth_ode(), 7), (smooth_dae(), 5)])
def test_enough_iterations_solve_the_collocation_equations(case: ClosedForm, order: int) -> None:
    """The gap to many iterations shrinks by h^2 an iteration, h in algebraic unknowns."""
    system, y = assemble(case.model), case.exact(0.0)
    few, many = (build_fixed(system, replace(RADAU5, iterations=k)) for k in (3, 12))
    gaps = [float(ca.norm_inf(few(y, 1 / n, []) - many(y, 1 / n, []))) for n in (4, 8, 16)]
    assert observed_order([4, 8, 16], gaps) == pytest.approx(order, abs=0.5)


def test_order_nine_takes_a_quarter_of_the_attempts_at_tight_tolerances() -> None:
    """Of Rodas5P, with smaller errors. An attempt takes about twice the time."""
    model, span = sf.rabinowicz(sf.BrownMcPhee()), 20.0
    exact = sf.simulate(model, span, rtol=1e-12, method="rodas4p")["x"]
    for rtol, ratio in ((1e-8, 0.55), (1e-10, 0.3)):
        attempts, errors = list[int](), list[float]()
        for method in ("rodas5p", "radau9"):
            run = sf.simulate(model, span, rtol=rtol, method=method)
            attempts.append(run.statistics.steps + run.statistics.rejections)
            errors.append(float(np.abs(run["x"] - exact).max() / np.abs(exact).max()))
        assert attempts[1] < ratio * attempts[0]
        assert errors[1] < 0.5 * errors[0]
        assert errors[1] < 10 * rtol


def test_rounding_stops_radau_with_a_narrow_law_a_decade_before_rodas5p() -> None:
    model, methods = sf.rabinowicz(sf.BrownMcPhee(v_t=1e-8)), ("rodas5p", "radau5", "radau9")
    for rtol, able in ((1e-8, [*methods]), (1e-9, ["rodas5p"]), (1e-10, [])):
        limits = {"rtol": rtol, "max_steps": 4000, "throw": False}
        runs = {name: sf.simulate(model, 5.0, method=name, **limits) for name in methods}
        assert [name for name, run in runs.items() if run.status.ok] == able
