"""Events against closed forms: times, directions, resets, jumps, storms, hybrid models.

Plants with events: those of `simulate`, at the same times, and what they end.
"""

from dataclasses import replace
from functools import cache
from math import asin, pi, sqrt
from typing import Any

import casadi as ca
import numpy as np
import pytest
from backends import each_backend
from hybrid import ball, coulomb_on_a_belt
from oracles import rabinowicz_coulomb

import symfric as sf
from symfric import Event, Hold, Linear, Model, SolveError, Status, Variable, simulate
from symfric.integrator.running.engine import VmEngine

G = 9.81
FALL = sqrt(2 / G)
"""Time [s] of the first impact from a height of 1 m."""

t = ca.SX.sym("t")
x, y, u = Variable("x", "m"), Variable("y", "m", start=2.0), Variable("u", "N")
X, Y, U = x.symbol, y.symbol, u.symbol


def clock(*events: Event) -> Model:
    """x' = 1."""
    return Model("clock", x=(x, y), ode=ca.SX([1.0, 0.0]), events=events, t=t)


def driven(*events: Event) -> Model:
    return Model("driven", x=(x,), u=(u,), ode=1 + 0 * X, events=events, t=t)


def due(slope: float) -> Model:
    """An event at the start, and one that is not."""
    first = Event("due", X, 1, reset={"x": -9.0, "y": 7.0}, at_start=True)
    return Model("due", x=(x, y), ode=ca.vertcat(slope, 0), events=(first, Event("plain", X, 1)))


def impacts(count: int, e: float) -> list[float]:
    """Times of the first impacts of a ball with restitution e."""
    return [FALL * (1 + 2 * sum(e**j for j in range(1, k + 1))) for k in range(count)]


def either_way(e: float) -> Model:
    """A ball whose impact is an event in both directions.

    The reset changes the velocity; the position is where the event was located, a hair below.
    """
    model = ball(e)
    return replace(model, events=(replace(model.events[0], direction=0),))


def once(name: str, *times: float) -> list[tuple[str, float]]:
    return [(name, at) for at in times]


HALF, ON = ca.sin(t) - 0.5, Event("on", U - 0.5, 1)
UP, DOWN = [pi / 6, 13 * pi / 6], [5 * pi / 6]
EDGE = Model(
    "edge", x=(x, y), ode=ca.vertcat(1, ca.sqrt(1.1 - X)),
    events=(Event("back", X - 1, 1, reset={"x": 0.0}),),
)  # fmt: skip
"""No step could go on beyond 1.1, where the root has no value."""
WAVES = [(asin(0.5) + 2 * pi * k) / 5 for k in range(3)]

Case = tuple[Model, float, dict[str, Any], list[tuple[str, float]], dict[str, float]]
CASES: dict[str, Case] = {
    "ball, 0.8": (ball(0.8), impacts(6, 0.8)[5] + 1e-3, {}, once("bounce", *impacts(6, 0.8)), {}),
    "ball, 0.5": (ball(0.5), impacts(6, 0.5)[5] + 1e-3, {}, once("bounce", *impacts(6, 0.5)), {}),
    "ball, either way": (either_way(0.8), 2.5, {}, once("bounce", *impacts(4, 0.8)), {}),
    "elastic ball": (ball(1.0), 20.0, {}, once("bounce", *impacts(22, 1.0)), {}),
    "no reset": (clock(Event("pass", X - 1, 1)), 2.0, {}, once("pass", 1), {"x": 2.0, "y": 2.0}),
    "at the very end": (clock(Event("end", X - 1, 1)), 1.0, {}, once("end", 1.0), {}),
    "sawtooth": (
        clock(Event("tooth", X - 1, 1, reset={"x": 0.0})), 10.5, {},
        once("tooth", *range(1, 11)), {"x": 0.5},
    ),
    "all values are read before a reset": (
        clock(Event("swap", X - 1, 1, reset={"x": Y - 5, "y": X})), 1.5, {},
        once("swap", 1.0), {"x": -2.5, "y": 1.0},
    ),
    "two half a tolerance apart read the values before both": (
        clock(Event("one", X - 1, 1, reset={"x": Y}), Event("two", X - 1 - 5e-11, reset={"y": X})),
        1.5, {}, [("one", 1.0), ("two", 1.0)], {"x": 2.5, "y": 1.0},
    ),
    "a mode triggers another at once": (
        clock(Event("first", X - 1, 1, reset={"y": -1.0}), Event("second", -Y, 1, reset={"x": 10})),
        2.0, {}, [("first", 1.0), ("second", 1.0)], {"x": 11.0},
    ),
    "quick succession": (
        clock(*(Event(f"e{k}", X - (1 + 1e-6 * k), 1) for k in range(5))), 2.0, {},
        [(f"e{k}", 1 + 1e-6 * k) for k in range(5)], {},
    ),
    "time alone, rising": (
        clock(Event("half", HALF, 1, reset={"x": 0.0})), 8.0, {},
        once("half", *UP), {"x": 8.0 - UP[1]},
    ),
    "falling": (clock(Event("half", HALF, -1)), 7.0, {}, once("half", *DOWN), {}),
    "both": (clock(Event("half", HALF)), 7.0, {}, once("half", *sorted(UP + DOWN)), {}),
    "what lies beyond a reset": (EDGE, 3.5, {}, once("back", 1.0, 2.0, 3.0), {}),
    "input, expression": (
        driven(ON), 3.0, {"u": {"u": lambda t: ca.sin(5 * t)}}, once("on", *WAVES), {},
    ),
    "input, linear": (
        driven(ON), 3.0, {"u": {"u": Linear([0, 1, 2, 3], [0, 1, 0, 2])}}, once("on", 0.5, 2.25), {}
    ),
    "input, hold": (
        driven(ON), 3.0, {"u": {"u": Hold([0, 1, 2, 2.5], [0, 1, 0, 3])}}, once("on", 1, 2.5), {}
    ),
    "input, against the direction": (
        driven(ON), 3.0, {"u": {"u": Hold([0, 1, 2], [1, 0, 0.2])}}, [], {}
    ),
    # a sample at 0.3 s, and a time of 3 * 0.1 s, as two grids have them
    "a rounding error before the end of a step": (
        driven(ON), 1.0, {"u": {"u": Hold([0, 0.3], [0, 1])}, "times": [3 * 0.1]},
        once("on", 0.3), {"x": 1.0},
    ),
    "terminal, at a jump": (
        driven(Event("off", U - 0.5, 0, terminal=True)), 3.0,
        {"u": {"u": Hold([0, 1.25], [1, 0])}}, once("off", 1.25), {"x": 1.25},
    ),
    "terminal": (
        clock(Event("stop", X - 0.7, 1, terminal=True)), 5.0, {"samples": 51},
        once("stop", 0.7), {"x": 0.7},
    ),
    # beyond zero, or leaving it; not at rest on it, nor below
    "due": (due(0.0), 1.0, {"x0": {"x": 0.5, "y": 0.0}}, once("due", 0.0), {"y": 7.0}),
    "leaving": (due(1.0), 1.0, {"x0": {"y": 0.0}}, once("due", 0.0), {"y": 7.0}),
    "at rest": (due(0.0), 1.0, {"x0": {"y": 0.0}}, [], {"y": 0.0}),
    "below": (due(0.0), 1.0, {"x0": {"x": -0.5, "y": 0.0}}, [], {"y": 0.0}),
}  # fmt: skip
"""Model, end, arguments, what happens, and some final values."""


@each_backend
@pytest.mark.parametrize("case", CASES)
def test_events_happen_at_the_times_of_closed_forms(backend: str, case: str) -> None:
    model, span, arguments, happened, final = CASES[case]
    run = simulate(model, span, rtol=1e-10, backend=backend, **arguments)
    ends = any(event.terminal for event in model.events)
    assert run.status is (Status.TERMINATED if ends else Status.SUCCESS)
    assert run.statistics.events == len(happened)
    assert [name for _, name in run.happened] == [name for name, _ in happened]
    times = [at for _, at in happened]
    assert [at for at, _ in run.happened] == pytest.approx(times, abs=2e-9)
    assert {name: run.final[name] for name in final} == pytest.approx(final, abs=1e-8)
    if arguments.get("u") and "input" not in case:
        assert [at for at, _ in run.happened] == times  # to the bit
    if ends:
        assert run.step_times[-1] == run.happened[-1][0]
        assert run.t[-1] <= run.happened[-1][0]


def test_the_step_that_an_event_cuts_keeps_its_polynomial() -> None:
    """sin t up to an event: long steps of high order, the last one cut where the event is."""
    velocity = replace(y, start=1.0, unit="m/s")
    cut: list[float] = []
    for until in (0.8, 0.9, 1.0, 1.1):
        end = Event("end", X - np.sin(until), terminal=True)
        swing = Model("swing", x=(x, velocity), ode=ca.vertcat(Y, -X), events=(end,))
        run = simulate(swing, 2.0, rtol=1e-8)
        assert run.step_times[-1] == pytest.approx(until, abs=1e-8)
        last = np.linspace(run.step_times[-2], run.step_times[-1], 50)
        assert run.at(last)["x"] == pytest.approx(np.sin(last), abs=1e-7)
        cut.append(last[-1] - last[0])
    assert max(cut) > 0.05


def test_parabola_between_two_impacts_is_right_and_the_corner_is_sharp() -> None:
    run = simulate(ball(0.8), 1.0, rtol=1e-10)
    hit = run.happened[0][0]
    s, v = np.linspace(0, 0.5, 101), 0.8 * sqrt(2 * G)
    assert run.at(hit + s)["x"] == pytest.approx(v * s - G / 2 * s**2, abs=1e-8)
    before, after = run.at([hit - 1e-9, hit])["v"]
    assert (before, after) == pytest.approx((-sqrt(2 * G), v), rel=1e-7)


def test_fast_events_are_not_a_storm() -> None:
    """Periods of 50 ns that get shorter; 200 crossings in a millionth of a span.

    Four events below a microsecond were called a storm.
    """
    x, v, w = Variable("x", "m", start=1.0), Variable("v", "m/s"), Variable("w", "rad/s")
    stiffness = (2 * np.pi * 2e7 * (1 + w.symbol)) ** 2
    rates = ca.vertcat(v.symbol, -stiffness * x.symbol, 1e4)
    model = Model("resonator", x=(x, v, w), ode=rates, events=(Event("up", x.symbol, 1),))
    for tolerance in ({}, {"event_tolerance": 1e-14}):
        run = simulate(model, 1e-6, **tolerance)
        assert run.status is Status.SUCCESS
        assert len(run.happened) == 20
    tick = Event("tick", ca.sin(np.pi * 1e3 * X), 0, reset={"y": Y + 1})
    last = Event("last", Y - 201.5, 1, terminal=True)
    run = simulate(clock(tick, last), 1e9, max_step=2e-4, throw=False)
    assert run.status is Status.TERMINATED
    assert run.step_times[-1] == pytest.approx(0.2, rel=1e-6)


@each_backend
def test_zeno_storm_is_reported_with_what_was_reached(backend: str) -> None:
    with pytest.raises(SolveError, match=r"Zeno.*mode.*t = 4\.063\d+ s, event 'bounce'") as caught:
        simulate(ball(0.8), 5.0, rtol=1e-10, backend=backend)
    partial = caught.value.partial
    assert caught.value.status is partial.status is Status.EVENT_STORM
    assert partial.step_times[-1] == pytest.approx(FALL * (1 + 2 * 0.8 / 0.2), abs=1e-5)
    assert 60 < len(partial.happened) < 100


def test_events_that_reset_each_other_for_ever_are_a_storm() -> None:
    """Each reset carries the other expression through zero at the same instant."""
    there = Event("there", X - 1, 1, reset={"y": -1})
    up, down = Event("up", -Y, 1, reset={"y": 1}), Event("down", Y, 1, reset={"y": -1})
    run = simulate(clock(there, up, down), 2.0, throw=False)
    assert run.status is Status.EVENT_STORM
    assert "t = 1" in run.message


def test_event_is_located_to_the_tolerance_on_the_side_after_it() -> None:
    model = clock(Event("found", t**3 - 2, 1))
    for tolerance in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12):
        run = simulate(model, 2.0, event_tolerance=tolerance)
        assert -1e-15 <= run.happened[0][0] - 2 ** (1 / 3) <= tolerance


def test_reset_without_consistent_algebraic_values_is_a_failure_with_what_was_reached() -> None:
    z = Variable("z", "1", start=1.0)
    model = Model(
        "dae", x=(x,), z=(z,), ode=ca.SX(1.0), alg=z.symbol**2 - 1 + X * (X - 1) * (X > 4),
        events=(Event("jump", X - 0.5, 1, reset={"x": 5.0}),),
    )  # fmt: skip
    with pytest.raises(SolveError, match=r"at t = 0\.5\d* s: .* no solution .* z") as caught:
        simulate(model, 1.0)
    assert caught.value.partial.final["x"] == pytest.approx(0.5, abs=1e-8)


BLOCK = {"m": 0.8, "k": 2.1, "v_belt": 0.1, "g": 9.81, "mu_s": 0.15, "mu_d": 0.1}


@each_backend
@pytest.mark.parametrize("rtol", [1e-10, 1e-12])
def test_exact_stick_slip_under_set_valued_coulomb_friction(backend: str, rtol: float) -> None:
    """Period, stick time and extreme elongations of the Rabinowicz block, as a hybrid model."""
    exact = rabinowicz_coulomb(**BLOCK)
    run = simulate(coulomb_on_a_belt(**BLOCK), 30.0, rtol=rtol, backend=backend)
    times = {
        name: np.array([time for time, which in run.happened if which == name])
        for name in ("stick", "slip", "turn", "back")
    }
    assert len(times["slip"]) == 5
    assert np.diff(times["slip"]) == pytest.approx(exact.period, abs=1e-9)
    sticking = times["slip"] - times["stick"][-5:]
    assert sticking[1:] == pytest.approx(exact.stick_time, abs=1e-9)
    for name, extreme in (("turn", exact.x_max), ("back", exact.x_min)):
        after = times[name][times[name] > times["slip"][0]]
        assert run.at(after)["x"] == pytest.approx(extreme, abs=1e-9)


def test_contact_that_is_overloaded_when_it_sticks_slips_on_at_once() -> None:
    """A spring far stretched: the velocities meet, but the static friction cannot hold."""
    start = {"x": 1.5, "v": 1.0, "mode": 1.0}
    meet, slip, *_ = simulate(coulomb_on_a_belt(**BLOCK), 3.0, x0=start, rtol=1e-9).happened
    assert (meet[1], slip[1]) == ("meet", "slip")
    assert slip[0] == pytest.approx(meet[0], abs=1e-8)


def test_event_at_the_start_needs_a_direction() -> None:
    with pytest.raises(ValueError, match="at_start: expected a direction 1 or -1, got 0"):
        Model("due", x=(x,), ode=ca.SX(1), events=(Event("due", X, at_start=True),))


height, speed = sf.Variable("x", "m", start=1.0), sf.Variable("v", "m/s")
z, push = sf.Variable("z", "1"), sf.Variable("u", "N")


@cache
def thrown(restitution: float = 0.5, terminal: bool = False) -> sf.Model:
    """Falls with 2 m/s^2 from 1 m at 0 s, so that it hits the ground at 1 s; u pushes it up."""
    event = Event(
        "hit",
        height.symbol,
        direction=-1,
        reset={"v": -restitution * speed.symbol},
        terminal=terminal,
    )
    ode = ca.vertcat(speed.symbol, push.symbol - 2)
    return sf.Model("ball", x=(height, speed), u=(push,), ode=ode, events=(event,))


@each_backend
def test_events_are_those_of_one_simulation(backend: str) -> None:
    """A block that is pushed beyond break-away, comes to rest, and breaks away again."""
    model, dt, rng = sf.drive(sf.ExactCoulomb()), 2e-3, np.random.default_rng(0)
    held = np.cumsum(rng.normal(size=400)) * 0.4
    t = np.arange(held.size + 1) * dt
    run = sf.simulate(
        model, t[-1], u={"force": sf.Hold(t[:-1], held)}, t_eval=t[1:], backend="auto"
    )
    plant, found, happened = sf.stepper(model, dt, backend=backend), [], []
    for force in held:
        found.append(plant.step(force))
        happened += plant.happened
    np.testing.assert_array_equal(np.array(found)[:, 0], run["x"])
    np.testing.assert_array_equal(np.array(found)[:, 1], run["v"])
    assert happened == list(run.happened)
    assert len(happened) >= 3


@each_backend
def test_resets_happen_inside_an_interval(backend: str) -> None:
    """At 1 s it leaves with 1 m/s and is back at 2 s; for ever, if it is elastic."""
    plant = sf.stepper(thrown(), 1.5, rtol=1e-8, backend=backend)
    assert plant.step() == pytest.approx([0.25, 0.0], abs=1e-6)
    assert plant.happened == [(pytest.approx(1.0), "hit")]
    assert not plant.terminated
    many = sf.stepper(thrown(1.0), 1.5, batch=2, rtol=1e-8, backend=backend)
    fall = many.step([[0.0], [2.0]])
    assert fall == pytest.approx(np.array([[0.75, 1.0], [1.0, 0.0]]), abs=1e-6)
    assert many.happened == [(0, pytest.approx(1.0), "hit")]
    assert many.copy().happened == many.happened


@each_backend
def test_a_terminal_event_ends_a_plant_until_it_is_put_back(backend: str) -> None:
    plant = sf.stepper(thrown(terminal=True), 0.4, batch=2, rtol=1e-8, backend=backend)
    for _ in range(4):
        plant.step([[0.0], [2.0]])
    assert plant.terminated.tolist() == [True, False]
    assert plant.t == pytest.approx([1.0, 1.6])
    assert plant.x[0] == pytest.approx([0.0, 1.0], abs=1e-6)
    plant.reset(members=[0])
    assert plant.terminated.tolist() == [False, False]
    plant.step()
    assert plant.t == pytest.approx([0.4, 2.0])


@each_backend
def test_a_storm_of_events_is_a_failure(backend: str) -> None:
    """Back at 2 s, 2.5 s, ... 3 s."""
    plant = sf.stepper(thrown(), 4.0, backend=backend)
    with pytest.raises(
        sf.SolveError, match=r"stepper 'ball' at t = 2\.999.*Events accumulate"
    ) as caught:
        plant.step(0.0)
    assert caught.value.status is sf.Status.EVENT_STORM


@each_backend
def test_unknowns_follow_events_that_set_states(backend: str) -> None:
    """z + z^3 = u - x, and x falls back to 0 where it reaches 1."""
    low = sf.Variable("x", "m")
    alg = z.symbol + z.symbol**3 - push.symbol + low.symbol
    back = Event("back", low.symbol - 1, direction=1, reset={"x": 0.0 * low.symbol})
    model = sf.Model(
        "saw", x=(low,), z=(z,), u=(push,), ode=1 + 0 * z.symbol, alg=alg, events=(back,)
    )
    plant = sf.stepper(model, 0.7, rtol=1e-8, backend=backend)
    for k, held in enumerate((2.0, 5.0, 200.0, -3.0), start=1):
        assert plant.step(held) == pytest.approx([0.7 * k % 1], abs=1e-7)
        root = plant["z"]
        assert root + root**3 == pytest.approx(held - 0.7 * k % 1, rel=1e-7)


def test_an_interrupted_step_skips_no_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    plant = sf.stepper(thrown(), 0.5, batch=2, backend="vm")

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(VmEngine, "march", interrupt)
    with pytest.raises(KeyboardInterrupt):
        plant.step()
    monkeypatch.undo()
    assert plant.step() == pytest.approx(np.array([[0.75, -1.0]] * 2))
    assert plant.t.tolist() == [0.5, 0.5]


def test_start_modes_that_contradict_the_sliding_velocity_are_refused() -> None:
    sled = sf.drive(sf.ExactCoulomb(mu_s=0.9, mu_d=0.1))
    free = simulate(sled, 0.5, x0={"v": 1.0})
    for v, mode in ((1.0, 0.0), (-1.0, 1.0), (1e-4, -1.0)):
        with pytest.raises(ValueError, match="mode: expected 0 in stick, else the direction"):
            simulate(sled, 0.5, x0={"v": v, "mode": mode})
    with pytest.raises(ValueError, match="got 1 at a sliding velocity of -2"):
        sf.simulate_many(sled, 0.5, x0={"v": [1.0, -2.0], "mode": 1.0})
    assert simulate(sled, 0.5, x0={"v": 1.0, "mode": 1.0}).final == free.final
    again = {v.name: free.final[v.name] for v in sled.x}
    assert simulate(sled, 2.0, x0=again).final["mode"] == 0.0
