from dataclasses import replace
from math import atan, exp, sqrt

import casadi as ca
import numpy as np
import pytest
from motions import double_integrator, fastest, least_effort, out_and_back, stage

from ocp import FREE, TIME, Free, Problem, Solution, at_end, integral, solve
from symfric import LuGre, Model, SolveError, Status, Variable, drive


def slope(sizes: list[int], errors: list[float]) -> float:
    """Observed order: minus the log-log slope of the error over the number of intervals."""
    return float(-np.polyfit(np.log(sizes), np.log(np.abs(errors)), 1)[0])


# --- closed forms -------------------------------------------------------------------------------


@pytest.mark.parametrize("N", [2, 5, 50])
def test_least_effort_of_a_double_integrator(N: int) -> None:
    """J = 12 for a free control; 12 N^2 / (N^2 - 1) for one held on N intervals."""
    solution = solve(least_effort(), intervals=N)
    assert solution.status is Status.SOLVED
    assert solution.cost == pytest.approx(12 * N**2 / (N**2 - 1), rel=1e-9)
    middles = (np.arange(N) + 0.5) / N
    np.testing.assert_allclose(
        solution.controls["a"], (1 - 2 * middles) * solution.cost / 2, atol=1e-9
    )


@pytest.mark.parametrize("distance", [0.5, 2.0])
def test_fastest_double_integrator_is_bang_bang(distance: float) -> None:
    problem = Problem(
        double_integrator(a_max=3.0), Free(0.1, 10.0), TIME, final={"x": distance, "v": 0.0}
    )
    solution = solve(problem)
    assert pytest.approx(2 * sqrt(distance / 3.0), rel=1e-6) == solution.T
    np.testing.assert_allclose(np.abs(solution.controls["a"]), 3.0, rtol=1e-4)
    assert np.count_nonzero(np.diff(np.sign(solution.controls["a"]))) == 1


def coulomb_time() -> float:
    """1 kg over 1 m with 20 N against 4 N: 16 m/s^2 up to the top speed, 24 m/s^2 down."""
    up, down = 16.0, 24.0
    return sqrt(2 * up * down / (up + down)) * (1 / up + 1 / down)


def test_fastest_move_approaches_coulomb_friction_as_the_transition_shrinks() -> None:
    errors = [solve(fastest(stage(v_t))).T - coulomb_time() for v_t in (1e-1, 1e-2, 1e-3)]
    assert errors[0] > 2 * errors[1] > 4 * errors[2] > 0
    assert errors[2] < 4e-4 * coulomb_time()


def test_time_of_the_fastest_move_converges_with_the_mesh() -> None:
    """First order: friction vanishes at the very last point, where v = 0."""
    sizes = [25, 50, 100, 200]
    errors = [solve(fastest(stage(1e-4)), intervals=N).T - coulomb_time() for N in sizes]
    assert slope(sizes, errors) == pytest.approx(1.0, abs=0.25)


def test_friction_makes_waiting_expensive_so_effort_has_a_best_time() -> None:
    """J(T) = 12 / T^3 + 16 T under 4 N of Coulomb friction: least at T = (36/16)^(1/4)."""
    problem = replace(fastest(stage(1e-4)), cost=integral(lambda s: s.force**2))
    solution = solve(problem)
    best = (36 / 16) ** 0.25
    assert pytest.approx(best, rel=3e-3) == solution.T
    assert solution.cost == pytest.approx(12 / best**3 + 16 * best, rel=1e-3)


# --- accuracy -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("degree", "sizes"), [(1, [32, 64, 128, 256]), (2, [4, 8, 16, 32]), (3, [4, 8, 16, 32])]
)
def test_order_of_convergence_is_2d_minus_1(degree: int, sizes: list[int]) -> None:
    """x' = -2 t x^2 from 1 has x = 1 / (1 + t^2)."""
    x, t = Variable("x", "1", start=1.0), ca.SX.sym("t")
    model = Model("decay", x=(x,), ode=-2 * t * x.symbol**2, t=t)
    problem = Problem(model, 2.0, integral(lambda s: s.x))
    runs = [
        solve(problem, intervals=N, degree=degree, verify=False, options={"tol": 1e-14})
        for N in sizes
    ]
    assert slope(sizes, [run["x"][-1] - 0.2 for run in runs]) == pytest.approx(
        2 * degree - 1, abs=0.25
    )
    assert runs[-1].cost == pytest.approx(atan(2.0), abs=0.02)


def test_algebraic_variables_hold_at_every_point() -> None:
    """x' = z, 0 = z + x: x = exp(-t) with no input at all."""
    x, z = Variable("x", "1", start=1.0), Variable("z", "1/s", start=-1.0)
    model = Model("dae", x=(x,), z=(z,), ode=ca.SX(z.symbol), alg=z.symbol + x.symbol)
    solution = solve(Problem(model, 1.0, at_end(lambda s: s.x - s.z)), intervals=10)
    assert solution.cost == pytest.approx(2 * exp(-1.0), abs=1e-8)
    np.testing.assert_allclose(solution["z"][1:], -solution["x"][1:], atol=1e-9)
    assert abs(solution.terminal_miss["x"]) < 1e-7


# --- what can be asked for ----------------------------------------------------------------------


def test_bounds_are_kept() -> None:
    problem = least_effort(bounds={"v": (None, 1.2), "a": (-20.0, 8.0), "power": (None, 4.0)})
    solution = solve(problem)
    assert solution.cost > 12.1
    assert solution["v"].max() == pytest.approx(1.2, abs=1e-6)
    assert solution["a"].max() <= 8.0 + 1e-6
    assert solution["power"][1:].max() <= 4.0 + 1e-6


def test_control_bound_shapes_the_cost() -> None:
    """|a| <= 4 leaves one way to move 1 m in 1 s: full force, then full brake."""
    solution = solve(least_effort(model=double_integrator(a_max=4.0)))
    assert solution.cost == pytest.approx(16.0, rel=1e-6)


def test_range_at_the_end_is_met_at_its_cheap_side() -> None:
    solution = solve(least_effort(final={"x": (1.0, 2.0), "v": 0.0}), intervals=10)
    assert solution["x"][-1] == pytest.approx(1.0, abs=1e-7)


def test_free_start_is_chosen_by_the_optimiser() -> None:
    problem = least_effort(initial={"x": (-1.0, 0.25)}, final={"x": 1.0, "v": 0.0})
    solution = solve(problem, intervals=10)
    assert solution["x"][0] == pytest.approx(0.25, abs=1e-7)
    assert solution.cost == pytest.approx(0.75**2 * 12 * 100 / 99, rel=1e-6)


def test_end_cost_stands_in_for_a_hard_target() -> None:
    """min int a^2 + w (x(1) - 1)^2 + w v(1)^2 approaches the hard move from below as w grows."""
    soft = integral(lambda s: s.a**2) + 1e5 * at_end(lambda s: (s.x - 1) ** 2 + s.v**2)
    solution = solve(least_effort(cost=soft, final={}))
    assert solution.cost == pytest.approx(12.0, rel=2e-3)
    assert solution["x"][-1] == pytest.approx(1.0, abs=1e-3)


def test_via_point_is_passed_at_its_time() -> None:
    solution = solve(least_effort(via={0.3: {"x": 0.9}}), intervals=10)
    assert np.interp(0.3, solution.t, solution["x"]) == pytest.approx(0.9, abs=1e-9)


def test_parameters_take_the_given_values() -> None:
    """Time scales with the root of the mass when friction and force stay."""
    model = stage(1e-4, free=["m"])
    light = solve(replace(fastest(model), p={"m": 1.0}))
    heavy = solve(replace(fastest(model), p={"m": 4.0}))
    assert pytest.approx(coulomb_time(), rel=1e-3) == light.T
    assert pytest.approx(2 * light.T, rel=1e-3) == heavy.T


def test_mesh_may_be_uneven() -> None:
    fine_at_the_ends = (1 - np.cos(np.pi * np.linspace(0, 1, 31))) / 2
    solution = solve(least_effort(), intervals=fine_at_the_ends)
    assert solution.cost == pytest.approx(12.0, rel=5e-3)
    np.testing.assert_allclose(solution.t_control, fine_at_the_ends[:-1])


def test_law_with_states_can_be_optimised_where_it_is_soft() -> None:
    law = LuGre(sigma_0=1e3)
    problem = Problem(
        drive(law, m=1.0, N=1.0),
        1.0,
        integral(lambda s: s.force**2),
        final={"x": 1.0, "v": 0.0},
    )
    assert solve(problem).ok


# --- what can go wrong --------------------------------------------------------------------------


def test_infeasible_problem_says_so_and_what_is_violated() -> None:
    """0.4 m at most within 1 s at 1.6 m/s^2, asked for 1 m."""
    problem = least_effort(model=double_integrator(a_max=1.6))
    with pytest.raises(SolveError, match="No point satisfies all constraints") as error:
        solve(problem)
    assert error.value.status is Status.INFEASIBLE
    assert "Most violated is the equation of" in str(error.value)
    assert isinstance(error.value.partial, Solution)


def test_reversal_between_the_nodes_is_a_terminal_miss() -> None:
    """Ipopt is content with the out-and-back move; the mass ends centimetres away."""
    with pytest.raises(SolveError, match=r"It misses x by 0\.\d+ m") as error:
        solve(out_and_back())
    partial = error.value.partial
    assert error.value.status is Status.TERMINAL_MISS
    assert abs(partial.terminal_miss["x"]) > 0.02
    assert not partial.ok
    assert partial.trajectory.status is Status.SUCCESS


def test_looser_tolerance_accepts_the_same_miss() -> None:
    assert solve(out_and_back(), tolerance=1.0).status is Status.SOLVED


def test_unverified_solution_reports_no_miss() -> None:
    solution = solve(out_and_back(), verify=False)
    assert solution.status is Status.SOLVED
    assert solution.trajectory is None
    assert solution.terminal_miss == {}


@pytest.mark.parametrize("tolerance", [0.0, -1.0, float("nan")])
def test_impossible_tolerance_is_refused(tolerance: float) -> None:
    with pytest.raises(ValueError, match="solve: tolerance: expected a number > 0"):
        solve(least_effort(), tolerance=tolerance)


# --- warm start ---------------------------------------------------------------------------------


def test_warm_start_spares_iterations() -> None:
    model = stage(free=["m"])
    cold = solve(replace(fastest(model), p={"m": 1.0}))
    near = replace(fastest(model), p={"m": 1.05})
    assert 2 * solve(near, guess=cold).iterations < solve(near).iterations
    assert solve(cold.problem, guess=cold).iterations <= 1


def test_solution_starts_a_finer_mesh() -> None:
    coarse = solve(least_effort(), intervals=10)
    fine = solve(least_effort(), intervals=40, guess=coarse)
    assert fine.cost == pytest.approx(12 * 1600 / 1599, rel=1e-9)


def test_start_free_and_fixed_at_the_optimum_agree() -> None:
    free = solve(least_effort(initial={"v": FREE}), intervals=10)
    fixed = solve(least_effort(initial={"v": float(free["v"][0])}), intervals=10)
    assert fixed.cost == pytest.approx(free.cost, abs=1e-8)
