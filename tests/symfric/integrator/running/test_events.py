"""Events against closed forms: times, directions, resets, jumps, storms, hybrid models."""

from dataclasses import replace
from math import asin, pi, sqrt

import casadi as ca
import numpy as np
import pytest
from backends import each_backend
from hybrid import ball, coulomb_on_a_belt
from oracles import rabinowicz_coulomb

from symfric import Event, Hold, Linear, Model, SolveError, Status, Variable, simulate
from symfric.integrator.equations.inputs import Input

G = 9.81
FALL = sqrt(2 / G)
"""Time [s] of the first impact from a height of 1 m."""

t = ca.SX.sym("t")
x, y = Variable("x", "m"), Variable("y", "m", start=2.0)
X, Y = x.symbol, y.symbol


def clock(*events: Event, rate: float = 1.0) -> Model:
    """x' = rate."""
    return Model("clock", x=(x, y), ode=ca.SX([rate, 0.0]), events=events, t=t)


def impacts(count: int, e: float) -> list[float]:
    """Times of the first impacts of a ball with restitution e."""
    return [FALL * (1 + 2 * sum(e**j for j in range(1, k + 1))) for k in range(count)]


@each_backend
@pytest.mark.parametrize("e", [0.8, 0.5])
def test_bouncing_ball_hits_the_ground_at_the_times_of_the_closed_form(
    backend: str, e: float
) -> None:
    expected = impacts(6, e)
    run = simulate(ball(e), expected[-1] + 1e-3, rtol=1e-10, backend=backend)
    assert [name for _, name in run.happened] == ["bounce"] * 6
    assert [time for time, _ in run.happened] == pytest.approx(expected, abs=1e-9)
    assert run.statistics.events == 6
    assert run.status is Status.SUCCESS


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
    flight = run.at(hit + np.linspace(0, 0.5, 101))
    s, v = np.linspace(0, 0.5, 101), 0.8 * sqrt(2 * G)
    assert flight["x"] == pytest.approx(v * s - G / 2 * s**2, abs=1e-8)
    before, after = run.at([hit - 1e-9, hit])["v"]
    assert (before, after) == pytest.approx((-sqrt(2 * G), v), rel=1e-7)


@pytest.mark.parametrize("direction", [-1, 0])
def test_impact_that_leaves_the_ball_a_hair_below_the_ground_is_one_event(direction: int) -> None:
    """The reset changes only the velocity; the position is where the event was located."""
    x, v = Variable("x", "m", start=1.0), Variable("v", "m/s")
    bounce = Event("bounce", x.symbol, direction, reset={"v": -0.8 * v.symbol})
    model = Model("ball", x=(x, v), ode=ca.vertcat(v.symbol, -G), events=(bounce,))
    run = simulate(model, 2.5, rtol=1e-10)
    assert [time for time, _ in run.happened] == pytest.approx(impacts(4, 0.8), abs=1e-8)


def test_elastic_ball_is_no_storm() -> None:
    run = simulate(ball(1.0), 40.0, rtol=1e-10)
    assert run.status is Status.SUCCESS
    assert len(run.happened) == round((40 / FALL - 1) / 2 + 0.5) == 44
    assert run.happened[-1][0] == pytest.approx(impacts(44, 1.0)[-1], abs=1e-6)


def test_fast_events_of_a_stiffening_machine_are_no_storm() -> None:
    """Periods of 50 ns that get shorter: four of them below a microsecond were called a storm."""
    x, v, w = Variable("x", "m", start=1.0), Variable("v", "m/s"), Variable("w", "rad/s")
    rate = 2 * np.pi * 2e7
    model = Model(
        "resonator", x=(x, v, w),
        ode=ca.vertcat(v.symbol, -((rate * (1 + w.symbol)) ** 2) * x.symbol, 1e4),
        events=(Event("up", x.symbol, 1),),
    )  # fmt: skip
    run = simulate(model, 1e-6, event_tolerance=1e-14)
    assert run.status is Status.SUCCESS
    run = simulate(model, 1e-6)
    assert run.status is Status.SUCCESS
    assert len(run.happened) == 20


def test_a_hundred_events_of_a_short_while_in_a_long_run_are_no_storm() -> None:
    """A burst of 200 crossings within a millionth of a span that the last of them ends."""
    count = Variable("count", "1")
    tick = Event("tick", ca.sin(np.pi * 1e3 * X), 0, reset={"count": count.symbol + 1})
    last = Event("last", count.symbol - 199.5, 1, terminal=True)
    model = Model("burst", x=(x, count), ode=ca.SX([1.0, 0.0]), events=(tick, last))
    run = simulate(model, 1e9, max_step=2e-4, throw=False)
    assert run.status is Status.TERMINATED
    assert run.step_times[-1] == pytest.approx(0.2, rel=1e-6)


@each_backend
def test_zeno_storm_is_said_with_what_was_reached(backend: str) -> None:
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


@each_backend
def test_terminal_event_ends_the_run_at_its_time(backend: str) -> None:
    model = clock(Event("stop", X - 0.7, 1, terminal=True))
    run = simulate(model, 5.0, backend=backend, samples=51)
    assert run.status is Status.TERMINATED
    assert run.step_times[-1] == run.happened[0][0] == pytest.approx(0.7, abs=1e-9)
    assert run.t.tolist() == pytest.approx(np.arange(0, 0.65, 0.1).tolist())
    assert run.final["x"] == pytest.approx(0.7, abs=1e-9)


HALF = ca.sin(t) - 0.5
UP, DOWN = [pi / 6, 13 * pi / 6], [5 * pi / 6]
Clock = tuple[list[Event], float, list[tuple[str, float]], dict[str, float]]
CLOCKS: dict[str, Clock] = {
    "no reset": ([Event("pass", X - 1, 1)], 2.0, [("pass", 1.0)], {"x": 2.0, "y": 2.0}),
    "at the very end": ([Event("end", X - 1, 1)], 1.0, [("end", 1.0)], {}),
    "sawtooth": (
        [Event("tooth", X - 1, 1, reset={"x": 0.0})], 10.5,
        [("tooth", k) for k in range(1, 11)], {"x": 0.5},
    ),
    "all values are read before a reset": (
        [Event("swap", X - 1, 1, reset={"x": Y - 5, "y": X})], 1.5,
        [("swap", 1.0)], {"x": -2.5, "y": 1.0},
    ),
    "two half a tolerance apart read the values before both": (
        [Event("one", X - 1, 1, reset={"x": Y}), Event("two", X - 1 - 5e-11, 0, reset={"y": X})],
        1.5, [("one", 1.0), ("two", 1.0)], {"x": 2.5, "y": 1.0},
    ),
    "a mode triggers another at once": (
        [Event("first", X - 1, 1, reset={"y": -1.0}), Event("second", -Y, 1, reset={"x": 10.0})],
        2.0, [("first", 1.0), ("second", 1.0)], {"x": 11.0},
    ),
    "quick succession": (
        [Event(f"e{k}", X - (1 + 1e-6 * k), 1) for k in range(5)], 2.0,
        [(f"e{k}", 1 + 1e-6 * k) for k in range(5)], {},
    ),
    "time alone, rising": (
        [Event("half", HALF, 1, reset={"x": 0.0})], 8.0,
        [("half", at) for at in UP], {"x": 8.0 - UP[1]},
    ),
    "falling": ([Event("half", HALF, -1)], 7.0, [("half", at) for at in DOWN], {}),
    "both": ([Event("half", HALF)], 7.0, [("half", at) for at in sorted(UP + DOWN)], {}),
}  # fmt: skip


@pytest.mark.parametrize("case", CLOCKS)
def test_events_of_a_clock(case: str) -> None:
    events, span, happened, final = CLOCKS[case]
    run = simulate(clock(*events), span, rtol=1e-9)
    assert [name for _, name in run.happened] == [name for name, _ in happened]
    assert [at for at, _ in run.happened] == pytest.approx([at for _, at in happened], abs=2e-9)
    assert {name: run.final[name] for name in final} == pytest.approx(final, abs=1e-8)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12])
def test_event_is_located_to_the_tolerance_on_the_side_after_it(tolerance: float) -> None:
    found = Event("found", t**3 - 2, 1)
    run = simulate(clock(found), 2.0, event_tolerance=tolerance)
    late = run.happened[0][0] - 2 ** (1 / 3)
    assert -1e-15 <= late <= tolerance


u = Variable("u", "N")


def driven(*events: Event) -> Model:
    return Model("driven", x=(x,), u=(u,), ode=1 + 0 * X, events=events, t=t)


ON = Event("on", u.symbol - 0.5, 1)


def five_waves(time: ca.SX) -> ca.SX:
    return ca.sin(5 * time)


@each_backend
@pytest.mark.parametrize(
    ("signal", "times"),
    [
        (five_waves, [(asin(0.5) + 2 * pi * k) / 5 for k in range(3)]),
        (Linear([0, 1, 2, 3], [0, 1, 0, 2]), [0.5, 2.25]),
        (Hold([0, 1, 2, 2.5], [0, 1, 0, 3]), [1.0, 2.5]),
    ],
    ids=["expression", "linear", "hold"],
)
def test_event_of_an_input(backend: str, signal: Input, times: list[float]) -> None:
    run = simulate(driven(ON), 3.0, u={"u": signal}, backend=backend)
    assert [time for time, _ in run.happened] == pytest.approx(times, abs=1e-9)


@each_backend
def test_event_a_rounding_error_before_the_end_of_a_step(backend: str) -> None:
    """A sample at 0.3 s, and a time of 3 * 0.1 s, as two grids have them."""
    signal = Hold([0, 0.3], [0, 1])
    run = simulate(driven(ON), 1.0, u={"u": signal}, times=[3 * 0.1], backend=backend)
    assert run.happened == ((0.3, "on"),)
    assert run.t[-1] == 1.0


def test_jump_of_an_input_against_the_direction_is_no_event() -> None:
    signal = Hold([0, 1, 2], [1, 0, 0.2])
    assert simulate(driven(ON), 3.0, u={"u": signal}).happened == ()


def test_terminal_event_at_a_jump_of_an_input_ends_there_exactly() -> None:
    model = driven(Event("off", u.symbol - 0.5, 0, terminal=True))
    run = simulate(model, 3.0, u={"u": Hold([0, 1.25], [1, 0])})
    assert run.happened == ((1.25, "off"),)
    assert run.final["x"] == pytest.approx(1.25)


def test_reset_without_consistent_algebraic_values_is_a_failure_with_what_was_reached() -> None:
    z = Variable("z", "1", start=1.0)
    model = Model(
        "dae", x=(x,), z=(z,), ode=ca.SX(1.0), alg=z.symbol**2 - 1 + X * (X - 1) * (X > 4),
        events=(Event("jump", X - 0.5, 1, reset={"x": 5.0}),),
    )  # fmt: skip
    with pytest.raises(SolveError, match=r"at t = 0\.5\d* s: .* no solution .* z") as caught:
        simulate(model, 1.0)
    assert caught.value.partial.final["x"] == pytest.approx(0.5, abs=1e-8)


def test_what_lies_beyond_a_reset_does_not_matter() -> None:
    """Where no step could go on: the root has no value beyond 1.1."""
    model = Model(
        "edge", x=(x, y), ode=ca.vertcat(1, ca.sqrt(1.1 - X)),
        events=(Event("back", X - 1, 1, reset={"x": 0.0}),),
    )  # fmt: skip
    run = simulate(model, 3.5)
    assert [time for time, _ in run.happened] == pytest.approx([1, 2, 3], abs=1e-8)


@each_backend
@pytest.mark.parametrize("rtol", [1e-10, 1e-12])
def test_exact_stick_slip_under_set_valued_coulomb_friction(backend: str, rtol: float) -> None:
    """Period, stick time and extreme elongations of the Rabinowicz block, as a hybrid model."""
    values = {"m": 0.8, "k": 2.1, "v_belt": 0.1, "g": 9.81, "mu_s": 0.15, "mu_d": 0.1}
    exact = rabinowicz_coulomb(**values)
    run = simulate(coulomb_on_a_belt(**values), 30.0, rtol=rtol, backend=backend)
    times = {
        name: np.array([time for time, which in run.happened if which == name])
        for name in ("stick", "slip", "turn", "back")
    }
    assert len(times["slip"]) == 5
    assert np.diff(times["slip"]) == pytest.approx(exact.period, abs=1e-9)
    sticking = times["slip"] - times["stick"][-5:]
    assert sticking[1:] == pytest.approx(exact.stick_time, abs=1e-9)
    after = times["turn"] > times["slip"][0]
    assert run.at(times["turn"][after])["x"] == pytest.approx(exact.x_max, abs=1e-9)
    after = times["back"] > times["slip"][0]
    assert run.at(times["back"][after])["x"] == pytest.approx(exact.x_min, abs=1e-9)


def test_contact_that_is_overloaded_when_it_sticks_slips_on_at_once() -> None:
    """A spring far stretched: the velocities meet, but the static friction cannot hold."""
    model = coulomb_on_a_belt(m=0.8, k=2.1, v_belt=0.1, g=9.81, mu_s=0.15, mu_d=0.1)
    run = simulate(model, 3.0, x0={"x": 1.5, "v": 1.0, "mode": 1.0}, rtol=1e-9)
    names = [name for _, name in run.happened]
    assert names[:2] == ["meet", "slip"]
    assert run.happened[1][0] == pytest.approx(run.happened[0][0], abs=1e-8)


def test_event_at_the_start_happens_where_it_is_due_already() -> None:
    """Beyond zero, or leaving it; not at rest on it, nor below; others keep to crossings."""
    for start, slope, expected in ((0.5, 0.0, 1), (0.0, 1.0, 1), (0.0, 0.0, 0), (-0.5, 0.0, 0)):
        due = Event("due", X, 1, reset={"x": -9.0, "y": 7.0}, at_start=True)
        model = Model("due", x=(x, y), ode=ca.vertcat(slope, 0), events=(due, Event("plain", X, 1)))
        run = simulate(model, 1.0, x0={"x": start, "y": 0.0})
        assert run.happened == ((0.0, "due"),) * expected
        assert run.final["y"] == 7.0 * expected
    with pytest.raises(ValueError, match="at_start: expected a direction 1 or -1, got 0"):
        Model("due", x=(x,), ode=ca.SX(1), events=(Event("due", X, at_start=True),))
