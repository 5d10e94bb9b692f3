"""Coefficients and order of the schemes, meshes, and mechanisms whose loops stay closed."""

from typing import Any

import casadi as ca
import numpy as np
import pytest
from discretised import EFFORT, angles, double_pendulum, four_bar, mean_of_scenarios, stage
from numpy.polynomial import Polynomial
from phases import on, slider_crank

from ocp.formulation.expressions import at_end, integral
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.transcription.schemes import Legendre, Radau, Scheme, make_meshes
from ocp.transcription.transcribe import Transcription, discretise
from ocp.transcription.unknowns import SpanPoints, Values
from symfric import Model, Variable
from symfric.multibody import PrescribedMotion

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


def error(scheme: Scheme, intervals: int) -> float:
    """Error at the end of x' = 1 + x^2, x = tan t over 1 s, solved by Newton's method."""
    x, u = Variable("x", "1"), Variable("u", "1")
    model = Model("tangent", x=(x,), u=(u,), ode=1 + x.symbol**2 + 0 * u.symbol)
    problem = Problem(Phase(model, 1.0, start={"x": 0.0}), at_end(lambda s: s.x))
    p = on(problem, intervals, scheme).program
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


def test_meshes_have_nodes_at_conditions() -> None:
    with pytest.raises(ValueError, match=r"expected a node at 0\.3"):
        discretise(ONE, Radau(2)).on([np.array([0.0, 0.5, 1.0])])


LEAST = integral(lambda s: s.tau**2)
TORQUE = integral(lambda s: s.torque**2)
Q_END, V_END = angles(2.0)
MODEL = four_bar()
DRIVEN = {"theta_crank": 2.0, "theta_crank_rate": 0.0}


def towards(t: Transcription, *ends: dict[int, float], T: float = 0.5) -> Values:
    """States from their start straight to the `ends` of each phase, moved onto the constraints."""
    spans: list[SpanPoints] = []
    for number, (span, end) in enumerate(zip(t.problem.spans, ends, strict=True)):
        model, mesh, inner = span.model, t.meshes[number], t.inner_fractions(number)
        x = model.initial_state()
        change = np.zeros((x.size, 1))
        for i, value in end.items():
            change[i] = value - x[i]
        nodes, points = (x[:, None] + s * change for s in (mesh, inner))
        z = np.tile([[float(v.start)] for v in model.z], (1, inner.size))
        spans.append(SpanPoints(T, nodes, points, z, np.zeros((len(model.u), mesh.size - 1))))
    return t.consistent(Values(tuple(spans)))


def solved(t: Transcription, start: Values) -> Values:
    p = t.program
    quiet = {"ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes", "ipopt.max_iter": 50}
    lean = {"no_nlp_grad": True, "calc_lam_p": False}
    solver = ca.nlpsol("solver", "ipopt", p.nlp, quiet | lean | p.derivatives)
    bounds = {"lbx": p.lower_w, "ubx": p.upper_w, "lbg": p.lower_g, "ubg": p.upper_g}
    found = solver(x0=t.pack(start), p=p.values, **bounds)
    assert solver.stats()["return_status"] == "Solve_Succeeded"
    return t.unpack(found["x"])


def opening(points: Values) -> float:
    """Largest residual of the loops and of their rates at the nodes."""
    mechanics, x = MODEL.holonomic, MODEL.vector("x")
    assert mechanics is not None
    rate = ca.jtimes(mechanics.phi, x[:3], x[3:])
    both = ca.Function("both", [x], [ca.vertcat(mechanics.phi, rate)])
    nodes = points.spans[0].nodes
    return float(np.abs(both.map(nodes.shape[1])(nodes).full()).max())


@pytest.mark.parametrize(
    ("scheme", "end"),
    [
        (Radau(3), DRIVEN),
        (Legendre(2), Q_END | {"theta_crank_rate": 0.0}),
        (Radau(2), Q_END | V_END),
    ],
)
def test_loops_stay_closed_with_any_coordinates_named(
    scheme: Scheme, end: dict[str, float]
) -> None:
    start = {"theta_crank": 1.2}
    t = on(Problem(Phase(MODEL, 0.5, start=start, end=end), LEAST), 6, scheme)
    points = solved(t, towards(t, {0: 2.0}))
    assert opening(points) < 1e-9
    last = [2.0, Q_END["theta_rocker"], Q_END["theta_coupler"], 0.0, 0.0, 0.0]
    np.testing.assert_allclose(points.spans[0].nodes[:, -1], last, atol=1e-8)
    rocker = angles(1.2)[0]["theta_rocker"]  # follows from the named start
    np.testing.assert_allclose(points.spans[0].nodes[1, 0], rocker, atol=1e-9)


def test_slider_crank_may_name_its_slider_its_crank_or_both() -> None:
    model, ends = slider_crank(), list[np.ndarray]()
    for names in (("crank",), ("slider",), ("crank", "slider")):
        known = dict(zip(("crank", "slider"), ends[0][:2].tolist(), strict=True)) if ends else {}
        end = {name: known.get(name, 1.0) for name in names} | {"crank_rate": 0.0}
        t = on(Problem(Phase(model, 0.5, end=end), TORQUE), 4, Legendre(2))
        to = {i: end[v.name] for i, v in enumerate(model.x) if v.name in end}
        ends.append(solved(t, towards(t, to)).spans[0].nodes[:, -1])
    np.testing.assert_allclose(ends[1:], [ends[0]] * 2, atol=1e-7)


@pytest.mark.parametrize("end", [DRIVEN, Q_END | V_END, {}])
def test_redundant_values_leave_the_jacobian_of_full_rank(end: dict[str, float]) -> None:
    t = on(Problem(Phase(MODEL, 0.5, end=end), LEAST), 2, Radau(2))
    p = t.program
    J = p.jacobian(t.pack(towards(t, {0: 2.0})), p.values)[1].full()
    values = np.linalg.svd(J[:, p.lower_w < p.upper_w], compute_uv=False)  # without fixed ones
    assert values[-1] > 1e-4 * values[0]


@pytest.mark.parametrize(
    "wrong",
    [
        Q_END | {"theta_coupler": Q_END["theta_coupler"] + 1e-3},
        {"theta_rocker": 0.0},  # beyond reach
        Q_END | V_END | {"theta_coupler_rate": 1.0},
    ],
)
def test_values_that_open_the_loops_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="end: expected values that satisfy the constraints"):
        discretise(Problem(Phase(MODEL, 0.5, end=wrong), LEAST), Radau(1))


def test_prescribed_motion_continues_from_phase_to_phase() -> None:
    """q1 = t^2, 0.4 s and 0.6 s: 1 rad at the end and not 0.36."""
    model = double_pendulum(PrescribedMotion("shoulder", "q1", lambda t: t**2))

    def moved(q1: float) -> Problem:
        phases = Phase(model, 0.4) >> Phase(model, 0.6, end={"q1": q1, "q2": 0.1})
        return Problem(phases, integral(lambda s: s.tau2**2))

    t = on(moved(1.0), 4, Radau(2))
    points = solved(t, towards(t, {}, {}))
    at = 0.4 + 0.6 * t.meshes[1]
    np.testing.assert_allclose(points.spans[1].nodes[[0, 2]], [at**2, 2 * at], atol=1e-9)
    with pytest.raises(ValueError, match="end: expected values that satisfy the constraints"):
        discretise(moved(0.36), Radau(2))


def test_constraints_and_links_are_imposed_once_between_phases() -> None:
    """Rows of loops: at every node but the first one of the second phase."""
    link = {"theta_crank_rate": lambda b: -0.5 * b.theta_crank_rate}
    plain = Phase(MODEL, 0.25) >> Phase(MODEL, 0.25, end=DRIVEN)
    linked = Phase(MODEL, 0.25) >> Phase(MODEL, 0.25, link=link)
    names, others = (
        [row.name for row in on(Problem(both, LEAST), 2, Radau(2)).program.rows]
        for both in (plain, linked)
    )
    assert sum(name in ("the loop 1", "the loop 2") for name in names) == 2 * (3 + 2)
    assert sum(name.startswith("the rate of loop") for name in names) == 2 * (3 + 2)
    assert "the start of theta_crank_rate" in others
    assert "the continuity of theta_crank" in others
    # the rates of the others follow from the loops: rows of the gaps alone
    assert sum(name.endswith("continuity of theta_rocker_rate") for name in others) == 4
    link["theta_rocker_rate"] = lambda b: -0.5 * b.theta_rocker_rate
    both = Phase(MODEL, 0.25) >> Phase(MODEL, 0.25, link=link)
    with pytest.raises(ValueError, match="link: expected at most 1 expressions for rates"):
        discretise(Problem(both, LEAST), Radau(1))
