"""Costs of absolute values and maxima, and further conditions, against closed forms."""

from math import asin, pi, sqrt
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from motions import double_integrator, stage
from scipy.optimize import brentq

from ocp import (
    TIME,
    Cost,
    Fatrop,
    Free,
    Legendre,
    Phase,
    Problem,
    Shooting,
    Sqp,
    absolute,
    at_end,
    complementary,
    integral,
    largest,
    load,
    soft,
    solve,
    verify,
    worst,
)
from symfric import Model, SolveError, Status, Variable

MODEL = double_integrator(4.0)
WIDE = double_integrator()
EFFORT = integral(lambda s: s.a**2)
REST = {"x": 0.0, "v": 0.0}
MOVE = {"start": REST, "end": {"x": 1.0, "v": 0.0}}


def carrier() -> Model:
    """m x'' = force."""
    x, v, force = Variable("x", "m"), Variable("v", "m/s"), Variable("force", "N")
    m = Variable("m", "kg", start=1.0)
    return Model("carrier", x=(x, v), u=(force,), p=(m,), ode=ca.vertcat(v, force / m))


def hopper() -> Model:
    """Unit mass on the ground: y'' = u + lam - 10."""
    y, v = Variable("y", "m"), Variable("v", "m/s")
    u, lam = (Variable(name, "m/s^2", nominal=10.0) for name in ("u", "lam"))
    return Model("hopper", x=(y, v), u=(u, lam), ode=ca.vertcat(v, u + lam - 10.0))


# --- absolute values and maxima -----------------------------------------------------------------


def test_least_fuel_is_bang_off_bang() -> None:
    move = solve(Problem(Phase(MODEL, 2.0, **MOVE), absolute(lambda s: s.a)))
    burn = (2.0 - sqrt(3.0)) / 2.0  # 4 burn (T - burn) = 1
    assert move.cost == pytest.approx(8.0 * burn, rel=2e-5)
    assert move.verified
    assert move.verification is not None
    assert move.verification.cost == pytest.approx(move.cost, rel=1e-6)
    off = (move.t_control > burn + 0.05) & (move.t_control < 2.0 - burn - 0.1)
    assert np.abs(move.controls["a"][off]).max() < 1e-3
    both = Problem(Phase(MODEL, 2.0, **MOVE), 2 * (absolute(lambda s: s.a, 0.5) + 0.25 * EFFORT))
    assert Problem(both.phases, both.cost).spans[0].absolutes[0].linear == 1.0


@pytest.mark.parametrize(("scheme", "N"), [(None, 7), (Legendre(2), 8)])
def test_kink_within_an_interval_is_integrated_exactly_by_the_verification(
    scheme: Legendre | None, N: int
) -> None:
    phase = Phase(WIDE, 1.0, start=REST, bounds={"a": 1.0})  # v = t
    cost = absolute(lambda s: s.v - 0.37) + at_end(lambda s: s.x)
    move = solve(Problem(phase, cost), scheme=scheme, intervals=N, refine=False, tolerance=0.1)
    exact = (0.37**2 + 0.63**2) / 2 + 0.5
    assert move.verification is not None
    assert move.verification.cost == pytest.approx(exact, abs=1e-9)
    assert move.cost == pytest.approx(exact, abs=0.5 / N**2)


def test_largest_values_of_a_motion_of_phases_and_of_scenarios() -> None:
    peak = largest(lambda s: abs(s.a))
    coarse = {"intervals": 12, "refine": False}
    alone = solve(Problem(Phase(WIDE, 2.0, **MOVE), peak), **coarse)
    assert alone.cost == pytest.approx(1.0, rel=1e-4)
    speed = solve(Problem(Phase(MODEL, 2.0, **MOVE), 3 * largest(lambda s: s.v)))
    assert speed.cost == pytest.approx(12.0 - 6.0 * sqrt(3.0), rel=1e-4)  # trapezoid of v
    assert speed.verified
    out, back = Phase(WIDE, 2.0, **MOVE), Phase(WIDE, 1.0, end=REST)
    both = solve(Problem(out >> back, peak), **coarse)
    assert both.cost == pytest.approx(4.0, rel=1e-4)  # the second phase determines it
    each = Phase(WIDE, 2.0, cost=peak, **MOVE) >> Phase(WIDE, 1.0, end=REST, cost=peak)
    assert solve(Problem(each), **coarse).cost == pytest.approx(5.0, rel=1e-4)
    masses = {"light": {"m": 1.0}, "heavy": {"m": 2.0}}
    move, force = Phase(carrier(), 2.0, **MOVE), largest(lambda s: abs(s.force))
    for cost, value in ((force, 1.5), (worst(force), 2.0)):
        found = solve(Problem(move, cost, scenarios=masses, shared=[]), **coarse)
        assert found.cost == pytest.approx(value, rel=1e-4)
        assert found.verified


def test_largest_value_between_nodes_is_the_cost_of_the_verification() -> None:
    x, v = Variable("x", "m"), Variable("v", "m/s")
    swing = Model("swing", x=(x, v), ode=ca.vertcat(v, -x))  # x = sin t
    phase = Phase(swing, pi, start={"x": 0.0, "v": 1.0})
    move = solve(Problem(phase, largest(lambda s: s.x)), intervals=3, refine=False, throw=False)
    assert move.cost < 0.998
    assert move.verification is not None
    assert move.verification.cost == pytest.approx(1.0, abs=1e-4)
    assert not move.verified
    assert solve(Problem(phase, largest(lambda s: s.x)), intervals=3).cost > 0.999


@pytest.mark.parametrize("term", [absolute(lambda s: s.a), largest(lambda s: s.v), worst(TIME)])
def test_least_upper_bounds_are_only_minimised(term: object) -> None:
    with pytest.raises(ValueError, match=r"expected a weight >= 0 of (absolute|largest|worst)"):
        _ = -1.0 * term  # pyright: ignore[reportOperatorIssue]


# --- soft conditions ----------------------------------------------------------------------------


def test_linear_penalty_is_exact_above_the_multiplier() -> None:
    # v <= 1.2 with cost a^2 / 2 over T = 1: a falls to zero in a quarter, with slope -38.4
    def found(**weights: float) -> tuple[float, float]:
        path = [soft(lambda s: s.v <= 1.2, **weights)]
        phase = Phase(WIDE, 1.0, inputs={"a": "linear"}, **MOVE)
        move = solve(Problem(phase, 0.5 * EFFORT, path=path), intervals=24, refine=False)
        assert move.verified
        (penalty,) = move.soft.values()
        assert f"largest violation {penalty.violation:.3g}" in str(move)
        return move.cost - penalty.cost, penalty.violation

    cost, violation = found(linear=40.0)
    assert cost == pytest.approx(7.68, rel=1e-3)
    assert violation < 1e-4
    assert found(linear=36.0)[1] > 1e-3
    assert 1e-4 < found(quadratic=1000.0)[1] < 0.05


@pytest.mark.parametrize(
    ("linear", "quadratic", "x"), [(100.0, 0.0, 1.0), (3.0, 0.0, 0.125), (0.0, 10.0, 20 / 44)]
)
def test_soft_end_balances_its_multiplier(
    linear: float, quadratic: float, x: float, tmp_path: Path
) -> None:
    wall = soft(lambda s: s.x == 1.0, linear=linear, quadratic=quadratic)
    phase = Phase(WIDE, 1.0, start=REST, end={"v": 0.0}, at={1.0: [wall]})
    problem = Problem(phase, EFFORT, inputs={"a": "linear"})
    move = solve(problem, intervals=10, refine=False)  # J = 12 x^2 + penalty of 1 - x
    (penalty,) = move.soft.values()
    assert penalty.violation == pytest.approx(1.0 - x, abs=1e-4)
    assert penalty.cost == pytest.approx(
        linear * (1 - x) + quadratic * (1 - x) ** 2, abs=1e-3
    )  # 12 x^2 remains
    assert move.cost - penalty.cost == pytest.approx(12 * x**2, rel=1e-3)
    move.save(tmp_path / "soft")
    again = load(tmp_path / "soft")
    assert again.soft == move.soft
    assert verify(again).ok


def test_soft_conditions_with_other_solvers_and_their_limits() -> None:
    phase = Phase(WIDE, 1.0, **MOVE)
    near = Problem(
        phase, EFFORT + largest(lambda s: s.v), path=[soft(lambda s: s.v <= 1.3, linear=9.0)]
    )
    costs = [solve(near, solver=solver, intervals=10, refine=False).cost
             for solver in (None, Fatrop(), Sqp())]  # fmt: skip
    assert np.ptp(costs) < 1e-4 * costs[0]
    with pytest.raises(ValueError, match="got soft path conditions, which need collocation points"):
        solve(near, scheme=Shooting())
    assert solve(Problem(phase, EFFORT + largest(lambda s: s.v)), scheme=Shooting()).verified
    with pytest.raises(ValueError, match=r"expected none of absolute.*, got soft conditions, larg"):
        near.to_mpc(step=0.1)


def test_soft_obstacle_and_absolute_value_agree_with_opti() -> None:
    names = ("x", "y", "v", "w", "a", "b")
    x, y, v, w, a, b = (Variable(name, "") for name in names)
    plane = Model("plane", x=(x, y, v, w), u=(a, b), ode=ca.vertcat(v, w, a, b))
    way = Phase(plane, 2.0, end={"x": 2.0, "y": 0.2, "v": 0.0, "w": 0.0})
    cost = integral(lambda s: s.a**2 + s.b**2) + absolute(lambda s: s.w - 0.3 * s.v, 2.0)
    disc = soft(lambda s: (s.x - 1.0) ** 2 + s.y**2 >= 0.25, linear=20.0, quadratic=5.0)
    found = solve(Problem(way, cost, path=[disc], inputs=dict.fromkeys("ab", "linear")),
                  intervals=20, refine=False)  # fmt: skip
    assert found.cost == pytest.approx(_plane_by_opti(24), rel=1e-3)
    assert found.verification is not None
    assert found.verification.cost == pytest.approx(found.cost, rel=5e-4)


def _plane_by_opti(N: int) -> float:
    """Return the cost with accelerations that are linear on N intervals, by Simpson's rule."""
    opti, h = ca.Opti(), 2.0 / N
    u, places, rates = (opti.variable(2, N + 1) for _ in range(3))
    total, every = 0, []
    for k in range(N):
        q, rate = places[:, k], rates[:, k]
        left, slope = u[:, k], (u[:, k + 1] - u[:, k]) / h
        for s in (0.0, 0.5 * h, h):
            force = left + s * slope
            v = rate + s * left + s**2 / 2 * slope
            p = q + s * rate + s**2 / 2 * left + s**3 / 6 * slope
            every.append((p, v, ca.sumsqr(force), (h / 6) * (4 if s == 0.5 * h else 1)))
        opti.subject_to(places[:, k + 1] == p)
        opti.subject_to(rates[:, k + 1] == v)
    slack = opti.variable(2, len(every))
    for (p, v, squares, weight), k in zip(every, range(len(every)), strict=True):
        e = v[1] - 0.3 * v[0]
        inside = 0.25 - (p[0] - 1.0) ** 2 - p[1] ** 2
        opti.subject_to(opti.bounded(-slack[0, k], e, slack[0, k]))
        opti.subject_to(inside <= slack[1, k])
        opti.subject_to(slack[1, k] >= 0)
        total += weight * (squares + 2 * slack[0, k] + 20 * slack[1, k] + 5 * slack[1, k] ** 2)
    opti.subject_to(places[:, 0] == 0)
    opti.subject_to(places[:, N] == ca.vertcat(2.0, 0.2))
    opti.subject_to(ca.horzcat(rates[:, 0], rates[:, N]) == 0)
    opti.minimize(total)
    opti.set_initial(places[0, :], 2.0 * np.linspace(0.0, 1.0, N + 1))
    opti.solver("ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes"})
    return float(opti.solve().value(total))


# --- integral and point conditions --------------------------------------------------------------


def test_total_is_a_budget() -> None:
    energy = {"energy": lambda s: s.a**2}
    phase = Phase(WIDE, Free(0.1, 10.0), start=REST, end=MOVE["end"] | {"energy": (None, 12.0)})
    fast = solve(
        Problem(phase, TIME, totals=energy, inputs={"a": "linear"}), intervals=10, refine=False
    )
    assert pytest.approx(1.0, rel=1e-4) == fast.T  # energy 12 / T^3
    assert fast["energy"][-1] == pytest.approx(12.0, rel=1e-6)
    assert fast.verified


def test_total_is_isoperimetric() -> None:
    y, u = Variable("y", "m"), Variable("u", "1")
    rope = Model("rope", x=(y,), u=(u,), ode=u.symbol)
    phase = Phase(rope, 1.0, start={"y": 0.0}, end={"y": 0.0, "length": 1.2})
    length = {"length": lambda s: ca.sqrt(1 + s.u**2)}
    area = solve(Problem(phase, -integral(lambda s: s.y), totals=length, inputs={"u": "linear"}))
    r = brentq(lambda r: 2 * r * asin(0.5 / r) - 1.2, 0.5001, 5.0)  # an arc over the chord 1
    assert -area.cost == pytest.approx((r * 1.2 - sqrt(r**2 - 0.25)) / 2, rel=1e-4)


def test_condition_at_a_fraction_equals_a_via_point() -> None:
    via = Problem(Phase(WIDE, 1.0, via={0.5: {"x": (None, 0.3)}}, **MOVE), EFFORT)
    at = Problem(Phase(WIDE, 1.0, at={0.5: [lambda s: 2 * s.x <= 0.6]}, **MOVE), EFFORT)
    costs = [solve(problem, intervals=10, refine=False).cost for problem in (via, at)]
    assert costs[0] == pytest.approx(costs[1], rel=1e-6)
    assert costs[0] > 13.0
    curve = Phase(WIDE, 1.0, at={1: [lambda s: s.x + s.v**2 == 1.0]}, start=REST)
    end = solve(Problem(curve, EFFORT), intervals=20, refine=False)
    assert end["x"][-1] + end["v"][-1] ** 2 == pytest.approx(1.0, rel=1e-6)


# --- complementary signals ----------------------------------------------------------------------


def test_lift_off_from_the_ground_is_found() -> None:
    path = [complementary(lambda s: s.y, lambda s: s.lam)]
    phase = Phase(hopper(), 1.5, start={"y": 0.0, "v": 0.0}, end={"y": 1.0, "v": 0.0})
    problem = Problem(phase, integral(lambda s: s.u**2), path=path)
    hop = solve(problem, intervals=30, refine=False)
    flight = sqrt(0.6)  # least of g^2 tau + 12 h^2 / tau^3
    assert hop.cost == pytest.approx(100 * flight + 12 / flight**3, rel=5e-3)
    assert hop.verified
    assert "eps = 1e-08, largest product 2e-08" in hop.message
    ground = hop["y"] < 1e-5
    assert hop.t[ground].max() == pytest.approx(1.5 - flight, abs=0.075)
    assert (hop["lam"] * hop["y"]).max() < 1e-6
    with pytest.raises(SolveError) as stopped:
        solve(problem, max_time=0.01)
    assert stopped.value.status is Status.TIME_LIMIT
    own = Problem(phase, problem.cost, path=path, p={"complementarity": 1e-2})
    assert "eps = 0.01" in solve(own, intervals=10, refine=False, throw=False).message
    with pytest.raises(ValueError, match=r"expected one of t, y, v, [^;]*, got q; check") as odd:
        solve(Problem(phase, integral(lambda s: s.q**2), path=path))
    assert "complementarity" not in str(odd.value)
    with pytest.raises(ValueError, match=r"got complementary.*, which need collocation points"):
        solve(problem, scheme=Shooting())
    with pytest.raises(ValueError, match=r"expected friction='smooth' with complementary"):
        solve(Problem(Phase(stage(), 1.0), integral(lambda s: s.force**2),
                      path=[complementary(lambda s: s.x, lambda s: s.v)]))  # fmt: skip


@pytest.mark.parametrize(
    ("name", "cost"),
    [("abs", integral(lambda s: abs(s.a))), ("fmax", integral(lambda s: ca.fmax(s.a, 0.0)))],
)
def test_a_kink_in_the_cost_is_named_with_its_remedy(name: str, cost: Cost) -> None:
    solution = solve(Problem(Phase(MODEL, 2.0, **MOVE), cost), throw=False)
    assert not solution.ok
    assert f"The cost contains {name}, whose derivative jumps; write absolute" in solution.message
