"""Every failure is one sentence: when, which equation, what to do; and keeps what was reached."""

import casadi as ca
import numpy as np
import pytest
from backends import each_backend

import symfric as sf
from symfric.integrator.running.diagnosis import chattering

t = ca.SX.sym("t")
x, y = sf.Variable("x", "m"), sf.Variable("y", "m", start=1.0)
X, Y = x.symbol, y.symbol


def failure(
    model: sf.Model, t_end: float = 2.0, **options: object
) -> tuple[sf.Status, str, sf.Trajectory]:
    """How a simulation fails."""
    with pytest.raises(sf.SolveError) as caught:
        sf.simulate(model, t_end, **options)  # type: ignore[arg-type]
    error = caught.value
    assert error.status is error.partial.status
    assert str(error) == error.partial.message
    assert str(error).count("\n") == 0
    return error.status, str(error), error.partial


def advancing(second: ca.SX) -> sf.Model:
    """x = t, and an equation for y that fails somewhere."""
    return sf.Model("edge", x=(x, y), ode=ca.vertcat(1, second), t=t)


NOT_FINITE = {
    "root": (ca.sqrt(1 - X), 1.0),
    "logarithm": (ca.log(1 - X), 1.0),
    "power": ((1 - X) ** 1.5, 1.0),
    "root of time": (ca.sqrt(1.5 - t), 1.5),
}


@each_backend
@pytest.mark.parametrize("case", NOT_FINITE)
def test_equation_that_turns_nan_is_named_with_its_time(case: str, backend: str) -> None:
    expression, end = NOT_FINITE[case]
    status, message, partial = failure(advancing(expression), backend=backend)
    assert status is sf.Status.NOT_FINITE
    assert message.startswith(f"simulate 'edge': stopped at t = {end:g} s: the ")
    assert "equation of y" in message
    assert "equation of x" not in message
    assert partial.step_times[-1] == pytest.approx(end, abs=1e-6)
    assert all(np.isfinite(signal).all() for signal in partial.signals.values())


@pytest.mark.parametrize(
    ("first", "second", "names"), [(1 / X, -Y, "x"), (-X, ca.log(X), "y"), (1 / X, Y / X, "x, y")]
)
def test_equations_that_are_not_finite_at_the_start_are_named(
    first: ca.SX, second: ca.SX, names: str
) -> None:
    model = sf.Model("edge", x=(x, y), ode=ca.vertcat(first, second))
    status, message, partial = failure(model)
    assert status is sf.Status.NOT_FINITE
    assert f"stopped at t = 0 s: the equation of {names} returned NaN or infinity" in message
    assert (partial.t.tolist(), partial.final["y"]) == ([0.0], 1.0)


def test_infinite_derivative_is_named_with_both_names() -> None:
    """The root of y: fine itself, vertical where the tank runs empty."""
    model = sf.Model("tank", x=(x, y), ode=ca.vertcat(1, -ca.sqrt(Y)))
    status, message, partial = failure(model, 3.0)
    assert status is sf.Status.NOT_FINITE
    assert "equation of y" in message
    assert partial.step_times[-1] == pytest.approx(2.0, abs=1e-4)


@each_backend
@pytest.mark.parametrize("power", [2, 3])
def test_unbounded_growth_is_said_with_the_state(power: int, backend: str) -> None:
    """y' = y^n from 1 is infinite at t = 1 / (n - 1)."""
    model = sf.Model("grow", x=(x, y), ode=ca.vertcat(-X, Y**power))
    status, message, partial = failure(model, backend=backend)
    assert status is sf.Status.STEP_TOO_SMALL
    assert "y = " in message
    assert "grows without bound; check signs and parameters" in message
    assert "x = " not in message
    assert partial.step_times[-1] == pytest.approx(1 / (power - 1), abs=1e-4)


def test_algebraic_equation_that_loses_its_solution_is_named() -> None:
    z = sf.Variable("z", "1", start=1.0)
    model = sf.Model("jam", x=(x,), z=(z,), ode=-z.symbol, alg=z.symbol**2 - (1 - t), t=t)
    status, message, partial = failure(model)
    assert status is sf.Status.SINGULAR
    assert "stopped at t = 1" in message
    assert "algebraic equations for z have no solution near their last one" in message
    early = partial.t < 0.99
    assert partial["z"][early] == pytest.approx(np.sqrt(1 - partial.t[early]), abs=1e-4)


def test_algebraic_unknown_that_turns_nan_is_named() -> None:
    """Though no state depends on it."""
    z = sf.Variable("z", "1")
    model = sf.Model("loose", x=(x,), z=(z,), ode=-X, alg=z.symbol - ca.log(1 - t), t=t)
    status, message, _ = failure(model)
    assert status is sf.Status.NOT_FINITE
    assert "equation of z" in message


def test_redundant_constraints_are_refused_at_the_start_by_name() -> None:
    a, b = sf.Variable("a", "N"), sf.Variable("b", "N")
    same = a.symbol + b.symbol - X
    model = sf.Model("redundant", x=(x,), z=(a, b), ode=-a.symbol, alg=ca.vertcat(same, 2 * same))
    with pytest.raises(ValueError, match="equations for a, b"):
        sf.simulate(model, 1.0, x0={"x": 1.0})


def test_discontinuity_that_stops_the_step_is_called_one() -> None:
    """Sliding on a switch a trillion times faster than the approach to it."""
    model = sf.Model("switch", x=(x,), ode=ca.if_else(X < 0.5, 1, -1e12))
    status, message, partial = failure(model)
    assert status is sf.Status.STEP_TOO_SMALL
    assert "fastest equation x; a discontinuity is near" in message
    assert "smooth form or the model an event" in message
    assert "begin nearer" not in message
    assert partial.step_times[-1] == pytest.approx(0.5, abs=1e-6)
    assert "steps below 2.2e-09 s are lost to rounding" in failure(model, 1e6 + 2.0, t_start=1e6)[1]


@each_backend
def test_number_of_attempts_is_limited(backend: str) -> None:
    model = sf.rabinowicz(sf.BrownMcPhee())
    status, message, partial = failure(model, 1000.0, max_steps=300, backend=backend)
    assert status is sf.Status.MAX_STEPS
    assert "maximum number of steps was used up" in message
    assert f"Stopped at t = {partial.step_times[-1]:g} s" in message
    attempts = partial.statistics.steps + partial.statistics.rejections
    assert 300 <= attempts < 300 + 32
    assert 0 < partial.step_times[-1] < 1000


def test_partial_result_equals_the_start_of_a_whole_one() -> None:
    model = sf.rabinowicz(sf.BrownMcPhee())
    whole = sf.simulate(model, 20.0)
    _, _, partial = failure(model, 20.0, max_steps=150, backend="vm")
    early = partial.t
    assert early.size > 10
    assert partial["x"] == pytest.approx(whole.at(early)["x"], abs=1e-12)


def test_failure_is_returned_where_nothing_is_to_be_thrown() -> None:
    run = sf.simulate(advancing(ca.sqrt(1 - X)), 2.0, throw=False)
    assert run.status is sf.Status.NOT_FINITE
    assert not run.status.ok
    assert run.t[-1] <= run.step_times[-1] < 2.0


def test_a_sign_of_ones_own_is_told_from_a_law() -> None:
    v = sf.Variable("v", "m/s", start=1.0)
    chatters = sf.Model("slide", x=(v,), ode=-ca.sign(v))
    with pytest.raises(sf.SolveError, match=r"contain sign\(\.\.\.\): use contact") as e:
        sf.simulate(chatters, 5.0, max_steps=300, backend="vm")
    assert e.value.status is sf.Status.MAX_STEPS
    assert chattering(chatters)
    assert not chattering(sf.Model("smooth", x=(v,), ode=-v.symbol))
    for law in (sf.ExactCoulomb(), sf.Karnopp()):  # of which one holds a sign of its own
        assert not chattering(sf.rabinowicz(law))
