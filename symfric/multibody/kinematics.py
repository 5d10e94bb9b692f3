"""Positions, velocities and accelerations of all bodies, by recursion from the ground."""

from dataclasses import dataclass
from math import pi
from typing import NamedTuple, final

import casadi as ca
import numpy as np

from symfric.foundation.checks import check_names
from symfric.foundation.numeric import nonzeros
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import stacked
from symfric.model.kinds import POSITION
from symfric.multibody.joint import Joint
from symfric.multibody.spatial import GROUND, Frame
from symfric.multibody.topology import Link, Topology, body_of, frame_at


@final
class Cuts:
    """Mutable collection of symbols l and their values in the order of the recursions.

    If all quantities are substituted, the balance of each link depends on the coordinates of all
    links, and its Jacobian is dense. With a symbol for each quantity passed between bodies
    (orientation, velocities and accelerations towards the tips, wrenches towards the ground), each
    equation depends on neighbouring links only. Elimination link by link, from the tips to the
    ground, then takes a number of operations proportional to the number of links, as in the
    articulated-body algorithm, but for all unknowns of an implicit step.

    Attributes:
        links: number of the link to which each entry of l belongs.
    """

    def __init__(self) -> None:
        self._symbols, self._values = list[ca.SX](), list[ca.SX]()
        self.links: list[int] = []

    @property
    def symbols(self) -> ca.SX:
        """The symbols l, shape (k, 1)."""
        return stacked(self._symbols)

    @property
    def values(self) -> ca.SX:
        """Value of each entry of l, in terms of coordinates and preceding entries of l."""
        return stacked(self._values)

    def __call__(self, link: int, expression: ca.SX) -> ca.SX:
        """Return `expression` with entries other than numbers and symbols replaced by symbols."""
        cut = ca.SX(expression)
        for k, value in enumerate(nonzeros(cut)):
            if not (value.is_constant() or value.is_symbolic()):
                symbol = ca.SX.sym(f"l_{len(self.links)}")
                self._symbols.append(symbol)
                self._values.append(value)
                self.links.append(link)
                cut.nz[k] = symbol
        return cut

    def needed(self, expression: ca.SX) -> list[int]:
        """Return the indices of the entries of l on which `expression` depends, also indirectly."""
        found = np.zeros(len(self.links), dtype=bool)
        found[ca.jacobian_sparsity(expression, self.symbols).get_triplet()[1]] = True
        own = ca.jacobian_sparsity(self.values, self.symbols).T
        first, columns = (np.array(part, dtype=int) for part in (own.colind(), own.row()))
        for k in range(found.size - 1, -1, -1):
            if found[k]:
                found[columns[first[k] : first[k + 1]]] = True
        return [int(k) for k in np.flatnonzero(found)]


PARALLEL = 1e-9
"""Largest difference between derivatives of a rate at several positions due to rounding."""


class Turn(NamedTuple):
    """State that counts full turns of a joint that closes a loop, and its rate [rad/s].

    The pose of two bodies gives the angle between them modulo 2 pi. A force that depends on the
    number of turns needs the angle as a state phi of the model, whose rate is the relative angular
    velocity. Its initial value is the angle of the pose plus the full turns of the start of the
    joint; if all axes are parallel, also those of the other joints of the loop:

        phi' = a' q'  with constant a,   so that   phi - phi_0 = a' (q - q_0)
    """

    angle: Variable
    rate: ca.SX


def constant_slopes(rate: ca.SX, qd: ca.SX) -> ca.SX | None:
    """Return the derivative a' of `rate` by `qd`, shape (1, n); None if it is not constant."""
    slopes = ca.densify(ca.jacobian(rate, qd))
    at = ca.symvar(slopes)
    numbers = ca.Function("slopes", [stacked(at)], [slopes])
    anywhere = np.random.default_rng(0)
    found = [numbers(anywhere.uniform(-1, 1, len(at))).full() for _ in range(3)]
    if np.ptp(found, axis=0).max(initial=0.0) > PARALLEL:
        return None
    return ca.SX(ca.sparsify(ca.DM(found[0].round(9))))


ZERO = ca.SX(3, 1)


class Motion(NamedTuple):
    """Motion of a body B relative to the world W.

    Attributes:
        R, p: orientation R_WB and position p_WB of the origin.
        w_B, v_B: angular velocity and velocity of the origin, in components of B.
        dw_B, dv_B: angular acceleration, and acceleration of the origin minus the gravitational
            acceleration, in components of B.
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

    def place(self, offset: ca.SX) -> ca.SX:
        """Return the position in the world of a point fixed to the body."""
        return self.p + self.R @ offset

    def point(self, offset: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Return the position and velocity in the world of a point fixed to the body."""
        return self.place(offset), self.R @ (self.v_B + ca.cross(self.w_B, offset))


class Relative(NamedTuple):
    """Pose and motion of a joint's child frame in its parent frame, in the parent's components.

    Attributes:
        R, p: pose.
        w, v: relative angular velocity, and velocity of the origin of the child frame.
        R_WP: orientation of the parent frame in the world.
        p_WC: position of the origin of the child frame in the world.
    """

    R: ca.SX
    p: ca.SX
    w: ca.SX
    v: ca.SX
    R_WP: ca.SX
    p_WC: ca.SX


@final
@dataclass(frozen=True, eq=False)
class Kinematics:
    """Motions of all bodies in terms of coordinates q, rates qd and accelerations qdd.

    Forces and constraints may use `motion`, `point`, `along`, `rate` and the time `t`.
    """

    topology: Topology
    q: ca.SX
    qd: ca.SX
    qdd: ca.SX
    motion: dict[str, Motion]
    t: ca.SX
    cuts: Cuts | None = None
    turns: dict[str, Turn] | None = None

    def point(self, place: str) -> tuple[ca.SX, ca.SX]:
        """Return the position and velocity of the origin of the frame "body.frame" in the world."""
        body, _, frame = place.partition(".")
        if body not in self.motion or frame not in self.topology.bodies[body].frames:
            raise ValueError(f"kinematics: expected a place 'body.frame', got {place}")
        return self.motion[body].point(self.frame(place).p)

    def frame(self, place: str) -> Frame:
        """Return the frame "body.frame" on its body."""
        return frame_at(self.topology.bodies, place)

    def relative(self, joint: Joint) -> Relative:
        """Return the pose and motion of the child frame of `joint` relative to its parent frame."""
        P, C = self.frame(joint.parent), self.frame(joint.child)
        parent, child = self.motion[body_of(joint.parent)], self.motion[body_of(joint.child)]
        R_WP = parent.R @ P.R
        p_WP, v_WP = parent.point(P.p)
        p_WC, v_WC = child.point(C.p)
        R, arm = R_WP.T @ child.R @ C.R, p_WC - p_WP
        w = R_WP.T @ (child.w - parent.w)
        v = R_WP.T @ (v_WC - v_WP - ca.cross(parent.w, arm))
        return Relative(R, R_WP.T @ arm, w, v, R_WP, p_WC)

    def rotation(self, joint: Joint) -> ca.SX:
        """Return R_PC of a joint."""
        link = self.topology.link_of.get(joint.name)
        return self.relative(joint).R if link is None else joint.pose(self.q[link.rows, 0])[0]

    def spin(self, joint: Joint) -> ca.SX:
        """Return the relative angular velocity w_PC of a joint, in the parent's components."""
        link = self.topology.link_of.get(joint.name)
        if link is None:
            return self.relative(joint).w
        q, qd = self.q[link.rows, 0], self.qd[link.rows, 0]
        return joint.pose(q)[0] @ (joint.subspace(q)[0] @ qd)

    def along(self, joint: Joint | str, direction: str = "") -> tuple[ca.SX, ca.SX]:
        """Return the displacement or angle of a joint in one of its `directions`, and its rate.

        `joint` may be a name, and the only direction, or else "turn", may be omitted. The angle of
        a joint that closes a loop counts full turns in forces; in constraints it is between -pi and
        pi.
        """
        if isinstance(joint, str):
            check_names("kinematics: along: joint", [joint], self.topology.joints)
            joint = self.topology.joints[joint]
            direction = joint.way(direction)
            check_names(f"kinematics: along: {joint.name}", [direction], joint.directions)
        link, rate = self.topology.link_of.get(joint.name), self.rate(joint, direction)
        if link is not None:
            return self.q[link.first + joint.directions[direction]], rate
        relative = self.relative(joint)
        s = joint.displacement(direction, relative.R, relative.p)
        if self.turns is not None and not joint.linear(direction):
            s = self._counted(self.turns, joint, joint.directions[direction], s, rate)
        return s, rate

    def _counted(
        self, turns: dict[str, Turn], joint: Joint, k: int, angle: ca.SX, rate: ca.SX
    ) -> ca.SX:
        """Return the state in `turns` that equals `angle` modulo 2 pi; create it if missing."""
        name = joint.coordinate(k)
        if name not in turns:
            near, slopes = ca.SX(joint.starts[k]), constant_slopes(rate, self.qd)
            if slopes is not None:
                starts = stacked(x for link in self.topology.links for x in link.joint.starts)
                moved = slopes @ self.q
                near = moved if joint.start is None else near + moved - slopes @ starts
            start = angle + 2 * pi * ca.floor((near - angle) / (2 * pi) + 0.5)
            doc = "angle of a joint that closes a loop"
            turns[name] = Turn(Variable(name, "rad", start=start, doc=doc, kind=POSITION), rate)
        return turns[name].angle.symbol

    def rate(self, joint: Joint, direction: str) -> ca.SX:
        """Return the rate of the displacement or angle of a joint in one of its `directions`."""
        link = self.topology.link_of.get(joint.name)
        if link is not None:
            return self.qd[link.first + joint.directions[direction]]
        relative = self.relative(joint)
        axis = joint.axis(direction, relative.R)
        return ca.dot(axis, relative.v if joint.linear(direction) else relative.w)


def kinematics(
    topology: Topology, q: ca.SX, qd: ca.SX, qdd: ca.SX, t: ca.SX, g: ca.SX, cuts: Cuts | None
) -> Kinematics:
    """Return the motions of all bodies, by recursion from the ground to the tips.

    Args:
        topology: bodies and the tree of joints.
        q, qd, qdd: coordinates, rates, accelerations, shape (n, 1).
        t: symbol of time.
        g: gravity [m/s^2]; the ground, and with it every body, is accelerated by -g instead.
        cuts: replaces quantities passed between bodies by symbols; None substitutes everything.
    """
    motion = {GROUND: Motion(ca.SX.eye(3), ZERO, ZERO, ZERO, ZERO, ca.sparsify(-g))}
    for k, link in enumerate(topology.links):
        own = _carried(motion[link.base], link, q, qd, qdd)
        motion[link.body] = own if cuts is None else Motion(*(cuts(k, part) for part in own))
    return Kinematics(topology, q, qd, qdd, motion, t, cuts)


def _carried(base: Motion, link: Link, q: ca.SX, qd: ca.SX, qdd: ca.SX) -> Motion:
    """Return the motion of the body of `link`, given the motion of its base A.

    P and C are the joint's frames on the base and on the body. All terms are rotated into the body
    before they are added; the contribution of the joint is simplest in its own axes.
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
    own_w, own_v = R_BC @ (H_w @ qd), R_BP @ (H_v @ qd)
    w_A, on_arm = R_BA @ base.w_B, ca.cross(base.w_B, arm)
    w = w_A + own_w
    on_body = ca.cross(w, to_body)
    dw = R_BA @ base.dw_B + ca.cross(w_A, own_w) + R_BC @ (H_w @ qdd + drift_w)
    dv = R_BA @ (base.dv_B + ca.cross(base.dw_B, arm) + ca.cross(base.w_B, on_arm))
    dv += 2 * ca.cross(w_A, own_v) + R_BP @ (H_v @ qdd + drift_v)
    dv = dv + ca.cross(dw, to_body) + ca.cross(w, on_body)
    v = R_BA @ (base.v_B + on_arm) + own_v + on_body
    R_WB = ca.sparsify(base.R @ R_BA.T)
    return Motion(R_WB, base.p + base.R @ arm + R_WB @ to_body, w, v, dw, dv)
