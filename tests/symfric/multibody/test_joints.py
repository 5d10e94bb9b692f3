"""Joints and trees: pose, motion subspace and constraints fit each other."""

from typing import ClassVar

import casadi as ca
import numpy as np
import pytest

from symfric import multibody as mb
from symfric.model.sketch import Symbol
from symfric.multibody.joint import COMPONENTS, Pair, unit
from symfric.multibody.spatial import (
    rotation_y,
    rotation_z,
    skew,
)
from symfric.multibody.topology import absolute, spanning_tree
from symfric.results.kinds import kinds

MOVING = [kind for kind in mb.ALL_JOINTS if not kind.closes]
IN_PLANE = {
    mb.PlanarRevolute: rotation_z,
    mb.PlanarPrismatic: rotation_y,
    mb.PinInSlot: rotation_y,
}
"""Rotation in the plane of a joint that closes planar loops."""
each_joint = pytest.mark.parametrize("kind", mb.ALL_JOINTS, ids=lambda kind: kind.__name__)
each_moving = pytest.mark.parametrize("kind", MOVING, ids=lambda kind: kind.__name__)


def joint(kind: type[mb.Joint]) -> mb.Joint:
    return kind("j", "a", "b")


def coordinates(kind: type[mb.Joint], seed: int = 0) -> np.ndarray:
    q = np.random.default_rng(seed).normal(size=len(kind.coordinates))
    if kind.quaternion is not None:
        q[kind.quaternion :] /= np.linalg.norm(q[kind.quaternion :])
    return q


@each_moving
def test_pose_motion_subspace_and_constraints_fit_each_other(kind: type[mb.Joint]) -> None:
    """The subspace is the derivative of the pose; constraints vanish, and do no work in it."""
    n = len(kind.coordinates)
    q, qd = ca.SX.sym("q", n), ca.SX.sym("qd", n)
    R, p = joint(kind).pose(q)
    H_w, H_v = joint(kind).subspace(q)
    R_dot = ca.reshape(ca.jtimes(ca.vec(ca.densify(R)), q, qd), 3, 3)
    p_dot = ca.jtimes(ca.densify(p), q, qd)
    zero = R_dot - R @ skew(H_w @ qd), p_dot - H_v @ qd, joint(kind).constraints(R, p)
    values = ca.Function("v", [q, qd], [ca.densify(x) for x in (*zero, R, p, H_v, R @ H_w)])
    at, rates = coordinates(kind), np.random.default_rng(1).normal(size=n)
    if kind.quaternion is not None:
        unit = at[kind.quaternion :]
        rates[kind.quaternion :] -= unit * (unit @ rates[kind.quaternion :])
    *zero, R, p, v, w = (m.full() for m in values.call([at, rates]))
    zero.append(twist_derivatives(kind, R, p) @ np.vstack([v, w]))
    for left in zero:
        assert left == pytest.approx(np.zeros(left.shape), abs=1e-14)
    freedoms = np.linalg.matrix_rank(np.vstack([v, w])) if n else 0
    assert freedoms == joint(kind).freedoms


def twist_derivatives(kind: type[mb.Joint], R: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Constraint rows along relative velocity and angular velocity."""
    R_s, p_s, w = ca.SX.sym("R", 3, 3), ca.SX.sym("p", 3), ca.SX.sym("w", 3)
    phi = ca.densify(joint(kind).constraints(R_s, p_s))
    by_w = ca.jacobian(ca.jtimes(phi, ca.vec(R_s), ca.vec(skew(w) @ R_s)), w)
    rows = ca.Function("C", [R_s, p_s], [ca.densify(ca.horzcat(ca.jacobian(phi, p_s), by_w))])
    return rows(R, p).full()


@each_joint
def test_constraints_are_independent_and_hold_what_joints_transmit(kind: type[mb.Joint]) -> None:
    apart = np.array([0.0, 0.0, 1.0]) if kind.closes else np.zeros(3)
    C = twist_derivatives(kind, np.eye(3), apart)
    assert C.shape[0] == np.linalg.matrix_rank(C)
    assert kind.closes or C.shape[0] == 6 - joint(kind).freedoms
    q = ca.SX.sym("q", len(kind.coordinates))
    if kind.closes:
        R, p = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0], np.ones(3)
        if turned := IN_PLANE.get(kind):
            R = ca.DM(turned(ca.SX(0.3))).full()
    else:
        pose = ca.Function("pose", [q], [ca.densify(x) for x in joint(kind).pose(q)])
        R, p = (m.full() for m in pose.call([coordinates(kind)]))
    C = twist_derivatives(kind, R, p)
    held = np.abs(np.hstack([C[:, :3] @ R, C[:, 3:] @ R])).max(axis=0, initial=0.0)
    assert tuple(np.array(COMPONENTS)[held > 1e-12]) == kind.transmits


def test_a_new_joint_is_a_class_and_nothing_else() -> None:
    """Results, pictures and tables ask the class, not a list of names."""

    class PinInSlot(mb.Joint):
        """Slides along x and turns about z."""

        coordinates = (("slide", "m"), ("angle", "rad"))
        directions: ClassVar = {"x": 0, "turn": 1}
        transmits = ("Fy", "Fz", "Mx", "My")
        symbol = Symbol("o", axes=(("a", 2),))

        def pose(self, q: ca.SX) -> Pair:
            return rotation_z(q[1]), ca.vertcat(q[0], 0, 0)

        def subspace(self, q: ca.SX) -> Pair:
            return ca.horzcat(ca.SX(3, 1), unit(2)), ca.horzcat(unit(0), ca.SX(3, 1))

        def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
            return ca.vertcat(p[1], p[2], R[0, 2], R[1, 2])

    m = mb.Mechanism("slotted", gravity=(0.0, -9.81, 0.0))
    m.body("bob", 1.0, (0.1, 0.1, 0.1))
    m.joint(PinInSlot("pin", "ground", "bob", rate=(1.0, 2.0)))
    for formulation in ("joint", "absolute"):
        model = m.build(formulation=formulation)
        reactions = {name for name in model.further if name.startswith("pin_")}
        reactions -= {"pin_slide_acc", "pin_angle_acc"}
        assert reactions == {"pin_Fy", "pin_Fz", "pin_Mx", "pin_My"}
        assert model.sketch is not None
        assert model.sketch().marks[0].symbol.marker == "o"
    assert kinds(m.build())["pin_slide"] == "position"


def full(expression: ca.SX) -> np.ndarray:
    return ca.DM(expression).full()


def test_axes_of_a_frame_are_right_handed_and_z_is_kept() -> None:
    R = full(mb.Frame(z=(0.0, 3.0, 4.0), x=(1.0, 1.0, 0.0)).R)
    assert pytest.approx(np.eye(3)) == R.T @ R
    assert np.linalg.det(R) == pytest.approx(1.0)
    assert R[:, 2] == pytest.approx([0.0, 0.6, 0.8])
    for more, message in (
        ({"z": (0, 0, 0)}, "z: expected three numbers that are not all zero, got (0, 0, 0)"),
        ({"z": (1, 0)}, "z: expected three numbers that are not all zero, got (1, 0)"),
        ({"x": (0, 0, 2)}, "x: expected a direction not parallel to z, got (0, 0, 2)"),
        ({"at": (1.0, 2.0)}, "frame: at: expected three numbers"),
    ):
        with pytest.raises(ValueError) as caught:
            mb.Frame(**more)  # type: ignore[arg-type]
        assert message in str(caught.value)


BODIES = {name: mb.Body(name, 1.0, (1.0, 1.0, 1.0)) for name in (mb.GROUND, "a", "b", "c")}


GROUND = mb.GROUND


def test_the_joints_with_fewest_constraints_are_cut_and_bodies_hang_near_the_ground() -> None:
    ball = mb.Spherical("ball", GROUND, "a")
    for joints, tree, loops in (
        ((mb.Revolute("1", GROUND, "a"), mb.Prismatic("2", "a", "b"), mb.Spherical("3", "b", "c")),
         ["1", "2", "3"], []),
        ((ball, mb.Cylindrical("tube", "a", "b"), mb.Revolute("hinge", "b", "c"),
          mb.Fixed("weld", "c", GROUND)), ["weld", "hinge", "tube"], ["ball"]),
        ((mb.Distance("rod", GROUND, "a"), ball), ["ball"], ["rod"]),
        ((mb.Revolute("1", GROUND, "a"), mb.Revolute("2", "a", "b"), mb.Revolute("3", GROUND, "b"),
          mb.Revolute("4", "b", "c")), ["1", "3", "4"], ["2"]),
    ):  # fmt: skip
        topology = spanning_tree(BODIES, joints)
        assert [link.joint.name for link in topology.links] == tree
        assert [joint.name for joint in topology.loops] == loops


def test_a_joint_whose_child_is_nearer_to_the_ground_is_turned_round() -> None:
    (link,) = spanning_tree(BODIES, [mb.Revolute("1", "a", mb.GROUND)]).links
    assert (link.base, link.body, link.reverse) == (mb.GROUND, "a", True)


def test_absolute_coordinates_cut_every_joint() -> None:
    joints = mb.Revolute("1", mb.GROUND, "a"), mb.Revolute("2", "a", "b")
    topology = absolute(BODIES, joints, {"a": (), "b": ()})
    assert topology.n == 14
    assert [j.name for j in topology.loops] == ["1", "2"]
    assert [link.rows for link in topology.links] == [slice(0, 7), slice(7, 14)]
