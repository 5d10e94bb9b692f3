"""Robots of URDF files as scenes: the law at the level of every joint, parameters by name."""

import numpy as np
import pytest
from robots import MOVING, SMALL, random_robot

from symfric import BrownMcPhee, Coulomb, LuGre, parameters, simulate
from symfric.multibody import JointFriction
from symfric.multibody.urdf import relative
from symfric.scenes import Robot

BARE = SMALL.replace(' friction="0.2"', "")


@pytest.mark.parametrize(("text", "level", "expected"), [(SMALL, 5.0, 0.2), (BARE, 5.0, 5.0)])
def test_tag_comes_before_the_level_of_all_joints(text: str, level: float, expected: float) -> None:
    run = simulate(Robot(LuGre(), text, level=level).model(), 0.01)
    assert run["hinge_N"][0] == expected


def test_joint_with_less_torque_than_its_level_stays_where_it_is() -> None:
    """The rod pulls with 1.45 N m, twice that as it is let go; 3 N m hold it, 1 N m do not."""
    law = relative(LuGre())
    ends = [
        simulate(Robot(law, BARE, level=level).model(), 1.0, x0={"hinge": 0.3}).final["hinge"]
        for level in (3.0, 1.0)
    ]
    assert ends[0] == pytest.approx(0.3, abs=1e-4)
    assert abs(ends[1] - 0.3) > 0.1


def test_without_tag_and_level_the_law_leaves_no_trace() -> None:
    with pytest.warns(UserWarning, match="BrownMcPhee has no effect"):
        model = Robot(BrownMcPhee(), BARE).model()
    assert not model.monitors


def test_every_parameter_can_be_free() -> None:
    scene = Robot(LuGre(), random_robot(2, 5, MOVING), level=1.0)
    names = list(parameters(scene))
    free, fixed = scene.model(names), scene.model()
    assert [p.name for p in free.p] == names
    assert free.initial_state() == pytest.approx(fixed.initial_state(), abs=1e-12)
    last = [simulate(model, 0.2, rtol=1e-8).final for model in (free, fixed)]
    assert last[0] == pytest.approx(last[1], rel=1e-5, abs=1e-6)


def test_joints_that_turn_have_units_of_turning_and_sliders_those_of_sliding() -> None:
    """Slip [m/s] and friction [N] of hinges were rad/s and N m."""
    hinge = Robot(LuGre(), SMALL).model()
    slider = Robot(LuGre(), SMALL.replace("revolute", "prismatic")).model()
    for model, slip, force, z in ((slider, "m/s", "N", "m"), (hinge, "rad/s", "N m", "rad")):
        assert model.signals["hinge_slip"] == slip
        assert model.signals["hinge_friction"] == force
        assert model.signals["hinge_z"] == z


def test_friction_of_a_moment_has_a_level_and_no_radius() -> None:
    level = "normal: expected the level of the friction moment [N m], got none"
    assert list(JointFriction(Coulomb(), turning=True).problems(("turn",))) == [level]
    slides = JointFriction(Coulomb(), normal=1.0, turning=True).problems(("slide",))
    assert list(slides) == ["turning: expected a joint that turns about an axis only"]
    both = JointFriction(Coulomb(), radius=0.1, normal=1.0, turning=True).problems(("turn",))
    assert list(both) == ["radius: expected none with turning, got 0.1"]


TWO = SMALL.replace(
    "</robot>",
    """<link name="hand"><inertial><origin xyz="0 0 -0.1"/><mass value="1"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <joint name="wrist" type="revolute"><parent link="arm"/><child link="hand"/>
    <origin xyz="0 0 -0.5"/><axis xyz="0 1 0"/><dynamics friction="0.05"/></joint></robot>""",
)


def test_a_joint_may_have_a_law_of_its_own() -> None:
    scene = Robot(Coulomb(mu_d=1.0), TWO, joints=("wrist",), laws=(relative(LuGre()),))
    model = scene.model(["mu_d_2"])
    assert [v.name for v in model.x] == ["hinge", "wrist", "hinge_rate", "wrist_rate", "wrist_z"]
    run = simulate(scene.model(), 0.5, x0={"hinge": 1.0})
    slow = np.abs(run["wrist_rate"]) > 0.05
    assert np.abs(run["wrist_friction"][slow]) == pytest.approx(0.05 * 0.1 / 0.15, rel=1e-2)
    names = parameters(scene)
    assert (names["mu_d_1"].value, names["mu_s"].value) == (1.0, 1.0)


def test_laws_of_joints_that_are_not_there_are_refused() -> None:
    with pytest.raises(ValueError, match=r"urdf 'small' laws: expected one of hinge, wrist, got"):
        Robot(LuGre(), TWO, joints=("elbow",), laws=(LuGre(),)).model()
    with pytest.raises(ValueError, match="a law for every one of the joints, got 1 joints and 0"):
        Robot(LuGre(), TWO, joints=("wrist",))
    with pytest.raises(ValueError, match="Robot: laws: expected a law such as"):
        Robot(LuGre(), TWO, joints=("wrist",), laws=("lugre",))  # type: ignore[arg-type]
