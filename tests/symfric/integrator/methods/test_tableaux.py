"""Coefficients: order conditions, stability, and the orders that are observed in fixed steps.

Radau IIA: coefficients against exact arithmetic and books, iterations, and stick-slip.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from itertools import combinations_with_replacement
from math import comb, perm, prod
from typing import Any

import casadi as ca
import numpy as np
import pytest
from closed_forms import (
    ClosedForm,
    assemble,
    between_fixed_steps,
    fixed_steps,
    observed_order,
    prothero_robinson,
    smooth_dae,
    smooth_ode,
    timed_ode,
)
from numpy.typing import NDArray

from symfric import BrownMcPhee, Model, Variable, rabinowicz, simulate
from symfric.integrator.methods.attempt import build_fixed
from symfric.integrator.methods.families import Explicit, Rosenbrock
from symfric.integrator.methods.method import Method
from symfric.integrator.methods.tableaux import (
    ADAPTIVE,
    DOPRI5,
    METHODS,
    RADAU5,
    RADAU9,
    Radau,
    collocation,
    eigenbasis,
    error_weights,
    nodes,
    shampine,
    through,
)

Array = NDArray[np.floating[Any]]
Tree = tuple["Tree", ...]

each_method = pytest.mark.parametrize("name", METHODS)
each_adaptive = pytest.mark.parametrize("name", ADAPTIVE)
each_stiff = pytest.mark.parametrize("name", [name for name, m in METHODS.items() if m.dae])


def rooted_trees(order: int) -> list[Tree]:
    """All rooted trees with `order` nodes; a tree is the sorted tuple of its branches."""

    def forests(nodes: int, largest: int) -> Iterator[Tree]:
        if nodes == 0:
            yield ()
        for size in range(min(nodes, largest), 0, -1):
            for count in range(1, nodes // size + 1):
                for chosen in combinations_with_replacement(rooted_trees(size), count):
                    for rest in forests(nodes - size * count, size - 1):
                        yield chosen + rest

    return list(forests(order - 1, order - 1))


def size(tree: Tree) -> int:
    return 1 + sum(size(branch) for branch in tree)


def density(tree: Tree) -> int:
    return size(tree) * prod(density(branch) for branch in tree)


def classical(method: Method) -> tuple[Array, Array, Array]:
    """alpha, beta of the classical form, and the map G of weights: b = G^T m.

    A Runge-Kutta method is a Rosenbrock method with beta = alpha.
    """
    if not isinstance(method, Rosenbrock):
        assert isinstance(method, Explicit | Radau)
        return method.A, method.A, np.eye(method.A.shape[0])
    G = np.linalg.inv(np.eye(len(method.A)) / method.gamma - method.C)
    return method.A @ G, (method.A + np.eye(len(method.A))) @ G, G


def defect(method: Method, weights: Array, tree: Tree, theta: float = 1.0) -> float:
    """Residual of the order condition of a tree (Hairer and Wanner, IV.7) after theta h.

    The stage values enter where a node branches, the linearised ones where it does not.
    """
    alpha, beta, G = classical(method)

    def weight(branching: Tree) -> Array:
        within = beta if len(branching) == 1 else alpha
        terms = [within @ weight(branch) for branch in branching]
        return np.prod(terms, axis=0) if terms else np.ones(alpha.shape[0])

    # beta = (A + 1) G is alpha + Gamma with G = Gamma, since T = I / gamma - C is its inverse
    return float(weights @ G @ weight(tree)) - theta ** size(tree) / density(tree)


def last_weights(method: Method) -> Array:
    """Of the stages in the end value: the last stage's argument, for Rosenbrock plus that stage."""
    assert isinstance(method, Rosenbrock | Explicit | Radau)
    last = np.eye(method.A.shape[0])[-1]
    return method.A[-1] + (last if isinstance(method, Rosenbrock) else 0.0)


def embedded_weights(method: Method) -> Array:
    """Of the stages in the solution behind the error estimate."""
    assert isinstance(method, Rosenbrock | Explicit)
    return method.A[-1] - (method.E if isinstance(method, Explicit) else 0.0)


def dense_weights(method: Method, theta: float) -> Array:
    """Of the stages after theta h; Radau's rows act on its increments A k."""
    d = sum(theta**r * row for r, row in enumerate(method.H))
    inner = d @ method.A if isinstance(method, Radau) else d
    return theta * (last_weights(method) + (1 - theta) * inner)


def order_of(method: Method, weights: Array, theta: float = 1.0) -> int:
    """Largest order whose conditions hold."""
    order = 0
    while max(abs(defect(method, weights, t, theta)) for t in rooted_trees(order + 1)) < 1e-11:
        order += 1
    return order


def test_rooted_trees_are_complete() -> None:
    assert [len(set(rooted_trees(n))) for n in range(1, 7)] == [1, 1, 2, 4, 9, 20]


@each_adaptive
def test_order_conditions_hold_up_to_the_order_and_no_further(name: str) -> None:
    """Of the end value, the embedded solution and the dense output."""
    method = METHODS[name]
    assert order_of(method, last_weights(method)) == method.order
    if isinstance(method, Rosenbrock | Explicit):
        assert not np.triu(method.A).any()
        assert order_of(method, embedded_weights(method)) == method.embedded == method.order - 1
    for theta in (0.2, 0.5, 0.9, 1.0):
        assert order_of(method, dense_weights(method, theta), theta) >= method.dense - 1


@each_method
def test_method_has_a_source_and_states_its_orders(name: str) -> None:
    method = METHODS[name]
    assert method.source
    assert (method.embedded > 0) == (method.dense > 0) == (name in ADAPTIVE)
    assert (method.dense_dae > 0) == (method.dae and name in ADAPTIVE)


@each_stiff
def test_stiffly_accurate_step_lands_on_a_linear_constraint(name: str) -> None:
    """Even from values that violate it."""
    x, z = Variable("x", "1"), Variable("z", "1")
    model = Model("line", x=(x,), z=(z,), ode=-z.symbol, alg=z.symbol - 2 * x.symbol - 3)
    x_1, z_1 = build_fixed(assemble(model), METHODS[name])([1.0, 7.0], 0.3, []).full().ravel()
    assert z_1 == pytest.approx(2 * x_1 + 3, abs=1e-13)


@each_stiff
def test_oscillation_never_grows_whatever_the_step(name: str) -> None:
    """A-stable: the step maps the circle into itself for every h omega (no pole is on the left)."""
    x, y = Variable("x", "1"), Variable("y", "1")
    model = Model("circle", x=(x, y), ode=ca.vertcat(y.symbol, -x.symbol))
    step = build_fixed(assemble(model), METHODS[name])
    radii = [np.linalg.norm(step([1.0, 0.0], h, []).full()) for h in np.logspace(-3, 6, 901)]
    assert max(radii) <= 1 + 1e-13


@pytest.mark.parametrize("name", [*(n for n, m in METHODS.items() if m.dae), "exponential"])
@pytest.mark.parametrize("rate", [1e8, 1e12])
def test_fast_transient_is_gone_after_one_step(name: str, rate: float) -> None:
    """L-stable: R(-inf) = 0."""
    x = Variable("x", "1", start=1.0)
    step = build_fixed(assemble(Model("fast", x=(x,), ode=-rate * x.symbol)), METHODS[name])
    assert abs(float(step(1.0, 1.0, []))) < 100 / rate


def test_explicit_pair_is_stable_on_the_interval_of_its_polynomial() -> None:
    """R(z) = 1 + z + ... + z^5/120 + z^6/600 leaves the unit disk at z = -3.3066."""
    x = Variable("x", "1", start=1.0)
    step = build_fixed(assemble(Model("decay", x=(x,), ode=-x.symbol)), DOPRI5)
    assert abs(float(step(1.0, 3.306, []))) < 1
    assert abs(float(step(1.0, 3.307, []))) > 1


def cases(method: Method) -> list[Callable[[], ClosedForm]]:
    """An ODE, an index-1 DAE (states and algebraic unknowns) and explicit time."""
    return [smooth_ode, timed_ode, *([smooth_dae] if method.dae else [])]


each_case = pytest.mark.parametrize(
    ("name", "case"), [(name, case) for name, m in METHODS.items() for case in cases(m)]
)
each_adaptive_case = pytest.mark.parametrize(
    ("name", "case"), [(name, case) for name, m in ADAPTIVE.items() for case in cases(m)]
)


@each_case
def test_order_is_observed(name: str, case: Callable[[], ClosedForm]) -> None:
    """Radau9 gains an order of ODEs at these steps, where its iteration dominates the error."""
    method, counts = METHODS[name], [2, 3, 4] if name == "radau9" else [32, 64, 96]
    errors = [fixed_steps(case(), method, count) for count in counts]
    assert min(errors) > 1e-14
    order = observed_order(counts, errors)
    assert order > method.order - 0.25
    if name != "radau9":
        assert order < method.order + 0.25


@each_adaptive_case
def test_order_of_the_dense_output_is_observed(name: str, case: Callable[[], ClosedForm]) -> None:
    method, counts = METHODS[name], [8, 16, 32] if name == "radau9" else [16, 32, 64]
    errors = [between_fixed_steps(case(), method, count) for count in counts]
    claimed = method.dense_dae if case is smooth_dae else method.dense
    assert observed_order(counts, errors) == pytest.approx(claimed, abs=0.25)


def test_a_pair_without_free_term_has_the_cubic_of_hermite() -> None:
    """The pair of Bogacki and Shampine, order 3."""
    A = np.array([[0, 0, 0, 0], [1 / 2, 0, 0, 0], [0, 3 / 4, 0, 0], [2 / 9, 1 / 3, 4 / 9, 0]])
    H, E = shampine(A[-1], np.zeros(4)), np.array([-5 / 72, 1 / 12, 1 / 9, -1 / 8])
    pair = Explicit(name="BS3", A=A, E=E, H=H, order=3, embedded=2, dense=3, source="1989")
    counts = [16, 32, 64]
    errors = [between_fixed_steps(smooth_ode(), pair, count) for count in counts]
    assert observed_order(counts, errors) == pytest.approx(3, abs=0.25)


@each_adaptive_case
def test_error_estimate_shrinks_with_the_order_of_the_embedded_solution(
    name: str, case: Callable[[], ClosedForm]
) -> None:
    """Of the states; algebraic unknowns do not enter it."""
    method, problem = METHODS[name], case()
    system, h = assemble(problem.model), ca.SX.sym("h")
    error = method.trials(system)(system.y, h, system.d).error
    estimate = ca.Function("estimate", [system.y, h], [error])
    counts = [8, 16, 32] if name == "radau9" else [32, 64, 128]
    found = [np.abs(estimate(problem.exact(0.3), 1 / n).full()[: system.nx]).max() for n in counts]
    assert observed_order(counts, found) == pytest.approx(method.embedded + 1, abs=0.25)


ORDER_REDUCTION = {"rodas5p": 3.0, "rodas4p": 3.0, "rodas3": 1.0, "radau5": 3.0, "radau9": 5.0}
"""Observed on Prothero-Robinson where h is a thousand times the time constant and more."""


@each_stiff
def test_order_reduction_on_prothero_robinson(name: str) -> None:
    """Rodas5P and Radau5 keep 3 of 5, Radau9 5 of 9, Rodas4P 3 of 4, RODAS3 1 of 3, backward Euler
    all of its 1; all errors vanish with the stiffness."""
    counts = [2, 4, 8] if name == "radau9" else [8, 16, 32]
    errors = [fixed_steps(prothero_robinson(1e5), METHODS[name], n) for n in counts]
    kept = ORDER_REDUCTION.get(name, METHODS[name].order)
    assert observed_order(counts, errors) == pytest.approx(kept, abs=0.15)
    stiffer = [fixed_steps(prothero_robinson(1e7), METHODS[name], n) for n in counts]
    assert max(stiffer) < 0.02 * max(errors)


x = Variable("x", "1", start=1.0)


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
    system = assemble(Model("decay", x=(x,), ode=-x.symbol))
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


@pytest.mark.parametrize(("case", "order"), [(smooth_ode(), 7), (smooth_dae(), 5)])
def test_enough_iterations_solve_the_collocation_equations(case: ClosedForm, order: int) -> None:
    """The gap to many iterations shrinks by h^2 an iteration, h in algebraic unknowns."""
    system, y = assemble(case.model), case.exact(0.0)
    few, many = (build_fixed(system, replace(RADAU5, iterations=k)) for k in (3, 12))
    gaps = [float(ca.norm_inf(few(y, 1 / n, []) - many(y, 1 / n, []))) for n in (4, 8, 16)]
    assert observed_order([4, 8, 16], gaps) == pytest.approx(order, abs=0.5)


def test_order_nine_takes_a_quarter_of_the_attempts_at_tight_tolerances() -> None:
    """Of Rodas5P, with smaller errors. An attempt takes about twice the time."""
    model, span = rabinowicz(BrownMcPhee()), 20.0
    exact = simulate(model, span, rtol=1e-12, method="rodas4p")["x"]
    for rtol, ratio in ((1e-8, 0.55), (1e-10, 0.3)):
        attempts, errors = list[int](), list[float]()
        for method in ("rodas5p", "radau9"):
            run = simulate(model, span, rtol=rtol, method=method)
            attempts.append(run.statistics.steps + run.statistics.rejections)
            errors.append(float(np.abs(run["x"] - exact).max() / np.abs(exact).max()))
        assert attempts[1] < ratio * attempts[0]
        assert errors[1] < 0.5 * errors[0]
        assert errors[1] < 10 * rtol


def test_rounding_stops_radau_with_a_narrow_law_a_decade_before_rodas5p() -> None:
    model, methods = rabinowicz(BrownMcPhee(v_t=1e-8)), ("rodas5p", "radau5", "radau9")
    for rtol, able in ((1e-8, [*methods]), (1e-9, ["rodas5p"]), (1e-10, [])):
        limits = {"rtol": rtol, "max_steps": 4000, "throw": False}
        runs = {name: simulate(model, 5.0, method=name, **limits) for name in methods}
        assert [name for name, run in runs.items() if run.status.ok] == able
