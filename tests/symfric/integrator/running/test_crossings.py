"""The search for events in both engines, also of algebraic variables, and storms."""

from dataclasses import fields
from math import asin, atan2, pi, sqrt
from typing import Any

import casadi as ca
import numpy as np
import pytest
from backends import each_backend, needs_compiler
from hybrid import ball

from symfric import Event, Linear, MaxwellSlip, Model, Status, Variable, drive, simulate
from symfric.foundation.numeric import Array
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import RODAS5P
from symfric.integrator.running.crossings import Memory
from symfric.integrator.running.engine import CompiledEngine, loop_source
from symfric.integrator.running.events import storm
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.record import Dense, Jumps
from symfric.integrator.running.run import Tolerances, integrate

ATOL = np.full(2, 1e-7)
x, y = Variable("x", "m"), Variable("y", "m", start=2.0)
X, Y = x.symbol, y.symbol


def jumps_of(model: Model, y0: Array, p: Array, span: float, backend: str) -> tuple[Dense, Jumps]:
    """Dense output and all jumps of a run."""
    inputs = input_data(model, None, 0.0, span)
    integrator, allowed = Integrator(model, inputs, RODAS5P), Tolerances(1e-6, ATOL, 1e-10, 10_000)
    run, _ = integrate(integrator, inputs, y0, p, allowed, backend, None)
    parts = ([getattr(part, f.name) for part in run.jumps] for f in fields(Jumps))
    return run.dense, Jumps(*map(np.concatenate, parts))


@each_backend
def test_each_jump_is_kept_with_the_values_on_both_sides(backend: str) -> None:
    """Derivatives through events need them: two events at 1 s, one more at the same time."""
    events = (
        Event("one", X - 1, 1, reset={"x": Y}),
        Event("two", 2 * X - 2, 0, reset={"y": -X}),
        Event("three", Y, -1, reset={"x": 10 * X}),
    )
    model = Model("clock", x=(x, y), ode=ca.vertcat(1.0, 0 * X), events=events)
    dense, jumps = jumps_of(model, np.array([0.0, 2.0]), np.zeros(0), 1.5, backend)
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


@needs_compiler
def test_engines_agree_on_unknowns_around_an_event() -> None:
    """After it those that follow are known; before it they are as the step has them."""
    given = watched("explicit"), np.array([0.1, 1.0, 0.3]), np.array([0.12]), SPAN
    one, other = (jumps_of(*given, backend)[1] for backend in ("vm", "compiled"))
    assert one.t.size == 3
    for field in fields(Jumps):
        np.testing.assert_array_equal(getattr(one, field.name), getattr(other, field.name))


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
    run = simulate(ball(0.93), 60.0, backend=backend, throw=False)
    assert run.status is Status.EVENT_STORM
    fall = np.sqrt(2 / 9.81)
    assert run.step_times[-1] == pytest.approx(fall * (1 + 2 * 0.93 / 0.07), rel=1e-6)
    assert len(run.happened) < 400


def test_no_attempt_behind_an_event_is_made_in_vain() -> None:
    """Two steps from tooth to tooth: a short one that tells the signs, and one up to the next.

    There were 88 attempts an event.
    """
    tooth = Event("tooth", X - 1e-2, 1, reset={"x": 0.0})
    run = simulate(Model("saw", x=(x,), ode=ca.SX(1), events=(tooth,)), 4.995)
    assert run.statistics.events == 499
    assert run.statistics.rejections == 0
    assert run.statistics.steps < 2.1 * 499


def test_a_model_without_events_has_nothing_of_them_in_its_code() -> None:
    for events, found in (((), False), ((Event("one", X - 1),), True)):
        model = Model("clock", x=(x,), ode=ca.SX(1), events=events)
        made = Integrator(model, input_data(model, None, 0.0, 1.0), RODAS5P)
        source = loop_source(made.step, RODAS5P.H.shape[0], made.crossings)
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


LEVELS = (-0.4, -0.29, -0.15, 0.05, 0.21, 0.35)
SPAN = 20.0


def watched(form: str) -> Model:
    """x'' = -x with z + 20 z^3 = 4 x, watched as z rises through `level`."""
    x, v = Variable("x", "1", start=0.1), Variable("v", "1", start=1.0)
    z, level, r = Variable("z", "1"), Variable("level", "1"), ca.SX.sym("rates", 2)
    alg = z.symbol + 20 * z.symbol**3 - 4 * x.symbol
    factor = 1 + x.symbol**2 if form == "changing masses" else 1.0
    rows = ca.vertcat(factor * (r[0] - v.symbol), factor * (r[1] + x.symbol), alg)
    how: dict[str, Any] = {"xdot": r, "residual": rows}
    if form == "explicit":
        how = {"ode": ca.vertcat(v.symbol, -x.symbol), "alg": alg}
    event = Event("up", z.symbol - level.symbol, direction=1)
    return Model("watched", x=(x, v), z=(z,), p=(level,), events=(event,), **how)


@pytest.mark.parametrize(
    ("form", "rtol"), [("explicit", 1e-6), ("implicit", 1e-8), ("changing masses", 1e-6)]
)
@each_backend
def test_each_passage_is_one_event(backend: str, form: str, rtol: float) -> None:
    """Behind an event z solves its equation exactly, and once was below the level again there."""
    model = watched(form)
    for level in LEVELS:
        run = simulate(model, SPAN, p={"level": level}, rtol=rtol, backend=backend)
        x, size = (level + 20 * level**3) / 4, sqrt(1.01)
        first = (asin(x / size) - atan2(0.1, 1.0)) % (2 * pi)  # x = size sin(t + atan2(0.1, 1))
        times = np.arange(first, SPAN, 2 * pi)
        assert [t for t, _ in run.happened] == pytest.approx(times, abs=30 * rtol)


def test_events_of_coupled_variables_grow_with_their_number() -> None:
    """Without the zeros of their equations: by a QR factorisation their length went with n^2."""

    def length(n: int) -> int:
        x, z = Variable("x", "1"), [Variable(f"z_{i}", "1") for i in range(n)]
        own = [x.symbol, *(v.symbol for v in z), 0.0]
        equations = [own[i] - 3 * own[i + 1] - own[i + 1] ** 3 + own[i + 2] for i in range(n)]
        events = (Event("up", z[n // 2].symbol - 0.1),)
        model = Model(
            "chain", x=(x,), z=tuple(z), ode=ca.SX(1), alg=ca.vertcat(*equations), events=events
        )
        data = input_data(model, None, 0.0, 1.0)
        return int(Integrator(model, data, RODAS5P).events.n_instructions())

    assert length(20) < 2.5 * length(10)


TOLERANCE = 2.0**-33


def gaps(*sizes: float) -> list[float]:
    """Times from 1 s on, with these gaps in tolerances."""
    return (1.0 + TOLERANCE * np.cumsum([0.0, *sizes])).tolist()


def test_storms_are_shrinking_gaps_of_one_kind_and_crowds_of_any_kind() -> None:
    """As much as the last of gaps that halve is still to come."""
    a, b, both, by_turns = (0,), (1,), (0, 1), [(k % 3,) for k in range(120)]
    late = [2.0**30 + k * 2.0**-22 for k in range(100)]  # neighbours, a thousand tolerances apart
    cases: list[tuple[list[float], list[tuple[int, ...]], list[int]]] = [
        (gaps(4 * 999, 2 * 999, 999), [a] * 4, [3]),
        (gaps(4 * 20, 2 * 20, 20), [a] * 4, [3]),
        (gaps(4 * 1001, 2 * 1001, 1001), [a] * 4, []),
        (gaps(2000, 1000, 500), [a, b, a, b], []),
        (gaps(2000, 1000, 500), [both] * 4, [3]),
        (gaps(*[500] * 19), [a] * 20, []),
        (gaps(*range(100, 4000, 200)), [a] * 21, []),
        (gaps(*[10] * 119), by_turns, list(range(99, 120))),
        (gaps(*[11] * 119), by_turns, []),
        (late, [(k % 2,) for k in range(100)], [99]),
    ]
    for times, kinds, expected in cases:
        memory = Memory.new(3, TOLERANCE)
        flags = [np.isin(np.arange(3), kind) for kind in kinds]
        found = [
            k for k, (t, w) in enumerate(zip(times, flags, strict=True)) if storm(memory, t, w)
        ]
        assert found == expected
