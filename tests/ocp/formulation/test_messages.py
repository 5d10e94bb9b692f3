"""Bad problems: every message names its place, the expected and the given."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import casadi as ca
import pytest
from motions import double_integrator, stage
from phases import slider_crank

from ocp.formulation.expressions import TIME, Signals, at_end, integral, track, worst
from ocp.formulation.phase import FREE, Free, Phase
from ocp.formulation.problem import Problem, rest_to_rest
from ocp.solve import solve
from ocp.transcription.schemes import Shooting
from symfric import Event, ExactCoulomb, LuGre, Model, Variable, drive

MODEL = double_integrator()
EFFORT, FORCE = integral(lambda s: s.a**2), integral(lambda s: s.force**2)
X = at_end(lambda s: s.x)
FREED = stage(free=["m", "mu_d"])


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
        ({"T": (0.1, 1.0)}, r"expected a duration T > 0 .*; write Free\(0\.1, 1\.0\)"),
        ({"cost": None}, "expected a cost made of integral"),
        ({"cost": lambda s: s.a}, r"cost: .* wrap it in integral\(\.\.\.\) or at_end"),
        ({"cost": TIME}, "got a constant; TIME needs a free duration"),
        ({"cost": integral(lambda s: 3.0)}, "cost: expected one that depends on the motion"),
        ({"cost": integral(lambda s: s.b)}, r"cost: signals of 'double integrator'.* got b"),
        ({"cost": integral(lambda s: ca.SX.sym("w") * s.a)}, "only signals of the model, got w"),
        ({"cost": integral(lambda s: math.sin(s.a))}, "got nan; write casadi functions"),
        ({"cost": integral(lambda s: s.a + math.cos(s.a))}, "it holds nan; write casadi"),
        ({"cost": integral(lambda s: s.a.foo)}, "AttributeError: 'SX' object has no attribute"),
        ({"cost": integral(lambda: 1.0)}, r"TypeError: .*positional argument[^;]*$"),
        ({"cost": integral(lambda s: ca.vertcat(s.x, s.v))}, r"got the expression .* of shape"),
        ({"cost": integral(lambda s: ca.MX.sym("x"))}, r"write it with casadi\.SX"),
        ({"cost": track("x", "gaol", 1.0)}, r"track: .* got gaol; .*give its value: p=\{'gaol'"),
        ({"end": {"y": 1.0}}, "end: expected one of x, v, a, power, x_acc, got y"),
        ({"end": {"T": 1.0}}, "end: .* got T; durations are T of the phases"),
        ({"bounds": {"powr": 1.0}}, r"bounds: .* got powr; did you mean power\?"),
        ({"p": {"m": 1.0}}, r"p: expected no names, got m; .*free=\['m'\]"),
        ({"choose": {"m": (1.0, 2.0)}}, r"choose: expected no names, got m; .*free=\['m'\]"),
        ({"scenarios": {"a": {"m": 1.0}}}, r"scenario 'a': expected no names, got m"),
        ({"via": {0.5: {"z": 1.0}}}, r"via 0\.5: expected one of x, v, power, x_acc, got z"),
        ({"via": {0.5: {"a": 1.0}}}, "got a; an input holds on intervals; with rates"),
        ({"via": {1.5: {"x": 1.0}}}, r"via: expected fractions of T between 0 and 1, got 1\.5"),
        ({"via": [0.5]}, "via: expected states by fractions of T"),
        ({"via": {0.5: {"x": (2, 1)}}}, r"via 0\.5: expected x as a finite number or \(lower"),
        ({"bounds": {"a": [0, 1]}}, r"bounds: expected a .* got \[0, 1\]; write a tuple"),
        ({"end": {"x": "far"}}, "end: expected x as a finite number .* got 'far'"),
        ({"rates": {"a": 400.0}}, r"rates: .* got 400\.0; write \(-400, 400\)"),
        ({"rates": {"v": (-1, 1)}}, "rates: .* got v; only inputs have rates that are chosen"),
        ({"bounds": {"x": (0.5, 2.0)}}, r"start: expected x inside its bounds \[0\.5, 2\], got 0"),
        ({"bounds": {"a": (-1, 1)}, "end": {"a": 3.0}}, r"end: expected a inside its bounds"),
        ({"model": implicit()}, r"expected an explicit model \(ode\), got an implicit one"),
        ({"path": lambda s: s.x <= 1}, r"path: expected a sequence of .*; write \[lambda"),
        ({"path": [lambda s: 0 <= s.x <= 1]}, "path condition 1: .* no if, and, max or"),
        ({"path": [lambda s: math.sin(s.x) <= 1]}, "got False: Python compared numbers"),
        ({"path": [lambda s: s.x - 1]}, r"path condition 1: .*; write <=, >= or =="),
        ({"path": [lambda s: ca.SX(0, 1)]}, "path condition 1: expected a comparison"),
        ({"path": [lambda s: None]}, "path condition 1: expected a comparison .* got None"),
        ({"path": [lambda s: s.v**2 >= 0]}, "got one that is always true"),
        ({"path": [lambda s: abs(s.v) <= -1]}, "expected a condition that can be met, got 1 to -1"),
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


def chosen(box: Any, **scenarios: Any) -> Problem:
    return Problem(Phase(FREED, 1.0), X, choose={"m": box}, scenarios=scenarios)


def scenarios(**values: dict[str, float]) -> Problem:
    return Problem(Phase(FREED, 1.0), X, scenarios=values)


def two(
    second: Phase | None = None, first: Phase | None = None, cost: Any = EFFORT, **more: Any
) -> Problem:
    """Two phases, the first to x = 1."""
    return Problem(
        (first or Phase(MODEL, 1.0, end={"x": 1.0})) >> (second or Phase(MODEL, 1.0, **more)), cost
    )


def clash() -> Problem:
    x, x_rate, u = Variable("x", "m"), Variable("u_rate", "m/s"), Variable("u", "N")
    model = Model("clash", x=(x, x_rate), u=(u,), ode=ca.vertcat(x_rate.symbol, u.symbol))
    return Problem(Phase(model, 1.0), integral(lambda s: s.u**2), rates={"u": (-1, 1)})


def with_stop(stuck: bool) -> Problem:
    model = drive(ExactCoulomb(mu_s=6.0, mu_d=4.0), m=1.0, N=1.0) if stuck else MODEL
    stop = Event("stop", model.x[0].symbol - 1.0, terminal=True)
    more: dict[str, Any] = {"events": (*model.events, stop)}
    if stuck:
        opened = replace(model.open, events=(*model.open.events, stop))
        more["opening"] = lambda: opened
    return Problem(Phase(replace(model, **more), 1.0), TIME)


def by_modes(**options: Any) -> object:
    move = rest_to_rest(drive(ExactCoulomb(mu_s=6.0, mu_d=4.0), m=1.0, N=1.0), 1.0, 1.0, limit=20.0)
    return solve(move, **options)


OPEN, BACK = Phase(MODEL, Free(0.1, 3.0)), Phase(MODEL, 1.0, name="back")
BAD_END, STARTED = Phase(MODEL, 1.0, end={"y": 1.0}), Phase(drive(LuGre()), 1.0, start={"v": FREE})
OPENED = Phase(slider_crank(), 0.5, start={"crank": 1.0, "slider": 0.9})
REFUSED: list[tuple[Callable[[], object], str]] = [
    (lambda: Problem(MODEL, EFFORT), r"give the model a duration: Phase\(model, T=1\.0\)"),
    (lambda: Problem([Phase(MODEL, 1.0)], EFFORT), "join phases with >>"),
    (lambda: Problem(None, EFFORT), "phases: expected a phase"),
    (lambda: Phase(1.0, 1.0), "Phase: expected a model"),
    (lambda: Phase(MODEL, 1.0) >> MODEL, "phases: expected a phase"),
    (
        lambda: two(replace(BACK, T=-1.0), BAD_END),
        r"phase 1: end: .*; phase 2 'back': expected a d",
    ),
    (lambda: two(BACK, BACK), "expected every name once, got 'back' 2 times"),
    (lambda: two(link={"y": None}), "phase 2: link: expected one of x, v, got y"),
    (lambda: two(link={"v": 0.5}), r"phase 2: link: expected v as a function .* belong in start"),
    (lambda: two(link={"v": lambda b: b.y}), "phase 2: link of v: signals of .* got y"),
    (lambda: two(link={"v": "w"}), "phase 2: link of v: signals of .* got w"),
    (lambda: two(joins=[lambda b: b.x <= 0]), "join 1: .* TypeError"),
    (lambda: two(joins=[lambda b, a: a.y <= 0]), "phase 2: join 1: signals of .* got y"),
    (lambda: two(start={"x": 2.0}), "phase 2: start: .* previous phase may end, 1, got 2; link"),
    (lambda: two(Phase(MODEL, 1.0, cost=worst(EFFORT))), "phase 2: cost: expected worst"),
    (lambda: two(Phase(stage(), 1.0)), r"phase 2: cost: .*; phases that differ have costs of"),
    (lambda: chosen((1.0, 1.0)), "the one number 1; a fixed value belongs in p"),
    (lambda: chosen(2.0), r"choose: expected m as \(lower, upper\) or \(lower, upper, guess\)"),
    (lambda: chosen((2.0, 1.0)), "with lower < upper"),
    (lambda: chosen((1.0, 2.0, 3.0)), "with a guess between"),
    (lambda: chosen((-2.0, -1.0)), r"within \[.*\] kg"),
    (lambda: chosen((1.0, 3.0), heavy={"m": 2.0}), "once for all, .* in scenario heavy"),
    (lambda: scenarios(heavy={"mm": 2.0}), "scenario 'heavy': .* got mm; did you mean m"),
    (lambda: scenarios(light={"m": -2.0}), r"scenario 'light': drive\.m: expected a number > 0"),
    (clash, "rates: expected new names for the rates, got u_rate"),
    (lambda: with_stop(stuck=False), "expected a model without events, got stop; deriv"),
    (lambda: with_stop(stuck=True), "expected a model without events, got stop; deriv"),
    (lambda: by_modes(friction="smooth"), "expected models without events, got .*modes"),
    (lambda: by_modes(scheme=Shooting()), "expected models without events, got .*modes"),
    (lambda: Problem(STARTED, FORCE), "whose start depends on v; name it"),
    (lambda: Problem(OPENED, TIME), "start: expected positions from which all loops can be"),
    (lambda: Problem(OPEN >> OPEN, TIME, durations=[((0, 1), 7.0)]), r"0\.2 to 6 s, got 7 to 7 s"),
    (lambda: rest_to_rest(MODEL, 1.0, 1.0, limit=1.0), "expected one of x, v, a, got force"),
    (lambda: TIME / 0.0, "expected a divisor that is not zero"),
    (lambda: worst(TIME) + TIME, r"write worst\(a \+ b\)"),
    (lambda: -1.0 * worst(TIME), "expected a weight >= 0 of worst"),
    (lambda: worst(lambda s: s.x), "worst: expected a cost made of"),
    (lambda: integral("x"), "integral: expected a function of the signals"),
    (lambda: at_end("x"), "at_end: expected a function of the signals"),
    (lambda: Signals(stage()).forse, r"got forse; did you mean force\?"),
    (lambda: track("", 0.0, 1.0), "track: expected the name of a signal"),
    (lambda: track("x", 0.0, 0.0), "track: weight: expected a number > 0"),
    (lambda: track("x", None, 1.0), "track: reference: .* or a function, or a name"),
]


@pytest.mark.parametrize(("make", "message"), REFUSED)
def test_bad_phases_costs_and_choices_are_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()


def test_all_problems_are_reported_at_once() -> None:
    with pytest.raises(ValueError) as error:
        moved(T=-1.0, cost=integral(lambda s: s.b), end={"y": 1.0}, bounds={"a": (1.0, 0.0)},
              path=[lambda s: 0 <= s.x <= 1])  # fmt: skip
    parts = ("problem 'double integrator': ", "T > 0", "got b", "got y", "bounds: expected a")
    for part in (*parts, "path condition 1"):
        assert str(error.value).count(part) == 1
    with pytest.raises(TypeError, match="unsupported operand"):
        _ = TIME + 1
