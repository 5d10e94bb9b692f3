"""Coefficients: order conditions, stability, and the orders that are observed in fixed steps."""

from collections.abc import Callable, Iterator
from itertools import combinations_with_replacement
from math import prod
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

from symfric import Model, Variable
from symfric.integrator.methods.attempt import build_fixed
from symfric.integrator.methods.families import Explicit, Rosenbrock
from symfric.integrator.methods.method import Method
from symfric.integrator.methods.tableaux import ADAPTIVE, DOPRI5, METHODS, Radau, shampine

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


def nodes(tree: Tree) -> int:
    return 1 + sum(nodes(branch) for branch in tree)


def density(tree: Tree) -> int:
    return nodes(tree) * prod(density(branch) for branch in tree)


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
    return float(weights @ G @ weight(tree)) - theta ** nodes(tree) / density(tree)


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
