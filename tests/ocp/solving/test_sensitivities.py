"""Sensitivities and the condition of optima against closed forms and re-solves."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from carts import CART, EFFORT, F, V, fastest, move, slope, there_and_back
from phases import solve_once
from scipy.linalg import null_space
from tables import sampled

from ocp import Free, Ipopt, Phase, Problem, Radau, at_end, integral, load, soft, solve
from ocp.solving.linearised import Linearised
from symfric import BrownMcPhee, Model, Variable
from symfric.scenes import drive

# --- sensitivities ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "name", "argument", "value"),
    sampled(
        [
            (move, "v at the start", "v", 0.0),
            (move, "k", "k", 0.0),
            (move, "T", "T", 1.0),
            (move, "m", "m", 2.0),
            (lambda **p: move(**({"limit": 8.5} | p)), "x at the end", "to", 1.0),
            (lambda **p: move(**({"limit": 8.5} | p)), "m", "m", 2.0),
            (there_and_back, "T of out", "T", 1.0),
            (fastest, "m", "m", 2.0),
            (fastest, "upper bound on a", "high", 10.0),
            (fastest, "lower bound on a", "low", -5.0),
        ],
        of=2,
    ),
)
def test_sensitivities_are_differences_of_solves(
    make: Callable[..., Problem], name: str, argument: str, value: float
) -> None:
    found = solve_once(make(), 16).sensitivity(name)
    cost, signals = slope(make, argument, value, 16, Radau(3))
    np.testing.assert_allclose(found.cost, cost, rtol=1e-5)
    np.testing.assert_allclose(found.T, signals["t"][-1], rtol=1e-5, atol=1e-9)
    for n, row in ({"t": found.t} | dict(found.signals)).items():
        np.testing.assert_allclose(row, signals[n], atol=1e-4 * max(1.0, np.abs(signals[n]).max()))
    assert not found.doubts


def test_chosen_parameters_and_starts_that_depend_on_parameters() -> None:
    """x(0) = 1 / k: the spring starts with a given force; its mass is chosen."""
    k, m = Variable("k", "N/m", start=2.0), Variable("m", "kg", start=1.0)
    x = Variable("x", "m", start=1.0 / k.symbol)
    ode = ca.vertcat(V.symbol, (F.symbol - k.symbol * x.symbol) / m.symbol)
    model = Model("spring", x=(x, V), u=(F,), p=(k, m), ode=ode)

    def problem(k: float = 2.0) -> Problem:
        phase = Phase(model, 1.0, end={"x": 0.0, "v": 0.0}, p={"k": k})
        return Problem(phase, EFFORT + at_end(lambda s: 1 / s.m), choose={"m": (0.01, 10.0)})

    found = solve_once(problem(), 20)
    by, (cost, signals) = found.sensitivity("k"), slope(problem, "k", 2.0, 20, Radau(3))
    np.testing.assert_allclose(by.cost, cost, rtol=1e-6)
    np.testing.assert_allclose(by.signals["x"], signals["x"], atol=1e-6)
    high, low = (solve_once(problem(2.0 + d), 20).chosen["m"] for d in (1e-4, -1e-4))
    np.testing.assert_allclose(by.chosen["m"], (high - low) / 2e-4, rtol=1e-4)
    with pytest.raises(ValueError, match=r"sensitivity: expected one of k, T, .* got m"):
        found.sensitivity("m")


def guided(T: float | Free, m: float = 1.0, to: float = 0.1) -> Problem:
    law = BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=1e-6)
    stage = drive(law, m=1.0, N=1.0, free=["m", "mu_d"])
    rest = {"x": 0.0, "v": 0.0}
    phase = Phase(stage, T, start=rest, end=rest | {"x": to}, p={"m": m})
    return Problem(phase, integral(lambda s: 100.0 + s.force**2))


@pytest.mark.slow
def test_sensitivities_of_a_sliding_mass_are_those_of_the_closed_form() -> None:
    """J = T (100 + F^2) + 12 m^2 d^2 / T^3 with friction F: T^4 = 36 m^2 d^2 / (100 + F^2)."""
    found = solve(guided(Free(0.1, 1.0)), starts=2)
    assert [mode.kind for mode in found.modes["guide"]] == ["slip+"]
    T = (0.36 / 116) ** 0.25
    wanted = {
        "m": (0.24 / T**3, T / 2),
        "mu_d": (8 * T, -8 * T / 4 / 116),
        "x at the end": (2.4 / T**3, T / 2 / 0.1),
    }
    for name, rates in wanted.items():
        by = found.sensitivity(name)
        np.testing.assert_allclose([by.cost, by.T], rates, rtol=1e-3)
        assert not by.doubts
    assert set(found.costates) == {"x", "v"}
    np.testing.assert_allclose(found.costates["x"], -2.4 / T**3, rtol=1e-3)
    np.testing.assert_allclose(found.hamiltonian, 0.0, atol=1e-6)


@pytest.mark.slow
def test_sensitivities_pass_through_stick() -> None:
    """The mass moves at once, as force costs more later, and then rests.

    The reference are solves of the program of the arcs with changed parameters.
    """
    phase = guided(1.5, to=0.2).chain[0]
    found = solve(Problem(phase, integral(lambda s: (1 + s.t / 2) * s.force**2)), starts=3)
    assert [mode.kind for mode in found.modes["guide"]] == ["slip+", "stick"]
    optimum = found.optimum
    assert optimum is not None
    program, stops = optimum.transcription.program, found.modes["guide"][0].end
    for name, (_, at) in Linearised(optimum).numbers.items():
        results: list[tuple[float, float]] = []
        for change in (1e-4, -1e-4):
            values = optimum.values.copy()
            values[at] += change
            outcome = Ipopt(tol=1e-11).prepared(program).run(optimum.iterate, values, warm=True)
            duration = optimum.transcription.unpack(outcome.iterate.w).spans[0].T
            results.append((outcome.cost, duration))
        (cost, T), by = np.subtract(*results) / 2e-4, found.sensitivity(name)
        np.testing.assert_allclose(by.cost, cost, rtol=1e-6, atol=1e-8)
        np.testing.assert_allclose(by.t[np.argmin(abs(found.t - stops))], T, rtol=1e-6, atol=1e-8)
    whole = found.sensitivity("T")  # a longer rest costs nothing
    np.testing.assert_allclose([whole.cost, whole.T], [0.0, 1.0], atol=1e-6)


# --- condition, and what cannot be known --------------------------------------------------------


def test_condition_counts_and_tests_the_second_order() -> None:
    """20 forces and 2 prescribed ends leave 18 degrees of freedom; a maximum is no minimum."""
    good = solve_once(move(), 20).condition
    assert (good.degrees_of_freedom, good.sufficient) == (18, True)
    assert good.number < 1e6
    assert good.residual < 1e-8
    assert "18 degrees of freedom; strict local minimum" in str(good)
    saddle = integral(lambda s: s.a**2 - 200.0 * s.x**2)
    phase = Phase(CART, 1.5, start={"x": 0.0, "v": 0.0}, end={"x": 0.0, "v": 0.0}, p={"m": 1.0})
    rest = solve_once(Problem(phase, EFFORT), 20)
    bad = solve_once(Problem(phase, saddle), 20, guess=rest).condition
    assert not bad.sufficient
    assert "second-order conditions not met" in str(bad)


def test_dependent_conditions_leave_a_unique_motion() -> None:
    """The end is prescribed twice: the multipliers are not unique, the derivatives are."""
    ends = {"start": {"x": 0.0, "v": 0.0}, "end": {"v": 0.0}, "p": {"m": 2.0}}
    twice = {1.0: [lambda s: s.x >= 1.0, lambda s: 2.0 * s.x >= 2.0]}
    found = solve_once(Problem(Phase(CART, 1.0, at=twice, **ends), EFFORT), 12).sensitivity("m")
    assert "multipliers are not unique" in found.doubts[-1]
    alone = solve_once(move(), 12).sensitivity("m")
    np.testing.assert_allclose(found.cost, alone.cost, rtol=1e-6)
    np.testing.assert_allclose(found.signals["a"], alone.signals["a"], atol=1e-4)


def scaled(kind: str, L: float, T: float, C: float, nominal: bool) -> Problem:
    """A move over L within T with costs times C, in which bounds are active or touched."""
    sizes = {"x": L, "v": L / T, "a": L / T**2}
    units = {"x": "m", "v": "m/s", "a": "m/s^2"}
    x, v, a = (
        Variable(n, units[n], **({"nominal": q} if nominal else {})) for n, q in sizes.items()
    )
    cart = Model("cart", x=(x, v), u=(a,), ode=ca.vertcat(v.symbol, a.symbol))
    rest, there = {"x": 0.0, "v": 0.0}, {"x": L, "v": 0.0}
    effort = integral(lambda s: C * (s.a / sizes["a"]) ** 2)
    if kind == "wall":
        phase = Phase(cart, T, start={"x": 0.0, "v": L / T}, end={"x": 0.0, "v": -L / T})
        return Problem(phase, effort, bounds={"x": (None, L / 9)})
    if kind == "flat":
        phase = Phase(cart, T, start=rest, end={"x": L})
        return Problem(phase, at_end(lambda s: C * s.x / L))
    if kind == "fastest":
        phase = Phase(cart, Free(0.1 * T, 5.0 * T), start=rest, end=there)
        limits = {"a": (-5.0 * sizes["a"], 10.0 * sizes["a"])}
        return Problem(phase, at_end(lambda s: C * s.t / T), bounds=limits)
    bounds = {"a": (-5.0 * sizes["a"], None), "v": (None, 1.45 * sizes["v"])}
    return Problem(Phase(cart, T, start=rest, end=there), effort, bounds=bounds)


@pytest.mark.parametrize("kind", sampled(["wall", "effort", "fastest", "flat"], of=2))
def test_statements_do_not_depend_on_units(kind: str) -> None:
    def stated(L: float, T: float, C: float, nominal: bool = True) -> list[object]:
        found = solve(scaled(kind, L, T, C, nominal), intervals=20, refine=False, verify=False)
        active = [(one.name, one.side, one.weak) for one in found.active()]
        condition, by = found.condition, found.sensitivity("x at the end")
        counts = condition.degrees_of_freedom, condition.sufficient, condition.weak
        return [active, counts, by.doubts, str(found).count("active:")]

    first = stated(1.0, 1.0, 1.0)
    # one unit at a time: those of length and time cancel in L T, if one shrinks and one grows
    for scales in ((1e-3, 1, 1), (1, 1e3, 1), (1, 1, 1e6), (1e3, 1e-3, 1e-6)):
        assert stated(*scales) == first
    assert stated(1e3, 1e-3, 1e-6, nominal=False) == first


def test_second_order_conditions_are_those_of_the_reduced_hessian() -> None:
    """Dense eigenvalues on the null space of the active conditions."""
    for kind in ("effort", "wall", "flat"):
        found = solve(scaled(kind, 1.0, 1.0, 1.0, True), intervals=8, refine=False, verify=False)
        own = found._linearised("condition")
        H, A = own.equations.H.toarray(), own.equations.A.toarray()
        Z = null_space(A, rcond=1e-9)
        assert Z.shape[1] == own.condition.degrees_of_freedom
        least = np.linalg.eigvalsh(Z.T @ H @ Z).min()
        assert found.condition.sufficient == (least > 1e-6)


def test_motion_that_is_not_unique_is_doubted() -> None:
    """Any force that ends at x = 1 is optimal if the cost is x at the end."""
    phase = Phase(CART, 1.0, start={"x": 0.0, "v": 0.0}, end={"x": 1.0})
    found = solve_once(Problem(phase, at_end(lambda s: s.x)), 6)
    assert found.condition.number > 1e12
    by = found.sensitivity("x at the end")
    np.testing.assert_allclose(by.cost, 1.0)
    assert np.isnan(by.signals["a"]).all()
    assert by.doubts == ("second-order conditions not met: the motion may not be unique",)


def test_files_keep_multipliers(tmp_path: Path) -> None:
    """Scenarios share the start of a linear input; durations have a sum; a path has a penalty."""
    ends = {"start": {"x": 0.0, "v": 0.0}, "end": {"x": 0.1, "v": 0.0}}
    goals = {"light": {"m": 1.0}, "heavy": {"m": 2.0}}
    near = EFFORT + at_end(lambda s: 100.0 * (s.x - 0.1) ** 2)
    rest = {"x": 0.0, "v": 0.0}
    shared = Problem(Phase(CART, 1.0, start=rest), near, scenarios=goals, inputs={"a": "linear"})
    parts = Phase(CART, Free(0.2, 1.0), name="out") >> Phase(CART, Free(0.2, 1.0), end={"x": 0.1})
    sums = Problem(parts, EFFORT, durations=[((0, 1), 1.0)], p={"m": 2.0}, periodic=["v"])
    path = [soft(lambda s: s.v <= 0.1, linear=0.5)]
    for problem in (move(), shared, sums, Problem(Phase(CART, 1.0, **ends), EFFORT, path=path)):
        found = solve_once(problem, 8)
        found.save(tmp_path / "move.npz")
        stored = load(tmp_path / "move.npz")
        assert str(stored.active()) == str(found.active())
        assert stored.condition == found.condition
        for name, row in found.costates.items():
            np.testing.assert_array_equal(stored.costates[name], row)
        np.testing.assert_array_equal(stored.hamiltonian, found.hamiltonian)
        name = "m" if problem is not shared else "T"
        one, other = (vars(s.sensitivity(name)) for s in (found, stored))
        np.testing.assert_equal(other, one)


def test_failed_solves_have_no_sensitivities() -> None:
    """x = 0 satisfies no end, but its residual is zero."""
    twice = {1.0: [lambda s: s.x == 1.0, lambda s: s.x == 2.0]}
    failed = solve_once(Problem(Phase(CART, 1.0, at=twice, p={"m": 2.0}), EFFORT), 6)
    assert not failed.ok
    with pytest.raises(ValueError, match="satisfies the optimality conditions, got a residual of"):
        failed.sensitivity("m")


def test_motions_without_multipliers_are_refused(tmp_path: Path) -> None:
    found = solve_once(move(), 6)
    older = replace(found, optimum=None)
    older.save(tmp_path / "move.npz")
    for read in (lambda s: s.costates, lambda s: s.active(), lambda s: s.sensitivity("m")):
        with pytest.raises(ValueError, match="expected an optimal solution with its multipliers"):
            read(load(tmp_path / "move.npz"))
    with pytest.raises(ValueError, match=r"sensitivity: expected one of .* got x at the ende"):
        found.sensitivity("x at the ende")
