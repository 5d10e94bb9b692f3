"""Inverse dynamics compared with the functions of mechanisms and with closed forms."""

from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import pytest
from one_program import OneProgram
from robots import random_robot, rod
from tables import Names, table

from symfric import BrownMcPhee, Coulomb, LuGre, law_from_text, multibody
from symfric.codegen import Block, law_block
from symfric.codegen.blocks.block import CBlock
from symfric.codegen.blocks.inverse_dynamics import gravity_block, inverse_dynamics_block
from symfric.codegen.runner import run_vm
from symfric.codegen.source import header
from symfric.codegen.verification import excitation
from symfric.emitter.c99 import FLOAT
from symfric.multibody import (
    GROUND,
    JointFriction,
    Mechanism,
    PrescribedMotion,
    Prismatic,
    Revolute,
    functions,
)
from symfric.multibody.urdf import read_urdf
from symfric.scenes import Arm


def call(block: Block, u: Any, states: Any = (), **parameters: float) -> tuple[Any, Any]:
    """States after a step and outputs as arrays, with some parameters changed."""
    p = [parameters.pop(v.name, float(v.start)) for v in block.parameters]
    assert not parameters
    following, y = block.step(ca.DM(states), p, u)
    return following.full().ravel(), y.full().ravel()


def moved(n: int, seed: int = 0) -> Any:
    return np.random.default_rng(seed).normal(size=3 * n)


@cache
def arm(law: type = BrownMcPhee, bare: bool = False) -> Mechanism:
    made = Arm(law()).mechanism()
    if bare:
        made.joints = [type(j)(j.name, j.parent, j.child, j.start) for j in made.joints]
    return made


@cache
def arm_block() -> Block:
    return inverse_dynamics_block(arm(), separate=True)


def test_the_arm_agrees_with_its_functions():
    u = moved(6)
    given = (*np.split(u, 3), [], [], np.zeros(6), [])
    expected, free = (
        functions(m)["inverse_dynamics"](*given).full().ravel() for m in (arm(), arm(bare=True))
    )
    _, y = call(arm_block(), u)
    assert y[:6] == pytest.approx(expected, rel=1e-12)
    assert y[6:] == pytest.approx(expected - free, rel=1e-10, abs=1e-12)
    assert [v.name for v in arm_block().inputs][::6] == ["q_1", "qd_1", "qdd_1"]
    _, more = call(arm_block(), u, mu_d_3=0.2, mu_s_3=0.3)  # parameters of one joint
    ratio = more[6:] / y[6:]
    assert np.delete(ratio, 2) == pytest.approx(np.ones(5), rel=1e-12)
    assert ratio[2] > 1.5
    assert inverse_dynamics_block(arm(), fold=True).parameters == ()


def test_payload_adds_the_forces_of_a_body():
    """J_v' m (a - g) + J_w' (J dw + w x J w) in world components, by differences of poses."""
    robot = arm(bare=True)
    block = inverse_dynamics_block(robot, payload="link6.root", payload_inertia=True)
    m, c, J = 3.0, np.array([0.1, -0.05, 0.2]), np.array([0.05, 0.06, 0.07, 0.01, -0.01, 0.005])
    given = {"payload_m": m} | {f"payload_c_{k + 1}": x for k, x in enumerate(c)}
    given |= {f"payload_J_{k + 1}": x for k, x in enumerate(J)}
    u = moved(6)
    added = call(block, u, **given)[1] - call(block, u)[1]

    q, qd, a = ca.SX.sym("q", 6), ca.SX.sym("qd", 6), ca.SX.sym("a", 6)
    pose = functions(robot)["poses"](q, [])[:, -4:]
    frame = next(f for place, f in robot.frames if place == "link6.root")
    R = pose[:, :3] @ frame.R
    p = pose[:, 3] + pose[:, :3] @ frame.p + R @ c
    v = ca.jtimes(p, q, qd)
    acceleration = ca.jtimes(v, q, qd) + ca.jtimes(v, qd, a) - ca.DM([0, 0, -9.81])
    spin = ca.jtimes(R, q, qd) @ R.T
    w = ca.vertcat(spin[2, 1], spin[0, 2], spin[1, 0])
    dw = ca.jtimes(w, q, qd) + ca.jtimes(w, qd, a)
    full = R @ ca.DM([[J[0], J[3], J[4]], [J[3], J[1], J[5]], [J[4], J[5], J[2]]]) @ R.T
    torque = full @ dw + ca.cross(w, full @ w)
    expected = m * ca.jacobian(p, q).T @ acceleration + ca.jacobian(w, qd).T @ torque
    values = ca.Function("f", [q, qd, a], [expected])(*np.split(u, 3)).full().ravel()
    assert added == pytest.approx(values, rel=1e-10)


def test_gravity_holds_at_rest():
    q = moved(6)[:6]
    _, at_rest = call(arm_block(), [*q, *np.zeros(12)])
    _, holding = call(gravity_block(arm()), q)
    assert holding == pytest.approx(at_rest[:6], rel=1e-12, abs=1e-12)
    _, above = call(gravity_block(arm(), tunable_gravity=True), q, g_3=9.81)
    assert above == pytest.approx(-holding, rel=1e-12, abs=1e-12)


def rotor(law: Any, radius: float = 0.1, normal: float = 1.0) -> Mechanism:
    m = Mechanism("rotor")
    m.body("wheel", 1.0, (0.1, 0.1, 0.1))
    m.joint(Revolute("hinge", GROUND, "wheel", friction=JointFriction(law, radius, normal=normal)))
    return m


def test_bristles_of_joints_make_the_step_of_their_law():
    """Under a constant load a joint is the block of its law at the bearing's surface."""
    law, radius = LuGre(), 0.05
    block, alone = inverse_dynamics_block(rotor(law, radius, 20.0)), law_block(law)
    z, y = call(block, [0.3, 0.7, 2.0], [1e-6], N_1=30.0)
    by_law, F = call(alone, [0.7 * radius, 30.0], [1e-6])
    assert z == pytest.approx(by_law, rel=1e-14)
    assert y[0] == pytest.approx(0.1 * 2.0 + radius * F[0], rel=1e-14)
    sliding = block.reset("init_sliding")(z, [float(v.start) for v in block.parameters], [0, 1, 0])
    assert float(sliding) == pytest.approx(0.1 * 20.0 / 1e5, rel=1e-6)
    block = inverse_dynamics_block(arm(LuGre), h=1e-3)
    assert [v.name for v in block.states] == [f"z_{k}" for k in range(1, 7)]
    z, _ = call(block, moved(6), np.zeros(6))
    same, _ = call(block, moved(6), [0, 0, z[2], 0, 0, 0])
    assert np.flatnonzero(same != z).tolist() == [2]


def test_mimicking_fingers_follow_their_leader():
    inertial = '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    mimic = '<mimic joint="ja" multiplier="-2" offset="0.3"/>'
    links = "".join(
        f'<link name="{n}"><inertial><origin xyz="0.1 0 0"/><mass value="{m}"/>{inertial}'
        f'<joint name="j{n}" type="revolute"><parent link="world"/><child link="{n}"/>'
        f'<axis xyz="0 1 0"/>{follow}</joint>'
        for n, m, follow in (("a", 1, ""), ("b", 2, mimic))
    )
    text = f'<robot name="grip"><link name="world"/>{links}</robot>'
    block = inverse_dynamics_block(read_urdf(text))
    assert [v.name for v in block.inputs] == ["q_1", "qd_1", "qdd_1"]
    _, y = call(block, [0.2, 0.5, 1.5])
    inertia = (0.1 + 1 * 0.01) + 4 * (0.1 + 2 * 0.01)
    weight = -9.81 * 0.1 * (1 * np.cos(0.2) - 2 * 2 * np.cos(0.3 - 2 * 0.2))
    assert y == pytest.approx([inertia * 1.5 + weight], rel=1e-12)


def bob(kind: str, **options: Any) -> Mechanism:
    m = Mechanism("bob")
    m.body("bob", 1.0, (0.1, 0.1, 0.1), com=(0.0, 0.0, -1.0))
    m.joint(getattr(multibody, kind)("socket", GROUND, "bob", **options))
    return m


CARDAN = {"friction": JointFriction(BrownMcPhee(), 0.05, length=0.1)}


def driven() -> Mechanism:
    m = rotor(BrownMcPhee())
    m.constraint(PrescribedMotion("drive", "hinge", lambda t: t * t))
    return m


def test_unsupported_mechanisms_and_options_are_refused():
    names = Names(globals())
    for call, words in table(__file__)["unsupported"].items():
        with pytest.raises(ValueError) as caught:
            names.value(f"inverse_dynamics_block({call})")
        assert words in str(caught.value), call


def test_urdf_is_accepted_as_text_and_a_fixed_tool_carries_the_load():
    tool = (
        '<link name="tool"/><joint name="flange" type="fixed"><parent link="arm"/>'
        '<child link="tool"/><origin xyz="0 0 -0.5"/></joint></robot>'
    )
    block = inverse_dynamics_block(rod(**{"</robot>": tool}), payload="tool")
    _, y = call(block, [0.4, 0.0, 0.0], payload_m=3.0)
    assert y == pytest.approx([9.81 * np.sin(0.4) * (2 * 0.25 + 3 * 0.5)], rel=1e-12)
    digit = gravity_block(rod(**{'name="small"': 'name="2dof arm"'}))
    assert digit.name == "robot_2dof_arm_gravity"


@pytest.mark.parametrize("seed", range(2))
def test_random_robots_agree_with_their_functions(seed):
    """The functions of random robots agree with Pinocchio (tests/symfric/multibody)."""
    robot = read_urdf(random_robot(seed, n=5 + seed), law=Coulomb(mu_d=1.0, v_eps=0.1))
    of_robot = functions(robot)["inverse_dynamics"]
    u = moved(len(robot.prepare().q), seed)
    others = [np.zeros(of_robot.size_in(i)) for i in range(3, of_robot.n_in())]
    expected = of_robot(*np.split(u, 3), *others).full().ravel()
    _, y = call(inverse_dynamics_block(robot), u)
    assert np.abs(y - expected).max() <= 1e-10 * np.abs(expected).max()


def test_joints_are_arrays_and_friction_has_the_number_of_its_joint(compiler, tmp_path):
    m = rotor(BrownMcPhee())
    m.body("slide", 1.0, (0.1, 0.1, 0.1))
    friction = JointFriction(law_from_text("viscous"), normal=2.0)
    m.joint(Prismatic("rail", "wheel", "slide", friction=friction))
    mixed = inverse_dynamics_block(m)
    names = [v.name for v in mixed.parameters]
    assert names == ["mu_s_1", "mu_d_1", "v_t_1", "N_1", "sigma_2_2"]  # N has no effect
    assert "Friction, numbered by joints: brown_mcphee in 1; viscous in 2." in mixed.use
    text = header(CBlock(mixed, FLOAT))
    assert "float q_2;" in text
    assert "q[2]" not in text  # the joints have different units
    block = inverse_dynamics_block(arm(LuGre), payload="link6.root")
    text = header(CBlock(block, FLOAT))
    for declared in ("q[6]", "qd[6]", "qdd[6]", "tau[6]", "z[6]", "mu_s[6]", "payload_c[3]"):
        assert f"    float {declared};" in text
    program = OneProgram([mixed, block], tmp_path, compiler)
    inputs = [excitation(b, 100) for b in (mixed, block)]
    for c, u, rows in zip(program.several, inputs, program.run([*enumerate(inputs)]), strict=True):
        assert np.array_equal(rows, run_vm(c, u))
