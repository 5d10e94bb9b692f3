"""Programs on meshes: equations, derivatives, names, bounds, structure, and their reuse."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from typing import Any
from unittest.mock import patch

import casadi as ca
import discretised
import numpy as np
import pytest
from discretised import CASES, EFFORT, all_at_once, mean_of_scenarios, mechanism, stage
from phases import UNIT, on, unit_move
from tables import sampled

from ocp import solve
from ocp.formulation.expressions import at_end, integral
from ocp.formulation.phase import FREE, Free, Phase, Row
from ocp.formulation.problem import Problem
from ocp.transcription.intervals import FUNCTIONS, PointEquations
from ocp.transcription.schemes import Legendre, Radau, Scheme, Shooting, make_meshes
from ocp.transcription.transcribe import Transcription, discretise
from ocp.transcription.unknowns import SpanPoints, Values
from symfric import Model, Variable

LOW = [Radau(2), Legendre(2), Legendre(3)]


@cache
def cased(make: Callable[[], Problem]) -> Transcription:
    """Return one of the `CASES` on three intervals."""
    return on(make(), 3, Radau(2))


def motion(
    t: Transcription, x: Callable[[np.ndarray], Sequence[object]], u: float, *durations: float
) -> Values:
    """The states x(time) of consecutive spans, and a constant input."""
    spans: list[SpanPoints] = []
    begin = 0.0
    for number, T in enumerate(durations):
        mesh, inner = (begin + T * s for s in (t.meshes[number], t.inner_fractions(number)))
        states = [np.array([np.broadcast_to(row, s.shape) for row in x(s)]) for s in (mesh, inner)]
        z = np.zeros((0, inner.size))
        spans.append(SpanPoints(T, *states, z, np.full((1, mesh.size - 1), u)))
        begin += T
    return Values(tuple(spans))


def values(t: Transcription, points: Values) -> tuple[float, np.ndarray]:
    w = t.pack(points)
    f, _ = t.program.gradient(w, t.program.values)
    return float(f), t.program.jacobian(w, t.program.values)[0].full().ravel()


def clock(rate: Callable[[ca.SX, ca.SX], ca.SX]) -> Model:
    x, u, t = Variable("x", "m"), Variable("u", "1"), ca.SX.sym("t")
    return Model("clock", x=(x,), u=(u,), ode=ca.SX(rate(t, u.symbol)), t=t)


@pytest.mark.parametrize("scheme", LOW, ids=str)
def test_motion_of_low_degree_satisfies_all_equations_at_their_times(scheme: Scheme) -> None:
    t = on(unit_move(T=2.0), 4, scheme)
    f, g = values(t, motion(t, lambda s: (s**2 / 2, s), 1.0, 2.0))
    np.testing.assert_allclose(g, 0.0, atol=1e-12)
    assert f == pytest.approx(2.0)  # a^2 over 2 s
    phase = Phase(clock(lambda t, u: t + u), 2.0)  # x' = t + u
    t = on(Problem(phase, at_end(lambda s: s.x**2) + integral(lambda s: s.t)), 4, scheme)
    f, g = values(t, motion(t, lambda s: (s**2 / 2 + s,), 1.0, 2.0))
    np.testing.assert_allclose(g, 0.0, atol=1e-12)
    assert f == pytest.approx(16.0 + 2.0)


@pytest.mark.parametrize("T", [(1.0, 2.0), (Free(0.5, 4.0), Free(0.5, 4.0))])
def test_time_continues_from_phase_to_phase(T: tuple[float | Free, ...]) -> None:
    first, second = (Phase(clock(lambda t, u: t + 0 * u), one) for one in T)
    t = on(Problem(first >> second, at_end(lambda s: s.x * s.t)), 2)
    f, g = values(t, motion(t, lambda s: (s**2 / 2,), 0.0, 1.0, 2.0))
    np.testing.assert_allclose(g, 0.0, atol=1e-12)
    assert f == pytest.approx(4.5 * 3.0)


def test_implicit_rows_of_a_mechanism_are_the_explicit_ones_times_its_masses() -> None:
    problem = mechanism()
    model = problem.chain[0].model
    explicit = replace(problem.chain[0], model=replace(model, holonomic=None))
    pair = [on(p, 2, Radau(2)) for p in (problem, replace(problem, phases=explicit))]
    w = np.random.default_rng(1).uniform(0.5, 1.0, pair[0].program.w.numel())
    implicit, plain = (t.program.jacobian(w, t.program.values)[0].full().ravel() for t in pair)
    masses = ca.jacobian(model.holonomic.implicit[:2], model.holonomic.a)
    M = ca.Function("M", [model.vector("x"), model.vector("p")], [masses])
    rows, span = pair[0].program.rows, pair[0].unpack(w).spans[0]
    names = ("the equation of q1_rate", "the equation of q2_rate")
    place = [i for i, row in enumerate(rows) if row.name in names]
    for k, own in enumerate(np.reshape(place, (4, 2))):
        expected = -M(span.inner[:, k], []).full() @ plain[own]
        scaled = implicit[own] * [rows[i].scale for i in own]
        np.testing.assert_allclose(scaled, expected, atol=1e-9 * 0.5 * span.T)


def test_conditions_at_starts_of_intervals_use_the_input_that_begins_there() -> None:
    """x = t^3, a = (1, 2, 3, 4) held over quarters of 1 s: x + 10 a where each of them begins."""
    row = Row("the sum", UNIT.expression("x") + 10.0 * UNIT.expression("a"), 2.0, np.inf)
    made = discretise(unit_move(), Radau(3), {0: [row]})
    for mesh in (np.linspace(0.0, 1.0, 5), np.array([0.0, 0.1, 0.5, 0.8, 1.0]), np.array([0.0, 1])):
        t = made.on([mesh])
        u = np.arange(1.0, mesh.size)[None]
        points = motion(t, lambda s: (s**3, 3 * s**2), 1.0, 1.0).spans[0]
        _, g = values(t, Values((replace(points, u=u),)))
        own = [i for i, place in enumerate(t.program.rows) if place.name == "the sum"]
        np.testing.assert_allclose(2.0 * g[own], mesh[1:-1] ** 3 + 10.0 * u[0, 1:])
        np.testing.assert_allclose([t.program.rows[i].fraction for i in own], mesh[1:-1])
        assert (t.program.lower_g[own] == 1.0).all()


def test_path_conditions_with_inputs_hold_between_the_collocation_points() -> None:
    # Rayleigh's problem with u <= -x/6: x falls within intervals, so u + x/6 is largest at starts
    x, y, u = (Variable(name, "1") for name in "xyu")
    speeding = -x.symbol + y.symbol * (1.4 - 0.14 * y.symbol**2) + 4.0 * u.symbol
    model = Model("rayleigh", x=(x, y), u=(u,), ode=ca.vertcat(y.symbol, speeding))
    ahead = Phase(model, 4.5, start={"x": -5.0, "y": -5.0}, path=[lambda s: s.u + s.x / 6.0 <= 0.0])
    problem = Problem(ahead, integral(lambda s: s.u**2 + s.x**2))
    excess: list[float] = []
    for intervals in (30, 60):
        made = solve(problem, intervals=intervals, refine=False)
        excess.append(made.cost - 44.8044)  # Maurer and Augustin 2001, by continuous inputs
        assert made.verified
        nodes = np.searchsorted(made.t, made.t_control)
        assert np.max(made.controls["u"] + made["x"][nodes] / 6.0) == pytest.approx(0.0, abs=1e-7)
    assert excess[0] / excess[1] == pytest.approx(2.0, rel=0.15)  # inputs constant on intervals


def test_nominal_values_scale_unknowns_and_rows() -> None:
    x, u = (tuple(replace(v, nominal=10.0) for v in group) for group in (UNIT.x, UNIT.u))
    larger = replace(UNIT, x=x, u=u)
    one, ten = on(unit_move(), 4), on(unit_move(model=larger), 4)
    points = motion(one, lambda s: (s**3, 2 * s), 2.0, 1.0)
    (f, g), (f_10, g_10) = values(one, points), values(ten, points)
    np.testing.assert_allclose(ten.pack(points), one.pack(points) / 10)
    np.testing.assert_allclose(g_10, g / 10, atol=1e-15)
    assert f_10 == pytest.approx(f)
    assert {place.scale for place in ten.program.rows} == {10.0}


@pytest.mark.parametrize(
    ("make", "scheme"),
    [
        *((make, Radau(2)) for make in CASES),
        *((make, Legendre(3)) for make in (all_at_once, mechanism, mean_of_scenarios)),
        (discretised.free_time, Shooting("rodas5p", 1)),
        (discretised.three_phases, Shooting("rodas5p", 1)),
    ],
    ids=lambda value: getattr(value, "__name__", str(value)),
)  # fmt: skip
def test_derivatives_and_their_sparsity_are_those_of_the_rows(
    make: Callable[[], Problem], scheme: Scheme
) -> None:
    """Compare with the derivatives of the graph of f and g that CasADi makes."""
    made = cased(make) if scheme == Radau(2) else on(make(), 3, scheme)
    p, by_steps = made.program, isinstance(scheme, Shooting)
    sigma, lam = ca.MX.sym("sigma"), ca.MX.sym("lam", p.g.numel())
    hessian = ca.triu(ca.hessian(sigma * p.f + ca.dot(lam, p.g), p.w)[0])
    graph = [p.f, ca.gradient(p.f, p.w), p.g, ca.jacobian(p.g, p.w), hessian]
    rng = np.random.default_rng(0)
    w, y = rng.uniform(0.9, 1.1, p.w.numel()), rng.standard_normal(p.g.numel())
    expected = ca.Function("by_casadi", [p.w, p.p, sigma, lam], graph)(w, p.values, 0.7, y)
    found = (*p.gradient(w, p.values), *p.jacobian(w, p.values), p.hessian(w, p.values, 0.7, y))
    for ours, theirs in zip(found, expected, strict=True):
        assert by_steps or ours.sparsity() == theirs.sparsity() or ours.is_dense()
        size = max(1.0, float(ca.norm_inf(ca.vec(ca.densify(theirs)))))
        np.testing.assert_allclose(ours.full() / size, theirs.full() / size, atol=1e-11)


def missed(method: str, steps: int) -> tuple[float, float]:
    """Errors of cost and rows by shooting over two phases, at an exact motion.

    x' = u - 2 t x^2 from 1 is x = 1 / (1 + t^2) for u = 0, its integral arctan t.
    """
    x, u, t = Variable("x", "m", nominal=2.0), Variable("u", "m/s"), ca.SX.sym("t")
    decay = Model("decay", x=(x,), u=(u,), ode=u.symbol - 2 * t * x.symbol**2, t=t)
    phases = Phase(decay, 1.0, start={"x": 1.0}) >> Phase(decay, 0.5)
    made = on(Problem(phases, integral(lambda s: s.x)), 2, Shooting(method, steps))
    spans = motion(made, lambda s: (1 / (1 + s**2),), 0.0, 1.0, 0.5).spans
    f, g = values(made, Values(tuple(replace(span, z=np.zeros((0, 0))) for span in spans)))
    return abs(f - np.arctan(1.5)), float(np.abs(g).max())


@pytest.mark.parametrize(("method", "order"), [("backward_euler", 1), ("rodas5p", 5)])
def test_shooting_converges_with_the_order_of_its_method(method: str, order: int) -> None:
    few, many = missed(method, 2), missed(method, 4)
    assert np.log2(np.divide(few, many)) == pytest.approx([order, order], abs=0.35)


def test_shooting_has_conditions_at_every_node_and_with_inputs_at_the_start_too() -> None:
    path = [lambda s: s.v * s.force <= 9]
    problem = Problem(Phase(stage(), 1.0), EFFORT, path=path, bounds={"power": (0.0, 9.0)})
    made = discretise(problem, Shooting())
    assert made.spans[0].block.rows.is_a("SXFunction")  # steps of a small model are expanded
    rows = made.on(make_meshes(problem, 3)).program.rows
    at = {name: [r.fraction for r in rows if r.name == name] for name in {r.name for r in rows}}
    np.testing.assert_allclose(at["the bound on power"], [1 / 3, 2 / 3, 1.0])
    np.testing.assert_allclose(at["path condition 1"], [0.0, 1 / 3, 2 / 3, 1.0])
    with pytest.raises(ValueError, match="Shooting: expected conditions on states and inputs"):
        discretise(all_at_once(), Shooting())


def test_rows_and_unknowns_are_named_with_their_place() -> None:
    program = on(all_at_once(), 2, Radau(2)).program
    rows, unknowns = program.rows, program.unknowns
    assert (len(rows), len(unknowns)) == (program.g.numel(), program.w.numel())
    names = [place.name for place in rows]
    assert names[:2] == ["the continuity of x", "the equation of x"]
    assert {"the algebraic equation 1", "the bound on y", "y at the end", "y at 0.5 T"} < {*names}
    via = rows[names.index("y at 0.5 T")]
    join = next(place for place in rows if place.name.startswith("join 1"))
    assert (via.span, via.fraction, join.span, join.fraction) == (0, 0.5, 1, 0.0)
    first = " ".join(f"{place.name} {place.fraction:.3f}" for place in list(unknowns)[:7])
    assert first == "x 0.000 u 0.000 x 0.167 z 0.167 x 0.500 z 0.500 x 0.500"
    durations = [place for place in unknowns if place.name == "T"]
    assert [place.span for place in durations] == [0, 1]
    assert np.isnan(durations[0].fraction)
    t = on(unit_move(T=2.0), 4)
    _, g = values(t, motion(t, lambda s: (s**2 / 2 + 0.5 * s, s), 1.0, 2.0))
    wrong = {row.name for row, x in zip(t.program.rows, g, strict=True) if abs(x) > 1e-9}
    assert wrong == {"the equation of x"}


@pytest.mark.parametrize("scheme", [Radau(2), Legendre(2)], ids=str)
def test_bounds_apply_once_at_their_places(scheme: Scheme) -> None:
    problem = unit_move(bounds={"v": (None, 1.5), "a": (-9.0, 8.0)}, via={0.5: {"x": 0.4}})
    t = on(problem, 4, scheme)
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


def test_scenarios_share_inputs_and_durations_and_the_largest_cost_bounds_each() -> None:
    t = on(discretised.largest_of_scenarios(), 4)
    light, heavy = t.layout.spans
    np.testing.assert_array_equal(light.u, heavy.u)
    assert light.T == heavy.T
    assert not set(light.nodes.ravel()) & set(heavy.nodes.ravel())
    apart = discretise(mean_of_scenarios(), Radau(2))
    spans = apart.on(make_meshes(apart.problem, 3)).layout.spans
    assert not set(spans[0].u.ravel()) & set(spans[2].u.ravel())
    assert spans[0].T == spans[2].T
    assert [apart.spans[k].engine for k in (0, 1)] == [apart.spans[k].engine for k in (2, 3)]
    w = np.random.default_rng(0).uniform(0.5, 1.0, t.program.w.numel())
    w = t.pack(t.unpack(w))  # sets the bound
    rows = [i for i, place in enumerate(t.program.rows) if place.name == "the largest cost"]
    span = t.unpack(w).spans[0]
    assert len(rows) == 2
    g = t.program.jacobian(w, t.program.values)[0].full()
    assert g[rows].max() == pytest.approx(0, abs=1e-12)
    expected = float(np.mean(span.u**2)) * span.T + span.T  # equal intervals
    assert float(t.program.gradient(w, t.program.values)[0]) == pytest.approx(expected)


@pytest.mark.parametrize("make", CASES, ids=lambda make: make.__name__)
def test_unpack_inverts_pack(make: Callable[[], Problem]) -> None:
    t = cased(make)
    w = np.random.default_rng(0).uniform(0.5, 1.0, t.program.w.numel())
    back = t.pack(t.unpack(w))
    extra = np.concatenate([span.extra.ravel() for span in t.layout.spans])
    kept = np.setdiff1d(np.arange(w.size), [*extra, t.layout.largest])
    np.testing.assert_allclose(back[kept], w[kept], rtol=1e-14)


def test_parameters_are_numbers_of_the_program() -> None:
    problem = discretised.one_phase()
    t, other = on(problem, 4), on(replace(problem, p={"m": 2.0}), 4)
    np.testing.assert_array_equal(t.values({"m": 2.0}), other.program.values)
    w = np.full(t.program.w.numel(), 0.3)
    g, g_2 = (x.program.jacobian(w, other.program.values)[0].full() for x in (t, other))
    np.testing.assert_array_equal(g, g_2)
    with pytest.raises(ValueError, match="values"):
        t.values({"mass": 2.0})


def test_second_mesh_builds_nothing_and_another_number_differentiates_nothing() -> None:
    made = discretise(discretised.three_phases(), Radau(3))
    even, uneven = np.linspace(0, 1, 6), np.linspace(0, 1, 6) ** 2
    one = made.on([even] * 3)
    with patch.object(ca, "Function", side_effect=AssertionError("built")):
        two = made.on([uneven] * 3)
    assert two.program.jacobian is one.program.jacobian
    w = np.full(two.program.w.numel(), 0.4)
    fresh = discretise(discretised.three_phases(), Radau(3)).on([uneven] * 3)
    np.testing.assert_array_equal(
        two.program.jacobian(w, two.program.values)[0].full(),
        fresh.program.jacobian(w, fresh.program.values)[0].full(),
    )
    with patch.object(ca, "jacobian", side_effect=AssertionError("differentiated")):
        three = made.on([np.linspace(0, 1, 9)] * 3)
    assert three.program.w.numel() > two.program.w.numel()


@pytest.mark.parametrize("make", sampled([all_at_once, mechanism], of=2))
def test_nonzeros_grow_linearly_and_the_graph_does_not_grow(make: Callable[[], Problem]) -> None:
    made = discretise(make(), Radau(2))

    def count(intervals: int) -> tuple[list[int], list[int]]:
        p = made.on(make_meshes(made.problem, intervals)).program
        sizes = [p.w.numel(), p.g.numel(), p.jacobian.nnz_out(1), p.hessian.nnz_out(0)]
        return sizes, [f.n_instructions() for f in (p.gradient, p.jacobian, p.hessian)]

    (few, graph), (more, same), (many, still) = count(4), count(8), count(16)
    assert np.all(np.subtract(many, more) == 2 * np.subtract(more, few))
    assert graph == same == still


def test_blocks_are_compiled_only_where_that_pays() -> None:
    made = discretise(discretised.one_phase(), Radau(3))
    equations = made.spans[0]
    assert isinstance(equations, PointEquations)
    made.on(make_meshes(made.problem, 500))
    assert equations.engine.at(1500) is equations.engine.block
    assert equations.engine.expected > 0


@pytest.mark.heavy
def test_compiled_blocks_give_the_same_bits() -> None:
    equations = discretise(mechanism(), Radau(2)).spans[0]
    assert isinstance(equations, PointEquations)
    compiled, rng = equations.engine.compiled, np.random.default_rng(0)
    for name in FUNCTIONS:
        vm, fast = getattr(equations.engine.block, name), getattr(compiled, name)
        arguments = [rng.uniform(0.5, 1.0, vm.size_in(i)) for i in range(vm.n_in())]
        assert fast.class_name() == "External"
        for a, b in zip(vm.call(arguments), fast.call(arguments), strict=True):
            np.testing.assert_array_equal(a.full(), b.full())
    assert equations.engine.at(10) is compiled


# --- stages for structured solvers --------------------------------------------------------------


def test_jacobian_has_the_form_of_the_stages() -> None:
    phase = Phase(stage(), 1.0, end={"x": 0.1, "power": (None, 2.0)}, via={0.5: {"power": 0.1}})
    made = on(Problem(phase, EFFORT), 4).program
    stages, _ = made.structure()
    assert stages is not None
    assert stages.nu == (7, 7, 7, 7, 0)  # 3 points of 2 states, and the force
    at = np.random.default_rng(1).standard_normal(made.w.numel())
    jacobian = made.jacobian(at, made.values)[1].full()
    row = column = 0
    for nx, nu, ng, after in zip(*stages, (*stages.nx[1:], 0), strict=True):
        end = column + nx + nu
        rows, own = jacobian[row : row + after], jacobian[row + after : row + after + ng]
        np.testing.assert_array_equal(rows[:, end : end + after], np.eye(after))
        for zeros in (rows[:, :column], rows[:, end + after :], own[:, :column], own[:, end:]):
            assert not zeros.any()
        row, column = row + after + ng, end
    assert (row, column) == jacobian.shape


A2, MORE = integral(lambda s: s.a**2), "depends on more than its interval"


def chained(**more: Any) -> Problem:
    return Problem(Phase(UNIT, 1.0) >> Phase(UNIT, 1.0, **more), A2)


@pytest.mark.parametrize(
    ("problem", "reason"),
    [
        (unit_move(T=Free(0.5, 2.0)), "a free duration"),
        (unit_move(scenarios={"a": {}, "b": {}}), "several scenarios"),
        (Problem(Phase(stage(), 1.0), EFFORT, choose={"m": (0.5, 2.0)}), "the chosen parameter m"),
        (Problem(Phase(UNIT, 1.0, start={"x": FREE}), A2, periodic=["x"]), f"x, which {MORE}"),
        (chained(link={"v": None}), "states that restart after a phase"),
        (chained(joins=[lambda a, b: a.v + b.v >= 0]), f"join 1, which {MORE}"),
    ],
)  # fmt: skip
def test_coupling_of_more_than_neighbours_is_named(problem: Problem, reason: str) -> None:
    stages, why = on(problem, 3).program.structure()
    assert stages is None
    assert why.endswith(reason)
