"""Branches of driven orbits, and branches beyond folds that are too sharp for steps."""

import casadi as ca
import numpy as np
import pytest

from symfric import LuGre, Model, Variable, contact, simulate
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


@pytest.mark.slow
def test_a_run_leads_beyond_a_fold_that_is_too_sharp() -> None:
    x, v = Variable("x", "m", start=1.2), Variable("v", "m/s")
    speed = Variable("v_b", "m/s", start=0.8)
    law = LuGre(mu_s=1.5, mu_d=1.0, v_s=0.2, sigma_2=0.1)
    slip = contact("belt", law, v - speed, 1.0, {"v": speed.symbol}, F_e=-x.symbol)
    model = Model("belt", x=(x, v), p=(speed,), ode=ca.vertcat(v.symbol, -x - slip.force),
                  contacts=(slip,))  # fmt: skip
    rest = continuation(equilibrium(model), "v_b", (0.3, 0.9))
    whole = orbits_from(rest, rest.located("Hopf")[-1], (0.3, 2.0))
    (found,) = whole.special  # exact friction grazes at 1.43549791
    assert found.kind == "fold" and found.value == pytest.approx(1.4352, abs=1e-4)
    assert not whole.stable[: found.index].any() and whole.stable[-1]
    assert whole.values[-1] == pytest.approx(0.3) and "its step only" in whole.message
