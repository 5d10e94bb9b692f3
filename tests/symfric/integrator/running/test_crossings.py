"""The search for events in both engines, also of algebraic variables, and storms.

Modes of several contacts that change at one time, against the referee of optimal control.
"""

from dataclasses import fields, replace
from functools import cache
from math import asin, atan2, pi, sqrt
from typing import Any

import casadi as ca
import numpy as np
import pytest
from backends import each_backend, needs_compiler
from hybrid import ball
from numpy.testing import assert_allclose

import symfric as sf
from symfric.bench.ocp_cases import MoveCase
from symfric.bench.ocp_referee import judged
from symfric.foundation.numeric import Array
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import RODAS5P
from symfric.integrator.running.crossings import Memory
from symfric.integrator.running.engine import CompiledEngine, loop_source
from symfric.integrator.running.events import storm
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.record import Dense, Jumps
from symfric.integrator.running.run import Tolerances, integrate
from symfric.laws import ExactCoulomb

ATOL = np.full(2, 1e-7)
x, y = sf.Variable("x", "m"), sf.Variable("y", "m", start=2.0)
X, Y = x.symbol, y.symbol


def jumps_of(
    model: sf.Model, y0: Array, p: Array, span: float, backend: str
) -> tuple[Dense, Jumps]:
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
        sf.Event("one", X - 1, 1, reset={"x": Y}),
        sf.Event("two", 2 * X - 2, 0, reset={"y": -X}),
        sf.Event("three", Y, -1, reset={"x": 10 * X}),
    )
    model = sf.Model("clock", x=(x, y), ode=ca.vertcat(1.0, 0 * X), events=events)
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
    strike = sf.Event("strike", ca.sin(10 * t))
    run = sf.simulate(sf.Model("clock", x=(x,), ode=ca.SX(1), events=(strike,), t=t), 10.0)
    assert [time for time, _ in run.happened] == pytest.approx(np.pi / 10 * np.arange(1, 32))
    late = sf.Event("late", t - 5, 1, terminal=True)
    run = sf.simulate(sf.Model("clock", x=(x,), ode=ca.SX(1), events=(late,), t=t), 10.0)
    assert run.statistics.steps < 20


@each_backend
def test_a_ball_that_loses_little_comes_to_rest_too(backend: str) -> None:
    """Its impacts were a tenth of a nanosecond late, which kept it bouncing for ever."""
    run = sf.simulate(ball(0.93), 60.0, backend=backend, throw=False)
    assert run.status is sf.Status.EVENT_STORM
    fall = np.sqrt(2 / 9.81)
    assert run.step_times[-1] == pytest.approx(fall * (1 + 2 * 0.93 / 0.07), rel=1e-6)
    assert len(run.happened) < 400


def test_no_attempt_behind_an_event_is_made_in_vain() -> None:
    """Two steps from tooth to tooth: a short one that tells the signs, and one up to the next.

    There were 88 attempts an event.
    """
    tooth = sf.Event("tooth", X - 1e-2, 1, reset={"x": 0.0})
    run = sf.simulate(sf.Model("saw", x=(x,), ode=ca.SX(1), events=(tooth,)), 4.995)
    assert run.statistics.events == 499
    assert run.statistics.rejections == 0
    assert run.statistics.steps < 2.1 * 499


def test_a_model_without_events_has_nothing_of_them_in_its_code() -> None:
    for events, found in (((), False), ((sf.Event("one", X - 1),), True)):
        model = sf.Model("clock", x=(x,), ode=ca.SX(1), events=events)
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
    force = {"force": sf.Linear(t, 12 * np.sin(3 * t))}
    run = sf.simulate(sf.drive(sf.MaxwellSlip(form="event")), 4.0, u=force, backend="compiled")
    assert run.statistics.events > 15
    assert len(calls) == 1


LEVELS = (-0.4, -0.29, -0.15, 0.05, 0.21, 0.35)
SPAN = 20.0


@cache
def watched(form: str) -> sf.Model:
    """x'' = -x with z + 20 z^3 = 4 x, watched as z rises through `level`."""
    x, v = sf.Variable("x", "1", start=0.1), sf.Variable("v", "1", start=1.0)
    z, level, r = sf.Variable("z", "1"), sf.Variable("level", "1"), ca.SX.sym("rates", 2)
    alg = z.symbol + 20 * z.symbol**3 - 4 * x.symbol
    factor = 1 + x.symbol**2 if form == "changing masses" else 1.0
    rows = ca.vertcat(factor * (r[0] - v.symbol), factor * (r[1] + x.symbol), alg)
    how: dict[str, Any] = {"xdot": r, "residual": rows}
    if form == "explicit":
        how = {"ode": ca.vertcat(v.symbol, -x.symbol), "alg": alg}
    event = sf.Event("up", z.symbol - level.symbol, direction=1)
    return sf.Model("watched", x=(x, v), z=(z,), p=(level,), events=(event,), **how)


@pytest.mark.parametrize(
    ("form", "rtol"), [("explicit", 1e-6), ("implicit", 1e-8), ("changing masses", 1e-6)]
)
@each_backend
def test_each_passage_is_one_event(backend: str, form: str, rtol: float) -> None:
    """Behind an event z solves its equation exactly, and once was below the level again there."""
    model = watched(form)
    for level in LEVELS:
        run = sf.simulate(model, SPAN, p={"level": level}, rtol=rtol, backend=backend)
        x, size = (level + 20 * level**3) / 4, sqrt(1.01)
        first = (asin(x / size) - atan2(0.1, 1.0)) % (2 * pi)  # x = size sin(t + atan2(0.1, 1))
        times = np.arange(first, SPAN, 2 * pi)
        assert [t for t, _ in run.happened] == pytest.approx(times, abs=30 * rtol)


def test_events_of_coupled_variables_grow_with_their_number() -> None:
    """Without the zeros of their equations: by a QR factorisation their length went with n^2."""

    def length(n: int) -> int:
        x, z = sf.Variable("x", "1"), [sf.Variable(f"z_{i}", "1") for i in range(n)]
        own = [x.symbol, *(v.symbol for v in z), 0.0]
        equations = [own[i] - 3 * own[i + 1] - own[i + 1] ** 3 + own[i + 2] for i in range(n)]
        events = (sf.Event("up", z[n // 2].symbol - 0.1),)
        model = sf.Model(
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


SEEDS = [*range(3), *(pytest.param(k, marks=pytest.mark.slow) for k in range(3, 20))]


def machine(seed: int, share: float) -> tuple[MoveCase, sf.Model, Array, Array]:
    """Chain of 1 to 4 blocks, each on the ground or on the block before it, and a random control.

    States are the positions and the sliding velocities s = G v. `share` is the ratio of both
    levels.
    """
    rng = np.random.default_rng(seed)
    n = 1 + seed % 4
    mass, stiffness, damping = rng.uniform(0.5, 2.0, n), rng.uniform(0, 60, n), rng.uniform(0, 1, n)
    G = np.eye(n) - np.diag(rng.random(n - 1) < 0.5, -1)
    back, pushed = np.linalg.inv(G), int(rng.integers(n))
    sliding = rng.uniform(1.0, 4.0, n)

    def rate(m: Any, x: Any, u: Any, F: Any) -> list[Any]:
        v = [sum(back[i, j] * x[n + j] for j in range(n)) for i in range(n)]
        force = [-sum(G[j, i] * F[j] for j in range(n)) for i in range(n)]
        force[pushed] = force[pushed] + u
        for i in range(n - 1):
            pull = stiffness[i] * (x[i + 1] - x[i]) + damping[i] * (v[i + 1] - v[i])
            force[i], force[i + 1] = force[i] + pull, force[i + 1] - pull
        change = [sum(G[j, i] * force[i] / mass[i] for i in range(n)) for j in range(n)]
        return [*v, *change]

    case = MoveCase(
        "machine", "", tuple(f"y{i}" for i in range(2 * n)), rate, tuple(range(n, 2 * n)),
        tuple((share * level, level) for level in sliding), (0.0,) * (2 * n), {}, 20.0, 1.5,
        normal=lambda m, x, u: [1.0] * n,
    )  # fmt: skip
    x, u = [sf.Variable(name, "1") for name in case.states], sf.Variable("u", "N")
    contacts = tuple(
        sf.Contact(f"c{i}", x[n + i].symbol, 1.0, ExactCoulomb(mu_s=static, mu_d=level))
        for i, (static, level) in enumerate(case.levels)
    )
    symbols, F = [v.symbol for v in x], [c.force for c in contacts]
    ode = ca.vertcat(*rate(None, symbols, u.symbol, F))
    model = sf.Model("machine", x=tuple(x), u=(u,), ode=ode, contacts=contacts)
    return case, model, np.linspace(0.0, 1.5, 7), rng.uniform(-20.0, 20.0, 6)


@pytest.mark.parametrize("seed", SEEDS)
def test_machines_of_one_to_four_contacts_move_as_by_the_referee(seed: int) -> None:
    """With equal levels the modes are unique."""
    case, model, edges, controls = machine(seed, 1.0)
    run = sf.simulate(model, case.T, u={"u": sf.Hold(edges[:-1], controls)}, rtol=1e-10)
    reached = list[float]()

    def final(_: Any, x: Any, __: Any) -> float:
        reached[:] = x
        return 0.0

    judged(replace(case, final=final), edges, controls)
    assert [run.final[name] for name in case.states] == pytest.approx(reached, abs=1e-6)


@pytest.mark.parametrize(("seed", "backend"), [(3, "vm"), (19, "compiled")])
def test_modes_after_each_change_are_consistent(seed: int, backend: str) -> None:
    """Forces at rest are within the static levels; sliding forces oppose the sliding."""
    case, model, edges, controls = machine(seed, 1.5)
    run = sf.simulate(model, case.T, u={"u": sf.Hold(edges[:-1], controls)}, backend=backend)
    times = np.linspace(0.0, case.T, 1501)
    for c, (static, sliding) in zip(model.contacts, case.levels, strict=True):
        slip, force, mode = run.of(ca.vertcat(c.slip, c.friction, c.states[0].symbol), times)
        rests = np.abs(mode) < 0.5
        assert np.abs(force[rests]).max(initial=0.0) <= static * (1 + 1e-6)
        assert np.abs(slip[rests]).max(initial=0.0) < 1e-9
        assert_allclose(force[~rests], sliding * np.round(mode[~rests]), rtol=1e-9)
        assert (slip[~rests] * mode[~rests] > -1e-9).all()


@cache
def stack(level: float = 1.0, *, kick: bool = False) -> sf.Model:
    """Two equal blocks, the upper one on the lower one, whose contact has the level `level`.

    With a `kick`, the lower block gets the velocity J at time T.
    """
    x = [sf.Variable(f"x{i}", "m") for i in range(2)]
    v = [sf.Variable(f"v{i}", "m/s") for i in range(2)]
    u, t = sf.Variable("force", "N"), ca.SX.sym("t")
    p = sf.Variable("T", "s", start=0.4), sf.Variable("J", "m/s", start=2.0)
    low = sf.Contact("low", v[0].symbol, 2.0, ExactCoulomb(mu_s=1.0, mu_d=1.0))
    top = sf.Contact("top", v[1].symbol - v[0].symbol, 1.0, ExactCoulomb(mu_s=level, mu_d=level))
    ode = ca.vertcat(v[0].symbol, v[1].symbol, u.symbol - low.force + top.force, -top.force)
    hit = sf.Event("kick", t - p[0].symbol, 1, reset={"v0": v[0].symbol + p[1].symbol})
    return sf.Model(
        "stack", x=(*x, *v), u=(u,), p=p, t=t, ode=ode, contacts=(low, top), events=(hit,) * kick
    )


@pytest.mark.parametrize(("force", "speeds"), [(1.9, (0, 0)), (3.0, (0.5, 0.5)), (5.0, (2.0, 1.0))])
def test_a_carried_block_sticks_if_it_can(force: float, speeds: tuple[float, float]) -> None:
    """A push of u moves both blocks together up to u = 2 + 2, then the upper one slides back."""
    for backend in ("vm", "compiled"):
        run = sf.simulate(stack(), 1.0, u={"force": force}, backend=backend)
        assert_allclose([run.final["v0"], run.final["v1"]], speeds, atol=1e-9)
    many = sf.simulate_many(stack(), 1.0, u={"force": np.array([force, force])})
    assert_allclose(many["v1"][:, -1], speeds[1], atol=1e-9)


@pytest.mark.parametrize("force", [0.0, 3.0])
def test_derivatives_after_a_decision_agree_with_differences(force: float) -> None:
    """The kick starts both contacts from rest, or the upper one while the lower one slides."""
    model, at, h = stack(1.3, kick=True), {"T": 0.4, "J": 2.0}, 1e-5

    def run(**given: Any) -> sf.Trajectory:
        return sf.simulate(model, 1.0, u={"force": force}, t_eval=[1.0], rtol=1e-11, **given)

    slopes = run(sensitivities=[*at]).sensitivities
    for name, value in at.items():
        up, down = (run(p={name: value + step}) for step in (h, -h))
        for signal in ("x0", "x1", "v0", "v1"):
            difference = (up[signal][0] - down[signal][0]) / (2 * h)
            assert slopes[name][signal][0] == pytest.approx(difference, abs=1e-6)
