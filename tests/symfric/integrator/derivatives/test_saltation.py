"""Derivatives through events: closed forms, differences of tight runs, and what has none."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from differentiable import pendulum
from stored import stored

import symfric as sf
from symfric import Hold, Linear, Model, Trajectory, Variable, simulate
from symfric.foundation.numeric import Array
from symfric.integrator.derivatives import saltation as module
from symfric.integrator.derivatives.functions import derivatives
from symfric.integrator.derivatives.path import seeds
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.integrator import built
from symfric.model import Event
from symfric.scenes import PendulumBox


def ball() -> Model:
    """Dropped from height h; it bounces with the restitution e."""
    h, v = Variable("h", "m", start=1.0), Variable("v", "m/s")
    g, e = Variable("g", "m/s^2", start=9.81), Variable("e", "1", start=0.8)
    bounce = Event("bounce", h.symbol, direction=-1, reset={"v": -e.symbol * v.symbol})
    return Model("ball", x=(h, v), p=(g, e), ode=ca.vertcat(v.symbol, -g.symbol), events=(bounce,))


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
    run = simulate(ball(), 1.5, t_eval=times, backend=backend, sensitivities=[*at])
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
    model = sf.rabinowicz(sf.ExactCoulomb(), free=["mu_s", "mu_d", "k"])
    start = {"v": 0.1, "mode": 0.0}
    run = simulate(model, 6.5, x0=start, t_eval=times, sensitivities=[*at])
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
    **{
        f"{name}_drive": (sf.drive(law, free=["m", "N"]), 4.0, force)
        for name, law, force in (
            ("exact", sf.ExactCoulomb(), Linear(GRID, WAVE)),
            ("gms", sf.GMS(form="event"), lambda t: 2 * ca.sin(ca.pi * t)),
            ("maxwell", sf.MaxwellSlip(form="event"), Hold(GRID, WAVE)),
        )
    },
}


OFTEN = ("leine_belt", "exact_drive", "gms_drive", "maxwell_drive")


def run_of(case: str, p: Mapping[str, float], **how: object) -> Trajectory:
    model, t_end, force = CASES[case]
    u = None if force is None else {"force": force}
    x0 = {"v": 0.02} if case.endswith("belt") else None
    at = np.linspace(0.0, t_end, 15)[1:]
    return simulate(model, t_end, x0=x0, u=u, p=p, t_eval=at, **how)  # pyright: ignore[reportArgumentType]


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


@pytest.mark.parametrize(
    "case", [pytest.param(c, marks=pytest.mark.slow) if c in OFTEN else c for c in CASES]
)
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


def struck() -> Model:
    """A point on a circle, whose rate an event halves; its tension follows."""
    model = pendulum()
    x, _, vx, vy = (v.symbol for v in model.x)
    stroke = Event("stroke", x - 0.3, -1, reset={"vx": vx / 2, "vy": vy / 2})
    return replace(model, events=(stroke,))


def test_mechanism_stays_on_its_constraints_behind_an_event() -> None:
    """By the radius, which moves the start, the event and all behind it; by differences."""

    def at(radius: float, **how: object) -> Trajectory:
        return simulate(
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
        made.step, made.forward(which.parameters, False).function, made.reverse(False).function,
        made.forward(which.parameters, True).function, made.reverse(True).function,
    ]  # fmt: skip
    most = [580, 2900, 1400, 3320, 1540]
    found = [f.n_instructions() for f in count]
    assert all(f <= m for f, m in zip(found, most, strict=True)), found


def events_of(
    *events: Event, x: tuple[Variable, ...], rates: tuple[Any, ...], **more: Any
) -> Model:
    return Model("small", x=x, ode=ca.vertcat(*rates), events=events, **more)


t = ca.SX.sym("t")
x, y, z = Variable("x", "1"), Variable("y", "1", start=-1.0), Variable("z", "1")
p, m, u = Variable("p", "1/s", start=2.0), Variable("m", "kg", start=2.0), Variable("u", "N")
X, Y, Z, P = x.symbol, y.symbol, z.symbol, p.symbol
STEP = {"u": Hold([0.0, 1.0], [1.0, -3.0])}
GAP = 4e-8
AT = np.array([0.25, 0.5 + 1e-8, 0.75])
BY_P = np.array([0.0, 1.0, 2.0]) * (1 + 2 / 4) * np.exp(AT - 0.5)


def twins(mixing: float) -> Model:
    """Two points that reach their walls at one time; each rebounds with a part of the other."""
    x, y = Variable("x", "m", start=1.0), Variable("y", "m", start=2.0)
    v, w = Variable("v", "m/s", start=-1.0), Variable("w", "m/s", start=-2.0)
    V, W = v.symbol, w.symbol
    return events_of(
        Event("wall x", x.symbol, -1, reset={"v": -V + mixing * W}),
        Event("wall y", y.symbol, -1, reset={"w": -W + mixing * V}),
        x=(x, y, v, w), rates=(V, W, 0, 0),
    )  # fmt: skip


Small = tuple[Model, dict[str, Any], dict[str, list[float]], dict[str, dict[str, Any]]]
SMALL: dict[str, Small] = {
    # x = p t reaches 1 at 1/p
    "an event that ends the run": (
        events_of(Event("full", X - 1, terminal=True), x=(x,), rates=(P,), p=(p,)),
        {"t_eval": [0.0, 0.2, 0.4]}, {"p": [-0.25], "x0.x": [-0.5]}, {"p": {"x": [0.0, 0.2, 0.4]}},
    ),
    # a second mark 2e-8 s after the first; at both y' = y jumps by p x: y = p exp(t - 1/p), twice
    "an event in the step that another one began": (
        events_of(
            *(Event(f"{k}", X - 1 - k * GAP, reset={"y": Y + X * P}) for k in (0, 1)),
            x=(x, replace(y, start=0.0)), rates=(P, Y), p=(p,),
        ),
        {"t_eval": AT, "rtol": 1e-9}, {"p": [-0.25] * 2, "x0.x": [-0.5] * 2},
        {"p": {"x": AT, "y": BY_P}, "x0.x": {"x": np.ones(3)}},
    ),
    # x = 1 lets y jump over zero, which lets z take the value of t y = 3 p / p
    "an event that another one brings about": (
        events_of(
            Event("first", X - 1, reset={"y": 3 * P}), Event("second", Y, reset={"z": t * Y}),
            x=(x, y, z), rates=(P, 0, 0), p=(p,), t=t,
        ),
        {"t_eval": [0.4, 0.6]}, {"p": [-0.25] * 2}, {"p": {"y": [0.0, 3.0], "z": [0.0, 0.0]}},
    ),
    # x' = u/m, and x is halved at t = 1, when u jumps
    "an event of time alone, at a jump of an input": (
        events_of(
            Event("half", t - 1, direction=1, reset={"x": X / 2}),
            x=(x,), rates=(u.symbol / m.symbol,), u=(u,), p=(m,), t=t,
        ),
        {"u": STEP, "t_eval": [0.9, 1.1, 2.0]}, {"m": [0.0]}, {"m": {"x": [-0.225, -0.05, 0.625]}},
    ),
    "events at one time that do not disturb each other": (
        twins(0.0), {"t_eval": [0.5, 1.5, 2.0]}, {"x0.x": [1.0, 0.0], "x0.w": [0.0, 0.5]},
        {"x0.x": {"x": [1.0, -1.0, -1.0], "y": [0.0] * 3}, "x0.w": {"y": [0.5, -1.5, -2.0]}},
    ),
}  # fmt: skip
"""Model, arguments, derivatives of times of events, and of signals."""


@pytest.mark.parametrize("case", SMALL)
def test_small_models_meet_their_derivatives_by_hand(case: str) -> None:
    model, arguments, times, signals = SMALL[case]
    end = max(arguments["t_eval"])
    run = simulate(model, end + 0.25, sensitivities=[*(times | signals)], **arguments)
    for name, expected in times.items():
        assert run.event_sensitivities[name] == pytest.approx(expected, rel=1e-6, abs=1e-9)
    for name, expected in signals.items():
        for signal, values in expected.items():
            found = run.sensitivities[name][signal]
            assert found == pytest.approx(values, rel=1e-6, abs=1e-8)
        weights = {signal: np.ones(run.t.size) for signal in expected}
        by_hand = sum(np.sum(values) for values in expected.values())
        assert run.gradient(weights)[name] == pytest.approx(by_hand, rel=1e-6, abs=1e-7)


@pytest.mark.parametrize(
    ("model", "seed", "message"),
    [
        (
            twins(0.5), "x0.x",
            "event 'wall x', 'wall y' at t = 1 s: .* whose order changes the result",
        ),
        (
            events_of(Event("touch", (X - 1) ** 3), x=(x,), rates=(P,), p=(p,)), "p",
            "event 'touch' at t = 0.5 s: .*touches it at a rate of .* per second",
        ),
        (
            events_of(Event("done", X - 1 + 1e-12, direction=1), x=(x,), rates=(u.symbol,), u=(u,)),
            "x0.x", "event 'done' at t = 1 s: .* apart from the jumps of the inputs",
        ),
    ],
)  # fmt: skip
def test_motion_without_a_derivative_is_named_with_event_and_time(
    model: Model, seed: str, message: str
) -> None:
    given = {"u": Hold([0.0, 1.0], [1.0, 2.0])} if model.u else None
    run = simulate(model, 2.0, u=given, samples=3, sensitivities=[seed])
    for request in (lambda: run.sensitivities, lambda: run.gradient({"x": 1.0})):
        with pytest.raises(ValueError, match=message):
            request()
