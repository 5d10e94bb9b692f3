"""Newton-Euler equations of motion, in one recursion from the tips of the tree to the base.

With the accelerations a of the coordinates and the multipliers lam of the loops as unknowns,

    balance(q, q', a, lam) = M a + Phi_q' lam - Q = 0,   Phi_q a + gamma = 0

where each row of the balance is the wrench that a joint of the tree transmits, projected on its
motion subspace. The remaining part of the wrench is the reaction that loads the bearing. The
reaction of a joint that closes a loop follows from its multipliers. Reactions act on the child of
the joint, about the origin and in the axes of the joint's frame on the child.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import casadi as ca

from symfric.foundation.variable import stacked
from symfric.multibody.forces import ZERO, Axial, Load
from symfric.multibody.joint import Joint
from symfric.multibody.joints import Distance, Floating
from symfric.multibody.kinematics import Kinematics, Relative
from symfric.multibody.spatial import GROUND, skew
from symfric.multibody.topology import Link, body_of

Wrench = tuple[ca.SX, ca.SX]
"""Force and moment."""


def numbered(name: str, count: int) -> tuple[str, ...]:
    """Return names of multipliers: `<name>_lambda`, or `<name>_lambda_1`, ... for several."""
    if count == 1:
        return (f"{name}_lambda",)
    return tuple(f"{name}_lambda_{i + 1}" for i in range(count))


def twist_jacobian(phi: ca.SX, R: ca.SX, p: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return C_v, C_w of phi' = C_v v + C_w w, with v = p' and w the angular velocity of R.

    The pose R, p must consist of symbols.
    """
    w = ca.SX.sym("w", 3)
    turned = ca.jtimes(phi, ca.vec(R), ca.vec(skew(w) @ R))
    return ca.jacobian(phi, p), ca.jacobian(turned, w)


class LoopConstraints(NamedTuple):
    """Constraints of a joint that closes a loop.

    Attributes:
        phi: constraints, shape (m, 1).
        C_v, C_w: phi' = C_v v + C_w w for the relative motion in the parent frame.
    """

    joint: Joint
    phi: ca.SX
    C_v: ca.SX
    C_w: ca.SX
    relative: Relative

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the multipliers."""
        return numbered(self.joint.name, self.phi.numel())

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the multipliers.

        The multiplier of a constraint on positions is a force, that of a constraint on directions
        is a moment, and that of a rod, which constrains its squared length, is a force per length.
        """
        if isinstance(self.joint, Distance):
            return ("N/m",)
        along = (self.C_v[i, :] for i in range(self.phi.numel()))
        return tuple("N m" if row.nnz() == 0 or row.is_zero() else "N" for row in along)

    def reaction(self, lam: ca.SX) -> Wrench:
        """Return the wrench on the child at its joint point, in the parent's joint frame."""
        return -self.C_v.T @ lam, -self.C_w.T @ lam

    def loads(self, kin: Kinematics, reaction: Wrench) -> tuple[Load, Load]:
        """Return the loads of the reaction on the child and on the parent."""
        R_WP, at = self.relative.R_WP, self.relative.p_WC
        force, moment = R_WP @ reaction[0], R_WP @ reaction[1]
        child, parent = self.joint.child, self.joint.parent
        return (
            Load(body_of(child), force, at, moment, kin.frame(child).p),
            Load(body_of(parent), -force, at, -moment),
        )


def loop_of(kin: Kinematics, joint: Joint) -> LoopConstraints:
    """Return the constraints of a joint that is not in the tree."""
    relative = kin.relative(joint)
    R, p = ca.SX.sym("R", 3, 3), ca.SX.sym("p", 3)
    phi = ca.densify(joint.constraints(R, p))
    expressions, pose = [phi, *twist_jacobian(phi, R, p)], [relative.R, relative.p]
    phi, C_v, C_w = ca.substitute(expressions, [R, p], [ca.densify(part) for part in pose])
    return LoopConstraints(joint, phi, ca.sparsify(C_v), ca.sparsify(C_w), relative)


def normalisations(kin: Kinematics) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return the norm constraints of Euler parameters, (p'p - 1)/2 = 0, and their balance terms.

    Returns:
        The constraints (k, 1); the directions p in which the mass matrix is singular, as columns
        (n, k); and weights (k, 1) that make it regular. The added term weight p (p'a + p''p') is
        zero if the constraints hold.
    """
    phi, along, weights = ca.SX(0, 1), ca.SX(kin.topology.n, 0), ca.SX(0, 1)
    for link in kin.topology.links:
        if link.joint.quaternion is None:
            continue
        first = link.first + link.joint.quaternion
        p, column = kin.q[first : first + 4], ca.SX(kin.topology.n, 1)
        column[first : first + 4] = p
        body = kin.topology.bodies[link.body]
        phi = ca.vertcat(phi, (ca.dot(p, p) - 1) / 2)
        along = ca.horzcat(along, column)
        weights = ca.vertcat(weights, 1.0 if body.ideal else ca.trace(body.J))
    return phi, along, weights


def balance(kin: Kinematics, applied: Iterable[Load | Axial]) -> tuple[ca.SX, dict[str, Wrench]]:
    """Return the rows of the equations of motion and the reaction in each joint of the tree.

    The terms of the norm constraints are not included. Reactions are the wrenches that constraints
    transmit, without the axial loads of the joint.
    """
    links = kin.topology.links
    loads: dict[str, list[Load]] = {name: [] for name in kin.motion}
    axial: dict[str, list[Axial]] = {link.joint.name: [] for link in links}
    for load in applied:
        if isinstance(load, Axial) and load.joint.name in axial:
            axial[load.joint.name].append(load)
        else:
            for one in (load,) if isinstance(load, Load) else load.loads(kin):
                loads[one.body].append(one)
    carrying = {link.base for link in links}
    carried: dict[str, Wrench] = {}
    rows: list[ca.SX] = [ca.SX(0, 1)] * len(links)
    reactions: dict[str, Wrench] = {}
    for k, link in reversed(list(enumerate(links))):
        if _floats(kin, link) and link.body not in carrying:
            rows[k] = _floating(kin, link, loads[link.body])
            reactions[link.joint.name] = ZERO, ZERO
            continue
        force, moment = _inertial(kin, link, loads[link.body])
        if link.body in carried:
            more_force, more_moment = carried[link.body]
            force, moment = force + more_force, moment + more_moment
        if kin.cuts is not None:
            force, moment = kin.cuts(k, force), kin.cuts(k, moment)
        carried[link.body] = force, moment
        rows[k], reactions[link.joint.name] = _project(kin, link, carried, axial[link.joint.name])
    return stacked(rows), reactions


def _floats(kin: Kinematics, link: Link) -> bool:
    """Return True if the coordinates of a link are the pose of its centre of mass in the ground."""
    centred = (link.at_body.p - kin.topology.bodies[link.body].c).is_zero()
    return isinstance(link.joint, Floating) and link.base == GROUND and not link.reverse and centred


def _floating(kin: Kinematics, link: Link, loads: Sequence[Load]) -> ca.SX:
    """Return the balance of a free body that carries no other body.

    Forces remain in world components: a transformation to body components and back would leave
    R R' in every derivative.
    """
    body, motion, rows = kin.topology.bodies[link.body], kin.motion[link.body], link.rows
    force = body.mass * (link.at_base.R @ kin.qdd[rows, 0][:3] + kin.motion[GROUND].dv_B)
    moment = body.J @ motion.dw_B + ca.cross(motion.w_B, body.J @ motion.w_B)
    for load in loads:
        force -= load.force
        moment -= load.moment_about(body, motion)
    H_w, _ = link.subspace(kin.q[rows, 0])
    return ca.vertcat(link.at_base.R.T @ force, H_w[:, 3:].T @ (link.at_body.R.T @ moment))


def _inertial(kin: Kinematics, link: Link, loads: Sequence[Load]) -> Wrench:
    """Return the inertial minus the applied wrench of a body about its centre of mass.

    Components are those of the body.
    """
    body, motion = kin.topology.bodies[link.body], kin.motion[link.body]
    w, c = motion.w_B, body.c
    a = motion.dv_B + ca.cross(motion.dw_B, c) + ca.cross(w, ca.cross(w, c))
    force, moment = body.mass * a, body.J @ motion.dw_B + ca.cross(w, body.J @ w)
    for load in loads:
        force -= motion.R.T @ load.force
        moment -= load.moment_about(body, motion)
    return force, moment


def _project(
    kin: Kinematics, link: Link, carried: dict[str, Wrench], axial: Sequence[Axial]
) -> tuple[ca.SX, Wrench]:
    """Return the balance of a link's coordinates and the reaction of its joint on the child.

    `carried` contains the wrench that each body requires from its joint, about the centre of mass
    and in components of that body; the wrench of this link is added to that of its base A. The
    reaction is in the axes and about the origin of the joint's frame on the child.
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
        f, m = carried.get(link.base, (ZERO, ZERO))
        passed = R_AP @ force_P
        carried[link.base] = f + passed, m + R_AP @ about_P + ca.cross(arm, passed)
    H_w, H_v = link.subspace(q)
    rows = H_w.T @ about_C + H_v.T @ force_P
    reaction = [force_C, about_C]
    if link.reverse:
        reaction = [-force_P, -about_P - ca.cross(p, force_P)]
    R = link.joint.pose(q)[0] if link.reverse else R_PC
    for load in axial:
        rows[load.joint.directions[load.direction]] -= load.value
        along = ca.sparsify(R.T @ link.joint.axis(load.direction, R))
        k = 0 if link.joint.linear(load.direction) else 1
        reaction[k] = reaction[k] - along * load.value
    return rows, (reaction[0], reaction[1])


def kinetic_energy(kin: Kinematics) -> ca.SX:
    """Return the kinetic energy of all bodies [J]."""
    total = ca.SX(0)
    for link in kin.topology.links:
        body, motion = kin.topology.bodies[link.body], kin.motion[link.body]
        w = motion.w_B
        v = motion.v_B + ca.cross(w, body.c)
        total += body.mass * ca.dot(v, v) / 2 + ca.dot(w, body.J @ w) / 2
    return total
