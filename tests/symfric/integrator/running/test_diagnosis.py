"""Every failure is one sentence: when, which equation, what to do; and keeps what was reached."""

from typing import Any

import casadi as ca
import numpy as np
import pytest
from backends import each_backend

import symfric as sf
from symfric import Model, Status, Variable, simulate
from symfric.integrator.running.diagnosis import chattering

t = ca.SX.sym("t")
x, y, z = Variable("x", "m"), Variable("y", "m", start=1.0), Variable("z", "1", start=1.0)
X, Y, Z = x.symbol, y.symbol, z.symbol


def ode(*rates: ca.SX | float) -> Model:
    return Model("edge", x=(x, y), ode=ca.vertcat(*rates), t=t)


def dae(rate: ca.SX, alg: ca.SX) -> Model:
    return Model("edge", x=(x,), z=(z,), ode=rate, alg=alg, t=t)


SLIDE = Model("slide", x=(y,), ode=-ca.sign(Y))
SWITCH = Model("edge", x=(x,), ode=ca.if_else(X < 0.5, 1, -1e12))
"""Sliding on a switch a trillion times faster than the approach to it."""

Failure = tuple[Model, dict[str, Any], Status, float, str]
NAN, SMALL, SINGULAR = Status.NOT_FINITE, Status.STEP_TOO_SMALL, Status.SINGULAR
FAILURES: dict[str, Failure] = {
    # x = t, and an equation for y that fails somewhere
    "root": (ode(1, ca.sqrt(1 - X)), {}, NAN, 1.0, "the .*equation of y "),
    "logarithm": (ode(1, ca.log(1 - X)), {}, NAN, 1.0, "the .*equation of y "),
    "power": (ode(1, (1 - X) ** 1.5), {}, NAN, 1.0, "the .*equation of y "),
    "root of time": (ode(1, ca.sqrt(1.5 - t)), {}, NAN, 1.5, "the .*equation of y "),
    "first, at once": (
        ode(1 / X, -Y), {}, NAN, 0.0, "the equation of x returned NaN or infinity"
    ),
    "second, at once": (ode(-X, ca.log(X)), {}, NAN, 0.0, "the equation of y returned"),
    "both, at once": (ode(1 / X, Y / X), {}, NAN, 0.0, "the equation of x, y returned"),
    # the root itself is finite, and its slope infinite where the tank runs empty
    "slope": (ode(1, -ca.sqrt(Y)), {"t_end": 3.0}, NAN, 2.0, ".*equation of y"),
    # no state depends on the unknown
    "unknown": (dae(-X, Z - ca.log(1 - t)), {}, NAN, 1.0, ".*equation of z"),
    # y' = y^n from 1 is infinite at t = 1 / (n - 1)
    "square": (
        ode(-X, Y**2), {}, SMALL, 1.0, r".*y = .*grows without bound; check signs and param"
    ),
    "cube": (ode(-X, Y**3), {}, SMALL, 0.5, ".*y = .*grows without bound; check signs and param"),
    "no solution": (
        dae(-Z, Z**2 - (1 - t)), {}, SINGULAR, 1.0,
        ".*algebraic equations for z have no solution near their last one",
    ),
    "switch": (
        SWITCH, {}, SMALL, 0.5,
        ".*fastest equation x; a discontinuity is near.*smooth form or the model an event",
    ),
    "switch, late": (
        SWITCH, {"t_start": 1e6, "t_end": 1e6 + 2}, SMALL, 1e6 + 0.5,
        ".*steps below 2.2e-09 s are lost to rounding",
    ),
}  # fmt: skip
"""Model, arguments, status, when it stops, and the rest of its message."""


@each_backend
@pytest.mark.parametrize("case", FAILURES)
def test_failures_are_named_with_their_time(case: str, backend: str) -> None:
    model, arguments, status, end, message = FAILURES[case]
    how = {"t_end": 2.0, "backend": backend} | arguments
    text = rf"^simulate 'edge': stopped at t = \S+ s: {message}"
    with pytest.raises(sf.SolveError, match=text) as caught:
        simulate(model, **how)
    error, run = caught.value, simulate(model, **how, throw=False)
    assert error.status is error.partial.status is run.status is status
    assert not run.status.ok
    assert str(error) == error.partial.message
    assert str(error).count("\n") == 0
    assert "x = " not in str(error)
    assert ("lost to rounding" in str(error)) == (case == "switch, late")
    assert run.step_times[-1] == pytest.approx(end, abs=1e-3)
    assert run.t[-1] <= run.step_times[-1]
    assert all(np.isfinite(signal).all() for signal in run.signals.values())


def test_redundant_constraints_are_refused_at_the_start_by_name() -> None:
    a, b = Variable("a", "N"), Variable("b", "N")
    same = a.symbol + b.symbol - X
    model = Model("redundant", x=(x,), z=(a, b), ode=-a.symbol, alg=ca.vertcat(same, 2 * same))
    with pytest.raises(ValueError, match="equations for a, b"):
        simulate(model, 1.0, x0={"x": 1.0})


@each_backend
def test_number_of_attempts_is_limited_and_the_start_of_the_run_returned(backend: str) -> None:
    model = sf.rabinowicz(sf.BrownMcPhee())
    with pytest.raises(sf.SolveError, match="maximum number of steps was used up") as caught:
        simulate(model, 1000.0, max_steps=300, backend=backend, samples=50_001)
    partial = caught.value.partial
    assert caught.value.status is Status.MAX_STEPS
    assert f"Stopped at t = {partial.step_times[-1]:g} s" in str(caught.value)
    assert 300 <= partial.statistics.steps + partial.statistics.rejections < 300 + 32
    early = partial.t[partial.t < 20]
    assert early.size > 10
    whole = simulate(model, 20.0).at(early)["x"]
    assert partial["x"][: early.size] == pytest.approx(whole, abs=1e-5)


def test_a_sign_in_the_equations_is_distinguished_from_a_law() -> None:
    with pytest.raises(sf.SolveError, match=r"contain sign\(\.\.\.\): use contact") as e:
        simulate(SLIDE, 5.0, max_steps=300, backend="vm")
    assert e.value.status is Status.MAX_STEPS
    assert chattering(SLIDE)
    assert not chattering(Model("smooth", x=(y,), ode=-Y))
    for law in (sf.ExactCoulomb(), sf.Karnopp()):  # of which one holds a sign of its own
        assert not chattering(sf.rabinowicz(law))
