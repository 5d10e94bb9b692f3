"""Phases and problems resolved to bounds, conditions, links, numbers and models."""

from dataclasses import replace
from math import inf

import casadi as ca
import numpy as np
import pytest
from motions import double_integrator, stage
from phases import SLIDER_CRANK, slider_crank

from ocp.formulation.changed_models import with_parameters, with_rates
from ocp.formulation.expressions import TIME, Signals, at_end, effort, integral
from ocp.formulation.phase import FREE, Free, Phase, Row, Span
from ocp.formulation.problem import Problem, rest_to_rest
from symfric import BrownMcPhee, LuGre, Model, drive, simulate
from symfric.scenes import PendulumBox

EFFORT = integral(lambda s: s.a**2)
MODEL = double_integrator(a_max=2.0)
FREED = stage(free=["m", "mu_d"])
LOOPED = slider_crank()


def lone(phase: Phase, **more: object) -> Span:
    (span,) = Problem(phase, EFFORT, **more).spans
    return span


def at(span: Span, row: Row, x: float, v: float, a: float) -> float:
    return float(ca.Function("row", span.symbols, [row.expression])(0.0, [x, v], [], a, []))


# --- bounds and conditions ----------------------------------------------------------------------


def test_boxes_at_starts_ends_and_via_points() -> None:
    assert lone(Phase(MODEL, 1.0)).nodes[0.0] == {"x": (0.0, 0.0), "v": (0.0, 0.0)}
    phase = Phase(MODEL, 1.0, start={"x": FREE, "v": (0.0, 1.0)}, bounds={"x": (-3.0, 4.0)})
    assert lone(phase).nodes[0.0] == {"x": (-3.0, 4.0), "v": (0.0, 1.0)}
    phase = Phase(MODEL, 1.0, end={"x": (1.0, None)}, via={0.5: {"x": (None, 0.7)}})
    span = lone(phase, bounds={"x": (-1.0, 2.0)})
    assert list(span.nodes) == [0.0, 0.5, 1.0]
    assert span.nodes[0.5] == {"x": (-1.0, 0.7), "v": FREE}
    assert span.nodes[1.0] == {"x": (1.0, 2.0), "v": FREE}


def test_bounds_of_the_phase_override_those_of_the_problem_and_the_model() -> None:
    bounds = {"a": (-5.0, None)}
    spans = lone(Phase(MODEL, 1.0)), lone(Phase(MODEL, 1.0), bounds=bounds)
    fixed = lone(Phase(MODEL, 1.0, bounds={"a": 1.5}), bounds=bounds)
    assert [s.boxes["a"] for s in (*spans, fixed)] == [(-2.0, 2.0), (-5.0, inf), (1.5, 1.5)]


def test_outputs_are_conditions_on_the_path_and_at_the_ends() -> None:
    phase = Phase(MODEL, 1.0, bounds={"power": (None, 3.0)}, end={"power": 0.5, "a": (0.0, 1.0)})
    span = lone(phase)
    (path,), (end,) = span.path, span.rows_at[1.0]
    assert (path.name, path.lower, path.upper) == ("the bound on power", -inf, 3.0)
    assert (end.name, end.lower, end.upper) == ("power at the end", 0.5, 0.5)
    assert at(span, path, x=1.0, v=3.0, a=2.0) == 6.0
    assert span.inputs_at == {0.0: {"a": (-2.0, 2.0)}, 1.0: {"a": (0.0, 1.0)}}


def test_path_conditions_are_rows() -> None:
    conditions = {
        lambda s: s.v <= 1.0: (0.5, -inf, 1.0),
        lambda s: s.x >= s.v: (0.5 - 3.0, -inf, 0.0),
        lambda s: s.x + s.v == 2.0: (3.5, 2.0, 2.0),
        lambda s: abs(s.a) <= 2.0: (-1.0, -2.0, 2.0),
    }
    both = lambda s: ca.logic_and(s.x >= 0.0, s.x <= 5.0)  # noqa: E731
    span = lone(Phase(MODEL, 1.0, path=[*conditions, both]))
    found = [(at(span, row, x=3.0, v=0.5, a=-1.0), row.lower, row.upper) for row in span.path]
    assert found == [*conditions.values(), (3.0, 0.0, inf), (3.0, -inf, 5.0)]


def test_details_in_conditions_are_outputs_of_the_span() -> None:
    """Solutions and simulations then show them."""
    model = PendulumBox(BrownMcPhee(), phi_0=0.0).model()
    phase = Phase(
        model, 1.0, end={"pendulum_x": 0.1}, path=[lambda s: s.pendulum_z <= 0.0],
        bounds={"box_vx": (-1.0, 1.0)}, cost=at_end(lambda s: s.box_x),
    )  # fmt: skip
    span, after = Problem(phase >> replace(phase, cost=None, joins=[rises])).spans
    details = {"pendulum_x", "pendulum_z", "box_vx", "box_x"}
    assert details <= span.model.outputs.keys()
    assert not details & (model.outputs.keys() | span.model.further.keys())
    assert span.model.further
    assert [row.name for row in span.rows_at[1.0]] == ["pendulum_x at the end"]
    (join,) = after.joins
    zero = [0.0, [0.0] * len(model.x), [0.0] * len(model.z), [], []]
    assert float(join.function(*zero, *zero)) == 0.0


def rises(before: Signals, after: Signals) -> object:
    return after.pendulum_z >= before.pendulum_z


# --- between phases and scenarios ---------------------------------------------------------------


def test_phases_continue_each_other_by_default() -> None:
    out = Phase(MODEL, 1.0, end={"x": 1.0})
    link = {"v": lambda before: -0.5 * before.v, "x": None}
    joins = (lambda before, after: after.a - before.a <= 0.3,)
    back = Phase(MODEL, Free(0.5, 2.0), link=link, joins=joins)
    first, second = Problem(out >> back, EFFORT + TIME).spans
    assert (first.links, first.joins) == ((), ())
    (link,), (join,) = second.links, second.joins
    end = ca.Function("end", first.symbols, [link.expression])(1.0, [1.0, 3.0], [], 0.0, [])
    assert (link.state, float(end)) == ("v", -1.5)
    before, after = (1.0, [1.0, 3.0], [], 0.5, []), (0.0, [1.0, -1.5], [], 0.25, [])
    assert float(join.function(*before, *after)) == -0.25
    assert (join.lower, join.upper) == (-inf, 0.3)
    assert second.nodes[0.0] == {"x": FREE, "v": FREE}
    assert Free(0.5, 2.0) == second.T
    fixed = Phase(MODEL, 1.0, start={"x": 1.0}, end={"x": 0.0})  # on both sides: no link
    assert [link.state for link in Problem(out >> fixed, EFFORT).spans[1].links] == ["v"]
    other = Phase(stage(), 1.0, link={"x": "x", "v": lambda before: before.a})
    linked = Problem(out >> other, integral(lambda s: s.x**2)).spans[1].links
    assert [str(link.expression) for link in linked] == ["x", "a"]


def test_costs_run_over_all_phases_and_end_with_the_last() -> None:
    chain = Phase(MODEL, 1.0, cost=effort("v", 3.0)) >> Phase(MODEL, 1.0)
    first, second = Problem(chain, EFFORT + 2.0 * TIME).spans
    values = [
        [float(x) for x in ca.Function("J", s.symbols, [s.running, s.end])(7.0, [0, 2], [], 3, [])]
        for s in (first, second)
    ]
    assert values == [[9.0 + 12.0, 0.0], [9.0, 14.0]]
    assert [weight for weight, _ in first.squares] == [3.0]


def test_scenarios_repeat_the_spans_with_their_numbers() -> None:
    phase = Phase(FREED, 1.0, end={"x": 1.0}, p={"m": 2.0})
    scenarios = {"dry": {"mu_d": 5.0}, "oiled": {"mu_d": 3.0}}
    problem = Problem(phase >> phase, effort("force"), scenarios=scenarios)
    where = [(span.scenario, span.phase) for span in problem.spans]
    assert where == [(0, 0), (0, 1), (1, 0), (1, 1)]
    numbers = [span.p.tolist() for span in problem.spans]
    assert numbers == [[2.0, 5.0], [2.0, 5.0], [2.0, 3.0], [2.0, 3.0]]
    assert problem.kind == "mean"
    assert problem.shared_inputs == ("force",)


def test_periodic_states_start_anywhere() -> None:
    phase = Phase(MODEL, 1.0, start={"v": 0.5}, via={0.5: {"x": 1.0}})
    problem = Problem(phase, EFFORT, periodic=["x", "v"])
    assert problem.spans[0].nodes[0.0] == {"x": FREE, "v": (0.5, 0.5)}


def test_rest_to_rest_is_least_effort_or_least_time() -> None:
    slow, fast = (rest_to_rest(stage(), 1.0, T, limit=20.0) for T in (1.0, Free(0.1, 10.0)))
    for problem in (slow, fast):
        (span,) = problem.spans
        assert span.boxes["force"] == (-20.0, 20.0)
        assert span.nodes[1.0] == {"x": (1.0, 1.0), "v": (0.0, 0.0)}
        assert span.boxes["x"] == (-inf, inf)
    assert slow.spans[0].end.is_zero()
    assert fast.spans[0].running.is_zero()


# --- chosen parameters --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("box", "p", "start"),
    [
        ((0.5, 2.0, 0.7), {}, 0.7),
        ((0.5, 2.0), {}, 1.0),
        ((0.5, 2.0), {"m": 1.5}, 1.5),
        ((10.0, 1000.0), {}, 100.0),
        ((None, 0.5), {}, 0.5),
        ((3.0, None), {}, 3.0),
    ],
)
def test_choice_starts_at_the_guess_the_value_or_the_middle(
    box: tuple[float, ...], p: dict[str, float], start: float
) -> None:
    (choice,) = Problem(Phase(FREED, 1.0), effort("force"), choose={"m": box}, p=p).chosen
    assert choice.guess == pytest.approx(start)


def test_chosen_parameters_keep_their_own_bounds() -> None:
    phases = Phase(FREED, 1.0) >> Phase(stage(), 1.0)
    problem = Problem(phases, effort("force"), choose={"m": (None, 2.0)})
    (choice,) = problem.chosen
    assert (choice.lower, choice.upper, choice.unit) == (1e-12, 2.0, "kg")
    assert choice.nominal == 1.0
    assert [span.chosen for span in problem.spans] == [("m",), ()]
    assert problem.spans[0].p.tolist() == [1.0, 4.0]


# --- consistent starts --------------------------------------------------------------------------


def test_bristles_start_in_steady_sliding() -> None:
    """At the given velocity; by an equation if the start depends on a chosen parameter."""
    (span,) = Problem(Phase(drive(LuGre()), 1.0, start={"v": 0.3}), effort("force")).spans
    expected = float(LuGre().steady_state(0.3, 0.8 * 9.81)[0])
    assert span.nodes[0.0]["z"] == pytest.approx((expected, expected))
    model = drive(LuGre(), free=["sigma_0"])
    phase = Phase(model, 1.0, start={"v": 0.3})
    (span,) = Problem(phase, effort("force"), choose={"sigma_0": (1e3, 1e5)}).spans
    (row,) = span.rows_at[0.0]
    assert span.nodes[0.0]["z"] == FREE
    assert not ca.depends_on(row.expression, ca.vertcat(model.x[1].symbol, *span.symbols[2:4]))
    residual = ca.Function("row", span.symbols, [row.expression])
    for sigma_0 in (1e3, 2e4):
        z = float(LuGre(sigma_0=sigma_0).steady_state(0.3, 0.8 * 9.81)[0])
        assert abs(float(residual(0.0, [0.0, 0.3, z], [], 0.0, sigma_0))) < 1e-15


def looped(**start: object) -> Span:
    return Problem(Phase(LOOPED, 0.5, start=start), integral(lambda s: s.torque**2)).spans[0]


def slider(crank: float) -> float:
    """The closed form of `SliderCrank`."""
    b, c, e, r, rod = SLIDER_CRANK.b, SLIDER_CRANK.c, SLIDER_CRANK.e, SLIDER_CRANK.r, SLIDER_CRANK.l
    across, down = b - r * np.sin(crank), c - e + r * np.cos(crank)
    return np.sqrt(rod**2 - across**2 - down**2)


def test_coordinates_that_are_not_named_close_the_loop() -> None:
    span = looped(crank=1.0, crank_rate=2.0)
    start = {name: low for name, (low, high) in span.nodes[0.0].items() if low == high}
    assert start["crank"] == 1.0
    assert start["slider"] == pytest.approx(slider(1.0), abs=1e-11)
    speed = (slider(1.0 + 1e-6) - slider(1.0 - 1e-6)) / 1e-6
    assert start["slider_rate"] == pytest.approx(speed, rel=1e-7)
    assert span.rows_at[0.0] == ()
    default = {v.name: v.start for v in LOOPED.x}
    assert looped().nodes[0.0]["slider"][0] == default["slider"]


@pytest.mark.parametrize("rate", [{}, {"crank_rate": FREE}])
def test_loop_that_starts_in_a_range_is_open(rate: dict[str, object]) -> None:
    """Its constraints close it; at rest all rates are zero and need none."""
    span = looped(crank=(0.5, 1.0), **rate)
    start = span.nodes[0.0]
    assert start["crank"] == (0.5, 1.0)
    assert start["slider"] == FREE
    assert start["slider_rate"] == (FREE if rate else (0.0, 0.0))
    assert span.rows_at[0.0] == ()


# --- inputs with rates, and models with further parameters --------------------------------------


@pytest.mark.parametrize(("model", "name"), [(drive(LuGre()), "force"), (LOOPED, "torque")])
def test_constant_rate_is_a_ramp_of_the_input(model: Model, name: str) -> None:
    rated = with_rates(model, {name: 50.0})
    assert [v.name for v in rated.u] == [f"{name}_rate"]
    assert rated.x[-1].symbol is next(v.symbol for v in model.u)
    direct = simulate(model, 0.02, u={name: lambda t: 1.0 + 50.0 * t})
    ramp = simulate(rated, 0.02, x0={name: 1.0}, u={f"{name}_rate": 50.0})
    for signal in (*model.signals, *list(model.further)[:2]):
        assert ramp[signal][-1] == pytest.approx(direct[signal][-1], rel=1e-5, abs=1e-8)


@pytest.mark.parametrize("model", [drive(BrownMcPhee()), LOOPED], ids=["drive", "crank"])
def test_contacts_remain_replaceable(model: Model) -> None:
    (name,) = (v.name for v in model.u)
    assert with_rates(model, {}) is with_parameters(model, {}) is model
    assert with_rates(model, {name: 1.0}) is not with_rates(model, {name: 2.0})
    for changed in (with_rates(model, {name: 1.0}), with_parameters(model, {"goal": "m"})):
        assert changed in (with_rates(model, {name: 1.0}), with_parameters(model, {"goal": "m"}))
        (contact,) = changed.contacts
        other = changed.with_forces({contact.name: 2.0 * contact.slip})
        assert [v.name for v in (*other.x, *other.u)] == [v.name for v in (*changed.x, *changed.u)]
        assert {v.name for v in other.p} == {v.name for v in changed.p}


def test_input_with_a_rate_is_a_state_with_bounds_and_a_shared_start() -> None:
    phase = Phase(FREED, 1.0, end={"force": 0.0}, via={0.5: {"force": (0, 1)}})
    cost = integral(lambda s: s.force**2)
    bounds, rates = {"force": (-20.0, 20.0)}, {"force": (-400.0, None)}
    first, second = Problem(phase >> Phase(FREED, 1.0), cost, bounds=bounds, rates=rates).spans
    assert first.model is second.model
    assert first.boxes["force_rate"] == (-400.0, inf)
    assert [first.nodes[s]["force"] for s in (0.0, 0.5, 1.0)] == [(-20, 20), (0, 1), (0, 0)]
    assert [link.state for link in second.links] == ["x", "v", "force"]
    assert first.model.u[0].nominal == 400.0
    phase = Phase(FREED, 1.0)
    both = {"scenarios": {"a": {"mu_d": 0.1}, "b": {"mu_d": 0.12}}, "rates": {"force": FREE}}
    problem = Problem(phase >> phase, cost, shared=["force"], **both)
    assert problem.shared_inputs == ("force_rate",)
    assert problem.shared_starts == ((0, "force"),)
    assert Problem(phase, cost, shared=[], **both).shared_starts == ()
    assert Problem(replace(phase, start={"force": 0.0}), cost, **both).shared_starts == ()
