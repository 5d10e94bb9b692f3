import casadi as ca
import pytest
from motions import double_integrator, stage

from ocp.formulation.expressions import TIME, Cost, Signals, at_end, effort, integral, track, worst
from ocp.formulation.phase import Free, Phase
from ocp.formulation.problem import Problem

MODEL = double_integrator()


def values(cost: Cost, t: float, x: float, v: float, a: float) -> list[float]:
    symbols = [MODEL.t, MODEL.vector("x"), MODEL.vector("u")]
    f = ca.Function("f", symbols, list(cost.expressions(MODEL)))
    return [float(value) for value in f(t, [x, v], a)]


def test_costs_add_up_and_take_weights() -> None:
    cost = 2 * integral(lambda s: s.a**2) + at_end(lambda s: s.x) * 3 + 0.5 * TIME
    assert values(cost, t=10.0, x=7.0, v=0.0, a=3.0) == [18.0, 26.0]
    assert values(2 * cost, t=10.0, x=7.0, v=0.0, a=3.0) == [36.0, 52.0]


def test_costs_are_taken_away_divided_and_summed() -> None:
    cost = integral(lambda s: s.a) - at_end(lambda s: s.x) / 2
    assert values(sum([cost, -TIME]), t=10.0, x=7.0, v=0.0, a=3.0) == [3.0, -13.5]
    with pytest.raises(ValueError, match="expected a divisor that is not zero"):
        _ = TIME / 0.0


@pytest.mark.parametrize(
    ("reference", "there"),
    [(2.0, 2.0), ("v", -1.0), (lambda s: 0.1 * s.t, 1.0), (lambda s: ca.sin(s.v), -0.8414709848)],
)
def test_tracking_is_a_square_that_is_kept(reference: object, there: float) -> None:
    cost = 3.0 * track("x", reference, 4.0) + effort("a", 0.5) + integral(lambda s: s.v)
    expected = 12.0 * (7.0 - there) ** 2 + 0.5 * 9.0 - 1.0
    assert values(cost, t=10.0, x=7.0, v=-1.0, a=3.0) == pytest.approx([expected, 0.0])
    (weight, residual), (other, signal) = cost.residuals(MODEL)
    assert (weight, other) == (12.0, 0.5)
    f = ca.Function("f", [MODEL.t, MODEL.vector("x")], [residual])
    assert float(f(10.0, [7.0, -1.0])) == pytest.approx(7.0 - there)
    assert ca.is_equal(signal**2, MODEL.u[0].symbol ** 2, 2)


def test_reference_that_no_model_has_is_a_parameter_of_the_problem() -> None:
    phase = Phase(MODEL, 0.2)
    (span,) = Problem(phase, track("x", "goal", 900.0), p={"goal": 0.1}).spans
    assert [v.name for v in span.model.p] == ["goal"]
    assert span.p.tolist() == [0.1]
    ((_, residual),) = span.squares
    f = ca.Function("f", span.symbols, [residual])
    assert float(f(0.0, [0.4, 0.0], [], 0.0, 0.1)) == pytest.approx(0.3)
    other = Problem(
        phase >> phase, track("x", "goal", 1.0), scenarios={"a": {"goal": 1.0}, "b": {"goal": 2.0}}
    )
    assert [span.p.tolist() for span in other.spans] == [[1.0], [1.0], [2.0], [2.0]]
    assert other.spans[0].model is other.spans[3].model is not MODEL


def test_worst_is_the_largest_of_all_scenarios() -> None:
    phase = Phase(stage(free=["mu_d"]), Free(1.0, 2.0))
    scenarios = {"dry": {"mu_d": 5.0}, "oiled": {"mu_d": 3.0}}
    assert Problem(phase, worst(TIME), scenarios=scenarios).kind == "worst"
    assert Problem(phase, 2.0 * worst(TIME), scenarios=scenarios).kind == "worst"
    assert Problem(phase, TIME, scenarios=scenarios).kind == "mean"
    assert Problem(phase, worst(TIME)).kind == "sum"


def test_worst_goes_round_the_whole_cost() -> None:
    with pytest.raises(ValueError, match=r"write worst\(a \+ b\)"):
        _ = worst(TIME) + TIME
    with pytest.raises(ValueError, match="expected a weight >= 0 of worst"):
        _ = -1.0 * worst(TIME)
    with pytest.raises(ValueError, match="worst: expected a cost made of"):
        worst(lambda s: s.x)  # pyright: ignore[reportArgumentType]


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


@pytest.mark.parametrize("make", [integral, at_end])
def test_cost_that_is_no_function_is_refused(make: object) -> None:
    with pytest.raises(ValueError, match="expected a function of the signals"):
        make("x")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("", 0.0, 1.0), "track: expected the name of a signal"),
        (("x", 0.0, 0.0), "track: weight: expected a number > 0"),
        (("x", None, 1.0), "track: reference: .* or a function, or a name"),
    ],
)
def test_bad_tracking_is_refused(arguments: tuple[object, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        track(*arguments)


def test_only_costs_add_up() -> None:
    with pytest.raises(TypeError, match="unsupported operand"):
        _ = TIME + 1
