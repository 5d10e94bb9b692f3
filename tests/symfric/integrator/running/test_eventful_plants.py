"""Plants with events: those of `simulate`, at the same times, and what they end."""

import casadi as ca
import numpy as np
import pytest
from backends import each_backend

import symfric as sf
from symfric.integrator.running.engine import VmEngine
from symfric.model import Event

x, v = sf.Variable("x", "m", start=1.0), sf.Variable("v", "m/s")
z, u = sf.Variable("z", "1"), sf.Variable("u", "N")


def ball(restitution: float = 0.5, terminal: bool = False) -> sf.Model:
    """Falls with 2 m/s^2 from 1 m at 0 s, so that it hits the ground at 1 s; u pushes it up."""
    event = Event(
        "hit", x.symbol, direction=-1, reset={"v": -restitution * v.symbol}, terminal=terminal
    )
    ode = ca.vertcat(v.symbol, u.symbol - 2)
    return sf.Model("ball", x=(x, v), u=(u,), ode=ode, events=(event,))


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
    plant = sf.stepper(ball(), 1.5, rtol=1e-8, backend=backend)
    assert plant.step() == pytest.approx([0.25, 0.0], abs=1e-6)
    assert plant.happened == [(pytest.approx(1.0), "hit")]
    assert not plant.terminated
    many = sf.stepper(ball(1.0), 1.5, batch=2, rtol=1e-8, backend=backend)
    fall = many.step([[0.0], [2.0]])
    assert fall == pytest.approx(np.array([[0.75, 1.0], [1.0, 0.0]]), abs=1e-6)
    assert many.happened == [(0, pytest.approx(1.0), "hit")]
    assert many.copy().happened == many.happened


@each_backend
def test_a_terminal_event_ends_a_plant_until_it_is_put_back(backend: str) -> None:
    plant = sf.stepper(ball(terminal=True), 0.4, batch=2, rtol=1e-8, backend=backend)
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
    plant = sf.stepper(ball(), 4.0, backend=backend)
    with pytest.raises(
        sf.SolveError, match=r"stepper 'ball' at t = 2\.999.*Events accumulate"
    ) as caught:
        plant.step(0.0)
    assert caught.value.status is sf.Status.EVENT_STORM


@each_backend
def test_unknowns_follow_events_that_set_states(backend: str) -> None:
    """z + z^3 = u - x, and x falls back to 0 where it reaches 1."""
    low = sf.Variable("x", "m")
    alg = z.symbol + z.symbol**3 - u.symbol + low.symbol
    back = Event("back", low.symbol - 1, direction=1, reset={"x": 0.0 * low.symbol})
    model = sf.Model("saw", x=(low,), z=(z,), u=(u,), ode=1 + 0 * z.symbol, alg=alg, events=(back,))
    plant = sf.stepper(model, 0.7, rtol=1e-8, backend=backend)
    for k, held in enumerate((2.0, 5.0, 200.0, -3.0), start=1):
        assert plant.step(held) == pytest.approx([0.7 * k % 1], abs=1e-7)
        root = plant["z"]
        assert root + root**3 == pytest.approx(held - 0.7 * k % 1, rel=1e-7)


def test_an_interrupted_step_skips_no_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    plant = sf.stepper(ball(), 0.5, batch=2, backend="vm")

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(VmEngine, "march", interrupt)
    with pytest.raises(KeyboardInterrupt):
        plant.step()
    monkeypatch.undo()
    assert plant.step() == pytest.approx(np.array([[0.75, -1.0]] * 2))
    assert plant.t.tolist() == [0.5, 0.5]
