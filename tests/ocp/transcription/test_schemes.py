"""Coefficients and order of the schemes, and meshes."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from discretised import EFFORT, largest_of_scenarios, mean_of_scenarios, stage
from numpy.polynomial import Polynomial

from ocp.formulation.expressions import at_end
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.transcription.schemes import Legendre, Radau, Scheme, Shooting, make_meshes
from ocp.transcription.transcribe import discretise
from symfric import Model, Variable

EVERY = [kind(degree) for kind in (Radau, Legendre) for degree in (1, 2, 3, 5, 9)]


@pytest.mark.parametrize("scheme", EVERY, ids=str)
def test_coefficients_are_exact_for_their_polynomials(scheme: Radau | Legendre) -> None:
    c, d = scheme.coefficients(), scheme.degree
    rng = np.random.default_rng(d)
    p = Polynomial(rng.standard_normal(d + 1))
    np.testing.assert_allclose(c.slopes.T @ p(c.nodes), p.deriv()(c.nodes[1:]), atol=1e-9)
    assert c.ends @ p(c.nodes) == pytest.approx(p(1.0), abs=1e-11)
    r = Polynomial(rng.standard_normal(d))
    assert c.inner_ends @ r(c.nodes[1:]) == pytest.approx(r(1.0), abs=1e-11)
    q = Polynomial(rng.standard_normal(scheme.order))  # quadrature is exact to order - 1
    assert c.weights @ q(c.nodes[1:]) == pytest.approx(q.integ()(1.0), abs=1e-12)


def test_radau_meets_the_end_of_its_interval_exactly() -> None:
    for degree in range(1, 10):
        c = Radau(degree).coefficients()
        assert c.meets_end
        np.testing.assert_array_equal(c.ends, np.eye(degree + 1)[-1])
    assert not Legendre(3).coefficients().meets_end


@pytest.mark.parametrize(
    "make",
    [
        *(lambda d=d, kind=kind: kind(d) for kind in (Radau, Legendre) for d in (0, 10, 2.5, "3")),
        lambda: Shooting("rodas", 2),
        lambda: Shooting("rodas5p", 0),
    ],
)
def test_impossible_schemes_are_refused(make: Callable[[], Scheme]) -> None:
    with pytest.raises(ValueError, match=r"(Radau|Legendre): degree|Shooting: (method|steps)"):
        make()


def error(scheme: Scheme, intervals: int) -> float:
    """Error at the end of x' = 1 + x^2, x = tan t over 1 s, solved by Newton's method."""
    x, u = Variable("x", "1"), Variable("u", "1")
    model = Model("tangent", x=(x,), u=(u,), ode=1 + x.symbol**2 + 0 * u.symbol)
    problem = Problem(Phase(model, 1.0, start={"x": 0.0}), at_end(lambda s: s.x))
    p = discretise(problem, scheme).on(make_meshes(problem, intervals)).program
    w, free = np.zeros(p.w.numel()), p.lower_w < p.upper_w
    free[[place.name == "u" for place in p.unknowns]] = False
    for _ in range(12):
        g, J = p.jacobian(w, p.values)
        w[free] -= np.linalg.solve(J.full()[:, free], g.full().ravel())
    last = max(i for i, place in enumerate(p.unknowns) if place.name == "x")
    return abs(w[last] - np.tan(1.0))


@pytest.mark.parametrize(
    ("scheme", "intervals"),
    [(Radau(1), 40), (Radau(2), 10), (Radau(3), 4), (Legendre(1), 20), (Legendre(2), 6),
     (Legendre(3), 6)],
)  # fmt: skip
def test_order_at_the_nodes(scheme: Radau | Legendre, intervals: int) -> None:
    rate = np.log2(error(scheme, intervals) / error(scheme, 2 * intervals))
    assert rate == pytest.approx(scheme.order, abs=0.25)


ONE = Problem(Phase(stage(), 1.0, via={0.5: {"x": 0.5}, 0.3: {"x": 0.2}}), EFFORT)
TWO = Problem(Phase(stage(), 1.0, end={"x": 1.0}) >> Phase(stage(), 1.0), EFFORT)


@pytest.mark.parametrize(
    ("intervals", "sizes"),
    [(3, [4, 4]), ([3, 5], [4, 6]), ([0, 0.2, 1], [3, 3]), ([[0, 0.2, 1], 4], [3, 5])],
)
def test_meshes_are_numbers_or_fractions_for_all_phases_or_each(
    intervals: Any, sizes: list[int]
) -> None:
    assert [mesh.size for mesh in make_meshes(TWO, intervals)] == sizes


def test_via_points_become_nodes_and_scenarios_have_meshes() -> None:
    np.testing.assert_allclose(make_meshes(ONE, 4)[0], [0, 0.25, 0.3, 0.5, 0.75, 1])
    np.testing.assert_allclose(make_meshes(ONE, [0, 0.4, 1])[0], [0, 0.3, 0.4, 0.5, 1])
    assert len(make_meshes(mean_of_scenarios(), 3)) == 4


@pytest.mark.parametrize(
    "intervals", [0, -3, 2.5, True, "3", [0.0], [0, 0.5], [0.1, 1.0], [0, 0.6, 0.5, 1], [[0, 1]]]
)
def test_impossible_meshes_are_refused(intervals: Any) -> None:
    with pytest.raises(ValueError, match="intervals: expected"):
        make_meshes(TWO, intervals)


@pytest.mark.parametrize(
    ("problem", "meshes", "text"),
    [
        (ONE, [[0.0, 0.5, 1.0]], r"expected a node at 0\.3"),
        (TWO, [[0.0, 1.0]] * 3, r"meshes: expected 2, one for each phase, .* got 3"),
        (ONE, [[0.0, 0.6, 0.5, 1.0]], "increasing fractions"),
        (ONE, [[0.0, 0.9]], "got 2 numbers from 0 to 0.9"),
        (ONE, [[]], "got none"),
        (
            largest_of_scenarios(),
            [[0.0, 0.5, 1.0], [0.0, 0.4, 1.0]],
            "expected the same in all scenarios",
        ),
    ],
)
def test_meshes_fit_the_phases(problem: Problem, meshes: list[list[float]], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        discretise(problem, Radau(2)).on([np.array(mesh) for mesh in meshes])
