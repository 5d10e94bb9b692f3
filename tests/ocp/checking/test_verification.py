"""Re-simulation against the conditions: ends, bounds between nodes, cost, phases, growth."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from phases import solve_once

from ocp.checking.interval_errors import local_errors
from ocp.checking.resimulate import Arc, arcs_of, resimulated
from ocp.checking.verify import verified, verified_arcs, verify
from ocp.formulation.expressions import integral
from ocp.formulation.phase import FREE, Phase
from ocp.formulation.problem import Problem
from symfric.foundation.parameters import Variable
from symfric.foundation.status import Status
from symfric.model import Model

EFFORT = integral(lambda s: s.force**2)


def cart(name: str = "cart") -> Model:
    x, v, force = Variable("x", "m"), Variable("v", "m/s"), Variable("force", "N")
    return Model(name, x=(x, v), u=(force,), ode=ca.vertcat(v.symbol, force.symbol))


def arc_of(problem: Problem, nodes: list[list[float]], u: list[list[float]]) -> Arc:
    """An arc made by hand on an even mesh."""
    span = problem.spans[0]
    T, N = float(span.T), len(u[0])  # type: ignore[arg-type]
    mesh = np.linspace(0.0, 1.0, N + 1)
    return Arc(0, span, 0.0, T, mesh, np.array(nodes), np.array(u), span.p)


def there_and_back() -> tuple[Problem, Arc]:
    """x from 0 by 1 m/s under -1 N: 1/2 m at 1 s, between nodes at 0, 2/3, 4/3 and 2 s."""
    problem = Problem(
        Phase(cart(), 2.0, start={"v": 1.0}, end={"x": 0.0, "v": -1.0}),
        EFFORT,
        bounds={"x": (None, 0.46)},
    )
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
    bounce = Phase(cart(), 1.0, link={"v": lambda before: -0.5 * before.v}, name="up")
    problem = Problem(Phase(cart(), 1.0, start={"v": 2.0}, name="down") >> bounce, EFFORT)
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
    problem = Problem(Phase(model, 2.0, end={"x": 1.0, "v": 0.0}), EFFORT)
    coarse = solve_once(problem, 6)
    assert coarse.status.ok  # of the discretised problem
    checked = verified(coarse)
    assert checked.status is Status.TERMINAL_MISS and not checked.verified
    assert "misses" in checked.message and "use more intervals" in checked.message
    fine = verified(solve_once(problem, 60))
    assert fine.verified and fine.status is Status.SOLVED


def test_path_conditions_and_periodicity_are_checked() -> None:
    phase = Phase(cart(), 2.0, start={"x": FREE, "v": FREE})
    problem = Problem(phase, EFFORT, path=[lambda s: s.x <= 0.46], periodic=["x"])
    found = verified_arcs(problem, [replace(there_and_back()[1], span=problem.spans[0])], cost=2.0)
    kinds = {miss.what: miss for miss in found.checked}
    assert kinds["path"].miss == pytest.approx(0.04, abs=1e-6)
    assert kinds["period"].relative < 1e-8


def test_arcs_have_chosen_parameters() -> None:
    x, u = Variable("x", "m", start=1.0), Variable("u", "m/s")
    k = Variable("k", "1/s", start=1.0)
    model = Model("decay", x=(x,), u=(u,), p=(k,), ode=u.symbol - k.symbol * x.symbol)
    problem = Problem(
        Phase(model, 1.0, end={"x": 0.2}),
        integral(lambda s: s.u**2 + s.k**2),
        choose={"k": (0.5, 3.0)},
    )
    solution = solve_once(problem, 20)
    (arc,) = arcs_of(problem, solution.meshes, solution.points)
    assert arc.parameters()["k"] == pytest.approx(solution.chosen["k"])
    assert verify(solution).ok
