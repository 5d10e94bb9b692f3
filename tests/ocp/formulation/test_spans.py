from dataclasses import replace
from math import inf

import casadi as ca
import numpy as np
import pytest
from motions import double_integrator, stage

from ocp.formulation.expressions import TIME, Signals, at_end, effort, integral
from ocp.formulation.phase import FREE, Free, Phase, Row, Span
from ocp.formulation.problem import Problem
from symfric import BrownMcPhee, LuGre, drive
from symfric.scenes import PendulumBox

EFFORT = integral(lambda s: s.a**2)
MODEL = double_integrator(a_max=2.0)


def lone(phase: Phase, **more: object) -> Span:
    (span,) = Problem(phase, EFFORT, **more).spans
    return span


def at(span: Span, row: Row, x: float, v: float, a: float) -> float:
    return float(ca.Function("row", span.symbols, [row.expression])(0.0, [x, v], [], a, []))


def test_states_start_where_the_model_says_unless_told_otherwise() -> None:
    assert lone(Phase(MODEL, 1.0)).nodes[0.0] == {"x": (0.0, 0.0), "v": (0.0, 0.0)}
    phase = Phase(MODEL, 1.0, start={"x": FREE, "v": (0.0, 1.0)}, bounds={"x": (-3.0, 4.0)})
    assert lone(phase).nodes[0.0] == {"x": (-3.0, 4.0), "v": (0.0, 1.0)}


def test_conditions_on_the_way_and_at_the_end_narrow_the_bounds() -> None:
    phase = Phase(MODEL, 1.0, end={"x": (1.0, None)}, via={0.5: {"x": (None, 0.7)}})
    span = lone(phase, bounds={"x": (-1.0, 2.0)})
    assert list(span.nodes) == [0.0, 0.5, 1.0]
    assert span.nodes[0.5] == {"x": (-1.0, 0.7), "v": FREE}
    assert span.nodes[1.0] == {"x": (1.0, 2.0), "v": FREE}


def test_bounds_of_the_phase_win_over_those_of_the_problem_and_these_over_the_model() -> None:
    assert lone(Phase(MODEL, 1.0)).box("a") == (-2.0, 2.0)
    assert lone(Phase(MODEL, 1.0), bounds={"a": (-5.0, None)}).box("a") == (-5.0, inf)
    assert lone(Phase(MODEL, 1.0, bounds={"a": 1.5}), bounds={"a": (-5.0, None)}).box("a") == (
        1.5,
        1.5,
    )


def test_outputs_are_conditions_on_the_path_and_at_the_ends() -> None:
    phase = Phase(MODEL, 1.0, bounds={"power": (None, 3.0)}, end={"power": 0.5, "a": (0.0, 1.0)})
    span = lone(phase)
    (path,), (end,) = span.path, span.rows_at[1.0]
    assert (path.name, path.lower, path.upper) == ("the bound on power", -inf, 3.0)
    assert (end.name, end.lower, end.upper) == ("power at the end", 0.5, 0.5)
    assert at(span, path, x=1.0, v=3.0, a=2.0) == 6.0
    assert span.inputs_at == {0.0: {"a": (-2.0, 2.0)}, 1.0: {"a": (0.0, 1.0)}}


def test_path_conditions_are_rows() -> None:
    conditions = [
        lambda s: s.v <= 1.0,
        lambda s: s.x >= s.v,
        lambda s: s.x + s.v == 2.0,
        lambda s: abs(s.a) <= 2.0,
        lambda s: ca.logic_and(s.x >= 0.0, s.x <= 5.0),
    ]
    span = lone(Phase(MODEL, 1.0, path=conditions))
    found = [(at(span, row, x=3.0, v=0.5, a=-1.0), row.lower, row.upper) for row in span.path]
    assert found == [
        (0.5, -inf, 1.0),
        (0.5 - 3.0, -inf, 0.0),
        (3.5, 2.0, 2.0),
        (-1.0, -2.0, 2.0),
        (3.0, 0.0, inf),
        (3.0, -inf, 5.0),
    ]


def test_phases_continue_each_other_unless_told_otherwise() -> None:
    out = Phase(MODEL, 1.0, end={"x": 1.0})
    back = Phase(
        MODEL,
        Free(0.5, 2.0),
        link={"v": lambda before: -0.5 * before.v, "x": None},
        joins=(lambda before, after: after.a - before.a <= 0.3,),
    )
    first, second = Problem(out >> back, EFFORT + TIME).spans
    assert first.links == ()
    assert first.joins == ()
    (link,) = second.links
    end = ca.Function("end", first.symbols, [link.expression])(1.0, [1.0, 3.0], [], 0.0, [])
    assert (link.state, float(end)) == ("v", -1.5)
    (join,) = second.joins
    before, after = (1.0, [1.0, 3.0], [], 0.5, []), (0.0, [1.0, -1.5], [], 0.25, [])
    assert float(join.function(*before, *after)) == -0.25
    assert (join.lower, join.upper) == (-inf, 0.3)
    assert second.nodes[0.0] == {"x": FREE, "v": FREE}
    assert Free(0.5, 2.0) == second.T


def test_costs_run_over_all_phases_and_end_with_the_last() -> None:
    own = effort("v", 3.0)
    chain = Phase(MODEL, 1.0, cost=own) >> Phase(MODEL, 1.0)
    first, second = Problem(chain, EFFORT + 2.0 * TIME).spans
    values = [
        [float(x) for x in ca.Function("J", s.symbols, [s.running, s.end])(7.0, [0, 2], [], 3, [])]
        for s in (first, second)
    ]
    assert values == [[9.0 + 12.0, 0.0], [9.0, 14.0]]
    assert [weight for weight, _ in first.squares] == [3.0]


def test_bristles_start_in_steady_sliding_at_the_given_velocity() -> None:
    law = LuGre()
    (span,) = Problem(Phase(drive(law), 1.0, start={"v": 0.3}), effort("force")).spans
    (name, box) = list(span.nodes[0.0].items())[-1]
    expected = float(law.steady_state(0.3, 0.8 * 9.81)[0])
    assert name not in ("x", "v")
    assert box == pytest.approx((expected, expected))
    assert expected > 0


def test_start_that_depends_on_a_free_state_must_be_named() -> None:
    with pytest.raises(ValueError, match="whose start depends on v; name it"):
        Problem(Phase(drive(LuGre()), 1.0, start={"v": FREE}), effort("force"))


def test_start_that_depends_on_a_chosen_parameter_is_an_equation() -> None:
    model = drive(LuGre(), free=["sigma_0"])
    problem = Problem(
        Phase(model, 1.0, start={"v": 0.3}), effort("force"), choose={"sigma_0": (1e3, 1e5)}
    )
    (span,) = problem.spans
    (row,) = span.rows_at[0.0]
    assert span.nodes[0.0]["z"] == FREE
    assert not ca.depends_on(row.expression, ca.vertcat(model.x[1].symbol, *span.symbols[2:4]))
    residual = ca.Function("row", span.symbols, [row.expression])
    for sigma_0 in (1e3, 2e4):
        z = float(LuGre(sigma_0=sigma_0).steady_state(0.3, 0.8 * 9.81)[0])
        assert float(residual(0.0, [0.0, 0.3, z], [], 0.0, sigma_0)) == pytest.approx(
            0.0, abs=1e-15
        )


def test_scenarios_repeat_the_spans_with_their_numbers() -> None:
    phase = Phase(stage(free=["mu_d", "m"]), 1.0, end={"x": 1.0}, p={"m": 2.0})
    problem = Problem(
        phase >> phase, effort("force"), scenarios={"dry": {"mu_d": 5.0}, "oiled": {"mu_d": 3.0}}
    )
    assert [(span.scenario, span.phase) for span in problem.spans] == [
        (0, 0),
        (0, 1),
        (1, 0),
        (1, 1),
    ]
    np.testing.assert_array_equal(
        [span.p for span in problem.spans], [[5.0, 2.0], [5.0, 2.0], [3.0, 2.0], [3.0, 2.0]]
    )
    assert problem.kind == "mean"
    assert problem.shared_inputs == ("force",)


def test_details_that_are_asked_for_are_outputs_of_the_span() -> None:
    """Solutions and simulations then show them."""
    model = PendulumBox(BrownMcPhee(), phi_0=0.0).model()
    phase = Phase(
        model,
        1.0,
        end={"pendulum_x": 0.1},
        path=[lambda s: s.pendulum_z <= 0.0],
        bounds={"box_vx": (-1.0, 1.0)},
        cost=at_end(lambda s: s.box_x),
    )
    span, after = Problem(phase >> replace(phase, cost=None, joins=[rises])).spans
    asked = {"pendulum_x", "pendulum_z", "box_vx", "box_x"}
    assert asked <= span.model.outputs.keys()
    assert not asked & (model.outputs.keys() | span.model.further.keys())
    assert span.model.further
    assert [row.name for row in span.rows_at[1.0]] == ["pendulum_x at the end"]
    (join,) = after.joins
    zero = [0.0, [0.0] * len(model.x), [0.0] * len(model.z), [], []]
    assert float(join.function(*zero, *zero)) == 0.0


def rises(before: Signals, after: Signals) -> object:
    return after.pendulum_z >= before.pendulum_z
