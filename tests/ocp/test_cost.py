import casadi as ca
import pytest
from motions import double_integrator, stage

from ocp import TIME, Cost, at_end, integral
from ocp.cost import Signals


def values(cost: Cost, t: float, x: float, v: float, a: float) -> list[float]:
    model = double_integrator()
    symbols = [model.t, model.vector("x"), model.vector("u")]
    f = ca.Function("f", symbols, list(cost.expressions(model)))
    return [float(value) for value in f(t, [x, v], a)]


def test_costs_add_up_and_take_weights() -> None:
    cost = 2 * integral(lambda s: s.a**2) + at_end(lambda s: s.x) * 3 + 0.5 * TIME
    assert values(cost, t=10.0, x=7.0, v=0.0, a=3.0) == [18.0, 26.0]
    assert values(2 * cost, t=10.0, x=7.0, v=0.0, a=3.0) == [36.0, 52.0]


def test_signals_are_states_inputs_parameters_outputs_and_time() -> None:
    model = stage(free=["m"])
    signals = Signals(model)
    assert ca.is_equal(signals.force, model.u[0].symbol)
    assert ca.is_equal(signals["m"], model.p[0].symbol)
    assert ca.is_equal(signals.t, model.t)
    assert ca.depends_on(signals.friction, model.x[1].symbol)


def test_unknown_signal_offers_the_closest() -> None:
    with pytest.raises(ValueError, match=r"got forse; did you mean force\?"):
        integral(lambda s: s.forse).expressions(stage())


def test_cost_of_a_vector_is_refused() -> None:
    with pytest.raises(
        ValueError, match=r"that returns one expression, .*, got the expression .* of shape"
    ):
        integral(lambda s: ca.vertcat(s.x, s.v)).expressions(stage())


@pytest.mark.parametrize("make", [integral, at_end])
def test_cost_that_is_no_function_is_refused(make: object) -> None:
    with pytest.raises(ValueError, match="expected a function of the signals"):
        make("x")


def test_only_costs_add_up() -> None:
    with pytest.raises(TypeError, match="unsupported operand"):
        _ = TIME + 1
