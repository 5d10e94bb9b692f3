from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from discretised import EFFORT, all_at_once, free_time, mean_of_scenarios, stage, three_phases

from ocp.formulation.expressions import integral
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.transcription.schemes import Shooting, make_meshes
from ocp.transcription.transcribe import discretise
from ocp.transcription.transcription import Transcription
from ocp.transcription.unknowns import Points, SpanPoints
from symfric import Model, Variable


def put(problem: Problem, scheme: Shooting, intervals: int = 3) -> Transcription:
    return discretise(problem, scheme).on(make_meshes(problem, intervals))


def decay() -> Model:
    """x' = u - 2 t x^2, which is x = 1 / (1 + t^2) from 1 for u = 0."""
    x, u, t = Variable("x", "m", nominal=2.0), Variable("u", "m/s"), ca.SX.sym("t")
    return Model("decay", x=(x,), u=(u,), ode=u.symbol - 2 * t * x.symbol**2, t=t)


def missed(method: str, steps: int) -> tuple[float, float]:
    """Error of the cost and the rows of two phases, whose time goes on, at the exact motion."""
    problem = Problem(
        Phase(decay(), 1.0, start={"x": 1.0}) >> Phase(decay(), 0.5), integral(lambda s: s.x)
    )
    t = put(problem, Shooting(method, steps), 2)
    spans: list[SpanPoints] = []
    for number, (start, T) in enumerate(((0.0, 1.0), (1.0, 0.5))):
        at = start + T * t.meshes[number]
        x = 1 / (1 + at**2)
        none = np.zeros((1, 0))
        spans.append(SpanPoints(T, x[None], none, np.zeros((0, 0)), np.zeros((1, 2))))
    w = t.pack(Points(tuple(spans)))
    f, _ = t.program.gradient(w, t.program.values)
    exact = np.arctan(1.5)
    g = t.program.jacobian(w, t.program.values)[0]
    return abs(float(f) - exact), float(np.abs(g.full()).max())


@pytest.mark.parametrize(("method", "order"), [("backward_euler", 1), ("rodas5p", 5)])
def test_flow_converges_with_the_order_of_its_method(method: str, order: int) -> None:
    few, many = missed(method, 4), missed(method, 8)
    assert np.log2(np.divide(few, many)) == pytest.approx([order, order], abs=0.2)


@pytest.mark.parametrize("make", [free_time, three_phases, mean_of_scenarios])
def test_derivatives_are_those_of_the_flow(make: Callable[[], Problem]) -> None:
    p = put(make(), Shooting("rodas5p", 1), 2).program
    sigma, lam = ca.MX.sym("sigma"), ca.MX.sym("lam", p.g.numel())
    hessian = ca.triu(ca.hessian(sigma * p.f + ca.dot(lam, p.g), p.w)[0])
    outputs = [ca.gradient(p.f, p.w), ca.jacobian(p.g, p.w), hessian]
    expected = ca.Function("by_casadi", [p.w, p.p, sigma, lam], outputs)
    rng = np.random.default_rng(0)
    w, y = rng.uniform(0.9, 1.1, p.w.numel()), rng.standard_normal(p.g.numel())
    found = (p.gradient(w, p.values)[1], p.jacobian(w, p.values)[1], p.hessian(w, p.values, 0.7, y))
    for ours, theirs in zip(found, expected(w, p.values, 0.7, y), strict=True):
        size = max(1.0, float(ca.norm_inf(ca.vec(ca.densify(theirs)))))
        np.testing.assert_allclose(ours.full() / size, theirs.full() / size, atol=1e-10)


def test_conditions_hold_at_every_node_and_with_inputs_at_the_start_too() -> None:
    path = [lambda s: s.v * s.force <= 9]
    problem = Problem(Phase(stage(), 1.0), EFFORT, path=path, bounds={"power": (0.0, 9.0)})
    t = put(problem, Shooting())

    def at(name: str) -> list[float]:
        return [place.fraction for place in t.program.rows if place.name == name]

    np.testing.assert_allclose(at("the bound on power"), [1 / 3, 2 / 3, 1.0])
    np.testing.assert_allclose(at("path condition 1"), [0.0, 1 / 3, 2 / 3, 1.0])


def test_what_is_inside_of_steps_is_refused() -> None:
    with pytest.raises(ValueError, match="Shooting: expected conditions on states and inputs"):
        discretise(all_at_once(), Shooting())
