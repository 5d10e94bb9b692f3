from math import inf

import pytest
from motions import double_integrator, stage

from ocp.formulation.expressions import TIME, effort, integral
from ocp.formulation.phase import FREE, Free, Phase
from ocp.formulation.problem import Problem, rest_to_rest

MODEL = stage(free=["m", "mu_d"])


def guess(choose: tuple[float | None, ...], **p: float) -> float:
    (choice,) = Problem(Phase(MODEL, 1.0), effort("force"), choose={"m": choose}, p=p).chosen
    return choice.guess


def test_choice_starts_at_the_guess_the_value_or_the_middle() -> None:
    assert guess((0.5, 2.0, 0.7)) == 0.7
    assert guess((0.5, 2.0)) == 1.0
    assert guess((0.5, 2.0), m=1.5) == 1.5
    assert guess((10.0, 1000.0)) == pytest.approx(100.0)
    assert guess((None, 0.5)) == 0.5
    assert guess((3.0, None)) == 3.0


def test_chosen_parameters_keep_their_own_bounds() -> None:
    problem = Problem(
        Phase(MODEL, 1.0) >> Phase(stage(), 1.0), effort("force"), choose={"m": (None, 2.0)}
    )
    (choice,) = problem.chosen
    assert (choice.lower, choice.upper, choice.unit) == (1e-12, 2.0, "kg")
    assert choice.nominal == 1.0
    assert [span.chosen for span in problem.spans] == [("m",), ()]
    assert problem.spans[0].p.tolist() == [1.0, 4.0]


def test_periodic_states_start_anywhere() -> None:
    problem = Problem(
        Phase(double_integrator(), 1.0, start={"v": 0.5}, via={0.5: {"x": 1.0}}),
        effort("a"),
        periodic=["x", "v"],
    )
    assert problem.spans[0].nodes[0.0] == {"x": FREE, "v": (0.5, 0.5)}


def test_values_given_on_both_sides_need_no_link() -> None:
    out = Phase(double_integrator(), 1.0, end={"x": 1.0})
    back = Phase(double_integrator(), 1.0, start={"x": 1.0}, end={"x": 0.0})
    _, second = Problem(out >> back, effort("a")).spans
    assert [link.state for link in second.links] == ["v"]


def test_durations_that_add_up() -> None:
    phase = Phase(double_integrator(), Free(0.1, 3.0))
    problem = Problem(phase >> phase >> phase, TIME, durations=[((0, 2), 1.0)])
    assert problem.durations == [((0, 2), 1.0)]
    with pytest.raises(ValueError, match=r"expected a sum .* 0\.2 to 6 s, got 7 to 7 s"):
        Problem(phase >> phase, TIME, durations=[((0, 1), 7.0)])


def test_states_link_by_name_or_expression_to_models_that_differ() -> None:
    reverse = {"link": {"x": "x", "v": lambda before: before.a}}
    before, after = Phase(double_integrator(), 1.0), Phase(stage(), 1.0, **reverse)
    cost = {"cost": integral(lambda s: s.x**2)}
    _, second = Problem(before >> after, **cost).spans
    assert [str(link.expression) for link in second.links] == ["x", "a"]


def test_rest_to_rest_is_least_effort_or_least_time() -> None:
    slow, fast = (rest_to_rest(stage(), 1.0, T, limit=20.0) for T in (1.0, Free(0.1, 10.0)))
    for problem in (slow, fast):
        (span,) = problem.spans
        assert span.box("force") == (-20.0, 20.0)
        assert span.nodes[1.0] == {"x": (1.0, 1.0), "v": (0.0, 0.0)}
        assert span.box("x") == (-inf, inf)
    assert slow.spans[0].end.is_zero()
    assert fast.spans[0].running.is_zero()
    with pytest.raises(ValueError, match=r"expected one of x, v, a, got force"):
        rest_to_rest(double_integrator(), 1.0, 1.0, limit=1.0)
