"""Meshes that follow from local errors and from the cost of holding the inputs."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from math import cos, pi, sin, sqrt

import casadi as ca
import numpy as np
import pytest
from motions import double_integrator
from numpy.typing import NDArray
from phases import SLIDER_CRANK, slider_crank, solve_once, unit_move

from ocp.checking.interval_errors import cut_meshes, zoh_losses
from ocp.checking.mesh_refinement import Goals, MeshErrors, refined, refined_solve
from ocp.checking.verify import verify
from ocp.formulation.expressions import TIME, integral
from ocp.formulation.phase import Free, Phase
from ocp.formulation.problem import Problem
from ocp.problems import READY, alp_rider, brachistochrone, bryson_denham, goddard, hang_glider
from ocp.solving.methods import Ipopt
from ocp.solving.prepared import Supervisor
from ocp.solving.solution import Solution
from ocp.transcription.program import Progress
from ocp.transcription.schemes import make_meshes
from ocp.transcription.transcribe import discretise
from symfric.foundation.parameters import Variable
from symfric.foundation.status import Status
from symfric.laws import BrownMcPhee
from symfric.model import Model

Array = NDArray[np.float64]
FOUR_DIGITS = 5e-5
BANG = Problem(Phase(double_integrator(), Free(0.5, 5.0), end={"x": 1.0, "v": 0.0}), TIME,
               bounds={"a": (-1.0, 2.0)})  # fmt: skip


def losses_of(problem: Problem, intervals: int) -> tuple[float, tuple[Array, ...]]:
    """J on an even mesh, and the loss by holding the inputs."""
    solution = solve_once(problem, intervals)
    assert solution.status.ok
    on = discretise(problem, solution.scheme).on(solution.meshes)
    return solution.cost, zoh_losses(on, solution.iterate)


def test_loss_of_a_smooth_input_has_its_closed_form() -> None:
    """a = 6 - 12 t, J = 12; held on N intervals J = 12 (1 + 1 / N^2 + ...)."""
    cost, (losses,) = losses_of(unit_move(), 20)
    assert losses.sum() == pytest.approx(cost - 12.0, rel=1e-2)
    np.testing.assert_allclose(losses, 12.0**2 / 12.0 / 20**3, rtol=1e-2)
    scenarios = unit_move(scenarios={"one": {}, "other": {}})
    _, (first, second) = losses_of(scenarios, 20)
    np.testing.assert_allclose(first, losses, rtol=1e-6)
    assert not second.any()


@pytest.mark.parametrize(("make", "optimum"), [(brachistochrone, 1.8016033), (bryson_denham, 4.0)])
def test_loss_predicts_the_distance_of_the_cost_from_its_optimum(
    make: Callable[[], Problem], optimum: float
) -> None:
    cost, (losses,) = losses_of(make(), 40)
    assert losses.sum() == pytest.approx(cost - optimum, rel=0.15)


def test_loss_at_a_switch_is_in_its_interval() -> None:
    """Bang-bang: the input switches at a third of the time."""
    cost, (losses,) = losses_of(BANG, 20)
    assert int(np.argmax(losses)) == 6
    assert losses[6] > 0.9 * losses.sum()
    assert 0.3 * (cost - sqrt(3.0)) < losses.sum() < 10 * (cost - sqrt(3.0))


def test_losses_of_a_mechanism_with_a_loop_are_those_of_its_points() -> None:
    """Its constraints at the nodes are equations, too."""
    model = slider_crank(replace(SLIDER_CRANK, law=BrownMcPhee(mu_s=0.0, mu_d=0.0)))
    phase = Phase(model, 0.5, end={"crank_rate": 6.0})
    (losses,) = losses_of(Problem(phase, integral(lambda s: s.torque**2)), 10)[1]
    assert losses.shape == (10,)
    assert (losses > 0).all()


# --- new meshes ---------------------------------------------------------------------------------


def even(N: int) -> Array:
    return np.linspace(0.0, 1.0, N + 1)


def remeshed(
    mesh: Array,
    errors: Array,
    losses: Array | None = None,
    outside: int = -1,
    **more: float,
) -> Array:
    """Return one refined mesh for tolerances 1e-4 and 1."""
    none = np.zeros(errors.size)
    mask = np.arange(errors.size) == outside if outside >= 0 else None
    given = MeshErrors(errors, none if losses is None else losses, mask)
    return refined([mesh], [given], [(0.0, 0.3, 1.0) if 0.3 in mesh else ()],
                   **({"local": 1e-4, "loss": 1.0} | more))[0]  # fmt: skip


def test_mesh_is_fine_where_errors_are_and_keeps_its_number() -> None:
    local = np.full(20, 1e-12)
    local[7] = 1e-3
    new = remeshed(even(20), local)
    assert new.size == 21  # no new program
    lengths = np.diff(new)
    inside = (new[:-1] >= 0.35 - 1e-9) & (new[:-1] < 0.4)
    assert lengths[inside].max() < 0.05 / 2
    assert lengths.max() > 0.05
    assert (lengths[1:] / lengths[:-1]).max() < 4.0


def test_number_of_intervals_follows_from_losses_limits_and_bounds() -> None:
    losses = np.full(10, 1e-3)  # in sum 1e-2; a goal of 2.5e-3 takes twice the intervals
    new = remeshed(even(10), np.zeros(10), losses, loss=2.5e-3)
    np.testing.assert_allclose(new, even(20), atol=1e-12)
    assert remeshed(even(50), np.full(50, 1.0), most=60).size - 1 <= 61
    split = remeshed(even(10), np.full(10, 1e-5), outside=4)
    assert ((split > 0.4 + 1e-9) & (split < 0.5 - 1e-9)).any()


def test_kept_fractions_stay_nodes_and_meshes_increase() -> None:
    random = np.random.default_rng(1)
    for _ in range(20):
        mesh = np.unique(np.concatenate([[0.0, 0.3, 1.0], random.random(12)]))
        local = 10.0 ** random.uniform(-9, -1, mesh.size - 1)
        new = remeshed(mesh, local, local**2, loss=1e-5)
        assert (np.diff(new) > 0).all() and new[0] == 0.0 and new[-1] == 1.0
        assert 0.3 in new


def test_intervals_are_cut_where_any_scenario_errs() -> None:
    errors = [np.array([0.0, 0.0, 1e-2, 0.0]), np.array([3e-3, 0.0, 0.0, np.inf])]
    cut = cut_meshes([even(4)] * 2, errors, 1, 1e-3, order=1, most=4)
    assert cut is not None
    for mesh in cut:  # 3, 1, 4 and 4 parts
        np.testing.assert_allclose(np.diff(mesh), np.repeat([1 / 12, 1 / 4, 1 / 16], [3, 1, 8]))
    assert cut_meshes([even(4)], errors[:1], 1, 1e-2, order=1, most=4) is None


# --- refined solves -----------------------------------------------------------------------------


def solved(problem: Problem, intervals: int = 50) -> Solution:
    return refined_solve(problem, make_meshes(problem, intervals))


@cache
def cycloid() -> float:
    """Fastest slide from (0, 10) to (10, 5): x = r (a - sin a), drop = r (1 - cos a)."""
    low, high = 0.1, 2 * pi - 0.1
    for _ in range(200):
        a = (low + high) / 2
        low, high = (a, high) if (a - sin(a)) / (1 - cos(a)) < 2.0 else (low, a)
    return high * sqrt(5.0 / (1 - cos(high)) / 9.80665)


def test_brachistochrone_is_as_fast_as_the_cycloid() -> None:
    assert READY["brachistochrone"].optimum == pytest.approx(cycloid(), abs=1e-7)
    solution = solved(brachistochrone(), 20)
    assert solution.cost == pytest.approx(cycloid(), rel=FOUR_DIGITS)
    assert verify(solution).ok


def test_bryson_denham_keeps_its_wall_between_nodes() -> None:
    solution = solved(bryson_denham(0.15), 20)
    assert solution.cost == pytest.approx(4 / (9 * 0.15), rel=FOUR_DIGITS)
    assert verify(solution, tolerance=1e-5).ok
    assert solution.statistics.solves <= 6


@pytest.mark.slow
@pytest.mark.parametrize("make", [goddard, hang_glider, alp_rider])
def test_published_optima_are_reached(make: Callable[[], Problem]) -> None:
    solution, rise = solved(make()), float(make is goddard)  # the rocket starts at height 1
    optimum = READY[make.__name__].optimum
    assert solution.cost + rise == pytest.approx(optimum + rise, rel=1e-4)
    verification = verify(solution)
    assert verification.ok == (make is not alp_rider)
    assert (verification.status is Status.UNSTABLE) == (make is alp_rider)


def test_switch_of_a_bang_bang_input_is_found_between_nodes() -> None:
    solution = solved(BANG, 20)
    assert solution.cost == pytest.approx(sqrt(3.0), rel=FOUR_DIGITS)
    assert solution.meshes[0].size - 1 <= 60


def test_nodes_move_and_their_number_stays_where_errors_are_misplaced() -> None:
    x, u, t = Variable("x", "m"), Variable("u", "m/s"), ca.SX.sym("t")
    pulse = ca.exp(-((t - 0.3) ** 2) / 2e-4)
    model = Model("pulse", x=(x,), u=(u,), t=t, ode=u.symbol + 50 * pulse * (1 - x.symbol))
    problem = Problem(Phase(model, 1.0, end={"x": 1.0}), integral(lambda s: s.u**2))
    goals = Goals.of(1e-3)._replace(loss=1.0)
    meshes = make_meshes(problem, 40)
    solution = refined_solve(problem, meshes, goals=goals)
    assert solution.meshes[0].size == meshes[0].size
    assert solution.statistics.solves > 1
    lengths = np.diff(solution.meshes[0])
    assert lengths[np.abs(solution.meshes[0][:-1] - 0.3) < 0.03].max() < 1 / 40
    assert max(e.max() for e in verify(solution).local_errors) <= goals.local


def test_large_program_is_not_refined_for_the_cost_alone() -> None:
    problem = bryson_denham()
    goals = Goals.of(1e-3)._replace(nonzeros=5000)
    solution = refined_solve(problem, make_meshes(problem, 20), goals=goals)
    statistics = solution.statistics
    assert 2500 < statistics.jacobian_nonzeros + statistics.hessian_nonzeros < 5500
    share = (solution.cost - 4.0) / 4.0
    assert share > goals.loss
    assert f"lower the cost by about {100 * share:.1g} %" in solution.message


def test_failed_first_solve_and_stop_on_a_later_mesh() -> None:
    def stop(progress: Progress) -> None:
        if progress.stage == "mesh 2":
            raise KeyboardInterrupt

    problem = bryson_denham()
    stopped = refined_solve(problem, make_meshes(problem, 20), supervisor=Supervisor(progress=stop))
    assert stopped.status is Status.INTERRUPTED
    assert stopped.meshes[0].size == 21
    assert stopped.cost == pytest.approx(4.0, rel=1e-2)
    assert "previous mesh" in stopped.message
    failed = refined_solve(problem, make_meshes(problem, 20), solver=Ipopt(max_iter=2))
    assert failed.status is Status.MAX_ITERATIONS
    assert failed.statistics.solves == 1
