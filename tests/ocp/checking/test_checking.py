"""Re-simulation against the conditions, losses by constant inputs, and refined meshes."""

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

from ocp.checking.interval_errors import cut_meshes, local_errors, zoh_losses
from ocp.checking.mesh_refinement import Goals, MeshErrors, refined, refined_solve
from ocp.checking.resimulate import Arc, arcs_of, resimulated, run_from
from ocp.checking.verify import left_between, verified, verified_arcs, verify
from ocp.formulation.expressions import TIME, integral
from ocp.formulation.phase import FREE, Free, Phase
from ocp.formulation.problem import Problem
from ocp.problems import READY, alp_rider, brachistochrone, bryson_denham, goddard, hang_glider
from ocp.solving.methods import Ipopt
from ocp.solving.one_solve import Task
from ocp.solving.prepared import Supervisor
from ocp.solving.solution import Solution
from ocp.solving.watch import Progress
from ocp.transcription.schemes import make_meshes
from ocp.transcription.transcribe import discretise
from symfric.foundation.parameters import Variable
from symfric.foundation.status import Status
from symfric.laws import BrownMcPhee
from symfric.model import Model, Output

EFFORT = integral(lambda s: s.a**2)


CART = double_integrator()


def arc_of(problem: Problem, nodes: list[list[float]], u: list[list[float]]) -> Arc:
    """An arc made by hand on an even mesh."""
    span = problem.spans[0]
    T, N = float(span.T), len(u[0])  # type: ignore[arg-type]
    mesh = np.linspace(0.0, 1.0, N + 1)
    return Arc(0, span, 0.0, T, mesh, np.array(nodes), np.array(u), span.p)


def there_and_back() -> tuple[Problem, Arc]:
    """x from 0 by 1 m/s under -1 N: 1/2 m at 1 s, between nodes at 0, 2/3, 4/3 and 2 s."""
    phase = Phase(CART, 2.0, start={"v": 1.0}, end={"x": 0.0, "v": -1.0})
    problem = Problem(phase, EFFORT, bounds={"x": (None, 0.46)})
    t = np.linspace(0.0, 2.0, 4)
    return problem, arc_of(problem, [list(t - t**2 / 2), list(1 - t)], [[-1.0] * 3])


def test_bound_violated_between_nodes_is_found_at_its_worst() -> None:
    problem, arc = there_and_back()
    assert arc.nodes[0].max() < 0.46  # none of the nodes is outside
    found = verified_arcs(problem, [arc], cost=2.0)
    assert found.status is Status.BOUND_MISS
    (miss,) = found.misses
    assert (miss.what, miss.name) == ("bound", "x")
    assert miss.time == pytest.approx(1.0, abs=1e-3)
    assert miss.miss == pytest.approx(0.04, abs=1e-6)
    assert "x is violated by 0.04 m at 1 s" in found.sentence


@pytest.mark.parametrize("restarts", [[0], [0, 1, 2]])
def test_bounds_between_nodes_are_relative_to_the_whole_arc(restarts: list[int]) -> None:
    """The room is 0.49 m at the start, 0.046 m at the inner nodes, and -0.01 m between them."""
    room = {"room": Output(0.49 - CART.x[0].symbol, "m")}
    stage = Model("room", x=CART.x, u=CART.u, ode=CART.ode, outputs=room)
    phase = Phase(stage, 2.0, start={"v": 1.0})
    problem = Problem(phase, EFFORT, bounds={"room": (0.0, None)})
    arc = replace(there_and_back()[1], span=problem.spans[0])
    ends = zip(restarts, arc.times[[*restarts[1:], -1]], strict=True)
    runs = [run_from(arc, node, arc.state(node))._replace(end=end) for node, end in ends]
    assert left_between(runs, 0.01).tolist() == [False, True, False]
    assert not left_between(runs, 0.1).any()  # a tenth of 0.49 m, not of 0.046 m


def test_end_and_cost_that_the_control_misses() -> None:
    problem, arc = there_and_back()
    wrong = replace(arc, u=np.array([[-1.0, -1.0, -1.1]]))
    found = verified_arcs(problem, [wrong], cost=1.0)
    assert found.status is Status.TERMINAL_MISS
    names = {miss.name: miss for miss in found.misses}
    assert names["v"].miss == pytest.approx(-0.1 * 2 / 3)
    assert names["the cost"].value == pytest.approx(2 * (1 + 1 + 1.1**2) / 3)
    assert names["phase 1"].what == "local error"  # of the last interval alone
    np.testing.assert_allclose(found.local_errors[0][:2], 0.0, atol=1e-8)


def test_exact_motion_is_verified_and_exported() -> None:
    problem, arc = there_and_back()
    found = verified_arcs(problem, [arc], cost=2.0, tolerance=0.1)
    assert found.ok and found.status is Status.SUCCESS and found.sentence == ""
    assert found.cost == pytest.approx(2.0)
    assert found.to_dict()["ok"] is True
    assert "bound" in str(found)


def test_local_errors_with_explicit_time_belong_to_their_intervals() -> None:
    x, u, t = Variable("x", "m"), Variable("u", "m/s"), ca.SX.sym("t")
    model = Model("clock", x=(x,), u=(u,), t=t, ode=u.symbol + 3 * t**2)
    problem = Problem(Phase(model, 2.0, start={"x": 0.0}), integral(lambda s: s.u**2))
    times = np.linspace(0.0, 2.0, 5)
    exact = arc_of(problem, [list(times**3)], [[0.0] * 4])
    np.testing.assert_allclose(local_errors([exact])[0], 0.0, atol=1e-6)
    off = replace(exact, nodes=exact.nodes + np.array([[0.0, 0.0, 0.8, 0.0, 0.0]]))
    np.testing.assert_allclose(local_errors([off])[0], [0.0, 0.1, 0.1, 0.0], atol=1e-6)


def test_phases_start_at_the_simulated_end_of_the_previous_one() -> None:
    bounce = Phase(CART, 1.0, link={"v": lambda before: -0.5 * before.v}, name="up")
    problem = Problem(Phase(CART, 1.0, start={"v": 2.0}, name="down") >> bounce, EFFORT)
    down, up = problem.spans
    mesh, hold = np.array([0.0, 1.0]), np.array([[0.0]])
    arcs = [
        Arc(0, down, 0.0, 1.0, mesh, np.array([[0.0, 2.0], [2.0, 2.0]]), hold, down.p),
        Arc(1, up, 1.0, 1.0, mesh, np.array([[2.1, 1.1], [-1.0, -1.0]]), hold, up.p),
    ]
    runs = resimulated(arcs)
    assert [run.trajectory.span for run in runs] == [(0.0, 1.0), (1.0, 2.0)]
    assert runs[1].of(up.model.vector("x"), 2.0)[:, 0] == pytest.approx([1.0, -1.0])
    motion = [m for m in verified_arcs(problem, arcs, 0.0).misses if m.what == "motion"]
    assert [(m.name, m.time) for m in motion] == [("x", 2.0)]


def unstable() -> tuple[Problem, Arc]:
    """x' = 4 x + u over 10 s, at rest at 1: an error of 1e-9 grows to 2e8."""
    x, u = Variable("x", "m", start=1.0), Variable("u", "m/s")
    model = Model("needle", x=(x,), u=(u,), ode=4 * x.symbol + u.symbol)
    problem = Problem(Phase(model, 10.0, end={"x": 1.0}), integral(lambda s: s.u**2))
    nodes = 1.0 + 1e-9 * np.cos(np.arange(21))
    return problem, arc_of(problem, [list(nodes)], [[-4.0] * 20])


def test_unstable_motion_is_distinguished_from_a_wrong_one() -> None:
    problem, arc = unstable()
    found = verified_arcs(problem, [arc], cost=160.0)
    assert not found.ok and found.unstable and found.status is Status.UNSTABLE
    assert not found.status.ok
    assert found.growth > 1e10
    assert found.restarted is not None and found.restarted.ok
    assert 3 <= len(found.restarts) <= 10
    assert "without feedback" in found.sentence
    wrong = replace(arc, nodes=arc.nodes + np.eye(21)[7] * 0.1)
    assert verified_arcs(problem, [wrong], cost=160.0).restarted is None


def test_failed_simulation_is_reported() -> None:
    x, u = Variable("x", "m", start=1.0), Variable("u", "m/s")
    model = Model("burst", x=(x,), u=(u,), ode=x.symbol**2 + u.symbol)  # x = 1 / (1 - t)
    problem = Problem(Phase(model, 2.0), integral(lambda s: s.u**2))
    found = verified_arcs(problem, [arc_of(problem, [[1.0, 1.0, 1.0]], [[0.0, 0.0]])], cost=0.0)
    assert found.failed and not found.ok and not found.status.ok
    assert found.sentence.startswith("Its control could not be re-simulated")
    assert found.largest == np.inf


def test_solution_that_misses_is_no_success() -> None:
    x, v, force = Variable("x", "m"), Variable("v", "m/s"), Variable("force", "N")
    spring = ca.vertcat(v.symbol, force.symbol - 400 * ca.sin(x.symbol))
    model = Model("stiff", x=(x, v), u=(force,), ode=spring)
    cost = integral(lambda s: s.force**2)
    problem = Problem(Phase(model, 2.0, end={"x": 1.0, "v": 0.0}), cost)
    coarse = solve_once(problem, 6)
    assert coarse.status.ok  # of the discretised problem
    checked = verified(coarse)
    assert checked.status is Status.TERMINAL_MISS and not checked.verified
    assert "misses" in checked.message and "use more intervals" in checked.message
    fine = verified(solve_once(problem, 60))
    assert fine.verified and fine.status is Status.SOLVED


def test_path_conditions_and_periodicity_are_checked() -> None:
    phase = Phase(CART, 2.0, start={"x": FREE, "v": FREE})
    problem = Problem(phase, EFFORT, path=[lambda s: s.x <= 0.46], periodic=["x"])
    found = verified_arcs(problem, [replace(there_and_back()[1], span=problem.spans[0])], cost=2.0)
    kinds = {miss.what: miss for miss in found.checked}
    assert kinds["path"].miss == pytest.approx(0.04, abs=1e-6)
    assert kinds["period"].relative < 1e-8


def test_arcs_have_chosen_parameters() -> None:
    x, u = Variable("x", "m", start=1.0), Variable("u", "m/s")
    k = Variable("k", "1/s", start=1.0)
    model = Model("decay", x=(x,), u=(u,), p=(k,), ode=u.symbol - k.symbol * x.symbol)
    cost = integral(lambda s: s.u**2 + s.k**2)
    problem = Problem(Phase(model, 1.0, end={"x": 0.2}), cost, choose={"k": (0.5, 3.0)})
    solution = solve_once(problem, 20)
    (arc,) = arcs_of(problem, solution.meshes, solution.points)
    assert arc.parameters()["k"] == pytest.approx(solution.chosen["k"])
    assert verify(solution).ok


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
    mesh: Array, errors: Array, losses: Array | None = None, outside: int = -1, **more: float
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
    return refined_solve(Task(problem), make_meshes(problem, intervals))


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
    goals = replace(Goals.of(1e-3), loss=1.0)
    meshes = make_meshes(problem, 40)
    solution = refined_solve(Task(problem), meshes, goals=goals)
    assert solution.meshes[0].size == meshes[0].size
    assert solution.statistics.solves > 1
    lengths = np.diff(solution.meshes[0])
    assert lengths[np.abs(solution.meshes[0][:-1] - 0.3) < 0.03].max() < 1 / 40
    assert max(e.max() for e in verify(solution).local_errors) <= goals.local


def test_large_program_is_not_refined_for_the_cost_alone() -> None:
    problem = bryson_denham()
    goals = replace(Goals.of(1e-3), nonzeros=5000)
    solution = refined_solve(Task(problem), make_meshes(problem, 20), goals=goals)
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
    meshes = make_meshes(problem, 20)
    stopped = refined_solve(Task(problem, supervisor=Supervisor(progress=stop)), meshes)
    assert stopped.status is Status.INTERRUPTED
    assert stopped.meshes[0].size == 21
    assert stopped.cost == pytest.approx(4.0, rel=1e-2)
    assert "previous mesh" in stopped.message
    failed = refined_solve(Task(problem, solver=Ipopt(max_iter=2)), meshes)
    assert failed.status is Status.MAX_ITERATIONS
    assert failed.statistics.solves == 1


def test_alp_rider_has_the_published_rates() -> None:
    rates = alp_rider().chain[0].model.function("ode")(0, [1, 2, 3, 4], [], [5, 7], [])
    assert rates.full().ravel().tolist() == [2.0, 15.0, 9.0, 29.0]
