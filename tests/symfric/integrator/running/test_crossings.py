"""The search for events as a part of both engines: what it leaves, and what it costs."""

from typing import Any

import casadi as ca
import numpy as np
import pytest
from backends import each_backend, needs_compiler
from hybrid import ball

from symfric import Event, Linear, MaxwellSlip, Model, Status, Variable, drive, simulate
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import ADAPTIVE
from symfric.integrator.running.engine import CompiledEngine, loop_source
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.run import Tolerances, integrate

x, y = Variable("x", "m"), Variable("y", "m", start=2.0)
X, Y = x.symbol, y.symbol


def waves(t: ca.SX) -> ca.SX:
    return 12 * ca.sin(3 * t)


@each_backend
def test_each_jump_is_kept_with_the_values_on_both_sides(backend: str) -> None:
    """What derivatives through events are made of: two events at 1 s, one more at the same time."""
    events = (
        Event("one", X - 1, 1, reset={"x": Y}),
        Event("two", 2 * X - 2, 0, reset={"y": -X}),
        Event("three", Y, -1, reset={"x": 10 * X}),
    )
    model = Model("clock", x=(x, y), ode=ca.vertcat(1.0, 0 * X), events=events)
    inputs = input_data(model, None, 0.0, 1.5)
    integrator = Integrator(model, inputs, ADAPTIVE["rodas5p"])
    allowed = Tolerances(1e-6, np.full(2, 1e-7), 1e-10, 1000)
    run, _ = integrate(
        integrator, inputs, np.array([0.0, 2.0]), np.zeros(0), allowed, backend, None
    )
    dense, (jumps,) = run.dense, run.jumps
    assert jumps.which.tolist() == [[True, True, False], [False, False, True]]
    assert jumps.t == pytest.approx([1, 1], abs=1e-9)
    assert jumps.before == pytest.approx(np.array([[1, 2], [2, -1]]), abs=1e-9)
    assert jumps.after == pytest.approx(np.array([[2, -1], [20, -1]]), abs=1e-9)
    first = int(jumps.step[0])
    assert jumps.step.tolist() == [first, first]
    assert dense.t1[first - 1] == dense.t0[first] == jumps.t[0] == jumps.t[1]
    assert dense.y1[first - 1].tolist() == jumps.before[0].tolist()
    assert dense.y0[first].tolist() == jumps.after[1].tolist()
    assert (np.diff(dense.t0) > 0).all()


def test_events_of_time_alone_are_not_leapt_over() -> None:
    """x' = 1 takes steps of most of the span; 8 s of a clock that strikes 31 times."""
    t = ca.SX.sym("t")
    strike = Event("strike", ca.sin(10 * t))
    run = simulate(Model("clock", x=(x,), ode=ca.SX(1), events=(strike,), t=t), 10.0)
    assert [time for time, _ in run.happened] == pytest.approx(np.pi / 10 * np.arange(1, 32))
    late = Event("late", t - 5, 1, terminal=True)
    run = simulate(Model("clock", x=(x,), ode=ca.SX(1), events=(late,), t=t), 10.0)
    assert run.statistics.steps < 20


@each_backend
def test_a_ball_that_loses_little_comes_to_rest_too(backend: str) -> None:
    """Its impacts were a tenth of a nanosecond late, which kept it bouncing for ever."""
    run = simulate(ball(0.97), 60.0, backend=backend, throw=False)
    assert run.status is Status.EVENT_STORM
    fall = np.sqrt(2 / 9.81)
    assert run.step_times[-1] == pytest.approx(fall * (1 + 2 * 0.97 / 0.03), rel=1e-6)
    assert len(run.happened) < 900


def test_no_attempt_behind_an_event_is_made_in_vain() -> None:
    """Two steps from tooth to tooth: a short one that tells the signs, and one up to the next.

    There were 88 attempts an event.
    """
    tooth = Event("tooth", X - 1e-2, 1, reset={"x": 0.0})
    run = simulate(Model("saw", x=(x,), ode=ca.SX(1), events=(tooth,)), 4.995)
    assert run.statistics.events == 499
    assert run.statistics.rejections == 0
    assert run.statistics.steps < 2.1 * 499


def test_exact_memory_takes_fewer_attempts_than_its_smooth_form() -> None:
    """Elements that begin to slip one by one, and all stick at every turn."""
    force = {"force": waves}
    attempts: list[int] = []
    for form in ("smooth", "event"):
        run = simulate(drive(MaxwellSlip(form=form)), 4.0, u=force, backend="vm", samples=2)
        attempts.append(run.statistics.steps + run.statistics.rejections)
    assert len(run.happened) > 15
    assert attempts[1] < 0.5 * attempts[0]


def test_a_model_without_events_has_nothing_of_them_in_its_code() -> None:
    for events, found in (((), False), ((Event("one", X - 1),), True)):
        model = Model("clock", x=(x,), ode=ca.SX(1), events=events)
        made = Integrator(model, input_data(model, None, 0.0, 1.0), ADAPTIVE["rodas5p"])
        source = loop_source(made.step, ADAPTIVE["rodas5p"].H.shape[0], made.crossings)
        assert ("static int symfric_search" in source) == found


@needs_compiler
def test_a_jump_of_an_input_does_not_leave_the_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor does an event: 100 samples and 40 events are one call."""
    calls: list[int] = []
    march = CompiledEngine.march

    def counted(self: CompiledEngine, *arguments: Any) -> Any:
        calls.append(1)
        return march(self, *arguments)

    monkeypatch.setattr(CompiledEngine, "march", counted)
    t = np.arange(0, 4, 0.04)
    force = {"force": Linear(t, 12 * np.sin(3 * t))}
    run = simulate(drive(MaxwellSlip(form="event")), 4.0, u=force, backend="compiled")
    assert run.statistics.events > 15
    assert len(calls) == 1
