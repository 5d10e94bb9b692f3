import casadi as ca
import numpy as np
import pytest
from discretised import angles, double_pendulum, four_bar

from ocp.formulation.expressions import integral
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.transcription.schemes import Legendre, Radau, Scheme, make_meshes
from ocp.transcription.transcribe import discretise
from ocp.transcription.transcription import Transcription
from ocp.transcription.unknowns import Points, SpanPoints
from symfric import BrownMcPhee
from symfric.multibody import JointSpringDamper, PrescribedMotion
from symfric.scenes import SliderCrank

EFFORT = integral(lambda s: s.tau**2)
Q_END, V_END = angles(2.0)
MODEL = four_bar()
DRIVEN = {"theta_crank": 2.0, "theta_crank_rate": 0.0}


def put(problem: Problem, scheme: Scheme, intervals: int = 10) -> Transcription:
    return discretise(problem, scheme).on(make_meshes(problem, intervals))


def at_rest(t: Transcription) -> Points:
    """The crank turns evenly, the rest follows from the constraints."""
    spans: list[SpanPoints] = []
    for number, span in enumerate(t.problem.spans):
        model, mesh, inner = span.model, t.meshes[number], t.inner_fractions(number)
        x = model.initial_state()
        nodes, points = (np.tile(x[:, None], (1, s.size)) for s in (mesh, inner))
        for values, s in ((nodes, mesh), (points, inner)):
            values[0] = 1.0 + s
        z = np.tile([[float(v.start)] for v in model.z], (1, inner.size))
        spans.append(SpanPoints(0.5, nodes, points, z, np.zeros((1, mesh.size - 1))))
    return t.consistent(Points(tuple(spans)))


def solved(t: Transcription, start: Points | None = None) -> tuple[str, Points]:
    p = t.program
    quiet = {"ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes", "ipopt.max_iter": 50}
    given = {"no_nlp_grad": True, "calc_lam_p": False}
    solver = ca.nlpsol("solver", "ipopt", p.nlp, quiet | given | p.derivatives)
    bounds = {"lbx": p.lower_w, "ubx": p.upper_w, "lbg": p.lower_g, "ubg": p.upper_g}
    found = solver(x0=t.pack(start or at_rest(t)), p=p.values, **bounds)
    return solver.stats()["return_status"], t.unpack(found["x"])


def off(points: Points) -> float:
    """By how much loops and their rates are open at the nodes."""
    mechanics, x = MODEL.holonomic, MODEL.vector("x")
    assert mechanics is not None
    rate = ca.jtimes(mechanics.phi, x[:3], x[3:])
    both = ca.Function("both", [x], [ca.vertcat(mechanics.phi, rate)])
    nodes = points.spans[0].nodes
    return float(np.abs(both.map(nodes.shape[1])(nodes).full()).max())


@pytest.mark.parametrize("scheme", [Radau(3), Legendre(2)])
@pytest.mark.parametrize("end", [DRIVEN, Q_END | {"theta_crank_rate": 0.0}, Q_END | V_END])
def test_loops_stay_closed_whatever_coordinates_are_named(
    scheme: Scheme, end: dict[str, float]
) -> None:
    status, points = solved(put(Problem(Phase(MODEL, 0.5, end=end), EFFORT), scheme))
    assert status == "Solve_Succeeded"
    assert off(points) < 1e-9
    np.testing.assert_allclose(points.spans[0].nodes[:, -1], [2.0, *_rest(2.0)], atol=1e-8)


def _rest(crank: float) -> list[float]:
    q, _ = angles(crank)
    return [q["theta_rocker"], q["theta_coupler"], 0.0, 0.0, 0.0]


def test_slider_crank_may_name_its_slider_its_crank_or_both() -> None:
    scene = SliderCrank(BrownMcPhee(mu_s=0.2, mu_d=0.15, v_t=0.02), omega=0.0)
    M = scene.mechanism()
    M.force(JointSpringDamper("motor", "crank", actuator=M.input("tau", "N m", nominal=10.0)))
    model = M.build()
    ends: list[np.ndarray] = []
    for names in (("crank",), ("slider",), ("crank", "slider")):
        known = dict(zip(("crank", "slider"), ends[0][:2].tolist(), strict=True)) if ends else {}
        end = {name: known.get(name, 1.0) for name in names} | {"crank_rate": 0.0}
        t = put(Problem(Phase(model, 0.5, end=end), EFFORT), Legendre(2))
        status, points = solved(t, Points((_level(t),)))
        assert status == "Solve_Succeeded"
        ends.append(points.spans[0].nodes[:, -1])
    np.testing.assert_allclose(ends[1:], [ends[0]] * 2, atol=1e-7)


def _level(t: Transcription) -> SpanPoints:
    """All states as they start, on the way to where the crank is asked to be."""
    span, mesh, inner = t.problem.spans[0], t.meshes[0], t.inner_fractions(0)
    ends = [span.nodes[1.0][v.name][0] for v in span.model.x]
    start = span.model.initial_state()
    ends = np.where(np.isfinite(ends), ends, start)
    nodes, points = (start[:, None] + s * (ends - start)[:, None] for s in (mesh, inner))
    z = np.tile([[float(v.start)] for v in span.model.z], (1, inner.size))
    guess = SpanPoints(0.5, nodes, points, z, np.zeros((1, mesh.size - 1)))
    return t.consistent(Points((guess,))).spans[0]


def test_redundant_values_leave_the_jacobian_of_full_rank() -> None:
    for end in (DRIVEN, Q_END | V_END, {}):
        t = put(Problem(Phase(MODEL, 0.5, end=end), EFFORT), Radau(2), 3)
        p = t.program
        J = p.jacobian(t.pack(at_rest(t)), p.values)[1].full()
        J = J[:, p.lower_w < p.upper_w]  # a solver takes fixed unknowns out
        values = np.linalg.svd(J, compute_uv=False)
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
        discretise(Problem(Phase(MODEL, 0.5, end=wrong), EFFORT), Radau(3))


def test_named_start_moves_the_coordinates_that_follow() -> None:
    start = {"theta_crank": 1.2}
    status, points = solved(
        put(Problem(Phase(MODEL, 0.5, start=start, end=DRIVEN), EFFORT), Radau(3))
    )
    q, _ = angles(1.2)
    assert status == "Solve_Succeeded"
    np.testing.assert_allclose(points.spans[0].nodes[1, 0], q["theta_rocker"], atol=1e-9)


def test_what_moves_in_time_goes_on_from_phase_to_phase() -> None:
    """q1 = t^2, 0.4 s and 0.6 s: 1 rad at the end and not 0.36."""
    model = double_pendulum(PrescribedMotion("shoulder", "q1", lambda t: t**2))
    cost = integral(lambda s: s.tau2**2)

    def moved(q1: float) -> Problem:
        return Problem(Phase(model, 0.4) >> Phase(model, 0.6, end={"q1": q1, "q2": 0.1}), cost)

    t = put(moved(1.0), Radau(2), 4)
    spans: list[SpanPoints] = []
    for number, T in enumerate((0.4, 0.6)):
        nodes, inner = (
            np.zeros((4, s.size)) for s in (t.meshes[number], t.inner_fractions(number))
        )
        z = np.tile([[float(v.start)] for v in model.z], (1, inner.shape[1]))
        spans.append(SpanPoints(T, nodes, inner, z, np.zeros((2, 4))))
    status, points = solved(t, t.consistent(Points(tuple(spans))))
    assert status == "Solve_Succeeded"
    at = 0.4 + 0.6 * t.meshes[1]
    np.testing.assert_allclose(points.spans[1].nodes[[0, 2]], [at**2, 2 * at], atol=1e-9)
    with pytest.raises(ValueError, match="end: expected values that satisfy the constraints"):
        discretise(moved(0.36), Radau(2))


def test_constraints_are_written_once_where_phases_meet() -> None:
    """Rows of loops: at every node but the first one of the second phase."""
    both = Phase(MODEL, 0.25) >> Phase(MODEL, 0.25, end=DRIVEN)
    names = [place.name for place in put(Problem(both, EFFORT), Radau(2), 4).program.rows]
    loops = [name for name in names if name in ("the loop 1", "the loop 2")]
    assert len(loops) == 2 * (5 + 4)
    assert sum(name.startswith("the rate of loop") for name in names) == 2 * (5 + 4)


def test_link_of_all_rates_of_a_loop_is_too_much() -> None:
    link = {
        f"theta_{n}_rate": lambda b, n=n: -0.5 * b[f"theta_{n}_rate"] for n in ("crank", "rocker")
    }
    both = Phase(MODEL, 0.25) >> Phase(MODEL, 0.25, link=link)
    with pytest.raises(ValueError, match="link: expected at most 1 expressions for rates"):
        discretise(Problem(both, EFFORT), Radau(2))


def test_link_of_the_crank_takes_the_other_rates_along() -> None:
    link = {"theta_crank_rate": lambda b: -0.5 * b.theta_crank_rate}
    both = Phase(MODEL, 0.25) >> Phase(MODEL, 0.25, link=link)
    names = [place.name for place in put(Problem(both, EFFORT), Radau(2), 2).program.rows]
    assert "the start of theta_crank_rate" in names
    assert "the continuity of theta_crank" in names
    between = [n for n in names if n.endswith("continuity of theta_rocker_rate")]
    assert len(between) == 4  # those of the gaps alone
