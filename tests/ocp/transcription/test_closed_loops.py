"""Mechanisms with loops: closed at every node, with any coordinates named."""

import casadi as ca
import numpy as np
import pytest
from discretised import angles, double_pendulum, four_bar
from phases import slider_crank

from ocp.formulation.expressions import integral
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.transcription.schemes import Legendre, Radau, Scheme, make_meshes
from ocp.transcription.transcribe import Transcription, discretise
from ocp.transcription.unknowns import Points, SpanPoints
from symfric.multibody import PrescribedMotion

EFFORT = integral(lambda s: s.tau**2)
TORQUE = integral(lambda s: s.torque**2)
Q_END, V_END = angles(2.0)
MODEL = four_bar()
DRIVEN = {"theta_crank": 2.0, "theta_crank_rate": 0.0}


def put(problem: Problem, scheme: Scheme, intervals: int = 6) -> Transcription:
    return discretise(problem, scheme).on(make_meshes(problem, intervals))


def towards(t: Transcription, *ends: dict[int, float], T: float = 0.5) -> Points:
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
    return t.consistent(Points(tuple(spans)))


def solved(t: Transcription, start: Points) -> Points:
    p = t.program
    quiet = {"ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes", "ipopt.max_iter": 50}
    lean = {"no_nlp_grad": True, "calc_lam_p": False}
    solver = ca.nlpsol("solver", "ipopt", p.nlp, quiet | lean | p.derivatives)
    bounds = {"lbx": p.lower_w, "ubx": p.upper_w, "lbg": p.lower_g, "ubg": p.upper_g}
    found = solver(x0=t.pack(start), p=p.values, **bounds)
    assert solver.stats()["return_status"] == "Solve_Succeeded"
    return t.unpack(found["x"])


def opening(points: Points) -> float:
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
    t = put(Problem(Phase(MODEL, 0.5, start=start, end=end), EFFORT), scheme)
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
        t = put(Problem(Phase(model, 0.5, end=end), TORQUE), Legendre(2), 4)
        to = {i: end[v.name] for i, v in enumerate(model.x) if v.name in end}
        ends.append(solved(t, towards(t, to)).spans[0].nodes[:, -1])
    np.testing.assert_allclose(ends[1:], [ends[0]] * 2, atol=1e-7)


@pytest.mark.parametrize("end", [DRIVEN, Q_END | V_END, {}])
def test_redundant_values_leave_the_jacobian_of_full_rank(end: dict[str, float]) -> None:
    t = put(Problem(Phase(MODEL, 0.5, end=end), EFFORT), Radau(2), 2)
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
        discretise(Problem(Phase(MODEL, 0.5, end=wrong), EFFORT), Radau(1))


def test_prescribed_motion_continues_from_phase_to_phase() -> None:
    """q1 = t^2, 0.4 s and 0.6 s: 1 rad at the end and not 0.36."""
    model = double_pendulum(PrescribedMotion("shoulder", "q1", lambda t: t**2))

    def moved(q1: float) -> Problem:
        phases = Phase(model, 0.4) >> Phase(model, 0.6, end={"q1": q1, "q2": 0.1})
        return Problem(phases, integral(lambda s: s.tau2**2))

    t = put(moved(1.0), Radau(2), 4)
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
        [row.name for row in put(Problem(both, EFFORT), Radau(2), 2).program.rows]
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
        discretise(Problem(both, EFFORT), Radau(1))
