import math
from dataclasses import replace
from math import inf, nan
from typing import Any

import casadi as ca
import pytest
from motions import double_integrator, stage

from ocp.formulation.expressions import TIME, at_end, integral, track, worst
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from symfric import Event, ExactCoulomb, Model, Variable, drive

MODEL = double_integrator()
EFFORT = integral(lambda s: s.a**2)


def implicit() -> Model:
    x, rate = Variable("x", "m"), ca.SX.sym("rate")
    return Model("implicit", x=(x,), xdot=rate, residual=rate + x.symbol)


def moved(**changes: Any) -> Problem:
    """Unit move in 1 s; changes of the phase or of the problem."""
    own = {name for name in changes if name in Phase.__dataclass_fields__}
    own -= {"bounds", "rates", "path", "cost", "p"}
    known: dict[str, Any] = {"model": MODEL, "T": 1.0, "end": {"x": 1.0, "v": 0.0}}
    phase = Phase(**(known | {name: changes[name] for name in own}))
    rest = {name: value for name, value in changes.items() if name not in own}
    return Problem(phase, **({"cost": EFFORT} | rest))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"T": 0.0}, r"expected a duration T > 0 \[s\] or Free\(lower, upper\), got 0\.0"),
        ({"T": nan}, "expected a duration T > 0"),
        ({"T": inf}, "expected a duration T > 0"),
        ({"T": "1 s"}, "expected a duration T > 0 .* got '1 s'"),
        ({"T": (0.1, 1.0)}, r"expected a duration T > 0 .*; write Free\(0\.1, 1\.0\)"),
        ({"cost": None}, "expected a cost made of integral"),
        ({"cost": lambda s: s.a}, r"cost: .* wrap it in integral\(\.\.\.\) or at_end"),
        ({"cost": TIME}, "got a constant; TIME needs a free duration"),
        ({"cost": integral(lambda s: 3.0)}, "cost: expected one that depends on the motion"),
        ({"cost": integral(lambda s: s.b)}, r"cost: signals of 'double integrator'.* got b"),
        ({"cost": integral(lambda s: ca.SX.sym("w") * s.a)}, "only signals of the model, got w"),
        ({"cost": integral(lambda s: math.sin(s.a))}, "got nan; write casadi functions"),
        ({"cost": integral(lambda s: s.a + math.cos(s.a))}, "it holds nan; write casadi"),
        ({"cost": integral(lambda s: max(s.a, 0.0))}, "RuntimeError: .*truth value.*no if, and"),
        ({"cost": integral(lambda s: math.inf * s.a)}, "it holds inf$"),
        ({"cost": integral(lambda s: s.a.size)}, "cost: expected one expression"),
        ({"cost": integral(lambda s: s.a.foo)}, "AttributeError: 'SX' object has no attribute"),
        ({"cost": integral(lambda: 1.0)}, r"TypeError: .*positional argument[^;]*$"),
        ({"cost": integral(lambda s: ca.vertcat(s.x, s.v))}, r"got the expression .* of shape"),
        ({"cost": integral(lambda s: ca.MX.sym("x"))}, r"write it with casadi\.SX"),
        ({"cost": track("x", "gaol", 1.0)}, r"track: .* got gaol; .*give its value: p=\{'gaol'"),
        ({"cost": track("y", 0.0, 1.0)}, "cost: .* got y"),
        ({"end": {"y": 1.0}}, "end: expected one of x, v, a, power, x_acc, got y"),
        ({"end": {"T": 1.0}}, "end: .* got T; durations are T of the phases"),
        ({"start": {"vv": 1.0}}, r"start: .* got vv; did you mean v\?"),
        ({"bounds": {"powr": 1.0}}, r"bounds: .* got powr; did you mean power\?"),
        ({"p": {"m": 1.0}}, r"p: expected no names, got m; .*free=\['m'\]"),
        ({"choose": {"m": (1.0, 2.0)}}, r"choose: expected no names, got m; .*free=\['m'\]"),
        ({"scenarios": {"a": {"m": 1.0}}}, r"scenario 'a': expected no names, got m"),
        ({"via": {0.5: {"z": 1.0}}}, r"via 0\.5: expected one of x, v, power, x_acc, got z"),
        (
            {"via": {0.5: {"a": 1.0}}},
            "got a; an input holds on intervals; with rates",
        ),
        ({"via": {1.5: {"x": 1.0}}}, r"via: expected fractions of T between 0 and 1, got 1\.5"),
        ({"via": {"half": {"x": 1.0}}}, "via: expected fractions of T, got 'half'"),
        ({"via": {"x": 1.0}}, "via: expected fractions of T, got 'x'"),
        ({"via": [0.5]}, "via: expected states by fractions of T"),
        ({"via": {0.5: {"x": (2, 1)}}}, r"via 0\.5: expected x as a finite number or \(lower"),
        ({"bounds": {"a": (1.0, -1.0)}}, r"bounds: expected a as a finite .* got \(1\.0, -1\.0\)"),
        ({"bounds": {"a": (nan, None)}}, "bounds: expected a as a finite number"),
        ({"bounds": {"a": [0, 1]}}, r"bounds: expected a .* got \[0, 1\]; write a tuple"),
        ({"bounds": ["a"]}, "bounds: expected values by name"),
        ({"end": {"x": "far"}}, "end: expected x as a finite number .* got 'far'"),
        ({"rates": {"a": 400.0}}, r"rates: .* got 400\.0; write \(-400, 400\)"),
        ({"rates": {"v": (-1, 1)}}, "rates: .* got v; only inputs have rates that are chosen"),
        ({"bounds": {"x": (0.5, 2.0)}}, r"start: expected x inside its bounds \[0\.5, 2\], got 0"),
        ({"bounds": {"x": (-1, 0.5)}}, r"end: expected x inside its bounds \[-1, 0\.5\], got 1"),
        ({"bounds": {"a": (-1, 1)}, "end": {"a": 3.0}}, r"end: expected a inside its bounds"),
        ({"model": implicit()}, r"expected an explicit model \(ode\), got an implicit one"),
        ({"path": lambda s: s.x <= 1}, r"path: expected a sequence of .*; write \[lambda"),
        ({"path": [1.0]}, "path: expected functions of the signals such as lambda"),
        (
            {"path": [lambda s: 0 <= s.x <= 1]},
            "path condition 1: .* no if, and, max or",
        ),
        (
            {"path": [lambda s: math.sin(s.x) <= 1]},
            "got False: Python compared numbers",
        ),
        ({"path": [lambda s: s.x - 1]}, r"path condition 1: .*; write <=, >= or =="),
        ({"path": [lambda s: s.x != 1]}, r"path condition 1: .*; write <=, >= or =="),
        ({"path": [lambda s: ca.SX(0, 1)]}, "path condition 1: expected a comparison"),
        ({"p": None}, "p: expected values by name.* got None; leave it out"),
        ({"path": [lambda s: None]}, "path condition 1: expected a comparison .* got None"),
        ({"path": [lambda s: s.v**2 >= 0]}, "got one that is always true"),
        ({"path": [lambda s: abs(s.v) <= -1]}, "expected a condition that can be met, got 1 to -1"),
        ({"path": [lambda s: s.y <= 1]}, "path condition 1: signals of .* got y"),
        ({"path": [lambda s: s.x <= ca.SX.sym("w")]}, "only signals of the model, got w"),
        ({"link": {"x": None}}, "link: expected none in the first phase"),
        ({"joins": [lambda b, a: b.x <= a.x]}, "joins: expected none in the first phase"),
        ({"periodic": ["a"]}, "periodic: expected one of x, v, got a; only states"),
        ({"periodic": "x"}, r"periodic: expected a sequence of names, got 'x'; write \['x'\]"),
        ({"shared": ["x"]}, "shared: expected one of a, got x; only inputs"),
        ({"scenarios": {"a": 1.0}}, "scenario 'a': expected values by name"),
        ({"durations": [((0, 1), 2.0)]}, "expected a whole number from 0 to 0, got 1; .* from 0"),
        ({"durations": [((0,), 2.0)]}, "expected a sum that the phases can have, 1 to 1 s, got 2"),
        ({"durations": [(0, 2.0)]}, "durations: expected sums of durations, such as"),
        ({"durations": [((0,), -2.0)]}, "durations of .*: expected a duration T > 0"),
        ({"name": 3}, "name: expected a text, got 3"),
    ],
)
def test_bad_input_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        moved(**changes)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (MODEL, r"give the model a duration: Phase\(model, T=1\.0\)"),
        ([Phase(MODEL, 1.0)], "join phases with >>"),
        (None, "phases: expected a phase"),
    ],
)
def test_what_is_no_phase_is_refused(given: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Problem(given, EFFORT)


def test_a_phase_needs_a_model_and_a_phase_to_join() -> None:
    with pytest.raises(ValueError, match="Phase: expected a model"):
        Phase(1.0, 1.0)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="phases: expected a phase"):
        _ = Phase(MODEL, 1.0) >> MODEL  # pyright: ignore[reportOperatorIssue]


def test_all_problems_are_told_at_once() -> None:
    with pytest.raises(ValueError) as error:
        moved(
            T=-1.0,
            cost=integral(lambda s: s.b),
            end={"y": 1.0},
            bounds={"a": (1.0, 0.0)},
            path=[lambda s: 0 <= s.x <= 1],
        )
    parts = ("problem 'double integrator': ", "T > 0", "got b", "got y", "bounds: expected a")
    for part in (*parts, "path condition 1"):
        assert str(error.value).count(part) == 1


def test_messages_name_the_phase() -> None:
    out, back = Phase(MODEL, 1.0, end={"y": 1.0}), Phase(MODEL, -1.0, name="back")
    with pytest.raises(ValueError, match=r"phase 1: end: .*; phase 2 'back': expected a duration"):
        Problem(out >> back, EFFORT)
    with pytest.raises(ValueError, match="expected every name once, got 'back' 2 times"):
        Problem(replace(back, T=1.0) >> replace(back, T=1.0), EFFORT)


@pytest.mark.parametrize(
    ("second", "message"),
    [
        ({"link": {"y": None}}, "phase 2: link: expected one of x, v, got y"),
        ({"link": {"v": 0.5}}, r"phase 2: link: expected v as a function .* stand in start"),
        ({"link": {"v": lambda before: before.y}}, "phase 2: link of v: signals of .* got y"),
        ({"link": {"v": "w"}}, "phase 2: link of v: signals of .* got w"),
        ({"joins": [lambda before: before.x <= 0]}, "join 1: .* TypeError"),
        ({"joins": [lambda before, after: after.y <= 0]}, "phase 2: join 1: signals of .* got y"),
        ({"start": {"x": 2.0}}, r"phase 2: start: expected x where the .* end, 1, got 2; link"),
        ({"cost": worst(EFFORT)}, r"phase 2: cost: expected worst\(\.\.\.\) in the cost of the"),
    ],
)
def test_bad_ways_on_are_refused(second: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Problem(Phase(MODEL, 1.0, end={"x": 1.0}) >> Phase(MODEL, 1.0, **second), EFFORT)


def test_cost_of_phases_that_differ_says_what_to_do() -> None:
    chain = Phase(MODEL, 1.0) >> Phase(stage(), 1.0)
    with pytest.raises(ValueError, match=r"phase 2: cost: .*; phases that differ have costs of"):
        Problem(chain, EFFORT)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ((1.0, 1.0), "the one number 1; a value that is given stands in p"),
        (2.0, r"choose: expected m as \(lower, upper\) or \(lower, upper, guess\)"),
        ((2.0, 1.0), "with lower < upper"),
        ((1.0, 2.0, 3.0), "with a guess between"),
        ((-2.0, -1.0), r"within \[.*\] kg"),
    ],
)
def test_bad_choices_are_refused(given: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Problem(Phase(stage(free=["m"]), 1.0), at_end(lambda s: s.x), choose={"m": given})


def test_scenarios_give_values_that_exist_and_are_not_chosen() -> None:
    phase = Phase(stage(free=["m", "mu_d"]), 1.0)
    cost = at_end(lambda s: s.x)
    with pytest.raises(ValueError, match=r"scenario 'heavy': .* got mm; did you mean m"):
        Problem(phase, cost, scenarios={"heavy": {"mm": 2.0}})
    with pytest.raises(ValueError, match=r"chosen once for all, got a value .* heavy"):
        Problem(phase, cost, scenarios={"heavy": {"m": 2.0}}, choose={"m": (1.0, 3.0)})
    with pytest.raises(ValueError, match=r"scenario 'light': drive\.m: expected a number >= 1e-12"):
        Problem(phase, cost, scenarios={"heavy": {"m": 2.0}, "light": {"m": -2.0}})


def test_events_are_refused_but_for_those_of_slip_and_stick() -> None:
    effort = integral(lambda s: s.force**2)
    stuck = drive(ExactCoulomb(mu_s=6.0, mu_d=4.0), m=1.0, N=1.0)
    assert Problem(Phase(stuck, 1.0), effort).spans[0].model.events
    stop = Event("stop", stuck.x[0].symbol - 1.0, terminal=True)
    for model in (
        replace(MODEL, events=(Event("stop", MODEL.x[0].symbol - 1.0, terminal=True),)),
        replace(stuck, events=(*stuck.events, stop), opening=lambda: with_stop(stuck, stop)),
    ):
        with pytest.raises(ValueError, match="expected a model without events, got stop; deriv"):
            Problem(Phase(model, 1.0), TIME)


def with_stop(model: Model, stop: Event) -> Model:
    return replace(model.open, events=(*model.open.events, stop))


def test_rate_of_an_input_needs_a_name_of_its_own() -> None:
    x, x_rate, u = Variable("x", "m"), Variable("u_rate", "m/s"), Variable("u", "N")
    model = Model("clash", x=(x, x_rate), u=(u,), ode=ca.vertcat(x_rate.symbol, u.symbol))
    with pytest.raises(ValueError, match="rates: expected new names for the rates, got u_rate"):
        Problem(Phase(model, 1.0), integral(lambda s: s.u**2), rates={"u": (-1, 1)})
