"""Mechanisms from URDF files against Pinocchio, closed forms, and what the file says."""

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray
from robots import MOVING, SMALL, random_robot

from symfric import Coulomb, Law, LuGre, Sum, Viscous, parameters, simulate
from symfric.laws import Stribeck
from symfric.multibody import JointFriction, Mechanism, functions
from symfric.multibody.spatial import euler_g, rotation
from symfric.multibody.urdf import read_urdf, relative, tag_friction
from symfric.multibody.urdf_file import parse

Array = NDArray[np.float64]
LIMIT = '<limit lower="-9" upper="9" effort="9" velocity="9"/></joint>'
EASY = Coulomb(mu_d=1.0, v_eps=0.1)
each_robot = pytest.mark.parametrize("seed", range(12))
each_gravity = pytest.mark.parametrize("g", [9.81, 0.0])


@dataclass(frozen=True)
class Twin:
    """A robot here and in Pinocchio, in one random state; `rows` are its velocities there."""

    pin: Any
    model: Any
    data: Any
    mechanism: Mechanism
    names: list[str]
    rows: list[int]
    q: Array
    qd: Array
    q_there: Array
    qd_there: Array


def twin(text: str, seed: int, g: float = 9.81, law: Law | None = None) -> Twin:
    pin = pytest.importorskip("pinocchio", reason="needs Pinocchio (extra urdf-check)")
    model = pin.buildModelFromXML(text.replace("</joint>", LIMIT))  # it demands limits
    model.gravity.linear = np.array([0.0, 0.0, -g])
    mechanism = read_urdf(text, law=law, gravity=(0.0, 0.0, -g))
    names = [v.name for v in mechanism.prepare().q]
    q, qd = np.random.default_rng(seed + 1000).normal(size=(2, len(names)))
    q_there, qd_there = np.zeros(model.nq), np.zeros(model.nv)
    rows: list[int] = []
    for i, name in enumerate(names):
        joint = model.joints[model.getJointId(name)]
        at = slice(joint.idx_q, joint.idx_q + joint.nq)
        q_there[at] = q[i] if joint.nq == 1 else (np.cos(q[i]), np.sin(q[i]))
        qd_there[joint.idx_v] = qd[i]
        rows.append(joint.idx_v)
    return Twin(
        pin, model, model.createData(), mechanism, names, rows, q, qd, q_there, qd_there
    )  # fmt: skip


def robot(seed: int) -> str:
    return random_robot(seed, n=3 + seed % 10)


def close(found: Array, expected: Array) -> bool:
    return bool(np.abs(found - expected).max() <= 1e-10 * np.abs(expected).max())


def friction(text: str, t: Twin) -> Array:
    """Damping and Coulomb friction of every joint, in closed form."""
    tags = {joint.name: joint for joint in parse(text).joints}
    levels = [(tags[name].damping, tags[name].friction) for name in t.names]
    return np.array([d * w + f * np.tanh(w / 0.1) for (d, f), w in zip(levels, t.qd, strict=True)])


@each_robot
def test_mass_matrix_is_that_of_pinocchio(seed: int) -> None:
    t = twin(robot(seed), seed)
    M = t.pin.crba(t.model, t.data, t.q_there)
    M = np.triu(M) + np.triu(M, 1).T
    assert close(functions(t.mechanism)["mass"](t.q, []).full(), M[np.ix_(t.rows, t.rows)])


@each_robot
@each_gravity
def test_bias_is_that_of_pinocchio(seed: int, g: float) -> None:
    t = twin(robot(seed), seed, g)
    expected = t.pin.nonLinearEffects(t.model, t.data, t.q_there, t.qd_there)[t.rows]
    still = np.zeros(len(t.mechanism.inputs))
    found = functions(t.mechanism)["bias"](t.q, t.qd, still, []).full().ravel()
    assert np.abs(found - expected).max() <= 1e-10 * max(1.0, np.abs(expected).max())


@each_robot
@each_gravity
def test_inverse_dynamics_are_those_of_pinocchio_and_friction(seed: int, g: float) -> None:
    text = robot(seed)
    t = twin(text, seed, g, law=EASY)
    a = np.random.default_rng(seed).normal(size=t.q.size)
    a_there = np.zeros(t.model.nv)
    a_there[t.rows] = a
    expected = t.pin.rnea(t.model, t.data, t.q_there, t.qd_there, a_there)[t.rows]
    inverse = functions(t.mechanism)["inverse_dynamics"]
    still = np.zeros(len(t.mechanism.inputs))
    found = inverse(t.q, t.qd, a, [], [], still, []).full().ravel()
    assert close(found, expected + friction(text, t))


@each_robot
@each_gravity
def test_forward_dynamics_are_those_of_pinocchio_with_friction(seed: int, g: float) -> None:
    text = robot(seed)
    t = twin(text, seed, g, law=EASY)
    torque = np.random.default_rng(seed).normal(size=t.q.size) * 5
    there = np.zeros(t.model.nv)
    there[t.rows] = torque - friction(text, t)
    expected = t.pin.aba(t.model, t.data, t.q_there, t.qd_there, there)[t.rows]
    model = t.mechanism.build()
    u = dict(zip(t.names, torque, strict=True))
    inputs = [u[v.name.removeprefix("tau_")] for v in model.u]
    found = model.function("ode")(0, np.hstack([t.q, t.qd]), [], inputs, []).full().ravel()
    assert len(model.z) == 0
    assert close(found[t.q.size :], expected)


@each_robot
def test_every_link_is_where_pinocchio_puts_it(seed: int) -> None:
    text = robot(seed)
    t = twin(text, seed)
    t.pin.framesForwardKinematics(t.model, t.data, t.q_there)
    eq = t.mechanism.prepare().eq
    frames = {f"{place.split('.')[-1]}": (place, f) for place, f in t.mechanism.frames}
    for link in parse(text).links:
        place, frame = frames[link]
        motion = eq.kin.motion[place.partition(".")[0]]
        pose = ca.Function("pose", [eq.q], [motion.R @ frame.R, eq.kin.point(place)[0]])
        expected = t.data.oMf[t.model.getFrameId(link)]
        R, p = (x.full() for x in pose.call([t.q]))
        assert expected.rotation == pytest.approx(R, abs=1e-12), link
        assert expected.translation == pytest.approx(p.ravel(), abs=1e-12), link


def test_random_robots_have_branches_and_every_kind_of_joint() -> None:
    every = [joint for seed in range(12) for joint in parse(robot(seed)).joints]
    assert {joint.kind for joint in every} == {*MOVING, "fixed"}
    assert any(j.damping and j.friction for j in every)
    parents = [j.parent for j in parse(robot(8)).joints]
    assert len(set(parents)) < len(parents) - 2


def test_floating_joints_move_as_pinocchio_says() -> None:
    """Energies, and the accelerations of the joints that turn and slide."""
    pin = pytest.importorskip("pinocchio", reason="needs Pinocchio (extra urdf-check)")
    text = random_robot(7, 5, ("floating", *MOVING))
    there = pin.buildModelFromXML(text.replace("</joint>", LIMIT))
    rng = np.random.default_rng(1)
    mechanism = read_urdf(text)
    made, f = mechanism.prepare(), functions(mechanism)
    q, qd = np.zeros(made.eq.n), np.zeros(made.eq.n)
    q_there, qd_there = pin.neutral(there), np.zeros(there.nv)
    columns = {v.name: i for i, v in enumerate(made.q)}
    rows = {}
    for joint in parse(text).joints:
        if joint.kind == "fixed":
            continue
        j = there.joints[there.getJointId(joint.name)]
        at, at_v = j.idx_q, j.idx_v
        if joint.kind == "floating":
            p, e, v, w = (rng.normal(size=n) for n in (3, 4, 3, 3))
            e /= np.linalg.norm(e)
            here = slice(columns[f"{joint.name}_x"], columns[f"{joint.name}_x"] + 7)
            R, G = (ca.DM(x(ca.SX(e))).full() for x in (rotation, euler_g))
            q[here] = [*p, *e]
            qd[here] = [*(R @ v), *(G.T @ w / 2)]
            q_there[at : at + 7] = [*p, *e[1:], e[0]]
            qd_there[at_v : at_v + 6] = [*v, *w]
            continue
        angle, rate = rng.normal(size=2)
        q[columns[joint.name]], qd[columns[joint.name]] = angle, rate
        q_there[at : at + j.nq] = angle if j.nq == 1 else (np.cos(angle), np.sin(angle))
        qd_there[at_v] = rate
        rows[columns[joint.name]] = at_v
    data = there.createData()
    kinetic, potential = (float(x) for x in f["energy"].call([q, qd, []]))
    assert kinetic == pytest.approx(pin.computeKineticEnergy(there, data, q_there, qd_there))
    assert potential == pytest.approx(pin.computePotentialEnergy(there, data, q_there))
    still = np.zeros(len(mechanism.inputs))
    M, b = f["mass"](q, []).full(), f["bias"](q, qd, still, []).full().ravel()
    J = f["constraints"].call([q, []])[1].full()
    m = J.shape[0]
    drift = [sum(qd[k] ** 2 for k in np.flatnonzero(row)) for row in J]
    matrix = np.block([[M, J.T], [J, np.zeros((m, m))]])
    a = np.linalg.solve(matrix, np.hstack([-b, -np.array(drift)]))
    expected = pin.aba(there, data, q_there, qd_there, np.zeros(there.nv))
    assert a[list(rows)] == pytest.approx(expected[list(rows.values())], rel=1e-10)


def rod(**changes: str) -> str:
    text = SMALL
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    return text


def test_damping_is_viscous_and_friction_a_constant_torque_without_any_unknown() -> None:
    model = read_urdf(SMALL).build()
    assert ([v.name for v in model.x], model.z) == (["hinge", "hinge_rate"], ())
    assert [(v.name, v.unit) for v in model.u] == [("tau_hinge", "N m")]
    inertia, weight = 0.1 + 2 * 0.25**2, 2 * 9.81 * 0.25
    f = model.function("ode")
    for rate, torque in ((0.5, 0.2 + 0.3 * 0.5), (-2.0, -0.2 - 0.3 * 2.0), (0.0, 0.0)):
        acceleration = float(f(0, [0.3, rate], [], [0.0], [])[1])
        assert acceleration == pytest.approx(-(weight * np.sin(0.3) + torque) / inertia, rel=1e-12)


@pytest.mark.parametrize(
    ("damping", "level", "expected"),
    [(0.0, 0.0, None), (0.3, 0.0, Viscous), (0.0, 0.2, Coulomb), (0.3, 0.2, Sum)],
)
def test_tags_of_zero_add_no_friction(
    damping: float, level: float, expected: type[Law] | None
) -> None:
    text = rod(**{'damping="0.3" friction="0.2"': f'damping="{damping}" friction="{level}"'})
    friction = tag_friction(parse(text).joints[0])
    assert friction is None if expected is None else isinstance(friction.law, expected)  # type: ignore[union-attr]


def test_another_law_gets_the_friction_tag_as_its_normal_force() -> None:
    run = simulate(read_urdf(SMALL, law=relative(LuGre())).build(), 0.2, x0={"hinge": 1.2})
    assert "hinge_z" in run.units
    rate = run["hinge_rate"][-1]
    assert rate < -0.5
    # sliding at mu_d/mu_s = 1/1.5 of the level, and the damping of the file
    assert run["hinge_friction"][-1] == pytest.approx(0.3 * rate - 0.2 / 1.5, rel=1e-6)


def test_relative_law_breaks_away_at_its_normal_force() -> None:
    law = relative(Stribeck(mu_s=0.6, mu_d=0.15, sigma_2=0.7))
    values = {name: p.value for name, p in parameters(law).items()}
    assert (values["mu_s"], values["mu_d"], values["sigma_2"]) == (1.0, 0.25, 0.7)
    assert relative(viscous := Viscous()) is viscous


def test_bearings_replace_what_the_file_says_by_friction_of_the_reactions() -> None:
    bearing = JointFriction(Coulomb(), radius=0.01)
    model = read_urdf(SMALL, bearings={"hinge": bearing}).build()
    assert [v.name for v in model.z] == ["hinge_N"]
    weight = simulate(model, 1e-3, rtol=1e-8)["hinge_N"][0]
    assert weight == pytest.approx(2 * 9.81, rel=1e-4)


WELDED = """<robot name="dumb bell">
  <link name="world"/><link name="hub-0"/>
  <joint name="spin" type="continuous"><parent link="world"/><child link="left"/>
    <axis xyz="0 0 2"/></joint>
  <link name="left"><inertial><mass value="1"/>
    <inertia ixx="0.1" iyy="0.2" izz="0.3"/></inertial></link>
  <joint name="weld" type="fixed"><parent link="left"/><child link="hub-0"/>
    <origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/></joint>
  <joint name="weld2" type="fixed"><parent link="hub-0"/><child link="right"/>
    <origin xyz="0 2 0" rpy="1.5707963267948966 0 0"/></joint>
  <link name="right"><inertial><origin xyz="0 0.5 0"/><mass value="3"/>
    <inertia ixx="0.1" iyy="0.2" izz="0.3"/></inertial></link>
</robot>"""


def test_links_held_by_fixed_joints_are_one_body() -> None:
    """Two bars turned against each other: parallel axes by hand."""
    with pytest.warns(UserWarning, match="names changed: link 'hub-0' to hub_0"):
        m = read_urdf(WELDED)
    _, body = m.bodies
    assert (m.name, body.name, body.mass) == ("dumb_bell", "left", 4.0)
    # right is at (-1, 0, 0), its y up and its x along y; its mass half a metre above
    assert body.com == pytest.approx((-0.75, 0.0, 0.375))
    d2, h2 = 3 / 4, 3 / 4 * 0.5**2
    expected = [0.1 + 0.3 + h2, 0.2 + 0.1 + d2 + h2, 0.3 + 0.2 + d2, 0.0, d2 * 0.5, 0.0]
    assert [float(x) for x in body.inertia] == pytest.approx(expected, abs=1e-12)
    places = {place: frame for place, frame in m.frames}
    assert ca.DM(places["left.right"].p).full().ravel() == pytest.approx([-1.0, 0.0, 0.0])


def test_quarter_turns_leave_zeros() -> None:
    with pytest.warns(UserWarning, match="hub_0"):
        m = read_urdf(WELDED)
    assert m.bodies[1].J.nnz() == 5
    assert functions(m)["mass"].n_instructions() <= 3


def test_massless_root_is_the_ground_and_a_heavy_one_may_float() -> None:
    assert [b.name for b in read_urdf(SMALL, floating=True).bodies] == ["ground", "arm"]
    heavy = rod(**{'<link name="world"/>': '<link name="world"><inertial><mass value="1"/><inertia '
                   'ixx="1" iyy="1" izz="1"/></inertial></link>'})  # fmt: skip
    assert [b.name for b in read_urdf(heavy).bodies] == ["ground", "arm"]
    model = read_urdf(heavy, floating=True, gravity=(0.0, 0.0, 0.0)).build()
    assert [v.name for v in model.x][:4] == [f"floating_base_{k}" for k in ("x", "y", "z", "e0")]
    run = simulate(model, 2.0, x0={"hinge_rate": 3.0, "floating_base_y_rate": 0.1}, rtol=1e-9)
    # nothing from outside: the centre of mass moves on as it did, p_y = (3 y + 2 s) of the arm
    assert run["energy"][0] > run["energy"][-1]
    assert np.ptp(run["floating_base_y"] - 0.1 * run.t) < 1e-9


MIMIC = """<robot name="gripper"><link name="palm"/>
  <joint name="a" type="revolute"><parent link="palm"/><child link="l1"/><axis xyz="0 1 0"/></joint>
  <link name="l1"><inertial><origin xyz="0.1 0 0"/><mass value="1"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial></link>
  <joint name="b" type="prismatic"><parent link="l1"/><child link="l2"/><axis xyz="1 0 0"/>
    <mimic joint="a" multiplier="-0.5" offset="0.2"/></joint>
  <link name="l2"><inertial><mass value="2"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial>
  </link></robot>"""


def test_mimic_joint_follows_and_its_mass_is_felt() -> None:
    """Of both joints with b = 0.2 - a/2 put in: the equation of one coordinate."""
    m = read_urdf(MIMIC)
    model = m.build()
    assert [v.name for v in model.u] == ["tau_a"]
    run = simulate(model, 1.0, rtol=1e-10, samples=11)
    assert run["b"] == pytest.approx(0.2 - run["a"] / 2, abs=1e-11)
    assert np.ptp(run["energy"]) < 1e-8
    f, s = functions(m), -0.5
    M, bias = f["mass"]([0.0, 0.2], []).full(), f["bias"]([0.0, 0.2], [0, 0], [0], []).full()
    T = np.array([[1.0], [s]])
    expected = -(T.T @ bias).item() / (T.T @ M @ T).item()
    short = simulate(model, 1e-3, rtol=1e-10, samples=2)
    assert short["a_rate"][-1] == pytest.approx(1e-3 * expected, rel=1e-3)


def test_all_that_is_left_out_is_said_once() -> None:
    more = '<limit lower="-1" upper="1"/><safety_controller k_velocity="1"/></joint><gazebo/>'
    visual = '<visual><geometry><sphere radius="1"/></geometry></visual></link>'
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read_urdf(rod(**{"</joint>": more, "</inertial></link>": f"</inertial>{visual}"}))
    (message,) = (str(w.message) for w in caught)
    expected = "<safety_controller> of joint 'hinge', <limit> of joint 'hinge', <gazebo>"
    assert message == f"urdf 'small': left out: {expected}"


def test_law_that_no_joint_uses_is_said() -> None:
    with pytest.warns(UserWarning, match="left out: LuGre, because no joint has <dynamics fric"):
        read_urdf(rod(**{' friction="0.2"': ""}), law=LuGre())


def test_planar_joint_takes_no_friction_and_says_so() -> None:
    with pytest.warns(UserWarning, match="<dynamics> of planar joint 'hinge'"):
        m = read_urdf(rod(revolute="planar"))
    assert [v.name for v in m.build().x[:3]] == ["hinge_x", "hinge_y", "hinge_angle"]


def test_names_are_kept_apart() -> None:
    """A link and its joint of one name, and a link called ground."""
    text = rod(arm="ground", hinge="ground").replace("world", "1 base")
    with pytest.warns(
        UserWarning, match="joint 'ground' to ground_joint, link 'ground' to ground_"
    ):
        m = read_urdf(text)
    assert [v.name for v in m.build().x] == ["ground_joint", "ground_joint_rate"]
    assert {place for place, _ in m.frames} >= {"ground._1_base", "ground_link.ground_link"}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({'mass value="2"': 'mass value="0"', "0.1": "0", "0.01": "0"},
         "urdf 'small' > link 'arm' > inertial: expected a mass > 0 kg, because joint 'hinge'"),
        ({"hinge": "a-b", "</robot>": '<joint name="a_b" type="continuous"><parent link="arm"/>'
          '<child link="x"/></joint><link name="x"><inertial><mass value="1"/><inertia ixx="1" '
          'iyy="1" izz="1"/></inertial></link><joint name="a_b_joint" type="continuous"><parent '
          'link="arm"/><child link="y"/></joint><link name="y"><inertial><mass value="1"/><inertia '
          'ixx="1" iyy="1" izz="1"/></inertial></link></robot>'},
         "joint 'a-b': expected a name that differs from that of joint 'a_b_joint' as a C ident"),
    ],
)  # fmt: skip
def test_what_cannot_be_a_mechanism_is_refused(changes: dict[str, str], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read_urdf(rod(**changes))


def test_unknown_bearing_is_refused_with_the_joints_there_are() -> None:
    friction = JointFriction(Coulomb(), radius=0.01)
    with pytest.raises(ValueError, match="urdf 'small' bearings: expected one of hinge, got elbow"):
        read_urdf(SMALL, bearings={"elbow": friction})


def test_file_is_read_by_its_path(tmp_path: Path) -> None:
    path = tmp_path / "small.urdf"
    path.write_text(f'<?xml version="1.0" encoding="utf-8"?>\n<!-- ä -->{SMALL}', encoding="utf-8")
    assert read_urdf(path).name == read_urdf(str(path)).name == "small"


def test_inertia_that_cannot_be_is_refused_with_the_name_of_the_link() -> None:
    with pytest.raises(
        ValueError, match="mechanism 'small' > body 'arm' > inertia: expected the l"
    ):
        read_urdf(rod(**{'izz="0.01"': 'izz="0.5"'})).build()
