"""What holding the inputs costs, and meshes that follow from errors."""

from collections.abc import Callable, Mapping

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from ocp.checking.interval_errors import zoh_losses
from ocp.checking.mesh_refinement import MeshErrors, refined
from ocp.formulation.expressions import TIME, Cost, at_end, integral
from ocp.formulation.phase import Free, Phase, Range
from ocp.formulation.problem import Problem
from ocp.problems import brachistochrone, bryson_denham
from ocp.solving.methods import Ipopt
from ocp.solving.one_solve import solve_on
from ocp.transcription.schemes import Radau, make_meshes
from ocp.transcription.transcribe import discretise
from symfric.foundation.parameters import Variable
from symfric.laws import BrownMcPhee
from symfric.model import Model
from symfric.multibody import JointSpringDamper
from symfric.scenes import SliderCrank

Array = NDArray[np.float64]


def losses_of(problem: Problem, intervals: int) -> tuple[float, tuple[Array, ...]]:
    """J on an even mesh, and what holding costs."""
    transcription = discretise(problem, Radau(3)).on(make_meshes(problem, intervals))
    solution = solve_on(transcription, Ipopt().prepared(transcription.program))
    assert solution.status.ok
    iterate = solution.iterate
    return solution.cost, zoh_losses(transcription, iterate.w, iterate.lam_g)


def double_integrator(
    cost: Cost, T: float | Free = 1.0, bounds: Mapping[str, Range] | None = None
) -> Problem:
    x, v, a = Variable("x", "m"), Variable("v", "m/s"), Variable("a", "m/s^2")
    model = Model("cart", x=(x, v), u=(a,), ode=ca.vertcat(v.symbol, a.symbol))
    return Problem(Phase(model, T, end={"x": 1.0, "v": 0.0}), cost, bounds=bounds or {})


def test_losses_of_a_mechanism_with_a_loop_are_those_of_its_points() -> None:
    """Its constraints at the nodes are equations, too."""
    m = SliderCrank(BrownMcPhee(mu_s=0.0, mu_d=0.0), omega=0.0).mechanism()
    m.force(JointSpringDamper("motor", "crank", actuator=m.input("torque", "N m")))
    cost = integral(lambda s: s.torque**2)
    (losses,) = losses_of(Problem(Phase(m.build(), 0.5, end={"crank_rate": 6.0}), cost), 10)[1]
    assert losses.shape == (10,)
    assert (losses > 0).all()


def test_loss_of_a_smooth_input_is_what_the_closed_form_says() -> None:
    # a = 6 - 12 t, J = 12; held on N intervals J = 12 (1 + 1 / N^2 + ...)
    cost, (losses,) = losses_of(double_integrator(integral(lambda s: s.a**2)), 20)
    assert losses.sum() == pytest.approx(cost - 12.0, rel=1e-2)
    np.testing.assert_allclose(losses, 12.0**2 / 12.0 / 20**3, rtol=1e-2)


@pytest.mark.parametrize(("make", "optimum"), [(brachistochrone, 1.8016033), (bryson_denham, 4.0)])
def test_loss_predicts_how_far_the_cost_is_from_its_optimum(
    make: Callable[[], Problem], optimum: float
) -> None:
    cost, (losses,) = losses_of(make(), 40)
    assert losses.sum() == pytest.approx(cost - optimum, rel=0.15)


def test_loss_at_a_switch_is_in_the_interval_that_holds_it() -> None:
    problem = double_integrator(TIME, Free(0.5, 5.0), bounds={"a": (-1.0, 2.0)})
    best = np.sqrt(2 * (1 / 2 + 1 / 1))  # bang-bang: switches at a third of the time
    cost, (losses,) = losses_of(problem, 20)
    where = int(np.argmax(losses))
    assert where == 6  # holds t = T / 3
    assert losses[where] > 0.9 * losses.sum()
    assert 0.3 * (cost - best) < losses.sum() < 10 * (cost - best)


def test_loss_with_scenarios_is_that_of_the_mean() -> None:
    problem = double_integrator(integral(lambda s: s.a**2))
    _, (alone,) = losses_of(problem, 10)
    x, v, a = Variable("x", "m"), Variable("v", "m/s"), Variable("a", "m/s^2")
    c = Variable("c", "1/s", start=0.0)
    model = Model(
        "cart", x=(x, v), u=(a,), p=(c,), ode=ca.vertcat(v.symbol, a.symbol - c.symbol * v.symbol)
    )
    both = Problem(
        Phase(model, 1.0),
        integral(lambda s: s.a**2) + 1e3 * at_end(lambda s: (s.x - 1) ** 2 + s.v**2),
        scenarios={"one": {"c": 0.0}, "other": {"c": 0.0}},
    )
    _, (first, second) = losses_of(both, 10)
    np.testing.assert_allclose(first, alone, rtol=0.1)
    assert not second.any()


def even(N: int) -> Array:
    return np.linspace(0.0, 1.0, N + 1)


def errors(local: Array, losses: Array | None = None) -> MeshErrors:
    return MeshErrors(local, np.zeros(local.size) if losses is None else losses)


def test_mesh_is_fine_where_errors_are_and_keeps_its_number() -> None:
    local = np.full(20, 1e-12)
    local[7] = 1e-3
    (new,) = refined([even(20)], [errors(local)], [()], local=1e-4, loss=1.0)
    assert new.size == 21  # nothing has to be made again
    lengths = np.diff(new)
    inside = (new[:-1] >= 0.35 - 1e-9) & (new[:-1] < 0.4)
    assert lengths[inside].max() < 0.05 / 2
    assert lengths.max() > 0.05
    assert (lengths[1:] / lengths[:-1]).max() < 4.0


def test_mesh_of_losses_has_the_number_that_brings_them_down() -> None:
    losses = np.full(10, 1e-3)  # in sum 1e-2; to be 2.5e-3, which takes twice the intervals
    (new,) = refined([even(10)], [errors(np.zeros(10), losses)], [()], local=1.0, loss=2.5e-3)
    np.testing.assert_allclose(new, even(20), atol=1e-12)


def test_fractions_to_keep_stay_nodes_and_the_mesh_is_increasing() -> None:
    random = np.random.default_rng(1)
    for _ in range(20):
        mesh = np.unique(np.concatenate([[0.0, 0.3, 1.0], random.random(12)]))
        local = 10.0 ** random.uniform(-9, -1, mesh.size - 1)
        (new,) = refined(
            [mesh], [errors(local, local**2)], [(0.0, 0.3, 1.0)], local=1e-4, loss=1e-5
        )
        assert (np.diff(new) > 0).all() and new[0] == 0.0 and new[-1] == 1.0
        assert 0.3 in new


def test_mesh_stays_below_the_most_that_is_allowed() -> None:
    local = np.full(50, 1.0)
    (new,) = refined([even(50)], [errors(local)], [()], local=1e-4, loss=1.0, most=60)
    assert new.size - 1 <= 61


def test_interval_that_leaves_a_bound_is_split() -> None:
    outside = np.zeros(10, dtype=bool)
    outside[4] = True
    nothing = MeshErrors(np.full(10, 1e-5), np.zeros(10), outside)
    (new,) = refined([even(10)], [nothing], [()], local=1e-4, loss=1.0)
    assert ((new > 0.4 + 1e-9) & (new < 0.5 - 1e-9)).any()
