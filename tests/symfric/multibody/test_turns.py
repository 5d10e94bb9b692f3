"""Springs about the axes of joints that close loops: full turns count."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from chains import attach

from symfric import simulate
from symfric.multibody import JointSpringDamper, Mechanism, Revolute, UserForce, functions
from symfric.multibody.kinematics import constant_slopes


def drill(loop: bool, start: float, stiffness: float = 473.0) -> Mechanism:
    """A rotary table drives a bit through a string of pipes; a bearing at the bit closes a loop."""
    m = Mechanism("drill", gravity=(0.0, 0.0, 0.0))
    attach(m, Revolute, "top", "table", J=2122.0, rate=5.0)
    attach(m, Revolute, "pipe", "bit", "table", J=374.0, start=start)
    if loop:
        attach(m, Revolute, "rock", "bit", start=start, rate=5.0)
    m.force(JointSpringDamper("string", "pipe", stiffness=stiffness, damping=23.0))
    m.force(JointSpringDamper("drive", "top", actuator=6000.0))
    m.force(UserForce("brake", "bit", lambda kin: ((0.0, 0.0, 0.0), (0.0, 0.0, -4000.0))))
    return m


@pytest.mark.parametrize("start", [0.0, -10.0])
def test_a_string_winds_up_over_full_turns_where_its_joint_is_cut(start: float) -> None:
    # the spring of a cut joint wrapped at pi: 183 rad of the table instead of 85, and SUCCESS
    tree, cut = (
        simulate(drill(loop, start).build(), 3.0, rtol=1e-8, backend="vm") for loop in (False, True)
    )
    assert np.abs(tree["pipe"]).max() > 1.5 * np.pi
    for name in ("pipe", "energy"):
        np.testing.assert_allclose(cut[name][-1], tree[name][-1], rtol=1e-5)
    assert cut.energy_balance().relative < 1e-6
    assert set(cut.energy_balance().work) == {"string", "drive", "brake"}


def test_absolute_coordinates_count_turns_in_few_steps() -> None:
    # ten times as many steps while error control watched the multiplier of the norm, which loads
    # nothing
    m = Mechanism("wheel", gravity=(0.0, 0.0, 0.0))
    attach(m, Revolute, "axle", "rim", J=1e3, start=-10.0, rate=5.0)
    m.force(JointSpringDamper("spring", "axle", stiffness=500.0))
    run = simulate(m.build(formulation="absolute"), 1.0, backend="vm")
    w = np.sqrt(0.5)
    expected = -10.0 * np.cos(w * run.t) + 5.0 / w * np.sin(w * run.t)
    np.testing.assert_allclose(run["axle"], expected, atol=1e-4)
    assert run.statistics.steps < 60


def test_angles_that_no_force_asks_for_are_no_states() -> None:
    without = drill(True, 0.0, stiffness=0.0).build()
    assert [v.name for v in without.x] == ["top", "rock", "top_rate", "rock_rate"]
    assert [v.name for v in drill(True, 0.0).build().x][4:] == ["pipe"]


def test_forces_of_users_see_full_turns_too() -> None:
    m = drill(True, -10.0, stiffness=0.0)
    pipe = m.joints[1]

    def spring(kin):
        angle, _ = kin.along(pipe, "turn")
        return (0.0, 0.0, 0.0), (0.0, 0.0, -473.0 * angle)

    m.force(UserForce("own", "bit", spring))
    model = m.build()
    assert model.initial_state({"top": 1.0})[-1] == pytest.approx(-11.0)
    run = simulate(model, 0.5, backend="vm")
    assert run["pipe"][0] == pytest.approx(-10.0)
    np.testing.assert_allclose(run["pipe"], run["rock"] - run["top"], atol=1e-6)


def test_functions_of_positions_count_the_turns_of_parallel_axes() -> None:
    bias = functions(drill(True, -10.0))["bias"]
    q = [0.0, -10.0 + 4.0 * np.pi]  # top, rock
    moment = bias(q, [0.0, 0.0], [], []).full().ravel()
    wound = -473.0 * q[1]
    assert moment == pytest.approx([-6000.0 + wound, 4000.0 - wound])


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_a_string_starts_as_wound_up_as_the_joints_of_its_loop_are(formulation: str) -> None:
    # -20 rad of the bit left -1.15 rad in the string, without a word
    m = drill(True, -20.0)
    top, pipe, rock = m.joints
    m.joints = [top, rock, replace(pipe, start=None)]
    model = m.build(formulation=formulation)
    k = [v.name for v in model.x].index("pipe")
    assert model.initial_state()[k] == pytest.approx(-20.0, abs=1e-12)
    if formulation == "joint":
        moved = model.initial_state({"rock": -33.0, "top": 1.0})
        assert moved[k] == pytest.approx(-34.0)


def test_in_space_the_start_of_a_joint_says_which_of_the_turns_is_meant() -> None:
    q, qd = ca.SX.sym("q", 2), ca.SX.sym("qd", 2)
    assert str(constant_slopes(ca.dot(ca.DM([2.0, -1.0]), qd), qd)) == "[[2, -1]]"
    assert constant_slopes(q[0] * qd[1], qd) is None
