from math import inf, nan

import casadi as ca
import pytest
from motions import double_integrator, least_effort, stage

from ocp import FREE, TIME, Free, Problem, at_end, integral
from symfric import LuGre, Model, Variable, drive


def implicit() -> Model:
    x, rate = Variable("x", "m"), ca.SX.sym("rate")
    return Model("implicit", x=(x,), xdot=rate, residual=rate + x.symbol)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"T": 0.0}, r"expected a duration T > 0 \[s\] or Free\(lower, upper\), got 0\.0"),
        ({"T": -1.0}, "expected a duration T > 0"),
        ({"T": nan}, "expected a duration T > 0"),
        ({"T": inf}, "expected a duration T > 0"),
        ({"T": (0.1, 1.0)}, "expected a duration T > 0"),
        ({"cost": None}, "expected a cost made of integral"),
        ({"cost": lambda s: s.a}, r"wrap it in integral\(\.\.\.\) or at_end"),
        ({"cost": TIME}, "got a constant; TIME needs a free duration"),
        ({"cost": integral(lambda s: s.b)}, r"cost of 'double integrator'.* got b"),
        ({"cost": integral(lambda s: ca.SX.sym("w") * s.a)}, "only signals of the model, got w"),
        ({"final": {"y": 1.0}}, "final: expected one of x, v, got y"),
        ({"initial": {"vv": 1.0}}, r"initial: .* got vv; did you mean v\?"),
        ({"initial": {"a": 1.0}}, "initial: expected one of x, v, got a"),
        ({"bounds": {"powr": 1.0}}, r"bounds: .* got powr; did you mean power\?"),
        ({"p": {"m": 1.0}}, "p: expected no names, got m"),
        ({"via": {0.5: {"z": 1.0}}}, r"via 0\.5: expected one of x, v, got z"),
        ({"via": {1.5: {"x": 1.0}}}, r"via: expected fractions of T between 0 and 1, got 1\.5"),
        ({"via": {0.5: {"x": (2, 1)}}}, r"via 0\.5: expected x as a finite number or \(lower"),
        ({"bounds": {"a": (1.0, -1.0)}}, r"bounds: expected a as a finite .* got \(1\.0, -1\.0\)"),
        ({"bounds": {"a": (nan, None)}}, "bounds: expected a as a finite number"),
        ({"bounds": {"a": (inf, None)}}, "bounds: expected a as a finite number"),
        ({"bounds": {"a": [0, 1]}}, r"bounds: expected a as a finite number .* got \[0, 1\]"),
        ({"final": {"x": nan}}, "final: expected x as a finite number"),
        ({"final": {"x": "far"}}, "final: expected x as a finite number .* got 'far'"),
        (
            {"bounds": {"x": (0.5, 2.0)}},
            r"initial: expected x inside its bounds \[0\.5, 2\], got 0",
        ),
        ({"bounds": {"x": (-1, 0.5)}}, r"final: expected x inside its bounds \[-1, 0\.5\], got 1"),
        ({"model": implicit()}, r"expected an explicit model \(ode\), got an implicit one"),
    ],
)
def test_bad_input_is_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        least_effort(**changes)


def test_all_problems_are_told_at_once() -> None:
    with pytest.raises(ValueError) as error:
        least_effort(T=-1.0, cost=None, final={"y": 1.0}, bounds={"a": (1.0, 0.0)})
    for part in ("T > 0", "a cost made of", "got y", "bounds: expected a"):
        assert part in str(error.value)


@pytest.mark.parametrize(
    "given", [(0.0, 1.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0, 3.0), (1.0, inf), (nan, 1.0)]
)
def test_impossible_durations_are_refused(given: tuple[float, ...]) -> None:
    with pytest.raises(
        ValueError,
        match=r"Free: (expected 0 < lower <= guess <= upper|(lower|upper): expected a number > 0)",
    ):
        Free(*given)


def test_free_duration_starts_at_the_guess_or_the_geometric_mean() -> None:
    assert Free(0.1, 10.0).start == pytest.approx(1.0)
    assert Free(0.1, 10.0, guess=3.0).start == 3.0


def test_bounds_of_the_model_hold_until_others_are_given() -> None:
    model = double_integrator(a_max=2.0)
    assert least_effort(model=model).box("a") == (-2.0, 2.0)
    assert least_effort(model=model, bounds={"a": (-5.0, None)}).box("a") == (-5.0, inf)
    assert least_effort(model=model, bounds={"a": 1.5}).box("a") == (1.5, 1.5)
    assert least_effort(model=model).box("power") == FREE


def test_states_start_where_the_model_says_unless_told_otherwise() -> None:
    assert least_effort().start == {"x": (0.0, 0.0), "v": (0.0, 0.0)}
    problem = least_effort(initial={"x": FREE, "v": (0.0, 1.0)}, bounds={"x": (-3.0, 4.0)})
    assert problem.start == {"x": (-3.0, 4.0), "v": (0.0, 1.0)}


def test_conditions_on_the_way_and_at_the_end_narrow_the_bounds() -> None:
    problem = least_effort(
        bounds={"x": (-1.0, 2.0)}, via={0.5: {"x": (None, 0.7)}}, final={"x": (1.0, None)}
    )
    assert problem.at(0.5) == {"x": (-1.0, 0.7), "v": FREE}
    assert problem.at(1.0) == {"x": (1.0, 2.0), "v": FREE}
    assert problem.at(0.25) == {"x": (-1.0, 2.0), "v": FREE}


def test_bristles_start_in_steady_sliding_at_the_given_velocity() -> None:
    law = LuGre()
    problem = Problem(drive(law), 1.0, integral(lambda s: s.force**2), initial={"v": 0.3})
    (name, box) = list(problem.start.items())[-1]
    expected = float(law.steady_state(0.3, 0.8 * 9.81)[0])
    assert name not in ("x", "v")
    assert box == pytest.approx((expected, expected))
    assert expected > 0


def test_start_that_depends_on_a_free_state_must_be_named() -> None:
    with pytest.raises(ValueError, match="whose start depends on v; name it"):
        Problem(drive(LuGre()), 1.0, integral(lambda s: s.force**2), initial={"v": FREE})


def test_cost_may_be_time_alone_when_the_duration_is_free() -> None:
    assert Problem(stage(), Free(0.1, 1.0), TIME).bounded_outputs == ()
    assert Problem(stage(), 1.0, at_end(lambda s: s.x)).bounded_outputs == ()
