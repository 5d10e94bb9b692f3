"""`measure_error` reports the errors of derivatives."""

import casadi as ca
import numpy as np
import pytest

from symfric import BrownMcPhee, Hold, Model, Trajectory, Variable, contact, simulate
from symfric.integrator.simulate import differences_of_derivatives
from symfric.model import Event
from symfric.scenes import rabinowicz


def decaying(size: float) -> Model:
    """x = x_0 e^(-k t) of this size with a state that nothing moves."""
    x, k, still = (
        Variable("x", "m", nominal=size),
        Variable("k", "1/s", start=2.0),
        Variable("still", "m"),
    )
    return Model("decay", x=(x, still), p=(k,), ode=ca.vertcat(-k.symbol * x.symbol, 0.0))


@pytest.mark.parametrize("size", [1.0, 1e-9])
def test_the_measured_error_is_the_error_against_the_closed_form(size: float) -> None:
    requested = ["k", "x0.x"]
    run = simulate(
        decaying(size), 3.0, x0={"x": size}, rtol=1e-5, sensitivities=requested, measure_error=True
    )
    exact = {"k": -size * run.t * np.exp(-2 * run.t), "x0.x": np.exp(-2 * run.t)}
    assert {*run.statistics.sensitivity_errors} == {*requested}
    for name, measured in run.statistics.sensitivity_errors.items():
        off = np.abs(run.sensitivities[name]["x"] - exact[name]).max() / np.abs(exact[name]).max()
        assert measured == pytest.approx(off, rel=0.1), name
        assert 1e-7 < off < 1e-4


def shaken() -> Model:
    """A block shaken so hard that it crosses the steep part of its friction within a step."""
    x, v, pull = Variable("x", "m"), Variable("v", "m/s"), Variable("pull", "N")
    mass = Variable("mass", "kg", start=2.0, nominal=2.0)
    slip = contact("floor", BrownMcPhee(v_t=1e-3), v.symbol, 20.0)
    rate = (pull.symbol - 50.0 * x.symbol - slip.force) / mass.symbol
    ode = ca.vertcat(v.symbol, rate)
    return Model("shaken", x=(x, v), u=(pull,), p=(mass,), ode=ode, contacts=(slip,))


DRIVE = {"pull": lambda t: 400 * ca.sin(60 * t)}


def off(run: Trajectory, truth: Trajectory) -> float:
    """Largest error of the derivatives of both states."""
    one, other = run.sensitivities["mass"], truth.sensitivities["mass"]
    return max(float(np.abs(one[s] - other[s]).max() / np.abs(other[s]).max()) for s in "xv")


def test_the_measured_error_is_that_of_differences_of_runs() -> None:
    model = shaken()
    exact = simulate(model, 0.5, u=DRIVE, rtol=1e-11, sensitivities=["mass"])
    runs = [simulate(model, 0.5, u=DRIVE, rtol=1e-12, p={"mass": 2.0 + d}) for d in (1e-4, -1e-4)]
    slope = (runs[0]["x"] - runs[1]["x"]) / 2e-4
    assert np.abs(slope - exact.sensitivities["mass"]["x"]).max() < 1e-6 * np.abs(slope).max()
    for method in ("auto", "radau5", "rodas5p"):
        run = simulate(
            model, 0.5, u=DRIVE, method=method, sensitivities=["mass"], measure_error=True
        )
        measured = run.statistics.sensitivity_errors["mass"]
        assert measured == pytest.approx(off(run, exact), rel=0.5), method
        assert f"of derivatives by mass {measured:.0e}" in repr(run)


def test_steps_see_the_steep_part_of_friction_where_they_are_differentiated() -> None:
    """No step is longer than half its width there, except for the curvature of the path."""
    model = shaken()
    (slip,) = model.monitors
    ways = dict[str, float]()
    for method in ("auto", "radau5"):
        run = simulate(model, 0.5, u=DRIVE, method=method, sensitivities=["mass"])
        v = run.at(run.step_times)["v"]
        nearest = np.where(v[1:] * v[:-1] > 0, np.minimum(np.abs(v[1:]), np.abs(v[:-1])), 0.0)
        ways[method] = float((np.abs(np.diff(v)) / (float(slip.nominal) + nearest)).max())
    assert ways["auto"] <= 0.5 < 1.0 < ways["radau5"] <= 4.0


def test_a_method_that_is_named_takes_the_steps_of_a_run_without_derivatives() -> None:
    model = rabinowicz(BrownMcPhee(), free=["k"])
    one, other = (
        simulate(model, 3.0, method="radau5", sensitivities=names) for names in ((), ("k",))
    )
    assert (one["x"] == other["x"]).all() and one.statistics.steps == other.statistics.steps


def test_derivatives_are_compared_on_the_same_side_of_events() -> None:
    """That of the velocity changes its sign where a ball bounces."""
    x, v, drag = Variable("x", "m"), Variable("v", "m/s"), Variable("drag", "1/m", start=0.3)
    bounce = Event("bounce", x.symbol, direction=-1, reset={"v": -0.8 * v.symbol})
    falling = ca.vertcat(v.symbol, -9.81 - drag.symbol * v.symbol * ca.sqrt(1 + v.symbol**2))
    model = Model("ball", x=(x, v), p=(drag,), ode=falling, events=(bounce,))

    def runs(at: list[float] | None = None) -> list[Trajectory]:
        return [
            simulate(model, 2.0, x0={"x": 1.0}, rtol=r, sensitivities=["drag"], t_eval=at)
            for r in (1e-5, 1e-9)
        ]

    whole = runs()
    pairs = list(zip(*([t for t, _ in run.happened] for run in whole), strict=True))
    assert len(pairs) == 4 and all(one != other for one, other in pairs)
    between = [(one + other) / 2 for one, other in pairs]
    found = runs(sorted([*whole[0].t[1::20], *between]))
    slopes = [run.sensitivities["drag"]["v"] for run in found]
    assert np.abs(slopes[0] - slopes[1]).max() > 0.2 * np.abs(slopes[1]).max()
    for both in (whole, found):
        assert differences_of_derivatives(model, ["drag"], *both)["drag"] < 1e-4


def test_an_event_at_a_jump_of_an_input_leaves_derivatives_without_an_error() -> None:
    x, u = Variable("x", "m"), Variable("u", "m/s")
    model = Model("filled", x=(x,), u=(u,), ode=u.symbol, events=(Event("full", x - 1.0),))
    push = {"u": Hold([0.0, 1.0], [1.0, 2.0])}
    run = simulate(model, 2.0, u=push, sensitivities=["x0.x"], measure_error=True)
    with pytest.raises(ValueError, match="apart from the jumps of the inputs"):
        _ = run.sensitivities
    assert np.isnan(run.statistics.sensitivity_errors["x0.x"])
