"""Positions, velocities and accelerations of all bodies: one recursion outwards from the ground."""

from dataclasses import dataclass, fields
from typing import final

import casadi as ca

from symfric.foundation.symbols import stacked
from symfric.multibody.body import GROUND
from symfric.multibody.cuts import Cuts
from symfric.multibody.joint import Joint
from symfric.multibody.topology import Link, Topology, body_of, frame_at
from symfric.multibody.turns import Moved, Turns

ZERO = ca.SX(3, 1)


@final
@dataclass(frozen=True, eq=False)
class Motion:
    """Motion of a body B relative to the world W.

    Attributes:
        R, p: pose R_WB, p_WB of its origin.
        w_B, v_B: angular velocity, velocity of the origin, in components of B.
        dw_B, dv_B: angular acceleration, acceleration of the origin less that of gravity, in
            components of B.
    """

    R: ca.SX
    p: ca.SX
    w_B: ca.SX
    v_B: ca.SX
    dw_B: ca.SX
    dv_B: ca.SX

    @property
    def w(self) -> ca.SX:
        """Angular velocity in world components."""
        return self.R @ self.w_B

    @property
    def v(self) -> ca.SX:
        """Velocity of the origin in world components."""
        return self.R @ self.v_B

    def point(self, offset: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Position and velocity in the world of a point fixed to the body."""
        return self.p + self.R @ offset, self.R @ (self.v_B + ca.cross(self.w_B, offset))

    def cut(self, cuts: Cuts, link: int) -> "Motion":
        """The same in new symbols."""
        return Motion(*(cuts(link, getattr(self, part.name)) for part in fields(self)))

    def acceleration(self, offset: ca.SX) -> ca.SX:
        """Acceleration, less gravity, of a point fixed to the body, in components of B."""
        w, r = self.w_B, offset
        return self.dv_B + ca.cross(self.dw_B, r) + ca.cross(w, ca.cross(w, r))


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

    What a force or a constraint may ask: `motion`, `point`, `along`, `rate` and the time `t`.
    """

    topology: Topology
    q: ca.SX
    qd: ca.SX
    qdd: ca.SX
    motion: dict[str, Motion]
    t: ca.SX
    cuts: Cuts | None = None
    turns: Turns | None = None

    def point(self, place: str) -> tuple[ca.SX, ca.SX]:
        """Position and velocity in the world of the origin of the frame "body.frame"."""
        body, _, frame = place.partition(".")
        if body not in self.motion or frame not in self.topology.bodies[body].frames:
            raise ValueError(f"kinematics: expected a place 'body.frame', got {place}")
        return self.motion[body].point(self.offset(place))

    def offset(self, place: str) -> ca.SX:
        """Position of the frame "body.frame" on its body, in the body's components."""
        return frame_at(self.topology.bodies, place).p

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

    def rotation(self, joint: Joint) -> ca.SX:
        """R_PC of a joint."""
        link = self.topology.link_of.get(joint.name)
        return self.relative(joint).R if link is None else joint.pose(self.q[link.rows, 0])[0]

    def spin(self, joint: Joint) -> ca.SX:
        """Relative angular velocity w_PC of a joint, in the parent's components."""
        link = self.topology.link_of.get(joint.name)
        if link is None:
            return self.relative(joint).w
        q, qd = self.q[link.rows, 0], self.qd[link.rows, 0]
        return joint.pose(q)[0] @ (joint.subspace(q)[0] @ qd)

    def along(self, joint: Joint, direction: str) -> tuple[ca.SX, ca.SX]:
        """Displacement or angle of a joint in one of its `directions`, and its rate.

        For a constraint the angle of a joint that closes a loop lies between -pi and pi.
        """
        link, rate = self.topology.link_of.get(joint.name), self.rate(joint, direction)
        if link is not None:
            return self.q[link.first + joint.directions[direction]], rate
        relative = self.relative(joint)
        s = joint.displacement(direction, relative.R, relative.p)
        if self.turns is None or joint.linear(direction):
            return s, rate
        return self.turns(joint, direction, s, rate, self._moved), rate

    @property
    def _moved(self) -> Moved:
        links = self.topology.links
        return Moved(self.q, self.qd, stacked(x for link in links for x in link.joint.starts))

    def rate(self, joint: Joint, direction: str) -> ca.SX:
        """Rate of the displacement or angle of a joint in one of its `directions`."""
        link = self.topology.link_of.get(joint.name)
        if link is not None:
            return self.qd[link.first + joint.directions[direction]]
        relative = self.relative(joint)
        axis = joint.axis(direction, relative.R)
        return ca.dot(axis, relative.v if joint.linear(direction) else relative.w)


def kinematics(
    topology: Topology,
    q: ca.SX,
    qd: ca.SX,
    qdd: ca.SX,
    t: ca.SX,
    g: ca.SX = ZERO,
    cuts: Cuts | None = None,
) -> Kinematics:
    """The recursion from the ground outwards.

    Args:
        topology: tree.
        q, qd, qdd: coordinates, rates, accelerations, shape (n, 1).
        t: symbol of time.
        g: gravity [m/s^2]; the ground is accelerated by -g instead, and all bodies with it.
        cuts: takes symbols for what bodies pass on to each other.
    """
    motion = {GROUND: Motion(ca.SX.eye(3), ZERO, ZERO, ZERO, ZERO, ca.sparsify(-g))}
    for k, link in enumerate(topology.links):
        own = _carried(motion[link.base], link, q, qd, qdd)
        motion[link.body] = own if cuts is None else own.cut(cuts, k)
    return Kinematics(topology, q, qd, qdd, motion, t, cuts)


def _carried(base: Motion, link: Link, q: ca.SX, qd: ca.SX, qdd: ca.SX) -> Motion:
    """Motion of the body of `link`, given that of its base A.

    P is the joint's frame on the base, C that on the body; everything is turned into the body
    before it is added up, so that what the joint adds stays what it is in its own axes.
    """
    q, qd, qdd = q[link.rows, 0], qd[link.rows, 0], qdd[link.rows, 0]
    R_PC, p = link.pose(q)
    H_w, H_v = link.subspace(q)
    drift_w, drift_v = (ca.sparsify(ca.jtimes(H @ qd, q, qd)) for H in (H_w, H_v))
    if link.joint.quaternion is not None and not link.reverse:
        drift_w = ca.SX(3, 1)  # G(p') p' = 0
    R_AP, R_BC, to_body = link.at_base.R, link.at_body.R, -link.at_body.p
    R_BP = ca.sparsify(R_BC @ R_PC.T)
    R_BA = ca.sparsify(R_BP @ R_AP.T)
    arm = link.at_base.p + R_AP @ p
    w_A, own_w, own_v = base.w_B, R_BC @ (H_w @ qd), R_BP @ (H_v @ qd)
    w = R_BA @ w_A + own_w
    dw = R_BA @ base.dw_B + ca.cross(R_BA @ w_A, own_w) + R_BC @ (H_w @ qdd + drift_w)
    dv = R_BA @ (base.dv_B + ca.cross(base.dw_B, arm) + ca.cross(w_A, ca.cross(w_A, arm)))
    dv += 2 * ca.cross(R_BA @ w_A, own_v) + R_BP @ (H_v @ qdd + drift_v)
    R_WB = ca.sparsify(base.R @ R_BA.T)
    return Motion(
        R_WB,
        base.p + base.R @ arm + R_WB @ to_body,
        w,
        R_BA @ (base.v_B + ca.cross(w_A, arm)) + own_v + ca.cross(w, to_body),
        dw,
        dv + ca.cross(dw, to_body) + ca.cross(w, ca.cross(w, to_body)),
    )
