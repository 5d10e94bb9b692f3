"""Simulation as a user sees it: named signals, inputs, files, errors, against closed forms."""

from math import exp
from typing import Any

import casadi as ca
import numpy as np
import pytest
from oracles import viscous_ramp, viscous_sine

from symfric import (
    Hold,
    Linear,
    LuGre,
    Model,
    Output,
    SolveError,
    Status,
    Trajectory,
    Variable,
    Viscous,
    drive,
    rabinowicz,
    simulate,
)
from symfric.integrator import arguments, simulate_by_peer
from symfric.integrator.running import run as running

M, C = 0.8, 2.0
RUNNERS = ["auto", "rosenbrock", "sundials"]

each_runner = pytest.mark.parametrize("runner", RUNNERS)


def by(runner: str, model: Model, t_end: float, **arguments: Any) -> Trajectory:
    """A run of our integrator, or of one of CasADi's."""
    if runner == "auto":
        return simulate(model, t_end, **arguments)
    return simulate_by_peer(model, t_end, runner, **arguments)


def cart() -> Model:
    """m v' = force - c v."""
    return drive(Viscous(sigma_2=C), m=M)


@pytest.fixture(scope="module")
def run() -> Trajectory:
    return simulate(rabinowicz(LuGre()), 1.0, samples=11)


def test_signals_have_names_units_and_the_length_of_time(run: Trajectory) -> None:
    assert run.scene == "rabinowicz"
    assert run.t == pytest.approx(np.linspace(0, 1, 11))
    assert list(run.signals) == ["x", "v", "z", "v_rel", "friction", "power"]
    assert [*run.units.values()] == ["m", "m/s", "m", "m/s", "N", "W"]
    assert all(signal.shape == (11,) for signal in run.signals.values())
    np.testing.assert_array_equal(run["v"], run.signals["v"])
    np.testing.assert_array_equal(run["t"], run.t)
    assert (run.status, run.message) == (Status.SUCCESS, Status.SUCCESS.value)
    assert run.statistics.evaluations >= run.statistics.steps > 10


def test_dense_output_meets_the_samples_and_is_accurate_between_them() -> None:
    run = simulate(cart(), 2.0, u={"force": 3.0}, rtol=1e-8, samples=201)
    assert run.at(run.t)["v"] == pytest.approx(run["v"], rel=1e-9)
    t = np.linspace(0, 2, 777)
    exact = [viscous_ramp(s, M, C, 0.0, 3.0, 0.0) for s in t]
    assert run.at(t)["v"] == pytest.approx(exact, abs=1e-6)
    assert run.at(0.5)["v"].shape == (1,)
    assert set(run.at(0.5)) == set(run.signals)


@pytest.mark.parametrize("backend", ["vm", "compiled"])
def test_no_step_is_longer_than_allowed_and_one_ends_at_each_time(backend: str) -> None:
    model, times = rabinowicz(LuGre()), [0.1234, 0.5, 1.7]
    run = simulate(model, 2.0, max_step=0.01, times=times, backend=backend)
    assert np.diff(run.step_times).max() <= 0.01 * (1 + 1e-12)
    assert set(times) <= set(run.step_times)
    free = simulate(model, 2.0, backend=backend)
    assert np.diff(free.step_times).max() > 0.02
    assert run.final["x"] == pytest.approx(free.final["x"], rel=1e-6)
    first = {"max_step": 1e-18, "times": [1e-17], "max_steps": 100, "throw": False}
    run = simulate(cart(), 1e-9, backend=backend, **first)  # shorter than the default first step
    assert np.diff(run.step_times).max() <= 1.01e-18


DRIVEN: dict[str, tuple[Any, list[tuple[float, float, float]]]] = {
    "number": (3.0, [(0.0, 3.0, 0.0)]),
    "held": (
        Hold([0.0, 0.3, 1.1], [1.0, -2.0, 4.0]),
        [(0.0, 1.0, 0.0), (0.3, -2.0, 0.0), (1.1, 4.0, 0.0)],
    ),
    "linear": (
        Linear([0.0, 0.5, 1.0], [0.0, 2.0, -1.0]),
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
    force = {"force": lambda t: 2.0 * ca.sin(5.0 * t)}
    run = by(runner, cart(), 3.0, u=force, rtol=1e-8)
    assert run["v"] == pytest.approx([viscous_sine(t, M, C, 2.0, 5.0) for t in run.t], abs=1e-6)


def test_start_times_and_parameters_are_taken_without_a_new_model() -> None:
    model = drive(Viscous(), free=["sigma_2", "m"])
    for c, m in ((2.0, 0.8), (0.5, 3.0)):
        run = simulate(
            model, 3.0, t_start=1.0, u={"force": lambda t: 4.0 * (t - 1.0)}, rtol=1e-8,
            p={"sigma_2": c, "m": m},
        )  # fmt: skip
        assert run.final["v"] == pytest.approx(viscous_ramp(2.0, m, c, 0.0, 0.0, 4.0), rel=1e-6)


x = Variable("x", "m", start=1.0)


@each_runner
def test_differential_algebraic_model(runner: str) -> None:
    """x' = -z with z^3 = x: x = (1 - 2t/3)^(3/2)."""
    z = Variable("z", "m/s", start=0.5)
    equation = z.symbol**3 - x.symbol
    model = Model("root", x=(x,), z=(z,), ode=-z.symbol, alg=equation)
    run = by(runner, model, 1.0, rtol=1e-8)
    assert run["x"] == pytest.approx((1 - 2 * run.t / 3) ** 1.5, abs=1e-6)
    assert run["z"] == pytest.approx((1 - 2 * run.t / 3) ** 0.5, abs=1e-6)


@pytest.mark.parametrize("runner", ["auto", "sundials"])
def test_implicit_model(runner: str) -> None:
    """2 x' + x = 0."""
    rate = ca.SX.sym("rate")
    model = Model("implicit", x=(x,), xdot=rate, residual=2 * rate + x.symbol)
    run = by(runner, model, 3.0, rtol=1e-8)
    assert run["x"] == pytest.approx(np.exp(-run.t / 2), abs=1e-6)


def test_implicit_model_with_coupled_nonlinear_rates() -> None:
    """x' + y' = -x - y and x'^3 = -x^3 have the solution x = exp(-t), y = 2 exp(-t)."""
    y, rates = Variable("y", "m", start=2.0), ca.SX.sym("rates", 2)
    first = rates[0] + rates[1] + x.symbol + y.symbol
    second = rates[0] + rates[0] ** 3 + x.symbol + x.symbol**3
    model = Model("implicit", x=(x, y), xdot=rates, residual=ca.vertcat(first, second))
    run = simulate(model, 2.0, rtol=1e-8)
    assert run["x"] == pytest.approx(np.exp(-run.t), abs=1e-6)
    assert run["y"] == pytest.approx(2 * np.exp(-run.t), abs=1e-6)


@each_runner
def test_outputs_may_depend_on_everything(runner: str) -> None:
    u, p, t = Variable("u", "1", start=2.0), Variable("p", "1", start=3.0), ca.SX.sym("t")
    out = Output(t + 10 * x.symbol + 100 * u.symbol + 1000 * p.symbol, "1")
    model = Model("all", x=(x,), u=(u,), p=(p,), ode=ca.SX(0.0), outputs={"out": out}, t=t)
    run = by(runner, model, 0.5, samples=2)
    assert run["out"] == pytest.approx([3210.0, 3210.5])


def blow_up() -> Model:
    """x' = x^2 from 1, infinite at t = 1."""
    return Model("blow_up", x=(x,), ode=x.symbol**2)


@pytest.mark.parametrize("runner", ["auto", "rosenbrock"])
def test_a_failed_solve_reports_the_place_and_keeps_partial_results(runner: str) -> None:
    with pytest.raises(SolveError, match=r"stopped .*t = (0\.9|1)") as caught:
        by(runner, blow_up(), 2.0)
    error = caught.value
    assert not error.status.ok
    partial = error.partial
    assert isinstance(partial, Trajectory)
    assert partial.status is error.status
    assert 0.9 < partial.t[-1] <= 1.0
    early = partial.t < 0.9
    assert partial["x"][early] == pytest.approx(1 / (1 - partial.t[early]), rel=1e-4)
    returned = by(runner, blow_up(), 2.0, throw=False)
    assert (returned.status, returned.message) == (error.status, str(error))


def test_a_long_run_runs_on_and_one_without_progress_stops(monkeypatch: pytest.MonkeyPatch) -> None:
    """With limits scaled down from 10 million attempts and a billion."""
    whole = simulate(rabinowicz(LuGre()), 20.0, backend="vm")
    for module in (arguments, running):
        monkeypatch.setattr(module, "MANY_STEPS", 50)
    assert whole.statistics.steps > 200
    found = simulate(rabinowicz(LuGre()), 20.0, backend="vm")
    assert found.status is Status.SUCCESS
    np.testing.assert_array_equal(found["x"], whole["x"])
    monkeypatch.setattr(running, "MOST_STEPS", 100)
    stopped = simulate(rabinowicz(LuGre()), 20.0, backend="vm", throw=False)
    assert stopped.status is Status.MAX_STEPS
    assert stopped.statistics.steps < whole.statistics.steps
    few = simulate(rabinowicz(LuGre()), 20.0, backend="vm", max_steps=60, throw=False)
    assert few.statistics.steps + few.statistics.rejections == 60


def test_algebraic_equation_without_a_solution_is_reported() -> None:
    z = Variable("z", "1", start=1.0)
    model = Model("none", x=(x,), z=(z,), ode=-z.symbol, alg=z.symbol**2 + 1)
    with pytest.raises((ValueError, SolveError), match=r"consistent|stopped at t = 0 s"):
        simulate(model, 1.0)


def test_nominal_values_scale_the_absolute_tolerance() -> None:
    """In micrometres the same model must not be solved a million times worse."""
    slow = Variable("s", "um", start=1e6, nominal=1e6)
    model = Model("scaled", x=(slow,), ode=-slow.symbol)
    assert simulate(model, 1.0, rtol=1e-8).final["s"] == pytest.approx(1e6 * exp(-1), rel=1e-7)
