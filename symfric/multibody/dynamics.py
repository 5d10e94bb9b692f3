"""Equations of motion by Newton and Euler, in one recursion from the tips of the tree inwards.

With the accelerations a of the coordinates and the multipliers lam of the loops as unknowns,

    balance(q, q', a, lam) = M a + Phi_q' lam - Q = 0,   Phi_q a + gamma = 0

where each row of the balance is the wrench that a joint of the tree transmits, projected on its
motion subspace. The rest of that wrench is the reaction that loads the bearing; for a joint that
closes a loop it follows from its multipliers. Both are wrenches on the joint's child about the
origin of the joint's frame there and in the axes of that frame.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import final

import casadi as ca

from symfric.foundation.variable import stacked
from symfric.multibody.forces import Axial, Load
from symfric.multibody.joint import Joint
from symfric.multibody.joints import Floating
from symfric.multibody.kinematics import Kinematics, Motion, Relative
from symfric.multibody.spatial import GROUND, Body, skew
from symfric.multibody.topology import Link, body_of, frame_at

Wrench = tuple[ca.SX, ca.SX]
"""Force and moment."""


@final
@dataclass(frozen=True, eq=False)
class Loop:
    """Constraints of a joint that closes a loop.

    Attributes:
        rows: its multipliers among all.
        phi: constraints, shape (m, 1).
        C_v, C_w: phi' = C_v v + C_w w for the relative motion in the parent frame.
    """

    joint: Joint
    rows: slice
    phi: ca.SX
    C_v: ca.SX
    C_w: ca.SX
    relative: Relative

    def reaction(self, lam: ca.SX) -> Wrench:
        """Return the wrench on the child at its joint point, in the parent's joint frame."""
        own = lam[self.rows, 0]
        return -self.C_v.T @ own, -self.C_w.T @ own


def loops(kin: Kinematics) -> tuple[Loop, ...]:
    """Return the constraints of all joints that are not in the tree."""
    found: list[Loop] = []
    first = 0
    for joint in kin.topology.loops:
        relative = kin.relative(joint)
        R, p, w = ca.SX.sym("R", 3, 3), ca.SX.sym("p", 3), ca.SX.sym("w", 3)
        phi = ca.densify(joint.constraints(R, p))
        turned = ca.jtimes(phi, ca.vec(R), ca.vec(skew(w) @ R))
        expressions = [phi, ca.jacobian(phi, p), ca.jacobian(turned, w)]
        values = ca.substitute(
            expressions, [R, p], [ca.densify(relative.R), ca.densify(relative.p)]
        )
        m = phi.numel()
        C_v, C_w = (ca.sparsify(value) for value in values[1:])
        found.append(Loop(joint, slice(first, first + m), values[0], C_v, C_w, relative))
        first += m
    return tuple(found)


def normalisations(kin: Kinematics) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return norms of the Euler parameters, (p'p - 1)/2 = 0, and their terms in the balance.

    Returns:
        Constraints (k, 1); the directions p in which the mass matrix is singular, as the columns
        of (n, k); weights (k, 1) that make it regular: adding weight p (p'a + p''p') has no effect
        if the constraints hold.
    """
    links = [link for link in kin.topology.links if link.joint.quaternion is not None]
    phi, along, weights = ca.SX(0, 1), ca.SX(kin.topology.n, 0), ca.SX(0, 1)
    for link in links:
        first = link.first + (link.joint.quaternion or 0)
        p = kin.q[first : first + 4]
        column = ca.SX(kin.topology.n, 1)
        column[first : first + 4] = p
        phi = ca.vertcat(phi, (ca.dot(p, p) - 1) / 2)
        along = ca.horzcat(along, column)
        body = kin.topology.bodies[link.body]
        weights = ca.vertcat(weights, 1.0 if body.ideal else ca.trace(body.J))
    return phi, along, weights


def _pairs(kin: Kinematics, axial: Axial) -> tuple[Load, Load]:
    """Return an axial load of a joint that closes a loop, as loads on both bodies."""
    relative, joint = kin.relative(axial.joint), axial.joint
    along = relative.R_WP @ joint.axis(axial.direction, relative.R) * axial.value
    none = ca.SX(3, 1)
    force, moment = (along, none) if joint.linear(axial.direction) else (none, along)
    child, parent = body_of(axial.joint.child), body_of(axial.joint.parent)
    return (
        Load(child, force, relative.p_WC, moment),
        Load(parent, -force, relative.p_WC, -moment),
    )


def balance(
    kin: Kinematics, applied: Iterable[Load | Axial], closed: tuple[Loop, ...], lam: ca.SX
) -> tuple[ca.SX, dict[str, Wrench]]:
    """Return the rows of the equations of motion, and the reaction in every joint.

    The weight of the normalisations is not included.
    """
    links = kin.topology.links
    loads: list[Load] = []
    axial: dict[str, list[Axial]] = {}
    for load in applied:
        if isinstance(load, Load):
            loads.append(load)
        elif load.joint.name in kin.topology.link_of:
            axial.setdefault(load.joint.name, []).append(load)
        else:
            loads += _pairs(kin, load)
    reactions: dict[str, Wrench] = {}
    for loop in closed:
        force_P, moment_P = loop.reaction(lam)
        R_WP, R_CP, at = loop.relative.R_WP, loop.relative.R.T, loop.relative.p_WC
        reactions[loop.joint.name] = R_CP @ force_P, R_CP @ moment_P
        force, moment = R_WP @ force_P, R_WP @ moment_P
        on_child = frame_at(kin.topology.bodies, loop.joint.child).p
        loads.append(Load(body_of(loop.joint.child), force, at, moment, on_child))
        loads.append(Load(body_of(loop.joint.parent), -force, at, -moment))
    carrying = {link.base for link in links}
    carried: dict[str, Wrench] = {}
    rows: list[ca.SX] = [ca.SX(0, 1)] * len(links)
    for k in range(len(links) - 1, -1, -1):
        link = links[k]
        if _floats(kin, link) and link.body not in carrying:
            rows[k] = _floating(kin, link, loads)
            reactions[link.joint.name] = ca.SX(3, 1), ca.SX(3, 1)
            continue
        force, moment = _inertial(kin, link, loads)
        if link.body in carried:
            more_force, more_moment = carried[link.body]
            force, moment = force + more_force, moment + more_moment
        if kin.cuts is not None:
            force, moment = kin.cuts(k, force), kin.cuts(k, moment)
        carried[link.body] = force, moment
        rows[k], reactions[link.joint.name] = _project(kin, link, carried, axial)
    return stacked(rows), reactions


def _floats(kin: Kinematics, link: Link) -> bool:
    """Return True if the coordinates of a link are those of its centre of mass in the world."""
    centred = (link.at_body.p - kin.topology.bodies[link.body].c).is_zero()
    return isinstance(link.joint, Floating) and link.base == GROUND and not link.reverse and centred


def _floating(kin: Kinematics, link: Link, loads: list[Load]) -> ca.SX:
    """Return the balance of a free body that carries no other body.

    Its forces stay in world components: transformed into the body and back, R R' would be
    multiplied out in every derivative.
    """
    body, motion, rows = kin.topology.bodies[link.body], kin.motion[link.body], link.rows
    ground = kin.motion[GROUND]
    force = body.mass * (link.at_base.R @ kin.qdd[rows, 0][:3] + ground.dv_B)
    moment = body.J @ motion.dw_B + ca.cross(motion.w_B, body.J @ motion.w_B)
    for load in loads:
        if load.body == link.body:
            force -= load.force
            moment -= _moment_about(body, motion, load)
    H_w, _ = link.subspace(kin.q[rows, 0])
    return ca.vertcat(link.at_base.R.T @ force, H_w[:, 3:].T @ (link.at_body.R.T @ moment))


def _moment_about(body: Body, motion: Motion, load: Load) -> ca.SX:
    """Return the moment of a load about the centre of mass, in the body's components."""
    com = motion.point(body.c)[0]
    arm = motion.R.T @ (load.point - com) if load.arm is None else load.arm - body.c
    return motion.R.T @ load.moment + ca.cross(arm, motion.R.T @ load.force)


def _inertial(kin: Kinematics, link: Link, loads: list[Load]) -> Wrench:
    """Return inertial minus applied wrench of a body about its centre of mass, in its
    components.
    """
    body, motion = kin.topology.bodies[link.body], kin.motion[link.body]
    w, J = motion.w_B, body.J
    force = body.mass * motion.acceleration(body.c)
    moment = J @ motion.dw_B + ca.cross(w, J @ w)
    for load in loads:
        if load.body == link.body:
            force -= motion.R.T @ load.force
            moment -= _moment_about(body, motion, load)
    return force, moment


def _project(
    kin: Kinematics, link: Link, carried: dict[str, Wrench], axial: dict[str, list[Axial]]
) -> tuple[ca.SX, Wrench]:
    """Return the balance of a link's coordinates and the wrench of its joint on the joint's child.

    `carried` holds the wrench that each body needs from its joint, about its centre of mass and in
    its own components; that of the base A is increased by the wrench of this link. The reaction is
    in the axes of the joint's frame on the child, about its origin.
    """
    body, q = kin.topology.bodies[link.body], kin.q[link.rows, 0]
    R_PC, p = link.pose(q)
    force, moment = carried[link.body]
    about = moment + ca.cross(body.c - link.at_body.p, force)
    force_C, about_C = link.at_body.R.T @ force, link.at_body.R.T @ about
    force_P, about_P = R_PC @ force_C, R_PC @ about_C
    if link.base != GROUND:
        R_AP, base = link.at_base.R, kin.topology.bodies[link.base]
        arm = link.at_base.p + R_AP @ p - base.c
        f, m = carried.get(link.base, (ca.SX(3, 1), ca.SX(3, 1)))
        passed = R_AP @ force_P
        carried[link.base] = f + passed, m + R_AP @ about_P + ca.cross(arm, passed)
    H_w, H_v = link.subspace(q)
    rows = H_w.T @ about_C + H_v.T @ force_P
    for load in axial.get(link.joint.name, ()):
        rows[load.joint.directions[load.direction]] -= load.value
    if not link.reverse:
        return rows, (force_C, about_C)
    return rows, (-force_P, -about_P - ca.cross(p, force_P))


def kinetic_energy(kin: Kinematics) -> ca.SX:
    """Return the kinetic energy of all bodies [J]."""
    total = ca.SX(0)
    for link in kin.topology.links:
        body, motion = kin.topology.bodies[link.body], kin.motion[link.body]
        w = motion.w_B
        v = motion.v_B + ca.cross(w, body.c)
        total += body.mass * ca.dot(v, v) / 2 + ca.dot(w, body.J @ w) / 2
    return total
