"""Positions, velocities and accelerations of all bodies: one recursion outwards from the ground.

All vectors are in world components.
"""

from dataclasses import dataclass
from typing import final

import casadi as ca

from symfric.multibody.body import GROUND
from symfric.multibody.joints import Joint
from symfric.multibody.topology import Link, Topology, body_of, frame_at


@final
@dataclass(frozen=True, eq=False)
class Motion:
    """Motion of a body: pose R_WB, p_WB of its origin; angular velocity w, velocity v of the origin
    and their derivatives dw, dv.
    """

    R: ca.SX
    p: ca.SX
    w: ca.SX
    v: ca.SX
    dw: ca.SX
    dv: ca.SX

    def point(self, offset: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Position and velocity of a point fixed to the body, `offset` in its components."""
        r = self.R @ offset
        return self.p + r, self.v + ca.cross(self.w, r)

    def acceleration(self, offset: ca.SX) -> ca.SX:
        """Acceleration of a point fixed to the body."""
        r = self.R @ offset
        return self.dv + ca.cross(self.dw, r) + ca.cross(self.w, ca.cross(self.w, r))


@final
@dataclass(frozen=True, eq=False)
class Relative:
    """Pose and motion of a joint's child frame in its parent frame, in the parent's components.

    Attributes:
        R, p: pose.
        w, v: relative angular velocity, velocity of the child frame's origin.
        R_WP, p_WP: parent frame in the world.
        p_WC: origin of the child frame in the world.
    """

    R: ca.SX
    p: ca.SX
    w: ca.SX
    v: ca.SX
    R_WP: ca.SX
    p_WP: ca.SX
    p_WC: ca.SX


@final
@dataclass(frozen=True, eq=False)
class Kinematics:
    """Motions of all bodies in terms of coordinates q, rates qd and accelerations qdd.

    What a force may ask: `motion`, `point`, `along`.
    """

    topology: Topology
    q: ca.SX
    qd: ca.SX
    motion: dict[str, Motion]

    def point(self, place: str) -> tuple[ca.SX, ca.SX]:
        """Position and velocity in the world of the origin of the frame "body.frame"."""
        return self.motion[body_of(place)].point(frame_at(self.topology.bodies, place).p)

    def relative(self, joint: Joint) -> Relative:
        """Pose and motion of the child frame of `joint` in its parent frame."""
        P, C = (frame_at(self.topology.bodies, place) for place in (joint.parent, joint.child))
        parent, child = self.motion[body_of(joint.parent)], self.motion[body_of(joint.child)]
        R_WP = parent.R @ P.R
        p_WP, v_WP = parent.point(P.p)
        p_WC, v_WC = child.point(C.p)
        arm = p_WC - p_WP
        return Relative(
            R_WP.T @ child.R @ C.R,
            R_WP.T @ arm,
            R_WP.T @ (child.w - parent.w),
            R_WP.T @ (v_WC - v_WP - ca.cross(parent.w, arm)),
            R_WP,
            p_WP,
            p_WC,
        )

    def along(self, joint: Joint, direction: str) -> tuple[ca.SX, ca.SX]:
        """Displacement along z ("slide") or angle about z ("turn") of a joint, and its rate.

        The angle of a joint that closes a loop lies between -pi and pi.
        """
        link = self.topology.link_of.get(joint.name)
        if link is not None:
            k = link.first + (1 if joint.slides and joint.turns and direction == "turn" else 0)
            return self.q[k], self.qd[k]
        relative = self.relative(joint)
        if direction == "slide":
            return relative.p[2], relative.v[2]
        return ca.atan2(relative.R[1, 0], relative.R[0, 0]), relative.w[2]


def kinematics(topology: Topology, q: ca.SX, qd: ca.SX, qdd: ca.SX) -> Kinematics:
    """The recursion from the ground outwards."""
    zero = ca.SX(3, 1)
    motion = {GROUND: Motion(ca.SX.eye(3), zero, zero, zero, zero, zero)}
    for link in topology.links:
        motion[link.body] = _carried(motion[link.base], link, q, qd, qdd)
    return Kinematics(topology, q, qd, motion)


def _carried(base: Motion, link: Link, q: ca.SX, qd: ca.SX, qdd: ca.SX) -> Motion:
    """Motion of the body of `link`, given that of its base."""
    q, qd, qdd = q[link.rows, 0], qd[link.rows, 0], qdd[link.rows, 0]
    R, p = link.pose(q)
    H_w, H_v = link.subspace(q)
    drift_w, drift_v = (ca.sparsify(ca.jtimes(H @ qd, q, qd)) for H in (H_w, H_v))
    R_WP = base.R @ link.at_base.R
    w_PC, v_PC = R_WP @ (H_w @ qd), R_WP @ (H_v @ qd)
    arm = base.R @ link.at_base.p + R_WP @ p
    to_body = -(R_WP @ R @ link.at_body.R.T @ link.at_body.p)
    w = base.w + w_PC
    dw = base.dw + ca.cross(base.w, w_PC) + R_WP @ (H_w @ qdd + drift_w)
    dv = base.dv + ca.cross(base.dw, arm) + ca.cross(base.w, ca.cross(base.w, arm))
    dv += 2 * ca.cross(base.w, v_PC) + R_WP @ (H_v @ qdd + drift_v)
    return Motion(
        ca.sparsify(R_WP @ R @ link.at_body.R.T),
        base.p + arm + to_body,
        w,
        base.v + ca.cross(base.w, arm) + v_PC + ca.cross(w, to_body),
        dw,
        dv + ca.cross(dw, to_body) + ca.cross(w, ca.cross(w, to_body)),
    )
