"""Costates, multipliers and the Hamiltonian against closed forms and re-solves."""

from typing import Any

import casadi as ca
import numpy as np
import pytest
from carts import CART, EFFORT, SCHEMES, F, V, X, fastest, move, slope, touching
from phases import solve_once
from scipy.integrate import solve_ivp

from ocp import Free, Phase, Problem, Radau, at_end, integral, solve, worst
from ocp.transcription.schemes import Scheme
from symfric import Model
from symfric.model import Output
from symfric.multibody import JointSpringDamper, Mechanism, Prismatic, Revolute

# --- costates -----------------------------------------------------------------------------------


@pytest.mark.parametrize("scheme", SCHEMES)
def test_costates_of_least_effort_are_those_of_the_closed_form(scheme: Scheme) -> None:
    """x = 3 t^2 - 2 t^3, so a = m (6 - 12 t): the costates are -2 m a and its integral, -24 m^2.

    Constant inputs on N intervals multiply all costs of a force that is linear in time by the same
    factor 1 / (1 - 1 / N^2).
    """
    N = 20
    found = solve_once(move(), N, scheme)
    factor = 1 / (1 - 1 / N**2)
    np.testing.assert_allclose(found.cost, 48 * factor, rtol=1e-8)
    np.testing.assert_allclose(found.costates["x"], -96 * factor, rtol=1e-7)
    wanted = -48 * factor * (1 - 2 * found.t)
    at = found.motions[0].nodes if scheme == Radau(3) else np.ones(found.t.size, bool)
    np.testing.assert_allclose(found.costates["v"][at], wanted[at], atol=1e-5)
    np.testing.assert_allclose(found.hamiltonian, -144 * factor, rtol=1e-7)
    np.testing.assert_allclose(found.sensitivity("T").cost, -144 * factor, rtol=1e-7)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_costates_at_the_start_are_derivatives_by_the_start_values(scheme: Scheme) -> None:
    found = solve_once(move(k=30.0), 8, scheme)
    for name in "xv":
        wanted = slope(lambda **p: move(k=30.0, **p), name, 0.0, 8, scheme)[0]
        np.testing.assert_allclose(found.costates[name][0], wanted, rtol=1e-6)
        there = {f"{name} at the start": found.costates[name][0]}
        there[f"{name} at the end"] = -found.costates[name][-1]
        for condition in found.active():
            if condition.name in there:
                np.testing.assert_allclose(condition.multiplier, there.pop(condition.name))
        assert not there


def test_costates_of_a_regulator_are_those_of_its_riccati_equation() -> None:
    """J = int (x^2 + v^2 + a^2) dt + 3 x(T)^2: the costate is 2 P(t) (x, v)."""
    running = integral(lambda s: s.x**2 + s.v**2 + s.a**2)
    phase = Phase(CART, 2.0, start={"x": 1.0, "v": 0.0}, p={"m": 1.0, "k": 0.5})
    found = solve_once(Problem(phase, running + at_end(lambda s: 3 * s.x**2)), 100)
    A, B = np.array([[0.0, 1.0], [-0.5, 0.0]]), np.array([[0.0], [1.0]])

    def backwards(_: float, flat: Any) -> Any:
        P = flat.reshape(2, 2)
        return (np.eye(2) + A.T @ P + P @ A - P @ B @ B.T @ P).ravel()

    run = solve_ivp(backwards, (0.0, 2.0), [3.0, 0.0, 0.0, 0.0], rtol=1e-10, atol=1e-12,
                    dense_output=True)  # fmt: skip
    states = np.array([found["x"], found["v"]])
    P = run.sol(2.0 - found.t).T.reshape(-1, 2, 2)
    wanted = 2 * np.einsum("tij,jt->it", P, states)
    for name, row in zip("xv", wanted, strict=True):
        np.testing.assert_allclose(found.costates[name], row, atol=2e-4)


def test_costates_jump_where_a_state_touches_its_bound() -> None:
    """Bryson-Denham: J = 4 / (9 l), costates 2 / (9 l^2) and 2 / (3 l) at the start."""
    found = solve_once(touching(), 60)
    x = found.costates["x"]
    np.testing.assert_allclose(x[found.t < 0.3], 18.0, rtol=3e-3)
    np.testing.assert_allclose(x[(found.t > 0.36) & (found.t < 0.64)], 0.0, atol=0.05)
    np.testing.assert_allclose(x[found.t > 0.7], -18.0, rtol=3e-3)
    np.testing.assert_allclose(found.costates["v"][0], 6.0, rtol=2e-3)
    first, last = [one for one in found.active() if one.side == "upper"]
    assert (first.name, first.unit, first.value) == ("the bound on x", "cost/m", 1 / 9)
    np.testing.assert_allclose([first.begin, last.end], [1 / 3, 2 / 3], atol=0.04)
    total = first.multiplier + last.multiplier
    np.testing.assert_allclose(total, -36.0, rtol=5e-3)
    np.testing.assert_allclose(total, found.sensitivity("upper bound on x").cost, rtol=1e-4)
    assert "weakly active: the bound on x" in found.sensitivity("k").doubts[0]


def mechanism(x: float = 0.0, phi: float = 0.0, T: float = 1.5) -> Problem:
    made = Mechanism("gantry", gravity=(0.0, 0.0, -9.81))
    made.body("cart", 1.0, (1e-3,) * 3)
    made.body("bob", 0.3, (1e-3,) * 3)
    rail, hinge = {"z": (1.0, 0.0, 0.0), "x": (0.0, 1.0, 0.0)}, {"z": (0.0, -1.0, 0.0)}
    made.frame("ground.p", **rail)
    made.frame("cart.p", **rail)
    made.frame("cart.h", **hinge, x=(0.0, 0.0, -1.0))
    made.frame("bob.h", at=(0.0, 0.0, 0.5), **hinge, x=(0.0, 0.0, -1.0))
    made.joint(Prismatic("x", "ground.p", "cart.p", start=0.0))
    made.joint(Revolute("phi", "cart.h", "bob.h", start=0.0))
    force = made.input("f", "N", nominal=1.0)
    made.force(JointSpringDamper("motor", "x", actuator=force))
    rest = {"x": 0.0, "phi": 0.0, "x_rate": 0.0, "phi_rate": 0.0}
    phase = Phase(
        made.build(), T, start=rest | {"x": x, "phi": phi}, end=rest | {"x": 0.5, "phi": 0.1}
    )
    return Problem(phase, integral(lambda s: s.f**2))


def test_costates_of_a_mechanism_account_for_its_mass_matrix() -> None:
    found = solve_once(mechanism(), 30)
    for name in ("x", "phi"):
        wanted = slope(mechanism, name, 0.0, 30, Radau(3))[0]
        np.testing.assert_allclose(found.costates[name][0], wanted, rtol=1e-6)
    np.testing.assert_allclose(found.costates["x"], found.costates["x"][0], rtol=1e-6)
    nodes = found.motions[0].nodes  # the costates are continuous over nodes and points
    for name in ("phi", "x_rate", "phi_rate"):
        inside = np.interp(found.t[nodes], found.t[~nodes], found.costates[name][~nodes])
        error = np.abs(inside - found.costates[name][nodes])[1:-1]
        assert error.max() < 0.02 * np.ptp(found.costates[name])
    wanted = slope(mechanism, "T", 1.5, 30, Radau(3))[0]
    np.testing.assert_allclose(found.sensitivity("T").cost, wanted, rtol=1e-6)
    np.testing.assert_allclose(found.hamiltonian, wanted, rtol=4e-3)


def test_bang_bang_motions_have_no_degrees_of_freedom() -> None:
    """The interior-point method ends with many forces near the switch inside their bounds."""
    for N in (31, 61):
        found = solve_once(fastest(), N)
        assert found.condition.degrees_of_freedom == 0
        assert found.condition.sufficient
        by = found.sensitivity("x at the end")
        np.testing.assert_allclose([by.cost, by.T], np.sqrt(0.3), rtol=1e-3)
        high = found.sensitivity("upper bound on a").cost
        np.testing.assert_allclose(high, -0.02 / found.T, rtol=0.04)
        np.testing.assert_allclose(by.cost, by.T, rtol=1e-6)


# --- multipliers --------------------------------------------------------------------------------


def test_hamiltonian_of_the_fastest_motion_is_zero() -> None:
    """T^2 = 2 m d (1 / F+ + 1 / F-), so dT/dd = T / (2 d) and so on."""
    found = solve_once(fastest(), 41)
    T = np.sqrt(2 * 2.0 * 1.0 * (1 / 10 + 1 / 5))
    np.testing.assert_allclose(found.T, T, rtol=1e-3)
    assert np.abs(found.hamiltonian).max() < 0.03
    by = {name: found.sensitivity(name) for name in ("m", "x at the end", "upper bound on a")}
    np.testing.assert_allclose([by["m"].cost, by["m"].T], T / 4, rtol=1e-3)
    np.testing.assert_allclose(by["x at the end"].T, T / 2, rtol=1e-3)
    np.testing.assert_allclose(by["upper bound on a"].T, -2 / 100 / T, rtol=0.05)
    high, low = (one for one in found.active() if one.name == "the bound on a")
    assert (high.side, low.side, high.begin) == ("upper", "lower", 0.0)
    np.testing.assert_allclose(low.end, found.T, rtol=1e-6)
    np.testing.assert_allclose(high.end, T / 3, atol=found.T / 41)
    assert "active: a <= 10 (0 ... " in str(found)
    assert "the bound on a" in str(found.active())


CONDITIONS: dict[str, tuple[dict[str, Any], str, str]] = {
    "path condition 1": ({"path": [lambda s: s.v**2 <= 1.44]}, "cost", "upper"),
    "the bound on power": ({"bounds": {"power": (None, 2.0)}}, "cost/W", "upper"),
    "the bound on a_rate": (
        {"rates": {"a": (-70.0, 70.0)}, "start": {"x": 0.0, "v": 0.0, "a": 0.0}},
        "cost/(N/s)",
        "upper",
    ),
    "x at 0.5 T": ({"via": {0.5: {"x": 0.4}}}, "cost/m", "="),
    "power at the end": ({"end": {"x": 1.0, "power": -0.5}}, "cost/W", "="),
}


@pytest.mark.parametrize("name", CONDITIONS)
def test_multipliers_of_conditions_have_names_and_units(name: str) -> None:
    fields, unit, side = CONDITIONS[name]
    power = Output(V.symbol * F.symbol, "W")
    model = Model("cart", x=(X, V), u=(F,), ode=ca.vertcat(V.symbol, F.symbol),
                  outputs={"power": power})  # fmt: skip
    rest = {"x": 0.0, "v": 0.0}
    known: dict[str, Any] = {"start": rest, "end": rest | {"x": 1.0}} | fields
    found = solve_once(Problem(Phase(model, 1.0, **known), EFFORT), 10)
    hits = [one for one in found.active() if one.name == name and one.side == side]
    assert hits and {one.unit for one in hits} == {unit}
    assert abs(sum(one.multiplier for one in hits)) > 1e-3


def test_multipliers_of_phases_links_and_sums_of_durations() -> None:
    """Two equal halves in 2 s: dJ/dT = -H, and the jump of a link acts as a change of position."""

    def two(total: float = 2.0, jump: float = 0.1) -> Problem:
        rest = {"x": 0.0, "v": 0.0}
        first = Phase(CART, Free(0.5, 1.5), start=rest, p={"m": 1.0})
        last = Phase(CART, Free(0.5, 1.5), end=rest | {"x": 1.0}, p={"m": 1.0},
                     link={"x": lambda before: before.x + jump})  # fmt: skip
        return Problem(first >> last, EFFORT, durations=[((0, 1), total)])

    found = solve_once(two(), 10)
    conditions = {one.name: one for one in found.active()}
    total = conditions["the duration"]
    assert (total.unit, total.begin, total.end) == ("cost/s", 0.0, 2.0)
    for name, condition, value in (("total", total, 2.0),
                                   ("jump", conditions["the start of x"], 0.1)):  # fmt: skip
        wanted = slope(two, name, value, 10, Radau(3))[0]
        np.testing.assert_allclose(condition.multiplier, wanted, rtol=1e-5)
    np.testing.assert_allclose(found.hamiltonian, total.multiplier, rtol=1e-6)
    by = found.sensitivity("T")
    np.testing.assert_allclose([by.cost, by.T], [total.multiplier, 1.0], rtol=1e-6)
    assert found.costates["x"].shape == found.t.shape


def test_multipliers_belong_to_the_scaled_problem_of_the_user() -> None:
    """A move in micrometres and meganewtons, whose unknowns and cost `solve` scales itself."""
    phase = Phase(CART, 1.0, start={"x": 0.0, "v": 0.0}, end={"x": 1e-6, "v": 0.0}, p={"m": 1e6})
    found = solve(Problem(phase, EFFORT), intervals=20, refine=False)
    np.testing.assert_allclose(found.cost, 12.0, rtol=3e-3)
    np.testing.assert_allclose(found.costates["x"][0], -24e6, rtol=3e-3)
    np.testing.assert_allclose(found.sensitivity("x at the end").cost, 24e6, rtol=3e-3)


@pytest.mark.parametrize("largest", [True, False])
def test_multipliers_of_scenarios_add_up_to_the_derivative_of_their_common_cost(
    largest: bool,
) -> None:
    def both(x: float = 0.0) -> Problem:
        phase = Phase(CART, 1.0, start={"x": x, "v": 0.0}, p={"k": 1.0})
        cost = EFFORT + 100 * at_end(lambda s: (s.x - 1) ** 2 + s.v**2)
        scenarios = {"light": {"m": 1.0}, "heavy": {"m": 3.0}}
        return Problem(phase, worst(cost) if largest else cost, scenarios=scenarios)

    found = solve_once(both(), 6)
    each = {one.scenario: one for one in found.active() if one.name == "x at the start"}
    total = sum(one.multiplier for one in each.values())
    np.testing.assert_allclose(total, slope(both, "x", 0.0, 6, Radau(3))[0], rtol=1e-5)
    np.testing.assert_allclose(found.costates["x"][0], each["light"].multiplier, rtol=1e-6)
    assert "(heavy)" in str(found.active())
