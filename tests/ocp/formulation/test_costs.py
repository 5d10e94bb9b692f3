"""Costs as expressions, and their sizes."""

from typing import Any

import casadi as ca
import pytest
from discretised import dae
from motions import double_integrator, stage

from ocp import Ipopt, solve
from ocp.formulation.expressions import TIME, Cost, Signals, at_end, effort, integral, track, worst
from ocp.formulation.phase import Free, Phase
from ocp.formulation.problem import Problem, cost_size, sized
from ocp.formulation.validate import doubts
from symfric import Model, Variable

MODEL = double_integrator()


def values(cost: Cost, t: float, x: float, v: float, a: float) -> list[float]:
    symbols = [MODEL.t, MODEL.vector("x"), MODEL.vector("u")]
    f = ca.Function("f", symbols, list(cost.expressions(Signals(MODEL))))
    return [float(value) for value in f(t, [x, v], a)]


def test_costs_are_added_weighted_and_divided() -> None:
    cost = 2 * integral(lambda s: s.a**2) + at_end(lambda s: s.x) * 3 + 0.5 * TIME
    assert values(2 * cost, t=10.0, x=7.0, v=0.0, a=3.0) == [36.0, 52.0]
    cost = integral(lambda s: s.a) - at_end(lambda s: s.x) / 2
    assert values(sum([cost, -TIME]), t=10.0, x=7.0, v=0.0, a=3.0) == [3.0, -13.5]


@pytest.mark.parametrize(
    ("reference", "there"),
    [(2.0, 2.0), ("v", -1.0), (lambda s: 0.1 * s.t, 1.0), (lambda s: ca.sin(s.v), -0.8414709848)],
)
def test_tracking_is_a_square_that_is_kept(reference: object, there: float) -> None:
    cost = 3.0 * track("x", reference, 4.0) + effort("a", 0.5) + integral(lambda s: s.v)
    expected = 12.0 * (7.0 - there) ** 2 + 0.5 * 9.0 - 1.0
    assert values(cost, t=10.0, x=7.0, v=-1.0, a=3.0) == pytest.approx([expected, 0.0])
    (weight, residual), (other, signal) = cost.residuals(Signals(MODEL))
    assert (weight, other) == (12.0, 0.5)
    f = ca.Function("f", [MODEL.t, MODEL.vector("x")], [residual])
    assert float(f(10.0, [7.0, -1.0])) == pytest.approx(7.0 - there)
    assert ca.is_equal(signal**2, MODEL.u[0].symbol ** 2, 2)


def test_unknown_reference_is_a_parameter_of_the_problem() -> None:
    phase = Phase(MODEL, 0.2)
    (span,) = Problem(phase, track("x", "goal", 900.0), p={"goal": 0.1}).spans
    assert [v.name for v in span.model.p] == ["goal"]
    assert span.p.tolist() == [0.1]
    ((_, residual),) = span.squares
    f = ca.Function("f", span.symbols, [residual])
    assert float(f(0.0, [0.4, 0.0], [], 0.0, 0.1)) == pytest.approx(0.3)
    goals = {"a": {"goal": 1.0}, "b": {"goal": 2.0}}
    other = Problem(phase >> phase, track("x", "goal", 1.0), scenarios=goals)
    assert [span.p.tolist() for span in other.spans] == [[1.0], [1.0], [2.0], [2.0]]
    assert other.spans[0].model is other.spans[3].model is not MODEL


def test_worst_is_the_largest_of_all_scenarios() -> None:
    phase = Phase(stage(free=["mu_d"]), Free(1.0, 2.0))
    scenarios = {"dry": {"mu_d": 5.0}, "oiled": {"mu_d": 3.0}}
    assert Problem(phase, 2.0 * worst(TIME), scenarios=scenarios).kind == "worst"
    assert Problem(phase, TIME, scenarios=scenarios).kind == "mean"
    assert Problem(phase, worst(TIME)).kind == "sum"


def test_signals_are_states_inputs_parameters_outputs_and_time() -> None:
    model = stage(free=["m"])
    signals = Signals(model)
    for found, symbol in ((signals.force, model.u[0]), (signals["m"], model.p[0])):
        assert ca.is_equal(found, symbol.symbol)
    assert ca.is_equal(signals.t, model.t)
    assert ca.depends_on(signals.friction, model.x[1].symbol)


# --- sizes --------------------------------------------------------------------------------------

SIZES = [1e-9, 1e6]


def move(size: float, nominal: float = 1.0, **more: object) -> Problem:
    """2 kg over `size` [m] from rest to rest in 1 s."""
    x, v = Variable("x", "m", nominal=nominal), Variable("v", "m/s")
    u = Variable("u", "N")
    model = Model("mass", x=(x, v), u=(u,), ode=ca.vertcat(v.symbol, u.symbol / 2.0))
    end = {"x": size, "v": 0.0}
    return Problem(Phase(model, 1.0, end=end), integral(lambda s: s.u**2), **more)  # type: ignore[arg-type]


def nominals(problem: Problem) -> dict[str, float]:
    model = problem.chain[0].model
    return {v.name: v.nominal for v in (*model.x, *model.u)}


def test_moves_are_solved_alike_at_every_size() -> None:
    """Least effort is 48 size^2, and the fastest move with |u| <= 2 size takes 2 s."""
    found = [solve(move(size), intervals=20, refine=False) for size in SIZES]
    costs = [one.cost / (48.0 * size**2) for one, size in zip(found, SIZES, strict=True)]
    assert all(one.verified for one in found)
    assert costs[0] == pytest.approx(costs[1], rel=1e-9)
    assert costs[1] == pytest.approx(1.0 / (1 - 1 / 20**2), rel=1e-6)
    assert len({one.iterations for one in found}) == 1
    for size in SIZES:
        phase = Phase(move(size).chain[0].model, Free(0.1, 20.0), end={"x": size, "v": 0.0})
        problem = Problem(phase, TIME, bounds={"u": (-2.0 * size, 2.0 * size)})
        assert solve(problem, intervals=10, refine=False).cost == pytest.approx(2.0, rel=1e-6), size
    options = {"solver": Ipopt(obj_scaling_factor=1e11), "intervals": 20, "refine": False}
    found = solve(move(1e-6), **options)  # options of the user override
    assert found.cost == pytest.approx(1e-12 * 48.0 * costs[1], rel=1e-6)


def test_sizes_follow_from_ends_bounds_and_equations_unless_near() -> None:
    assert nominals(sized(move(1e-6))) == pytest.approx({"x": 1e-6, "v": 1e-6, "u": 2e-6})
    assert cost_size(sized(move(1e-6))) == pytest.approx(4e-12)
    assert nominals(sized(move(1.0, bounds={"u": (-5e3, 2e3)})))["u"] == 5e3
    assert nominals(sized(move(1e-6, bounds={"u": (-0.02, 0.02)})))["u"] == 0.02
    for problem in (move(1.0), move(0.02), move(50.0), move(1e4, nominal=10.0)):
        assert sized(problem) is problem


# --- doubts: ends and bounds in another unit than the model's -----------------------------------


def cart(reach: float, most: float) -> Problem:
    x, v = Variable("x", "m", nominal=0.1), Variable("v", "m/s", nominal=0.5)
    f = Variable("force", "N", nominal=20.0)
    model = Model("cart", x=(x, v), u=(f,), ode=ca.vertcat(v.symbol, f.symbol))
    phase = Phase(model, 1.0, start={"v": 0.0}, end={"x": reach, "v": 0.0}, name="go")
    return Problem(phase, integral(lambda s: s.force**2), bounds={"force": (-most, most)})


@pytest.mark.parametrize(
    ("reach", "most", "text"),
    [
        (0.3, 40.0, ""),
        (29.0, 0.07, ""),
        (0.0, 40.0, ""),
        (0.3, 0.0, ""),
        (300.0, 40.0, "end: x = 300 m is 3000 times its nominal 0.1 m: check the unit."),
        (0.3, 0.04, "bounds: force = 0.04 N is 500 times less than its nominal 20 N"),
    ],
)
def test_odd_sizes_are_doubted(reach: float, most: float, text: str) -> None:
    assert text in doubts(cart(reach, most))
    assert bool(doubts(cart(reach, most))) == bool(text)
    algebraic = Problem(Phase(dae(), 1.0, end={"z": 3000.0}), effort("u"))
    assert "z = 3000 N is 1000 times its nominal 3 N" in doubts(algebraic)


def test_doubts_follow_only_a_failed_solve() -> None:
    options: dict[str, Any] = {"throw": False, "intervals": 5, "refine": False}
    assert solve(cart(300.0, 40.0), **options).message.endswith("check the unit.")
    assert "check the unit" not in solve(cart(300.0, 4000.0), **options).message


def test_duration_at_its_lower_bound_is_reported() -> None:
    x, v = Variable("x", "m"), Variable("v", "m/s")
    model = Model("point", x=(x,), u=(v,), ode=v.symbol)
    moving, idle = (
        Problem(Phase(model, Free(0.1, 3.0), end=end), TIME, bounds={"v": (-1.0, 1.0)})
        for end in ({"x": 0.3}, {})
    )
    assert "lower bound" not in str(solve(moving, intervals=5))
    assert "T is at its lower bound, 0.1 s" in str(solve(idle, intervals=5))
