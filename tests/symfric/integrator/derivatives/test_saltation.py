"""Derivatives through events: closed forms, differences of tight runs, and what has none."""

from collections.abc import Mapping
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from differentiable import pendulum
from numpy.typing import NDArray
from stored import stored

import symfric as sf
from symfric.integrator.derivatives import saltation as module
from symfric.integrator.derivatives.functions import derivatives
from symfric.integrator.derivatives.path import seeds
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.integrator import built
from symfric.model import Event
from symfric.scenes import PendulumBox

Array = NDArray[np.float64]


def ball() -> sf.Model:
    """Dropped from height h; it bounces with the restitution e."""
    h, v = sf.Variable("h", "m", start=1.0), sf.Variable("v", "m/s")
    g, e = sf.Variable("g", "m/s^2", start=9.81), sf.Variable("e", "1", start=0.8)
    bounce = Event("bounce", h.symbol, direction=-1, reset={"v": -e.symbol * v.symbol})
    return sf.Model(
        "ball", x=(h, v), p=(g, e), ode=ca.vertcat(v.symbol, -g.symbol), events=(bounce,)
    )


def bounced(t: Array, h: complex, g: complex, e: complex) -> tuple[Array, Array, Array]:
    """Height and velocity of the ball at times before its third bounce, and times of the bounces.

    Complex numbers carry a derivative in their imaginary part.
    """
    fall = np.sqrt(2 * h / g)
    bounces = np.array([fall, fall + 2 * e * fall])
    impact = np.sqrt(2 * h * g)
    flights = [(0.0, h, 0.0), (bounces[0], 0.0, e * impact), (bounces[1], 0.0, e**2 * impact)]
    k = np.searchsorted(bounces.real, t, side="right")
    began, height, speed = (np.array([flights[i][j] for i in k]) for j in range(3))
    later = t - began
    return height + speed * later - g * later**2 / 2, speed - g * later, bounces


@pytest.mark.parametrize("backend", ["vm", "compiled"])
def test_bouncing_ball_meets_its_closed_form(backend: str) -> None:
    """Before and behind each bounce, states and times of events, forwards and backwards."""
    at = {"x0.h": 1.0, "g": 9.81, "e": 0.8}
    times = np.array([0.0, 0.2, 0.4515, 0.4516, 0.7, 1.0, 1.1739, 1.174, 1.5])
    run = sf.simulate(ball(), 1.5, t_eval=times, backend=backend, sensitivities=[*at])
    assert [name for _, name in run.happened] == ["bounce"] * 2
    weights = {"h": np.arange(9.0), "v": np.ones(9)}
    gradient = run.gradient(weights)
    for name in at:
        numbers = {k: complex(x, 1e-20 * (k == name)) for k, x in at.items()}
        h, v, bounces = (a.imag / 1e-20 for a in bounced(times, *numbers.values()))
        slopes = run.sensitivities[name]
        assert slopes["h"] == pytest.approx(h, rel=0, abs=1e-7)
        assert slopes["v"] == pytest.approx(v, rel=0, abs=1e-7)
        assert run.event_sensitivities[name] == pytest.approx(bounces, abs=1e-8)
        assert gradient[name] == pytest.approx(weights["h"] @ h + weights["v"] @ v, abs=1e-6)


def test_stick_and_slip_on_a_belt_meet_their_closed_form() -> None:
    """The block sticks until k x = mu_s N, and slides as an oscillator about k x = mu_d N.

    Sticking it goes on with the velocity that it starts with, which is that of the belt.
    """
    at = {"mu_s": 0.15, "mu_d": 0.1, "k": 2.1, "x0.v": 0.1}
    times = np.array([5.0, 5.59, 5.7, 6.3])
    run = sf.simulate(
        sf.rabinowicz(sf.ExactCoulomb(), free=["mu_s", "mu_d", "k"]), 6.5, x0={"v": 0.1, "mode": 0.0},
        t_eval=times, sensitivities=[*at],
    )  # fmt: skip
    weight, m = 0.8 * 9.81, 0.8
    for name in at:
        mu_s, mu_d, k, belt = (complex(x, 1e-20 * (n == name)) for n, x in at.items())
        leaves = mu_s * weight / (k * belt)
        w, later = np.sqrt(k / m), times - leaves
        slides = (mu_d + (mu_s - mu_d) * np.cos(w * later)) * weight / k
        slides = slides + belt / w * np.sin(w * later)
        x = np.where(times < leaves.real, belt * times, slides).imag / 1e-20
        assert run.sensitivities[name]["x"] == pytest.approx(x, rel=1e-6, abs=1e-7)
        assert run.event_sensitivities[name][0] == pytest.approx(leaves.imag / 1e-20, rel=1e-7)


GRID = np.linspace(0.0, 4.0, 41)
WAVE = 2.2 * np.sin(np.pi * GRID)
CASES = {
    "exact_box": (PendulumBox(sf.ExactCoulomb()).model(["mu_d"]), 2.0, None),
    "karnopp_belt": (sf.rabinowicz(sf.Karnopp(form="event"), free=["mu_d", "m"]), 20.0, None),
    "leine_belt": (sf.rabinowicz(sf.LeineSwitch(form="event"), free=["mu_s", "k"]), 20.0, None),
    "exact_drive": (sf.drive(sf.ExactCoulomb(), free=["m", "N"]), 4.0, sf.Linear(GRID, WAVE)),
    "gms_drive": (sf.drive(sf.GMS(form="event"), free=["m", "N"]), 4.0, lambda t: 2 * ca.sin(ca.pi * t)),
    "maxwell_drive": (sf.drive(sf.MaxwellSlip(form="event"), free=["m", "N"]), 4.0, sf.Hold(GRID, WAVE)),
}  # fmt: skip


def run_of(case: str, p: Mapping[str, float], **how: object) -> sf.Trajectory:
    model, t_end, force = CASES[case]
    u = None if force is None else {"force": force}
    x0 = {"v": 0.02} if case.endswith("belt") else None
    at = np.linspace(0.0, t_end, 15)[1:]
    return sf.simulate(model, t_end, x0=x0, u=u, p=p, t_eval=at, **how)  # pyright: ignore[reportArgumentType]


def signals(case: str) -> list[str]:
    """Position and velocity, or two positions."""
    return [v.name for v in CASES[case][0].x[:2]]


def quotients(case: str) -> Array:
    """Central differences of two signals by each parameter, a row each."""
    rows: list[Array] = []
    for parameter in CASES[case][0].p:
        at = float(parameter.start)
        above, below = (
            run_of(case, {parameter.name: at * s}, rtol=1e-12, event_tolerance=1e-14)
            for s in (1 + 1e-5, 1 - 1e-5)
        )
        rows += [(above[s] - below[s]) / (2e-5 * at) for s in signals(case)]
    return np.array(rows)


@pytest.mark.parametrize("case", CASES)
def test_laws_by_events_meet_differences_of_tight_runs(case: str) -> None:
    names = [v.name for v in CASES[case][0].p]
    run = run_of(case, {}, rtol=1e-9, sensitivities=names)
    assert run.statistics.events >= 4
    found = np.array([run.sensitivities[name][s] for name in names for s in signals(case)])
    expected = stored(f"saltation_{case}", lambda: quotients(case))
    size = np.abs(expected).max(axis=1, keepdims=True)
    np.testing.assert_allclose(found / size, expected / size, rtol=0, atol=1e-6)
    weights = dict(zip(signals(case), (np.cos(run.t), np.ones(run.t.size)), strict=True))
    by_hand = [np.cos(run.t) @ found[2 * i] + found[2 * i + 1].sum() for i in range(len(names))]
    assert [*run.gradient(weights).values()] == pytest.approx(by_hand, rel=1e-9)


def test_many_events_at_once_are_those_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    names = [v.name for v in CASES["gms_drive"][0].p]
    together = run_of("gms_drive", {}, sensitivities=names)
    monkeypatch.setattr(module, "_is_single", lambda *_: False)  # pyright: ignore[reportUnknownLambdaType]
    alone = run_of("gms_drive", {}, sensitivities=names)
    for name in names:
        assert together.sensitivities[name]["x"] == pytest.approx(
            alone.sensitivities[name]["x"], rel=1e-12
        )
        assert together.event_sensitivities[name] == pytest.approx(
            alone.event_sensitivities[name], rel=1e-11
        )


def struck() -> sf.Model:
    """A point on a circle, whose rate an event halves; its tension follows."""
    model = pendulum()
    x, _, vx, vy = (v.symbol for v in model.x)
    stroke = Event("stroke", x - 0.3, -1, reset={"vx": vx / 2, "vy": vy / 2})
    return replace(model, events=(stroke,))


def test_mechanism_stays_on_its_constraints_behind_an_event() -> None:
    """By the radius, which moves the start, the event and all behind it; by differences."""

    def at(radius: float, **how: object) -> sf.Trajectory:
        return sf.simulate(
            struck(), 1.0, p={"l": radius}, t_eval=[0.2, 0.6, 1.0], event_tolerance=1e-13,
            rtol=1e-10, **how,  # pyright: ignore[reportArgumentType]
        )  # fmt: skip

    run = at(1.0, sensitivities=["l", "x0.vx"])
    assert run.statistics.events >= 1
    above, below = at(1.0 + 1e-5), at(1.0 - 1e-5)
    for signal in ("x", "y", "vx", "lam"):
        quotient = (above[signal] - below[signal]) / 2e-5
        assert run.sensitivities["l"][signal] == pytest.approx(quotient, rel=2e-5, abs=2e-5)
    weights = {"x": [0.0, 1.0, 2.0], "lam": [1.0, 1.0, 0.0]}
    by_hand = [
        sum(float(np.array(w) @ run.sensitivities[n][s]) for s, w in weights.items())
        for n in ("l", "x0.vx")
    ]
    assert [*run.gradient(weights).values()] == pytest.approx(by_hand, rel=1e-10)


def test_sweeps_cost_what_they_are_written_for() -> None:
    """Instructions of a step of Rabinowicz: itself, by four parameters, backwards, with jumps."""
    model = sf.rabinowicz(sf.BrownMcPhee(), free=["mu_s", "mu_d", "k", "m"])
    integrator, _ = built(model, input_data(model, None, 0.0, 1.0), METHODS["rodas5p"])
    made = derivatives(integrator)
    which = seeds(model, ["mu_s", "mu_d", "k", "m"], None, None)
    count = [
        made.step, made.forward(which, False).function, made.reverse(False).function,
        made.forward(which, True).function, made.reverse(True).function,
    ]  # fmt: skip
    most = [580, 2900, 1400, 3320, 1540]
    found = [f.n_instructions() for f in count]
    assert all(f <= m for f, m in zip(found, most, strict=True)), found


def counter(events: tuple[Event, ...], x: sf.Variable, *others: sf.Variable) -> sf.Model:
    """x' = p, all others at rest."""
    p = sf.Variable("p", "1/s", start=2.0)
    still = ca.SX.zeros(len(others))
    return sf.Model(
        "counter", x=(x, *others), p=(p,), ode=ca.vertcat(p.symbol, still), events=events
    )


def test_end_of_a_run_that_an_event_ends_has_a_derivative() -> None:
    """x = p t reaches 1 at 1/p."""
    x = sf.Variable("x", "1")
    model = counter((Event("full", x.symbol - 1, terminal=True),), x)
    run = sf.simulate(model, 3.0, samples=4, sensitivities=["p", "x0.x"])
    assert run.event_sensitivities["p"] == pytest.approx([-0.25])
    assert run.event_sensitivities["x0.x"] == pytest.approx([-0.5])
    assert run.sensitivities["p"]["x"] == pytest.approx(run.t)


def test_event_in_the_very_step_that_another_one_began() -> None:
    """x = p t reaches 1, and 2e-8 s later another mark; at both y' = y jumps by p x."""
    x, y = sf.Variable("x", "1"), sf.Variable("y", "1")
    p = sf.Variable("p", "1/s", start=2.0)
    gap = 4e-8
    events = tuple(
        Event(name, x.symbol - mark, reset={"y": y.symbol + x.symbol * p.symbol})
        for name, mark in (("first", 1.0), ("second", 1.0 + gap))
    )
    model = sf.Model("marks", x=(x, y), p=(p,), ode=ca.vertcat(p.symbol, y.symbol), events=events)
    times = np.array([0.25, 0.5 + 1e-8, 0.75])
    run = sf.simulate(model, 1.0, t_eval=times, rtol=1e-9, sensitivities=["p", "x0.x"])
    assert run.event_sensitivities["p"] == pytest.approx([-0.25, -0.25], rel=1e-6)
    assert run.event_sensitivities["x0.x"] == pytest.approx([-0.5, -0.5], rel=1e-6)
    assert run.sensitivities["p"]["x"] == pytest.approx(times)
    assert run.sensitivities["x0.x"]["x"] == pytest.approx(1.0)
    # y = p exp(t - 1/p) after the first one, twice that after the second one
    growth = np.exp(times - 0.5)
    by_p = np.array([0.0, 1.0, 2.0]) * (1 + 2 / 4) * growth
    assert run.sensitivities["p"]["y"] == pytest.approx(by_p, rel=1e-6)
    gradient = run.gradient({"x": np.ones(3), "y": np.ones(3)})
    assert gradient["p"] == pytest.approx((times + by_p).sum(), rel=1e-6)


def test_event_that_another_one_brings_about_moves_along() -> None:
    """x = 1 lets y jump over zero, which lets z take the value of t: z = 1/p."""
    t = ca.SX.sym("t")
    x, y, z = sf.Variable("x", "1"), sf.Variable("y", "1", start=-1.0), sf.Variable("z", "1")
    p = sf.Variable("p", "1/s", start=2.0)
    events = (
        Event("first", x.symbol - 1, reset={"y": 3 * p.symbol}),
        Event("second", y.symbol, reset={"z": t * y.symbol}),
    )
    model = sf.Model(
        "chain", x=(x, y, z), p=(p,), ode=ca.vertcat(p.symbol, 0, 0), events=events, t=t
    )
    run = sf.simulate(model, 1.0, t_eval=[0.4, 0.6], sensitivities=["p"])
    assert run.event_sensitivities["p"] == pytest.approx([-0.25, -0.25])
    assert run["z"] == pytest.approx([0.0, 3.0])
    assert run.sensitivities["p"]["y"] == pytest.approx([0.0, 3.0])
    assert run.sensitivities["p"]["z"] == pytest.approx([0.0, 0.0], abs=1e-9)  # 3 p / p


def test_events_of_time_alone_do_not_move_even_with_jumps_of_the_inputs() -> None:
    """v' = u/m, and v is halved at t = 1, when u jumps."""
    t, v, m = ca.SX.sym("t"), sf.Variable("v", "m/s"), sf.Variable("m", "kg", start=2.0)
    u = sf.Variable("u", "N")
    half = Event("half", t - 1, direction=1, reset={"v": v.symbol / 2})
    model = sf.Model("pushed", x=(v,), u=(u,), p=(m,), ode=u.symbol / m.symbol, events=(half,), t=t)
    run = sf.simulate(
        model, 2.0, u={"u": sf.Hold([0.0, 1.0], [1.0, -3.0])}, t_eval=[0.9, 1.1, 2.0],
        sensitivities=["m"],
    )  # fmt: skip
    assert run["v"] == pytest.approx([0.45, 0.1, -1.25])
    assert run.sensitivities["m"]["v"] == pytest.approx([-0.225, -0.05, 0.625])
    assert run.event_sensitivities["m"] == [0.0]


def twins(mixing: float) -> sf.Model:
    """Two points that reach their walls at one time; each rebounds with a part of the other."""
    x, y = sf.Variable("x", "m", start=1.0), sf.Variable("y", "m", start=2.0)
    v, w = sf.Variable("v", "m/s", start=-1.0), sf.Variable("w", "m/s", start=-2.0)
    events = (
        Event("wall x", x.symbol, -1, reset={"v": -v.symbol + mixing * w.symbol}),
        Event("wall y", y.symbol, -1, reset={"w": -w.symbol + mixing * v.symbol}),
    )
    return sf.Model(
        "twins", x=(x, y, v, w), ode=ca.vertcat(v.symbol, w.symbol, 0, 0), events=events
    )


def test_events_at_one_time_that_do_not_disturb_each_other_are_taken_one_by_one() -> None:
    times = [0.5, 1.5, 2.0]
    run = sf.simulate(twins(0.0), 2.0, t_eval=times, sensitivities=["x0.x", "x0.w"])
    assert run.statistics.events == 2
    assert run.sensitivities["x0.x"]["x"] == pytest.approx([1.0, -1.0, -1.0])
    assert run.sensitivities["x0.x"]["y"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    assert run.sensitivities["x0.w"]["y"][2] == pytest.approx(-2.0)
    weights = {"x": [0.0, 0.0, 1.0], "y": [0.0, 0.0, 1.0]}
    assert run.gradient(weights) == pytest.approx({"x0.x": -1.0, "x0.w": -2.0})


def cubed() -> sf.Model:
    x = sf.Variable("x", "1")
    return counter((Event("touch", (x.symbol - 1) ** 3),), x)


def at_a_jump() -> sf.Model:
    """x = t reaches 1 when u jumps."""
    x, u = sf.Variable("x", "m"), sf.Variable("u", "m/s")
    done = Event("done", x.symbol - 1.0 + 1e-12, direction=1)
    return sf.Model("pushed", x=(x,), u=(u,), ode=u.symbol, events=(done,))


@pytest.mark.parametrize(
    ("model", "seed", "message"),
    [
        (
            twins(0.5),
            "x0.x",
            "event 'wall x', 'wall y' at t = 1 s: .* whose order changes the result",
        ),
        (cubed(), "p", "event 'touch' at t = 0.5 s: .*touches it at a rate of .* per second"),
        (at_a_jump(), "x0.x", "event 'done' at t = 1 s: .* apart from the jumps of the inputs"),
    ],
)
def test_motion_without_a_derivative_is_named_with_event_and_time(
    model: sf.Model, seed: str, message: str
) -> None:
    u = {"u": sf.Hold([0.0, 1.0], [1.0, 2.0])} if model.u else None
    run = sf.simulate(model, 2.0, u=u, samples=3, sensitivities=[seed])
    with pytest.raises(ValueError, match=message):
        _ = run.sensitivities
    with pytest.raises(ValueError, match=message):
        run.gradient({"x": 1.0})
