"""Expressions of a mechanism in one choice of coordinates."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import final

import casadi as ca

from symfric.foundation.numeric import Scalar
from symfric.foundation.variable import stacked
from symfric.laws.composed.isotropic import SpatialSlip
from symfric.multibody.constraints import Constraint, Held
from symfric.multibody.dynamics import Loop, Wrench, balance, kinetic_energy, loops, normalisations
from symfric.multibody.forces import Axial, Force, Gravity, Load
from symfric.multibody.joint import Contact, Joint
from symfric.multibody.kinematics import Cuts, Kinematics, Turn, Turns, kinematics
from symfric.multibody.spatial import vector
from symfric.multibody.topology import Topology, body_of, frame_at


@final
@dataclass(frozen=True, eq=False)
class Equations:
    """Equations of motion with accelerations, multipliers and friction forces as symbols.

    Attributes:
        q, qd, a: coordinates, rates, accelerations, shape (n, 1).
        lam: multipliers of loops, then further constraints, then Euler parameters, shape (m, 1).
        F: friction forces of the contacts [N].
        held: constraints other than joints.
        turns: angles of loops that forces need.
        norms: number of Euler parameter norms, which are the last constraints.
        phi, phi_dot, phi_ddot: constraints on three levels, shape (m, 1).
        balance: M a + Phi_q' lam - Q, shape (n, 1), affine in a, lam and F.
        contacts: of all joints with friction.
        normals: normal force of each contact [N], in terms of q, qd, a, lam.
        kinetic, potential: energies [J].
        power: power of all applied forces, of friction and of drives on the bodies [W].
        reactions: wrench on the child of each joint at its joint point, in the child's joint frame.
        pressing: the wrenches that load bearings; of joints that only close loops, their own.
    """

    kin: Kinematics
    loops: tuple[Loop, ...]
    held: tuple[Held, ...]
    turns: tuple[Turn, ...]
    norms: int
    q: ca.SX
    qd: ca.SX
    a: ca.SX
    lam: ca.SX
    F: ca.SX
    phi: ca.SX
    phi_dot: ca.SX
    phi_ddot: ca.SX
    balance: ca.SX
    contacts: tuple[Contact, ...]
    normals: tuple[ca.SX, ...]
    kinetic: ca.SX
    potential: ca.SX
    power: ca.SX
    reactions: dict[str, Wrench]
    pressing: dict[str, Wrench]

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return self.q.numel()

    @property
    def m(self) -> int:
        """Number of constraints."""
        return self.phi.numel()

    @property
    def Phi_q(self) -> ca.SX:
        """Constraint Jacobian, shape (m, n)."""
        return ca.jacobian(self.phi, self.q)

    @property
    def phi_t(self) -> ca.SX:
        """Partial derivative of the constraints by time, shape (m, 1)."""
        return ca.jacobian(self.phi, self.kin.t)

    @property
    def mass(self) -> ca.SX:
        """Mass matrix M, shape (n, n)."""
        return ca.jacobian(self.balance, self.a)


def equations(
    topology: Topology,
    joints: Sequence[Joint],
    forces: Sequence[Force],
    constraints: Sequence[Constraint],
    q: ca.SX,
    qd: ca.SX,
    t: ca.SX,
    kept: Sequence[int] | None = None,
    cuts: Cuts | None = None,
) -> Equations:
    """Write the equations of motion of a mechanism.

    Args:
        topology: tree and loops.
        joints: all joints.
        forces: all applied forces.
        constraints: other than joints.
        q, qd: symbols of the coordinates and their rates, shape (n, 1).
        t: symbol of time.
        kept: indices of the independent constraints; None keeps all.
        cuts: introduces symbols for quantities passed between bodies; None writes everything out.
    """
    a = ca.SX.sym("a", topology.n)
    gravity = [f for f in forces if isinstance(f, Gravity)]
    g = sum((vector(f.g) for f in gravity), ca.SX(3, 1))
    kin = kinematics(topology, q, qd, a, t, g, cuts)
    by_name = {joint.name: joint for joint in joints}
    closed = loops(kin)
    norms, along, inertia = normalisations(kin)
    held = tuple(c.held(kin, by_name) for c in constraints)
    turns = Turns()
    kin = replace(kin, turns=turns)
    phi = ca.vertcat(ca.SX(0, 1), *(part.phi for part in (*closed, *held)), norms)
    kept = range(phi.numel()) if kept is None else kept
    lam = ca.SX.sym("lam", len(kept))
    every = ca.SX(phi.numel(), 1)
    for k, row in enumerate(kept):
        every[row] = lam[k]
    contacts = tuple(_contacts(kin, joints))
    rest = (f for f in forces if not isinstance(f, Gravity))
    loads: list[Load | Axial] = [load for f in rest for load in f.loads(kin, by_name)]
    loads += [load for c in contacts for load in _rubbing(kin, by_name[c.joint], c)]
    weights = [load for f in gravity for load in f.loads(kin, by_name)]
    power = _power(kin, [*loads, *weights]) + ca.dot(every, ca.jacobian(phi, t))
    loads += _holding(held, every[sum(loop.phi.numel() for loop in closed) :, 0])
    rows, world = balance(kin, loads, closed, every)
    rows += along @ (every[phi.numel() - norms.numel() :, 0])
    pushed = along.T @ a + ca.jtimes(along.T @ qd, q, qd)
    rows += along @ (inertia * pushed)
    phi = phi[list(kept), 0]
    phi_dot = ca.jtimes(phi, q, qd) + ca.jacobian(phi, t)
    reactions = {name: _without(world[name], name, kin, loads) for name in by_name}
    own = {loop.joint.name: loop.reaction(every) for loop in closed if loop.joint.closes}
    pressing = reactions | own
    return Equations(
        kin,
        closed,
        held,
        turns.found,
        norms.numel(),
        q,
        qd,
        a,
        lam,
        stacked(c.F for c in contacts),
        ca.densify(phi),
        phi_dot,
        ca.jtimes(phi, q, a) + ca.jtimes(phi_dot, q, qd) + ca.jacobian(phi_dot, t),
        ca.densify(rows),
        contacts,
        tuple(_normal(kin, c, by_name[c.joint], pressing) for c in contacts),
        kinetic_energy(kin),
        sum((f.energy(kin, by_name) for f in forces), ca.SX(0)),
        power,
        reactions,
        pressing,
    )


def normals_with(eq: Equations, eps: Mapping[str, Scalar]) -> tuple[ca.SX, ...]:
    """Return the normal force of each contact, rounded over the widths `eps` by `pressed` name."""
    joints = {link.joint.name: link.joint for link in eq.kin.topology.links}
    joints |= {loop.joint.name: loop.joint for loop in eq.loops}
    return tuple(
        _normal(
            eq.kin,
            replace(c, friction=replace(c.friction, eps=eps[c.pressed])),
            joints[c.joint],
            eq.pressing,
        )
        for c in eq.contacts
    )


def _without(wrench: Wrench, name: str, kin: Kinematics, loads: Sequence[Load | Axial]) -> Wrench:
    """Return the wrench that the constraints of a joint in the tree transmit, without axial
    loads.
    """
    if name not in kin.topology.link_of:
        return wrench
    force, moment = ca.SX(wrench[0]), ca.SX(wrench[1])
    link = kin.topology.link_of[name]
    R = link.joint.pose(kin.q[link.rows, 0])[0]
    for load in loads:
        if isinstance(load, Axial) and load.joint.name == name:
            own = ca.sparsify(R.T @ link.joint.axis(load.direction, R)) * load.value
            if link.joint.linear(load.direction):
                force -= own
            else:
                moment -= own
    return force, moment


def _holding(held: Sequence[Held], lam: ca.SX) -> list[Load | Axial]:
    """Return loads of constraints other than joints, whose multipliers come first in `lam`."""
    loads: list[Load | Axial] = []
    first = 0
    for part in held:
        m = part.phi.numel()
        loads += part.loads(lam[first : first + m, 0])
        first += m
    return loads


def _contacts(kin: Kinematics, joints: Sequence[Joint]) -> list[Contact]:
    """Return the contacts of all joints with friction."""
    found: list[Contact] = []
    for joint in joints:
        if joint.friction is None:
            continue
        friction = joint.friction
        for direction in joint.rubs:
            name = joint.name if len(joint.rubs) == 1 else f"{joint.name}_{direction}"
            rate = kin.spin(joint) if direction == "ball" else kin.rate(joint, direction)
            slip = rate if direction == "slide" else friction.arm * rate
            law = SpatialSlip(friction.law) if direction == "ball" else friction.law
            pressed = name if direction in ("x", "y") else joint.name
            F = ca.SX.sym(f"{name}_friction", slip.numel())
            found.append(Contact(name, joint.name, direction, friction, law, pressed, slip, F))
    return found


def _rubbing(kin: Kinematics, joint: Joint, contact: Contact) -> list[Load | Axial]:
    """Return the friction on the child of a joint, and on the parent."""
    if contact.direction != "ball":
        return [Axial(joint, contact.direction, contact.load)]
    parent, child = body_of(joint.parent), body_of(joint.child)
    R_WP = kin.motion[parent].R @ frame_at(kin.topology.bodies, joint.parent).R
    moment, none = R_WP @ contact.load, ca.SX(3, 1)
    return [
        Load(body, none, kin.motion[body].p, sign * moment, none)
        for body, sign in ((child, 1), (parent, -1))
    ]


def _normal(kin: Kinematics, contact: Contact, joint: Joint, reactions: dict[str, Wrench]) -> ca.SX:
    """Return the normal force of a contact [N]."""
    F, T = reactions[joint.name]
    if contact.direction not in ("x", "y"):
        return joint.normal_force(contact.friction, F, T)
    R = joint.bearing(contact.direction, kin.rotation(joint))
    return contact.friction.normal_force(("turn",), R @ F, R @ T)


def _power(kin: Kinematics, loads: Sequence[Load | Axial]) -> ca.SX:
    """Return the power of loads on the bodies [W]."""
    total = ca.SX(0)
    for load in loads:
        if isinstance(load, Load):
            total += load.power(kin)
        else:
            total += load.value * kin.rate(load.joint, load.direction)
    return total
