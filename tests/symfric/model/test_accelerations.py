"""Accelerations of models against differences of velocities and closed forms."""

import casadi as ca
import numpy as np

from symfric.foundation.parameters import Variable
from symfric.integrator import simulate
from symfric.laws import Armstrong, BrownMcPhee, LuGre
from symfric.model import Model, Output
from symfric.scenes import ALL_SCENES, FourBar, rabinowicz


def test_scenes_have_the_accelerations_of_their_positions() -> None:
    """Differences of the dense rates: of second order in h, and rounded by 1e-16 / h."""
    for name in ("rabinowicz", "drill_string", "nip", "clutch", "pendulum_box", "slider_crank"):
        scene = ALL_SCENES[name](BrownMcPhee())
        given = {n: g.function for n, g in scene.inputs.items()}
        model = scene.model()
        run = simulate(model, 0.2, u=given, rtol=1e-8, samples=5)
        found = [n for n in run.details if n.endswith("_acc")]
        moves = {v.unit for v in model.x} & {"m/s", "rad/s"}
        assert bool(found) is bool(moves), name
        assert all(run.details[n] in ("m/s^2", "rad/s^2") for n in found), name
        h, t = 1e-6, np.linspace(0.02, 0.18, 23)
        here, after, before = run.at(t), run.at(t + h), run.at(t - h)
        slopes = {v.name: (after[v.name] - before[v.name]) / (2 * h) for v in model.x}
        for n in found:  # the rate of q is the state that is the slope of q, whatever it is called
            q = n.removesuffix("_acc")
            speeds = [v.name for v in model.x if run.units[v.name] in ("m/s", "rad/s")]
            if q in speeds:  # of nothing that is a state
                rate = q
            else:
                rate = min(speeds, key=lambda r: float(np.abs(here[r] - slopes[q]).max()))
            wanted = run.of(model.expression(n), t)
            scale = max(1.0, float(np.abs(wanted).max()))
            assert np.abs(slopes[rate] - wanted).max() < 2e-3 * scale, (name, n, rate)


def test_the_acceleration_of_the_block_is_what_newton_says() -> None:
    run = simulate(rabinowicz(LuGre()), 3.0, samples=301)
    np.testing.assert_allclose(run["x_acc"], (-2.1 * run["x"] - run["friction"]) / 0.8, atol=1e-12)
    assert run.unit("x_acc") == "m/s^2"


def test_a_velocity_that_a_law_keeps_has_no_acceleration() -> None:
    model = rabinowicz(Armstrong())
    assert [v.unit for v in model.x if v.name == "w"] == ["m/s"]
    assert [*model.further] == ["x_acc"]


def test_accelerations_cost_nothing_until_they_are_asked_for() -> None:
    model = FourBar(BrownMcPhee()).model()
    run = simulate(model, 0.05, samples=3)
    assert "further" not in model.__dict__
    assert not any(n.endswith("_acc") for n in run.units)
    assert "theta_crank_acc" in run.details


def test_only_rates_that_are_states_have_accelerations_and_names_are_not_taken_twice() -> None:
    x, v, w = Variable("x", "m"), Variable("v", "m/s"), Variable("w", "V")
    model = Model(
        "own", x=(x, v, w), ode=ca.vertcat(v.symbol, -x.symbol, 2 * v.symbol),
        details=lambda: {"x_acc": Output(7.0, "m")},
    )  # fmt: skip
    assert list(model.further) == ["x_acc"]
    assert model.further["x_acc"].unit == "m"
    rate = ca.SX.sym("rate")
    implicit = Model("rc", x=(w,), xdot=rate, residual=rate + w.symbol)
    assert implicit.further == {}
    volts = Model("volts", x=(w, x), ode=ca.vertcat(x.symbol, w.symbol))
    assert {n: o.unit for n, o in volts.further.items()} == {"w_acc": "m/s", "x_acc": "V/s"}
