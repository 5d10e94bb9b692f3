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
from symfric.integrator.step import blocks, build_fixed, stages
from symfric.integrator.tableaux import ROSENBROCK, Rosenbrock

Array = NDArray[np.floating[Any]]
Tree = tuple["Tree", ...]

each_method = pytest.mark.parametrize("name", ROSENBROCK)


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


def classical(tableau: Rosenbrock) -> tuple[Array, Array, Array]:
    """alpha, beta of the classical form, and the map G of its weights: b = G^T m."""
    G = np.linalg.inv(np.eye(tableau.stages) / tableau.gamma - tableau.C)
    return tableau.A @ G, (tableau.A + np.eye(tableau.stages)) @ G, G


def defect(tableau: Rosenbrock, weights: Array, tree: Tree, theta: float = 1.0) -> float:
    """Residual of the order condition of a tree (Hairer and Wanner, IV.7) after theta h.

    The stage values enter where a node branches, the linearised ones where it does not.
    """
    alpha, beta, G = classical(tableau)

    def weight(branching: Tree) -> Array:
        within = beta if len(branching) == 1 else alpha
        terms = [within @ weight(branch) for branch in branching]
        return np.prod(terms, axis=0) if terms else np.ones(tableau.stages)

    # beta = (A + 1) G is alpha + Gamma with G = Gamma, since T = I / gamma - C is its inverse
    return float(weights @ G @ weight(tree)) - theta ** nodes(tree) / density(tree)


def last_weights(tableau: Rosenbrock) -> Array:
    """Of the stages in the end value: the last stage's argument plus the last stage."""
    return tableau.A[-1] + np.eye(tableau.stages)[-1]


def dense_weights(tableau: Rosenbrock, theta: float) -> Array:
    d = sum(theta**r * row for r, row in enumerate(tableau.H))
    return theta * (last_weights(tableau) + (1 - theta) * d)


def test_rooted_trees_are_complete() -> None:
    assert [len(rooted_trees(n)) for n in range(1, 7)] == [1, 1, 2, 4, 9, 20]
    assert [len(set(rooted_trees(n))) for n in range(1, 7)] == [1, 1, 2, 4, 9, 20]


@each_method
def test_coefficients_have_one_shape_and_lower_triangles(name: str) -> None:
    tableau = ROSENBROCK[name]
    shape = (tableau.stages, tableau.stages)
    assert tableau.A.shape == tableau.C.shape == shape
    assert not np.triu(tableau.A).any()
    assert not np.triu(tableau.C).any()
    assert tableau.H.shape[1] == tableau.stages
    assert tableau.source


@each_method
def test_order_conditions_hold_up_to_the_order_and_no_further(name: str) -> None:
    tableau = ROSENBROCK[name]
    m = last_weights(tableau)
    for order in range(1, tableau.order + 1):
        for tree in rooted_trees(order):
            assert defect(tableau, m, tree) == pytest.approx(0, abs=1e-12), tree
    higher = [abs(defect(tableau, m, tree)) for tree in rooted_trees(tableau.order + 1)]
    assert max(higher) > 1e-4


@each_method
def test_embedded_solution_has_exactly_its_order(name: str) -> None:
    tableau = ROSENBROCK[name]
    for order in range(1, tableau.embedded + 1):
        for tree in rooted_trees(order):
            assert defect(tableau, tableau.A[-1], tree) == pytest.approx(0, abs=1e-12), tree
    higher = [
        abs(defect(tableau, tableau.A[-1], tree)) for tree in rooted_trees(tableau.embedded + 1)
    ]
    assert tableau.embedded == tableau.order - 1
    assert max(higher) > 1e-4


@each_method
@pytest.mark.parametrize("theta", [0.0, 0.2, 0.5, 0.9, 1.0])
def test_dense_output_meets_the_order_conditions_below_the_order(name: str, theta: float) -> None:
    tableau = ROSENBROCK[name]
    m = dense_weights(tableau, theta)
    for order in range(1, tableau.order):
        for tree in rooted_trees(order):
            assert defect(tableau, m, tree, theta) == pytest.approx(0, abs=1e-11), tree


@each_method
def test_stiffly_accurate_step_lands_on_a_linear_constraint(name: str) -> None:
    """Even from values that violate it."""
    x, z = Variable("x", "1"), Variable("z", "1")
    model = Model("line", x=(x,), z=(z,), ode=-z.symbol, alg=z.symbol - 2 * x.symbol - 3)
    x_1, z_1 = build_fixed(assemble(model), ROSENBROCK[name])([1.0, 7.0], 0.3, []).full().ravel()
    assert z_1 == pytest.approx(2 * x_1 + 3, abs=1e-13)


@each_method
def test_oscillation_never_grows_whatever_the_step(name: str) -> None:
    """A-stable: the step maps the circle into itself for every h omega (no pole is on the left)."""
    x, y = Variable("x", "1"), Variable("y", "1")
    model = Model("circle", x=(x, y), ode=ca.vertcat(y.symbol, -x.symbol))
    step = build_fixed(assemble(model), ROSENBROCK[name])
    radii = [np.linalg.norm(step([1.0, 0.0], h, []).full()) for h in np.logspace(-3, 6, 901)]
    assert max(radii) <= 1 + 1e-13
    assert ROSENBROCK[name].gamma > 0


@each_method
@pytest.mark.parametrize("rate", [1e8, 1e12])
def test_fast_transient_is_gone_after_one_step(name: str, rate: float) -> None:
    """L-stable: R(-inf) = 0."""
    x = Variable("x", "1", start=1.0)
    step = build_fixed(assemble(Model("fast", x=(x,), ode=-rate * x.symbol)), ROSENBROCK[name])
    assert abs(float(step(1.0, 1.0, []))) < 100 / rate


@each_method
@pytest.mark.parametrize("case", [smooth_ode, smooth_dae, timed_ode])
def test_order_is_observed(name: str, case: Callable[[], ClosedForm]) -> None:
    """On an ODE, an index-1 DAE (states and algebraic unknowns) and with explicit time."""
    tableau, counts = ROSENBROCK[name], [16, 32, 64, 128]
    errors = [fixed_steps(case(), tableau, count) for count in counts]
    assert min(errors) > 1e-14
    assert observed_order(counts, errors) == pytest.approx(tableau.order, abs=0.25)


@each_method
@pytest.mark.parametrize("case", [smooth_ode, smooth_dae, timed_ode])
def test_order_of_the_dense_output_is_observed(name: str, case: Callable[[], ClosedForm]) -> None:
    """That of the method without algebraic unknowns, `dense` with them."""
    tableau, counts = ROSENBROCK[name], [16, 32, 64]
    errors = [between_fixed_steps(case(), tableau, count) for count in counts]
    claimed = tableau.dense if case is smooth_dae else tableau.order
    assert observed_order(counts, errors) == pytest.approx(claimed, abs=0.25)


@each_method
@pytest.mark.parametrize("case", [smooth_ode, smooth_dae])
def test_error_estimate_shrinks_with_the_order_of_the_embedded_solution(
    name: str, case: Callable[[], ClosedForm]
) -> None:
    """Of the states; algebraic unknowns do not enter it."""
    tableau, problem = ROSENBROCK[name], case()
    system, h = assemble(problem.model), ca.SX.sym("h")
    _, error, _ = stages(blocks(system, tableau), tableau, system.y, h, system.d)
    estimate = ca.Function("estimate", [system.y, h], [error])
    counts = [16, 32, 64]
    found = [np.abs(estimate(problem.exact(0.3), 1 / n).full()[:2]).max() for n in counts]
    assert observed_order(counts, found) == pytest.approx(tableau.embedded + 1, abs=0.25)


ORDER_REDUCTION = {"rodas5p": 3.0, "rodas4p": 3.0, "rodas3": 1.0}
"""Observed on Prothero-Robinson where h is a thousand times the time constant and more."""


@each_method
def test_order_reduction_on_prothero_robinson(name: str) -> None:
    """Rodas5P keeps 3 of 5, Rodas4P 3 of 4, RODAS3 1 of 3; all errors vanish with the stiffness."""
    counts = [8, 16, 32]
    errors = [fixed_steps(prothero_robinson(1e5), ROSENBROCK[name], n) for n in counts]
    assert observed_order(counts, errors) == pytest.approx(ORDER_REDUCTION[name], abs=0.15)
    stiffer = [fixed_steps(prothero_robinson(1e7), ROSENBROCK[name], n) for n in counts]
    assert max(stiffer) < 0.02 * max(errors)
