"""Branches of driven orbits, and branches beyond folds that are too sharp for steps."""

import casadi as ca
import numpy as np
import pytest

from symfric import LuGre, Model, Variable, simulate
from symfric.bench.dynamics import LEVELS, belt
from symfric.dynamics import continuation, equilibrium, orbits_from, periodic_orbit


def test_a_driven_oscillator_has_its_resonance() -> None:
    x, v, k = Variable("x", "m"), Variable("v", "m/s"), Variable("k", "N/m", start=3.0)
    t = ca.SX.sym("t")
    rates = ca.vertcat(v.symbol, ca.cos(2 * t) - k * x - 0.4 * v)
    model = Model("driven", x=(x, v), p=(k,), t=t, ode=rates)
    orbit = periodic_orbit(model, simulate(model, 80.0), period=np.pi)
    branch = continuation(orbit, "k", (2.0, 8.0), points=40)
    expected = 1 / np.hypot(branch.values - 4, 0.8)
    assert branch.high[:, 0] == pytest.approx(expected, rel=1e-6) and branch.stable.all()
    assert branch.values.min() < 2.01 and expected.max() > 1.24 and branch.driven
    assert branch.orbit(5).driven and not branch.special


@pytest.mark.parametrize(
    ("in_equations", "rate"), [(True, 2e-6), (True, 2e6), (False, 2.0), (False, 2e6)]
)
def test_what_is_no_period_of_the_drive_is_refused(in_equations: bool, rate: float) -> None:
    """After 3 / rate the states may return, but the motion does not repeat."""
    x, v = Variable("x", "m"), Variable("v", "m/s", nominal=rate)
    t, f = ca.SX.sym("t"), Variable("f", "m/s^2", nominal=rate**2)
    push = rate**2 * ca.cos(rate * t) if in_equations else f.symbol
    rates = ca.vertcat(v.symbol, push - 2 * rate**2 * x - 0.4 * rate * v)
    model = Model("driven", x=(x, v), u=() if in_equations else (f,), t=t, ode=rates)
    u = {} if in_equations else {"f": lambda t: rate**2 * ca.cos(rate * t)}
    run = simulate(model, 150 / rate, u=u)
    for turns in (1, 2):
        period = 2 * np.pi * turns / rate
        found = periodic_orbit(model, run, u=u, period=period)
        assert found.amplitude("x") == pytest.approx(1 / np.hypot(1, 0.4), rel=1e-6)
    for period, text in (
        (3 / rate, r"a period \[s\] of the inputs and of the equations, got"),
        (None, r"the period \[s\] of the (equations|input f), got None; give period="),
        (1e-9 / rate, "guess: expected a run of .* or more, with 3 times in a period"),
    ):
        with pytest.raises(ValueError, match=f"periodic_orbit: .*{text}"):
            periodic_orbit(model, run, u=u, period=period)


@pytest.mark.slow
def test_a_run_leads_beyond_a_fold_that_is_too_sharp() -> None:
    rest = continuation(equilibrium(belt(LuGre(**LEVELS))), "v_b", (0.3, 0.9))
    whole = orbits_from(rest, rest.located("Hopf")[-1], (0.3, 2.0))
    (found,) = whole.special  # exact friction grazes at 1.43549791
    assert found.kind == "fold" and found.value == pytest.approx(1.4352, abs=1e-4)
    assert not whole.stable[: found.index].any() and whole.stable[-1]
    assert whole.values[-1] == pytest.approx(0.3) and "its step only" in whole.message
