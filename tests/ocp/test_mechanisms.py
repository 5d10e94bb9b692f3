"""Mechanisms under optimal control: trees, and loops as a DAE of index 1 with its multipliers."""

import numpy as np
import pytest

from ocp import Problem, Solution, integral, solve
from symfric import BrownMcPhee, Law
from symfric.multibody import JointSpringDamper
from symfric.scenes import FourBar, PendulumBox, SliderCrank
from symfric.scenes.mechanism import MechanismScene

LAW = BrownMcPhee(mu_s=0.2, mu_d=0.15, v_t=0.02)
SMOOTH = BrownMcPhee(mu_s=0.0, mu_d=0.0)


def moved(scene: MechanismScene, joint: str, direction: str, by: float, T: float) -> Solution:
    """Move a joint from rest to rest at the least effort of a motor in it."""
    m = scene.mechanism()
    drive = m.input("drive", "N", nominal=10.0)
    m.force(JointSpringDamper("motor", joint, direction, actuator=drive))
    model = m.build()
    start = dict(zip((v.name for v in model.x), model.initial_state().tolist(), strict=True))
    final = {joint: start[joint] + by, f"{joint}_rate": 0.0}
    return solve(Problem(model, T, cost=integral(lambda s: s.drive**2), final=final), intervals=30)


def box(law: Law) -> PendulumBox:
    return PendulumBox(law, phi_0=0.0)


def test_a_box_with_a_pendulum_is_moved_against_friction() -> None:
    rough = moved(box(LAW), "x", "slide", 0.5, 1.5)
    assert rough.ok
    assert abs(rough.terminal_miss["x"]) < 0.01 * 0.5
    free = moved(box(SMOOTH), "x", "slide", 0.5, 1.5)
    assert rough.cost > 2 * free.cost
    # the work of the motor is what friction takes: the box starts and ends at rest
    run = rough.trajectory
    assert run is not None
    balance = run.energy_balance()
    assert balance.relative < 1e-6
    assert balance.work["friction"][-1] < 0 < balance.work["motor"][-1]


@pytest.mark.parametrize(
    ("scene", "joint", "by", "T"),
    [(FourBar(LAW, omega=0.0), "theta_crank", 1.0, 0.5),
     (SliderCrank(LAW, omega=0.0), "crank", 1.5, 1.0)],
)  # fmt: skip
def test_a_loop_is_closed_at_every_point_and_meets_its_target(
    scene: MechanismScene, joint: str, by: float, T: float
) -> None:
    """Index 1: the collocated constraints drift with its error, those of the simulation do not."""
    solution = moved(scene, joint, "turn", by, T)
    assert solution.ok
    assert abs(solution.terminal_miss[joint]) < 1e-3 * by
    assert np.abs(solution["constraint_position"]).max() < 1e-6
    assert np.abs(solution["constraint_velocity"]).max() < 1e-5
    run = solution.trajectory
    assert run is not None
    assert run["constraint_position"].max() < 1e-12
    assert run[joint][-1] == pytest.approx(solution[joint][-1], abs=1e-3 * by)


def test_drift_of_a_loop_falls_with_the_order_of_the_collocation() -> None:
    drift: list[float] = []
    for degree in (1, 2):
        m = FourBar(SMOOTH, omega=0.0).mechanism()
        drive = m.input("drive", "N m")
        m.force(JointSpringDamper("motor", "theta_crank", actuator=drive))
        model = m.build()
        final = {"theta_crank": 2.0, "theta_crank_rate": 0.0}
        problem = Problem(model, 0.5, cost=integral(lambda s: s.drive**2), final=final)
        solution = solve(problem, intervals=30, degree=degree, verify=False)
        drift.append(float(np.abs(solution["constraint_position"]).max()))
    assert drift[1] < 0.01 * drift[0]
