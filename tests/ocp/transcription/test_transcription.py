from dataclasses import replace
from unittest.mock import patch

import casadi as ca
import numpy as np
import pytest
from discretised import (
    CASES,
    EFFORT,
    all_at_once,
    free_time,
    largest_of_scenarios,
    mean_of_scenarios,
    mechanism,
    stage,
    three_phases,
)
from phases import UNIT, there_and_back, unit_move

from ocp.formulation.expressions import at_end, integral
from ocp.formulation.phase import Free, Phase, Row
from ocp.formulation.problem import Problem
from ocp.transcription.schemes import Legendre, Radau, Scheme, make_meshes
from ocp.transcription.transcribe import discretise
from ocp.transcription.transcription import Transcription
from ocp.transcription.unknowns import Points, SpanPoints
from symfric import Model, Variable

SCHEMES = [Radau(2), Radau(3), Legendre(2), Legendre(3)]


def put(problem: Problem, intervals: int = 4, scheme: Scheme | None = None) -> Transcription:
    return discretise(problem, scheme or Radau(3)).on(make_meshes(problem, intervals))


def at_points(t: Transcription, x: object, u: float, T: float) -> Points:
    """The states x(time) and a constant input, in one span."""
    mesh, inner = T * t.meshes[0], T * t.inner_fractions(0)
    states = [np.array([np.broadcast_to(row, s.shape) for row in x(s)]) for s in (mesh, inner)]
    return Points(
        (SpanPoints(T, *states, np.zeros((0, inner.size)), np.full((1, mesh.size - 1), u)),)
    )


def values(t: Transcription, points: Points) -> tuple[float, np.ndarray]:
    w = t.pack(points)
    f, _ = t.program.gradient(w, t.program.values)
    return float(f), t.program.jacobian(w, t.program.values)[0].full().ravel()


# --- equations ----------------------------------------------------------------------------------


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_a_motion_of_low_degree_satisfies_all_equations(scheme: Scheme) -> None:
    """a = 1 over 2 s: x = t^2/2, v = t."""
    t = put(unit_move(T=2.0), 4, scheme)
    f, g = values(t, at_points(t, lambda s: (s**2 / 2, s), 1.0, 2.0))
    np.testing.assert_allclose(g, 0.0, atol=1e-12)
    assert f == pytest.approx(2.0)  # a^2 over 2 s


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_equations_and_costs_of_every_point_are_taken_at_its_own_time(scheme: Scheme) -> None:
    """x' = t + u under u = 1: x = t^2/2 + t; integral of t and end cost x^2 over 2 s."""
    x, u, time = Variable("x", "m"), Variable("u", "1"), ca.SX.sym("t")
    clock = Model("clock", x=(x,), u=(u,), ode=ca.SX(time + u.symbol), t=time)
    cost = at_end(lambda s: s.x**2) + integral(lambda s: s.t)
    t = put(Problem(Phase(clock, 2.0), cost), 4, scheme)
    f, g = values(t, at_points(t, lambda s: (s**2 / 2 + s,), 1.0, 2.0))
    np.testing.assert_allclose(g, 0.0, atol=1e-12)
    assert f == pytest.approx(16.0 + 2.0)


@pytest.mark.parametrize("free", [False, True])
def test_time_goes_on_from_phase_to_phase(free: bool) -> None:
    """x' = t over 1 s and 2 s: x = t^2/2 in both phases, t at the end is 3 s."""
    x, u, time = Variable("x", "m"), Variable("u", "1"), ca.SX.sym("t")
    clock = Model("clock", x=(x,), u=(u,), ode=ca.SX(time + 0 * u.symbol), t=time)
    first, second = (Free(0.5, 4.0), Free(0.5, 4.0)) if free else (1.0, 2.0)
    t = put(Problem(Phase(clock, first) >> Phase(clock, second), at_end(lambda s: s.x * s.t)), 2)
    spans: list[SpanPoints] = []
    for number, (start, T) in enumerate(((0.0, 1.0), (1.0, 2.0))):
        nodes, inner = start + T * t.meshes[number], start + T * t.inner_fractions(number)
        none = np.zeros((0, inner.size))
        spans.append(
            SpanPoints(T, nodes[None] ** 2 / 2, inner[None] ** 2 / 2, none, np.zeros((1, 2)))
        )
    f, g = values(t, Points(tuple(spans)))
    np.testing.assert_allclose(g, 0.0, atol=1e-12)
    assert f == pytest.approx(4.5 * 3.0)


def test_mechanism_without_inverse_is_the_one_with_it() -> None:
    """The same solutions: implicit rows are M times the explicit ones, over scaled masses."""
    problem = mechanism()
    model = problem.chain[0].model
    explicit = replace(model, holonomic=None)
    phase = replace(problem.chain[0], model=explicit)
    pair = [put(p, 2, Radau(2)) for p in (problem, replace(problem, phases=phase))]
    rng = np.random.default_rng(1)
    w = rng.uniform(0.5, 1.0, pair[0].program.w.numel())
    implicit, plain = (t.program.jacobian(w, t.program.values)[0].full().ravel() for t in pair)
    rows = list(pair[0].program.rows)
    M = ca.Function("M", [model.vector("x"), model.vector("p")], [
        ca.jacobian(model.holonomic.implicit[:2], model.holonomic.a)
    ])  # fmt: skip
    inner = pair[0].unpack(w).spans[0].inner
    h = 0.5 * pair[0].unpack(w).spans[0].T
    place = [
        i
        for i, row in enumerate(rows)
        if row.name.startswith("the equation of q") and "rate" in row.name
    ]
    for k in range(4):
        own = place[2 * k : 2 * k + 2]
        scale = np.array([rows[i].scale for i in own])
        expected = -M(inner[:, k], []).full() @ plain[own]
        np.testing.assert_allclose(implicit[own] * scale, expected, atol=1e-9 * h)


def test_conditions_at_starts_of_intervals_know_the_input_that_begins_there() -> None:
    """x = t^3, a = (1, 2, 3, 4) held over quarters of 1 s: x + 10 a where each of them begins."""
    problem = unit_move()
    x, a = UNIT.expression("x"), UNIT.expression("a")
    row = Row("the sum", x + 10.0 * a, 2.0, np.inf)
    made = discretise(problem, Radau(3), {0: [row]})
    for mesh in (np.linspace(0.0, 1.0, 5), np.array([0.0, 0.1, 0.5, 0.8, 1.0]), np.array([0.0, 1])):
        t = made.on([mesh])
        points = at_points(t, lambda s: (s**3, 3 * s**2), 1.0, 1.0).spans[0]
        u = np.arange(1.0, mesh.size)[None]
        _, g = values(t, Points((replace(points, u=u),)))
        own = [i for i, place in enumerate(t.program.rows) if place.name == "the sum"]
        np.testing.assert_allclose(2.0 * g[own], mesh[1:-1] ** 3 + 10.0 * u[0, 1:])
        fractions = [t.program.rows[i].fraction for i in own]
        np.testing.assert_allclose(fractions, mesh[1:-1])
        assert (t.program.lower_g[own] == 1.0).all()


def test_nominal_values_scale_unknowns_and_rows() -> None:
    """Ten times the nominal values: a tenth of the unknowns and of the rows, the same cost."""
    larger = replace(
        UNIT,
        x=tuple(replace(v, nominal=10.0) for v in UNIT.x),
        u=tuple(replace(v, nominal=10.0) for v in UNIT.u),
    )
    one, ten = put(unit_move()), put(unit_move(model=larger))
    points = at_points(one, lambda s: (s**3, 2 * s), 2.0, 1.0)
    (f, g), (f_10, g_10) = values(one, points), values(ten, points)
    np.testing.assert_allclose(ten.pack(points), one.pack(points) / 10)
    np.testing.assert_allclose(g_10, g / 10, atol=1e-15)
    assert f_10 == pytest.approx(f)
    assert {place.scale for place in ten.program.rows} == {10.0}


# --- names and bounds ---------------------------------------------------------------------------


def test_rows_and_unknowns_are_named_with_their_place() -> None:
    t = put(all_at_once(), 2, Radau(2))
    rows, unknowns = t.program.rows, t.program.unknowns
    assert len(rows) == t.program.g.numel()
    assert len(unknowns) == t.program.w.numel()
    names = [place.name for place in rows]
    assert names[:2] == ["the continuity of x", "the equation of x"]
    for name in ("the algebraic equation 1", "the bound on y", "y at the end", "y at 0.5 T"):
        assert name in names
    via = rows[names.index("y at 0.5 T")]
    assert (via.span, via.fraction) == (0, 0.5)
    join = next(place for place in rows if place.name.startswith("join 1"))
    assert (join.span, join.fraction) == (1, 0.0)
    first = [(place.name, round(place.fraction, 3)) for place in list(unknowns)[:7]]
    assert first == [
        ("x", 0.0),
        ("u", 0.0),
        ("x", 0.167),
        ("z", 0.167),
        ("x", 0.5),
        ("z", 0.5),
        ("x", 0.5),
    ]
    durations = [place for place in unknowns if place.name == "T"]
    assert [place.span for place in durations] == [0, 1]
    assert np.isnan(durations[0].fraction)


def test_a_wrong_slope_shows_in_the_rows_of_its_state_only() -> None:
    t = put(unit_move(T=2.0))
    _, g = values(t, at_points(t, lambda s: (s**2 / 2 + 0.5 * s, s), 1.0, 2.0))
    wrong = {
        place.name for place, value in zip(t.program.rows, g, strict=True) if abs(value) > 1e-9
    }
    assert wrong == {"the equation of x"}


def test_bounds_stand_where_they_are_asked_for() -> None:
    problem = unit_move(bounds={"v": (None, 1.5), "a": (-9.0, 8.0)}, via={0.5: {"x": 0.4}})
    for scheme in (Radau(2), Legendre(2)):
        t = put(problem, 4, scheme)
        lower, upper = (t.unpack(b).spans[0] for b in (t.program.lower_w, t.program.upper_w))
        np.testing.assert_array_equal(lower.nodes[:, [0, -1]], [[0, 1], [0, 0]])
        np.testing.assert_array_equal(upper.nodes[:, [0, -1]], [[0, 1], [0, 0]])
        assert lower.nodes[0, 2] == upper.nodes[0, 2] == 0.4
        assert np.isinf(lower.nodes[1, 1:-1]).all()
        assert (upper.nodes[1, 1:-1] == 1.5).all()
        ends = slice(1, None, 2)  # last points of the intervals: with Radau the nodes have bounds
        assert np.isinf(upper.inner[1, ends]).all() == isinstance(scheme, Radau)
        assert (upper.inner[1, ::2] == 1.5).all()
        assert (lower.u == -9.0).all()
        assert (upper.u == 8.0).all()


def test_shared_inputs_and_durations_are_the_same_unknowns() -> None:
    t = put(largest_of_scenarios())
    light, heavy = t.layout.spans
    np.testing.assert_array_equal(light.u, heavy.u)
    assert light.T == heavy.T
    assert not set(light.nodes.ravel()) & set(heavy.nodes.ravel())
    apart = put(mean_of_scenarios())
    assert not set(apart.layout.spans[0].u.ravel()) & set(apart.layout.spans[2].u.ravel())
    assert apart.layout.spans[0].T == apart.layout.spans[2].T


def test_the_largest_cost_bounds_that_of_every_scenario() -> None:
    t = put(largest_of_scenarios())
    w = np.random.default_rng(0).uniform(0.5, 1.0, t.program.w.numel())
    w = t.pack(t.unpack(w))  # sets the bound
    f, _ = t.program.gradient(w, t.program.values)
    rows = [i for i, place in enumerate(t.program.rows) if place.name == "the largest cost"]
    g = t.program.jacobian(w, t.program.values)[0].full().ravel()[rows]
    T = t.unpack(w).spans[0].T
    cost = float(np.mean(t.unpack(w).spans[0].u ** 2)) * T + T  # equal intervals
    assert g.max() == pytest.approx(0.0, abs=1e-12)
    assert float(f) == pytest.approx(cost)


@pytest.mark.parametrize("make", CASES, ids=lambda make: make.__name__)
def test_unpack_undoes_pack(make: object) -> None:
    t = put(make(), 3, Legendre(2))
    w = np.random.default_rng(0).uniform(0.5, 1.0, t.program.w.numel())
    w[t.layout.largest :] = 0.0 if t.layout.largest >= 0 else w[t.layout.largest :]
    back = t.pack(t.unpack(w))
    extra = np.concatenate([span.extra.ravel() for span in t.layout.spans])
    kept = np.setdiff1d(np.arange(w.size), [*extra, t.layout.largest])
    np.testing.assert_allclose(back[kept], w[kept], rtol=1e-14)


# --- what is made, and how often ----------------------------------------------------------------


def test_what_is_chosen_and_parameters_are_numbers_of_the_program() -> None:
    problem = Problem(Phase(stage(), 1.0, end={"x": 1.0}), EFFORT)
    t = put(problem)
    other = put(replace(problem, p={"m": 2.0}))
    np.testing.assert_array_equal(t.values({"m": 2.0}), other.program.values)
    w = np.full(t.program.w.numel(), 0.3)
    g, g_2 = (x.program.jacobian(w, other.program.values)[0].full() for x in (t, other))
    np.testing.assert_array_equal(g, g_2)
    with pytest.raises(ValueError, match="values"):
        t.values({"mass": 2.0})


def test_a_second_mesh_builds_nothing_and_another_number_differentiates_nothing() -> None:
    made = discretise(three_phases(), Radau(3))
    even, uneven = np.linspace(0, 1, 6), np.linspace(0, 1, 6) ** 2
    one = made.on([even] * 3)
    with patch.object(ca, "Function", side_effect=AssertionError("built")):
        two = made.on([uneven] * 3)
    assert two.program.jacobian is one.program.jacobian
    w = np.full(two.program.w.numel(), 0.4)
    fresh = discretise(three_phases(), Radau(3)).on([uneven] * 3)
    np.testing.assert_array_equal(
        two.program.jacobian(w, two.program.values)[0].full(),
        fresh.program.jacobian(w, fresh.program.values)[0].full(),
    )
    with patch.object(ca, "jacobian", side_effect=AssertionError("differentiated")):
        three = made.on([np.linspace(0, 1, 9)] * 3)
    assert three.program.w.numel() > two.program.w.numel()


def test_scenarios_differ_in_numbers_only() -> None:
    spans = discretise(mean_of_scenarios(), Radau(2)).equations.spans
    assert spans[0].block is spans[2].block
    assert spans[1].block is spans[3].block


@pytest.mark.parametrize("make", [free_time, all_at_once, mechanism, mean_of_scenarios])
def test_nonzeros_grow_linearly_and_the_graph_does_not_grow(make: object) -> None:
    made = discretise(make(), Radau(3))

    def count(intervals: int) -> tuple[list[int], list[int]]:
        p = made.on(make_meshes(made.problem, intervals)).program
        functions = (p.gradient, p.jacobian, p.hessian)
        sizes = [p.w.numel(), p.g.numel(), p.jacobian.nnz_out(1), p.hessian.nnz_out(0)]
        return sizes, [f.n_instructions() for f in functions]

    (few, graph), (more, same), (many, still) = count(4), count(8), count(16)
    assert np.all(np.subtract(many, more) == 2 * np.subtract(more, few))
    assert np.all(np.subtract(more, few) > 0)
    assert graph == same == still


def test_program_of_the_drive_has_the_expected_size() -> None:
    """N intervals of u, 3 points and a copy of (x, v); T. Rows: 3 points and a gap of 2 each."""
    t = put(Problem(Phase(stage(), Free(0.1, 1.0), end={"x": 1.0}), EFFORT), 50)
    p = t.program
    assert (p.w.numel(), p.g.numel()) == (2 + 50 * 9 + 1, 50 * 8)
    # x' couples 4 nodes, v and T; v' couples 4 nodes, force and T; a gap is two entries
    assert p.jacobian.nnz_out(1) == 50 * (3 * (6 + 6) + 2 * 2)


def test_phases_hold_together() -> None:
    t = put(there_and_back(), 2, Radau(2))
    names = [(place.name, place.span) for place in t.program.rows]
    assert names.count(("the continuity of x", 1)) == 1 + 2  # the link, and its own gaps
