"""Simulation as a user sees it: named signals, inputs, files, errors, against closed forms.

Arguments that simulations have in common, checked once for a model; the method "auto".

Invalid arguments of simulations, ensembles, plants, flows and inputs: one table of calls.
"""

import math
import warnings
from functools import cache
from math import exp
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from differentiable import oscillator
from oracles import viscous_ramp, viscous_sine
from refusing import not_refused

import symfric as sf
from symfric import integrator
from symfric.integrator import prepared, simulate_by_peer
from symfric.integrator.methods.tableaux import LOOSE, RADAU5, RODAS5P, chosen
from symfric.integrator.prepared import REMEMBERED, check_span
from symfric.integrator.running import run as running

M, C = 0.8, 2.0
RUNNERS = ["auto", "rosenbrock", "sundials"]

each_runner = pytest.mark.parametrize("runner", RUNNERS)


def by(runner: str, model: sf.Model, t_end: float, **arguments: Any) -> sf.Trajectory:
    """A run of our integrator, or of one of CasADi's."""
    if runner == "auto":
        return sf.simulate(model, t_end, **arguments)
    return simulate_by_peer(model, t_end, runner, **arguments)


@cache
def cart() -> sf.Model:
    """m v' = force - c v."""
    return sf.drive(sf.Viscous(sigma_2=C), m=M)


@pytest.fixture(scope="module")
def run() -> sf.Trajectory:
    return sf.simulate(sf.rabinowicz(sf.LuGre()), 1.0, samples=11)


def test_signals_have_names_units_and_the_length_of_time(run: sf.Trajectory) -> None:
    assert run.scene == "rabinowicz"
    assert run.t == pytest.approx(np.linspace(0, 1, 11))
    assert list(run.signals) == ["x", "v", "z", "v_rel", "friction", "power"]
    assert [*run.units.values()] == ["m", "m/s", "m", "m/s", "N", "W"]
    assert all(signal.shape == (11,) for signal in run.signals.values())
    np.testing.assert_array_equal(run["v"], run.signals["v"])
    np.testing.assert_array_equal(run["t"], run.t)
    assert (run.status, run.message) == (sf.Status.SUCCESS, sf.Status.SUCCESS.value)
    assert run.statistics.evaluations >= run.statistics.steps > 10


def test_dense_output_meets_the_samples_and_is_accurate_between_them() -> None:
    run = sf.simulate(cart(), 2.0, u={"force": 3.0}, rtol=1e-8, samples=201)
    assert run.at(run.t)["v"] == pytest.approx(run["v"], rel=1e-9)
    t = np.linspace(0, 2, 777)
    exact = [viscous_ramp(s, M, C, 0.0, 3.0, 0.0) for s in t]
    assert run.at(t)["v"] == pytest.approx(exact, abs=1e-6)
    assert run.at(0.5)["v"].shape == (1,)
    assert set(run.at(0.5)) == set(run.signals)


@pytest.mark.parametrize("backend", ["vm", "compiled"])
def test_no_step_is_longer_than_allowed_and_one_ends_at_each_time(backend: str) -> None:
    model, times = sf.rabinowicz(sf.LuGre()), [0.1234, 0.5, 1.7]
    run = sf.simulate(model, 2.0, max_step=0.01, times=times, backend=backend)
    assert np.diff(run.step_times).max() <= 0.01 * (1 + 1e-12)
    assert set(times) <= set(run.step_times)
    free = sf.simulate(model, 2.0, backend=backend)
    assert np.diff(free.step_times).max() > 0.02
    assert run.final["x"] == pytest.approx(free.final["x"], rel=1e-6)
    first = dict[str, Any](max_step=1e-18, times=[1e-17], max_steps=100, throw=False)
    run = sf.simulate(cart(), 1e-9, backend=backend, **first)  # shorter than the default first step
    assert np.diff(run.step_times).max() <= 1.01e-18


DRIVEN: dict[str, tuple[Any, list[tuple[float, float, float]]]] = {
    "number": (3.0, [(0.0, 3.0, 0.0)]),
    "held": (
        sf.Hold([0.0, 0.3, 1.1], [1.0, -2.0, 4.0]),
        [(0.0, 1.0, 0.0), (0.3, -2.0, 0.0), (1.1, 4.0, 0.0)],
    ),
    "linear": (
        sf.Linear([0.0, 0.5, 1.0], [0.0, 2.0, -1.0]),
        [(0.0, 0.0, 4.0), (0.5, 2.0, -6.0), (1.0, -1.0, 0.0)],
    ),
}  # fmt: skip
"""Input -> its pieces: start [s], force [N], slope [N/s]."""


@each_runner
@pytest.mark.parametrize("kind", DRIVEN)
def test_inputs_jump_and_bend_exactly_at_their_samples(runner: str, kind: str) -> None:
    (force, pieces), times = DRIVEN[kind], [0.3, 0.5, 1.0, 1.1, 1.5]
    run = by(runner, cart(), 1.5, u={"force": force}, x0={"v": 0.5}, rtol=1e-8, t_eval=times)
    for k, t in enumerate(times):
        v, parts = 0.5, [piece for piece in pieces if piece[0] <= t]
        for (start, level, slope), end in zip(parts, [p[0] for p in parts[1:]] + [t], strict=True):
            v = viscous_ramp(end - start, M, C, v, level, slope)
        assert run["v"][k] == pytest.approx(v, abs=1e-6)
        assert run["force"][k] == pytest.approx(parts[-1][1] + parts[-1][2] * (t - parts[-1][0]))
    assert run["friction"] == pytest.approx(C * run["v"])


@each_runner
def test_functions_of_time_are_inputs(runner: str) -> None:
    def force(t: Any) -> Any:
        return 2.0 * ca.sin(5.0 * t)

    run = by(runner, cart(), 3.0, u={"force": force}, rtol=1e-8)
    assert run["v"] == pytest.approx([viscous_sine(t, M, C, 2.0, 5.0) for t in run.t], abs=1e-6)


def test_start_times_and_parameters_are_taken_without_a_new_model() -> None:
    model = sf.drive(sf.Viscous(), free=["sigma_2", "m"])
    for c, m in ((2.0, 0.8), (0.5, 3.0)):
        run = sf.simulate(
            model, 3.0, t_start=1.0, u={"force": lambda t: 4.0 * (t - 1.0)}, rtol=1e-8,
            p={"sigma_2": c, "m": m},
        )  # fmt: skip
        assert run.final["v"] == pytest.approx(viscous_ramp(2.0, m, c, 0.0, 0.0, 4.0), rel=1e-6)


x = sf.Variable("x", "m", start=1.0)


@each_runner
def test_differential_algebraic_model(runner: str) -> None:
    """x' = -z with z^3 = x: x = (1 - 2t/3)^(3/2)."""
    z = sf.Variable("z", "m/s", start=0.5)
    equation = z.symbol**3 - x.symbol
    model = sf.Model("root", x=(x,), z=(z,), ode=-z.symbol, alg=equation)
    run = by(runner, model, 1.0, rtol=1e-8)
    assert run["x"] == pytest.approx((1 - 2 * run.t / 3) ** 1.5, abs=1e-6)
    assert run["z"] == pytest.approx((1 - 2 * run.t / 3) ** 0.5, abs=1e-6)


@pytest.mark.parametrize("runner", ["auto", "sundials"])
def test_implicit_model(runner: str) -> None:
    """2 x' + x = 0."""
    rate = ca.SX.sym("rate")
    model = sf.Model("implicit", x=(x,), xdot=rate, residual=2 * rate + x.symbol)
    run = by(runner, model, 3.0, rtol=1e-8)
    assert run["x"] == pytest.approx(np.exp(-run.t / 2), abs=1e-6)


def test_implicit_model_with_coupled_nonlinear_rates() -> None:
    """x' + y' = -x - y and x'^3 = -x^3 have the solution x = exp(-t), y = 2 exp(-t)."""
    y, rates = sf.Variable("y", "m", start=2.0), ca.SX.sym("rates", 2)
    first = rates[0] + rates[1] + x.symbol + y.symbol
    second = rates[0] + rates[0] ** 3 + x.symbol + x.symbol**3
    model = sf.Model("implicit", x=(x, y), xdot=rates, residual=ca.vertcat(first, second))
    run = sf.simulate(model, 2.0, rtol=1e-8)
    assert run["x"] == pytest.approx(np.exp(-run.t), abs=1e-6)
    assert run["y"] == pytest.approx(2 * np.exp(-run.t), abs=1e-6)


@each_runner
def test_outputs_may_depend_on_everything(runner: str) -> None:
    u, p, t = sf.Variable("u", "1", start=2.0), sf.Variable("p", "1", start=3.0), ca.SX.sym("t")
    out = sf.Output(t + 10 * x.symbol + 100 * u.symbol + 1000 * p.symbol, "1")
    model = sf.Model("all", x=(x,), u=(u,), p=(p,), ode=ca.SX(0.0), outputs={"out": out}, t=t)
    run = by(runner, model, 0.5, samples=2)
    assert run["out"] == pytest.approx([3210.0, 3210.5])


def blow_up() -> sf.Model:
    """x' = x^2 from 1, infinite at t = 1."""
    return sf.Model("blow_up", x=(x,), ode=x.symbol**2)


@pytest.mark.parametrize("runner", ["auto", "rosenbrock"])
def test_a_failed_solve_reports_the_place_and_keeps_partial_results(runner: str) -> None:
    with pytest.raises(sf.SolveError, match=r"stopped .*t = (0\.9|1)") as caught:
        by(runner, blow_up(), 2.0)
    error = caught.value
    assert not error.status.ok
    partial = error.partial
    assert isinstance(partial, sf.Trajectory)
    assert partial.status is error.status
    assert 0.9 < partial.t[-1] <= 1.0
    early = partial.t < 0.9
    assert partial["x"][early] == pytest.approx(1 / (1 - partial.t[early]), rel=1e-4)
    returned = by(runner, blow_up(), 2.0, throw=False)
    assert (returned.status, returned.message) == (error.status, str(error))


def test_a_long_run_runs_on_and_one_without_progress_stops(monkeypatch: pytest.MonkeyPatch) -> None:
    """With limits scaled down from 10 million attempts and a billion."""
    whole = sf.simulate(sf.rabinowicz(sf.LuGre()), 20.0, backend="vm")
    for module in (prepared, running):
        monkeypatch.setattr(module, "MANY_STEPS", 50)
    assert whole.statistics.steps > 200
    found = sf.simulate(sf.rabinowicz(sf.LuGre()), 20.0, backend="vm")
    assert found.status is sf.Status.SUCCESS
    np.testing.assert_array_equal(found["x"], whole["x"])
    monkeypatch.setattr(running, "MOST_STEPS", 100)
    stopped = sf.simulate(sf.rabinowicz(sf.LuGre()), 20.0, backend="vm", throw=False)
    assert stopped.status is sf.Status.MAX_STEPS
    assert stopped.statistics.steps < whole.statistics.steps
    few = sf.simulate(sf.rabinowicz(sf.LuGre()), 20.0, backend="vm", max_steps=60, throw=False)
    assert few.statistics.steps + few.statistics.rejections == 60


def test_algebraic_equation_without_a_solution_is_reported() -> None:
    z = sf.Variable("z", "1", start=1.0)
    model = sf.Model("none", x=(x,), z=(z,), ode=-z.symbol, alg=z.symbol**2 + 1)
    with pytest.raises((ValueError, sf.SolveError), match=r"consistent|stopped at t = 0 s"):
        sf.simulate(model, 1.0)


def test_nominal_values_scale_the_absolute_tolerance() -> None:
    """In micrometres the same model must not be solved a million times worse."""
    slow = sf.Variable("s", "um", start=1e6, nominal=1e6)
    model = sf.Model("scaled", x=(slow,), ode=-slow.symbol)
    assert sf.simulate(model, 1.0, rtol=1e-8).final["s"] == pytest.approx(1e6 * exp(-1), rel=1e-7)


MODEL = sf.drive(sf.Viscous())


def test_tolerance_is_that_of_the_events_at_most_and_then_no_loose_one() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert check_span("here", sf.rabinowicz(sf.ExactCoulomb()), 0.0, 1.0, 1e-3)[2] == 1e-7
    assert check_span("here", sf.rabinowicz(sf.ExactCoulomb()), 0.0, 1.0, 1e-9)[2] == 1e-9
    assert check_span("here", MODEL, 0.0, 1.0, 1e-6)[2] == 1e-6


def test_methods_by_name_and_by_tolerance() -> None:
    for rtol, method in ((1e-13, RODAS5P), (1e-6, RODAS5P), (LOOSE, RODAS5P), (2e-5, RADAU5)):
        assert chosen("here", "auto", rtol) is method
    for name, message in (
        ("rodas5", "here: method: expected one of auto, rodas5p.* did you mean rodas5p"),
        ("backward_euler", "here: method: expected one with error control.* which has fixed steps"),
    ):
        with pytest.raises(ValueError, match=message):
            chosen("here", name, 1e-6)


def test_settings_are_checked_once_and_true_is_no_time() -> None:
    """Equal numbers of another type are other settings."""
    model = sf.drive(sf.Viscous())
    first = sf.simulate(model, 1.0, samples=5)
    again = sf.simulate(model, 1.0, samples=5)
    assert again.t.tolist() == first.t.tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    again.t[:] = 0.0
    assert sf.simulate(model, 1.0, samples=5).t[-1] == 1.0
    assert len(model.memory["prepared"]) == 1
    with pytest.raises(ValueError, match="t_end"):
        sf.simulate(model, True, samples=5)
    end: Any = np.array(1.0)
    assert sf.simulate(model, end, samples=5).t[-1] == 1.0
    for k in range(REMEMBERED + 4):
        sf.simulate(model, 0.01 * (k + 1), samples=5)
    assert len(model.memory["prepared"]) == REMEMBERED


def test_every_loose_call_is_warned_of_where_it_is_made() -> None:
    assert sf.simulate(MODEL, 0.1, rtol=LOOSE, samples=5).status.ok
    for call in (sf.simulate, sf.simulate, simulate_by_peer, sf.simulate_many):
        with pytest.warns(UserWarning, match="rtol = 0.001 is above 1e-05; whole stick") as seen:
            call(MODEL, 0.1, rtol=1e-3)
        assert [w.filename for w in seen] == [__file__]


X = sf.Variable("x", "m", start=1.0)
FALLING = sf.Model("falling", x=(X,), ode=ca.SX(-1.0), events=(sf.Event("ground", X.symbol),))


class Source:
    """An input as an object."""

    def __init__(self, size: float) -> None:
        self.size = size

    def __call__(self, t: ca.SX) -> ca.SX:
        return self.size * t


def test_bad_arguments_are_refused_in_a_sentence() -> None:
    cart, swing = sf.drive(sf.Viscous()), oscillator()
    plain, run = (sf.simulate(swing, 2.0, samples=5, sensitivities=s) for s in ([], ["k"]))

    def pushed(force: Any) -> object:
        return sf.simulate(cart, 1.0, u={"force": force}, backend="vm")

    wrong = not_refused(
        Path(__file__).with_name("refusals.toml"), sf, integrator, cart=cart, swing=swing,
        belt=sf.rabinowicz(sf.Viscous(), free=["m"]), falling=FALLING, plain=plain, run=run,
        pushed=pushed, Source=Source, math=math,
    )  # fmt: skip
    assert wrong == []


def test_bounds_of_a_parameter_are_allowed_themselves() -> None:
    k = sf.Variable("k", "1/s", start=0.5, lower=0.0, upper=1.0)
    model = sf.Model("bounded", x=(X,), p=(k,), ode=-k.symbol * X.symbol)
    assert sf.simulate(model, 1.0, p={"k": 0.0}).final["x"] == 1.0
    many = sf.simulate_many(model, 1.0, p={"k": np.array([0.0, 1.0])})
    assert many["x"][0, -1] == 1.0
