"""The search for events as a part of both engines: what it leaves, and what it costs."""

import casadi as ca
import numpy as np
import pytest
from hybrid import ball

from symfric import Event, Model, Status, Variable, simulate
from symfric.foundation.compiler import find_compiler
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import ADAPTIVE
from symfric.integrator.running.events import Jumps
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.run import Tolerances, integrate

needs_compiler = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")
each_backend = pytest.mark.parametrize(
    "backend", ["vm", pytest.param("compiled", marks=needs_compiler)]
)
x, y = Variable("x", "m"), Variable("y", "m", start=2.0)
X, Y = x.symbol, y.symbol


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
    run = integrate(integrator, inputs, np.array([0.0, 2.0]), np.zeros(0), allowed, backend, None)
    dense, jumps = run.dense, Jumps.joined(run.jumps)
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
