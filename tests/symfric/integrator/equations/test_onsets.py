"""Pulses of inputs that are functions of time: found on a grid, hit by steps."""

from collections.abc import Callable
from math import pi, sqrt

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from symfric import BrownMcPhee, Model, SolveError, Status, Variable, drive, simulate, simulate_many
from symfric.integrator.equations.expressions import DEPTH, changes, levels, pieces
from symfric.laws import Karnopp

Function = Callable[[ca.SX], ca.SX]
x, force = Variable("x", "m"), Variable("force", "N")
AT = 5.1234


def pulse(width: float) -> Function:
    """A pulse of impulse one at `AT`."""
    return lambda t: ca.exp(-(((t - AT) / width) ** 2)) / (width * sqrt(pi))


def times(function: Function, t_end: float = 10.0) -> NDArray[np.float64]:
    t = ca.SX.sym("t")
    return np.array(pieces(ca.SX.serialize(ca.SX(function(t))), 0.0, t_end).onsets)


@pytest.mark.parametrize(
    "steady",
    [
        lambda t: ca.SX(3.0),
        lambda t: 2 - 3 * t,
        lambda t: 2 * ca.sin(pi * t),
        lambda t: ca.sin(300 * t),
        lambda t: ca.sin(2 * t) + 0.02 * ca.sin(200 * t),
        lambda t: t**3,
        lambda t: t / 0.0,
    ],
)
def test_a_function_of_one_pace_needs_no_step_to_end(steady: Function) -> None:
    assert times(steady).size == 0


@pytest.mark.parametrize("width", [1.0, 0.1, 0.01, 0.001])
def test_a_pulse_lies_between_times_that_are_about_as_near_as_it_is_short(width: float) -> None:
    found = times(pulse(width))
    before, after = found[found < AT], found[found > AT]
    nearest = AT - before[-1], after[0] - AT
    assert max(nearest) < 50 * width + 20 * 10.0 / 2**DEPTH
    assert found.size < 12


def test_both_sides_of_a_jump_are_hit() -> None:
    found = times(lambda t: ca.if_else(t > 3.3, 1.0, 0.0))
    assert np.diff(found)[np.searchsorted(found, 3.3) - 1] <= 16 * 10.0 / 2**DEPTH


def test_pieces_are_halved_until_they_are_straight() -> None:
    assert levels(np.array([0.0, 1.0, 2.0, 3.0, 4.0])).tolist() == [0] * 4
    assert levels(np.array([0.0, 0.0, 0.0, 1.0, 0.0])).tolist() == [1, 1, 2, 2]


def test_a_change_of_pace_is_counted_from_the_last_one() -> None:
    assert changes(np.array([1, 2, 3, 4, 5, 7, 7, 4, 1])).tolist() == [3, 5, 7, 8]


@pytest.mark.parametrize("width", [1.0, 0.1, 0.01, 0.001])
def test_no_pulse_is_leapt_over(width: float) -> None:
    """A block on a table got none of the impulse and stayed where it was, with SUCCESS."""
    model = drive(BrownMcPhee(mu_s=0.0, mu_d=0.0), m=1.0)
    run = simulate(model, 10.0, u={"force": pulse(width)}, backend="vm")
    assert run.final["v"] == pytest.approx(1.0, rel=1e-5)
    many = simulate_many(model, 10.0, u={"force": pulse(width)}, backend="vm", executor="serial")
    assert many["v"][0, -1] == run.final["v"]


def test_a_pulse_beside_feedback_is_seen() -> None:
    model = Model("integrator", x=(x,), u=(force,), ode=force.symbol)
    feedback = {"force": lambda t: pulse(0.01)(t) - 1e-3 * x.symbol}
    run = simulate(model, 10.0, u=feedback, backend="vm")
    assert run.final["x"] == pytest.approx(np.exp(-1e-3 * (10 - AT)), rel=1e-5)


def test_a_pulse_too_short_for_the_grid_is_hit_where_it_is_named() -> None:
    model = Model("integrator", x=(x,), u=(force,), ode=force.symbol)
    how = {"u": {"force": pulse(1e-6)}, "backend": "vm"}
    missed, hit = simulate(model, 10.0, **how), simulate(model, 10.0, times=[AT], **how)
    assert missed.final["x"] == 0.0
    assert hit.final["x"] == pytest.approx(1.0, rel=1e-5)
    assert AT in hit.step_times


def test_pace_is_that_of_the_quickest_hundredth() -> None:
    def of(function: Function) -> float:
        t = ca.SX.sym("t")
        return pieces(ca.SX.serialize(ca.SX(function(t))), 0.0, 10.0).pace

    for period in (0.1, 1.0, 7.0):
        assert period / 110 < of(lambda t, T=period: 3 * ca.sin(2 * pi * t / T)) < period / 40
    assert of(lambda t: ca.SX(2.0)) == of(lambda t: 2 * t - 1) == np.inf
    assert of(lambda t: ca.if_else(t > 3, 1.0, 0.0)) > 0.05  # a jump is an onset, hardly a pace


def test_load_that_is_too_strong_for_a_moment_in_every_period_ends_rest() -> None:
    """By 4 %, for a tenth of the time: at rest steps grew over it, at the tighter tolerance."""
    law, A, w = Karnopp(form="event", mu_d=0.025), 0.0831, 0.74
    model = drive(law, m=8.8, N=0.5327)
    for rtol in (1e-6, 1e-11):
        run = simulate(model, 27.0, u={"force": lambda t: A * ca.sin(w * t)}, rtol=rtol)
        slips = np.array([t for t, name in run.happened if name == "slip"])
        first = np.arcsin(0.15 * 0.5327 / A) / w
        assert slips == pytest.approx(first + pi / w * np.arange(6), abs=1e-6)


@pytest.mark.parametrize("method", ["auto", "radau5", "rodas5p", "dopri5"])
def test_a_ramp_in_the_equations_of_a_model_is_not_leapt_over(method: str) -> None:
    """Radau's stages lay on both sides of a short ramp under a car at rest: it never moved."""
    t = ca.SX.sym("t")
    ramp = ca.fmin(ca.fmax((t - 0.5) / 0.226, 0.0), 1.0)
    v = Variable("v", "m/s")
    rate = ca.jtimes(ramp, t, ca.SX(1)) - v.symbol / 10
    model = Model("bump", x=(v,), ode=rate, t=t)
    exact = 10 / 0.226 * (np.exp(-(3.5 - 0.726) / 10) - np.exp(-(3.5 - 0.5) / 10))
    run = simulate(model, 3.5, method=method, rtol=1e-5, backend="vm")
    assert run.final["v"] == pytest.approx(exact, rel=1e-3)
    many = simulate_many(model, 3.5, p={}, x0={"v": [0.0, 0.0]}, rtol=1e-5, backend="vm")
    assert many["v"][:, -1] == pytest.approx(exact, rel=1e-3)


@pytest.mark.filterwarnings("ignore:simulate. rtol")
@pytest.mark.parametrize("method", ["auto", "rodas5p", "dopri5"])
def test_a_pulse_of_any_width_is_solved_or_refused(method: str) -> None:
    """The rate of a ramp of a nanosecond was leapt over, with SUCCESS."""
    t, y, solved = ca.SX.sym("t"), Variable("y", "m"), 0
    for width in np.logspace(-14, -1, 27):
        ramp = ca.fmin(ca.fmax((t - 0.5) / width, 0.0), 1.0)
        rate = ramp + ca.jtimes(ramp, t, ca.SX(1)) - y.symbol / 10
        model = Model("bump", x=(y,), ode=rate, t=t)
        # y during the ramp: 10 (1/w - 1) e(w) + 10 s / w, with e(s) = 1 - exp(-s/10)
        peak = (10 / width - 100 / width) * -np.expm1(-width / 10) + 10
        after = np.exp(-(3.0 - width) / 10)
        try:
            run = simulate(model, 3.5, method=method, rtol=1e-4, backend="vm")
        except SolveError as error:
            assert error.status is Status.STEP_TOO_SMALL
            continue
        assert run.final["y"] == pytest.approx(peak * after + 10 * (1 - after), abs=1e-2), width
        solved += 1
    assert solved >= 16


def test_pulses_within_jumps_are_found_and_jumps_are_not() -> None:
    def ramp(t: ca.SX) -> ca.SX:
        return ca.fmin(ca.fmax((t - AT) / 1e-9, 0.0), 1.0)

    def rate(t: ca.SX) -> ca.SX:
        return ca.jtimes(ramp(t), t, ca.SX(1))

    assert np.abs(times(lambda t: ramp(t) + rate(t)) - AT - 5e-10).min() < 1e-12
    assert np.abs(times(ramp) - AT).min() > 1e-6


def test_time_that_enters_beside_parameters_is_seen_at_their_start_values() -> None:
    t, at, width = (
        ca.SX.sym("t"),
        Variable("at", "s", start=2.0),
        Variable("width", "s", start=0.01),
    )
    pulse = ca.exp(-(((t - at.symbol) / width.symbol) ** 2)) / (width.symbol * sqrt(pi))
    model = Model("pulsed", x=(x,), p=(at, width), ode=pulse, t=t)
    assert simulate(model, 10.0, backend="vm").final["x"] == pytest.approx(1.0, rel=1e-5)
