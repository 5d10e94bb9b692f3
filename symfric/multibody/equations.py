"""Equations of motion of a mechanism in given coordinates, as CasADi expressions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate, chain, pairwise
from typing import final

import casadi as ca

from symfric.foundation.numeric import Scalar
from symfric.foundation.variable import stacked, symbols_of
from symfric.multibody.actuated import ActuatedElement
from symfric.multibody.constraints import Constraint, ConstraintLoads
from symfric.multibody.contact import Contact, joint_contacts
from symfric.multibody.dynamics import (
    LoopConstraints,
    Wrench,
    balance,
    kinetic_energy,
    loop_of,
    normalisations,
)
from symfric.multibody.forces import Axial, Force, Gravity, Load
from symfric.multibody.kinematics import Cuts, Kinematics, Turn, kinematics
from symfric.multibody.spatial import vector
from symfric.multibody.topology import Topology


@final
@dataclass(frozen=True, eq=False)
class Equations:
    """Equations of motion with accelerations, multipliers and friction forces as symbols.

    Attributes:
        forces, constraints: applied forces, and constraints other than joints.
        loads: loads of each of `forces` on the bodies.
        held: equations and loads of each of `constraints`.
        turns: angles of joints in loops that forces depend on.
        norms: number of norm constraints of Euler parameters; these are the last constraints.
        q, qd, a: coordinates, rates, accelerations, shape (n, 1).
        lam: multipliers of loops, of other constraints, and of Euler parameters, shape (m, 1).
        F: friction forces of the contacts [N].
        phi, phi_dot, phi_ddot: constraints and their time derivatives, shape (m, 1).
        balance: M a + Phi_q' lam - Q, shape (n, 1), affine in a, lam and F.
        contacts: contacts of all joints and elements with friction.
        normals: normal force of each contact [N], in terms of q, qd, a, lam.
        reactions: wrench on the child of each joint at its joint point, in the child's joint frame.
        pressing: wrench that loads each bearing: the reaction; for a joint that only closes loops,
            the reaction in the parent's joint frame.
    """

    kin: Kinematics
    forces: tuple[Force, ...]
    constraints: tuple[Constraint, ...]
    loads: tuple[tuple[Load | Axial, ...], ...]
    loops: tuple[LoopConstraints, ...]
    held: tuple[ConstraintLoads, ...]
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
        """Partial derivative of the constraints with respect to time, shape (m, 1)."""
        return ca.jacobian(self.phi, self.kin.t)

    @cached_property
    def mass(self) -> ca.SX:
        """Mass matrix M, shape (n, n)."""
        return ca.jacobian(self.balance, self.a)

    @property
    def kinetic(self) -> ca.SX:
        """Kinetic energy of all bodies [J]."""
        return kinetic_energy(self.kin)

    @property
    def potential(self) -> ca.SX:
        """Potential energy of all forces [J]."""
        return sum((force.energy(self.kin) for force in self.forces), ca.SX(0))

    @property
    def power(self) -> ca.SX:
        """Power of all applied forces, of friction and of drives on the bodies [W]."""
        loads = [*chain(*self.loads), *(x for c in self.contacts for x in c.loads(self.kin))]
        total = sum((load.power(self.kin) for load in loads), ca.SX(0))
        return total + ca.dot(self.lam, self.phi_t)

    @property
    def angles(self) -> ca.SX:
        """Symbols of the angles `turns`, shape (k, 1)."""
        return symbols_of(turn.angle for turn in self.turns)

    @property
    def N(self) -> ca.SX:
        """Symbols of the normal forces that `normals` contain, shape (k, 1)."""
        return stacked(c.normal_symbol for c in self.contacts)

    @property
    def multipliers(self) -> dict[str, str]:
        """Unit of each multiplier by its name, including those of redundant constraints."""
        found: dict[str, str] = {}
        for part in (*self.loops, *self.held):
            found |= zip(part.labels, part.units, strict=True)
        links = (x for x in self.kin.topology.links if x.joint.quaternion is not None)
        return found | {f"{link.joint.name}_norm": "J" for link in links}


def equations(
    topology: Topology,
    forces: Sequence[Force],
    constraints: Sequence[Constraint],
    q: ca.SX,
    qd: ca.SX,
    t: ca.SX,
    kept: Sequence[int] | None = None,
    cuts: Cuts | None = None,
) -> Equations:
    """Return the equations of motion of a mechanism.

    Args:
        topology: bodies and joints.
        forces: all applied forces.
        constraints: constraints other than joints.
        q, qd: symbols of the coordinates and their rates, shape (n, 1).
        t: symbol of time.
        kept: indices of the independent constraints; None keeps all.
        cuts: replaces quantities passed between bodies by symbols; None substitutes everything.
    """
    a = ca.SX.sym("a", topology.n)
    gravity = [f for f in forces if isinstance(f, Gravity)]
    g = sum((vector(f.g) for f in gravity), ca.SX(3, 1))
    kin = kinematics(topology, q, qd, a, t, g, cuts)
    loops = tuple(loop_of(kin, joint) for joint in topology.loops)
    held = tuple(constraint.held(kin) for constraint in constraints)
    norms, along, inertia = normalisations(kin)
    turns: dict[str, Turn] = {}
    kin = replace(kin, turns=turns)
    phi = ca.vertcat(ca.SX(0, 1), *(part.phi for part in (*loops, *held)), norms)
    independent = [*(range(phi.numel()) if kept is None else kept)]
    lam, every = ca.SX.sym("lam", len(independent)), ca.SX(phi.numel(), 1)
    every[independent] = lam
    sizes = (part.phi.numel() for part in (*loops, *held))
    own = [every[i:j, 0] for i, j in pairwise(accumulate(sizes, initial=0))]
    of_held = list(zip(held, own[len(loops) :], strict=True))
    rubbing = (c.contacts(kin, x) for c, (_, x) in zip(constraints, of_held, strict=True))
    elements = (f.contact(kin) for f in forces if isinstance(f, ActuatedElement))
    contacts = (*joint_contacts(kin), *chain(*rubbing), *elements)
    applied = tuple(tuple(f.loads(kin)) for f in forces)
    weighed = [isinstance(f, Gravity) for f in forces]  # the ground is accelerated by -g instead
    loads = [x for own, weight in zip(applied, weighed, strict=True) if not weight for x in own]
    loads += [load for c in contacts for load in c.loads(kin)]
    in_parent = [loop.reaction(x) for loop, x in zip(loops, own, strict=False)]
    loads += [load for part, x in of_held for load in part.loads(x)]
    of_loops = list(zip(loops, in_parent, strict=True))
    loads += [load for loop, wrench in of_loops for load in loop.loads(kin, wrench)]
    rows, reactions = balance(kin, loads)
    rows += along @ (every[phi.numel() - norms.numel() :, 0])
    pushed = along.T @ a + ca.jtimes(along.T @ qd, q, qd)
    rows += along @ (inertia * pushed)
    reactions |= {
        loop.joint.name: (loop.relative.R.T @ F, loop.relative.R.T @ T) for loop, (F, T) in of_loops
    }
    reactions = {name: reactions[name] for name in topology.joints}
    pressing = {loop.joint.name: wrench for loop, wrench in of_loops if loop.joint.closes}
    pressing = reactions | pressing
    phi = phi[independent, 0]
    phi_dot = ca.jtimes(phi, q, qd) + ca.jacobian(phi, t)
    phi_ddot = ca.jtimes(phi, q, a) + ca.jtimes(phi_dot, q, qd) + ca.jacobian(phi_dot, t)
    normals = tuple(c.normal(kin, pressing) for c in contacts)
    return Equations(
        kin, tuple(forces), tuple(constraints), applied, loops, held, tuple(turns.values()),
        norms.numel(), q, qd, a, lam, stacked(c.F for c in contacts), ca.densify(phi), phi_dot,
        phi_ddot, ca.densify(rows), contacts, normals, reactions, pressing,
    )  # fmt: skip


def normals_with(eq: Equations, eps: Mapping[str, Scalar]) -> tuple[ca.SX, ...]:
    """Return the normal force of each contact, smoothed with the widths `eps` by `pressed` name."""
    rounded = (replace(c, friction=replace(c.friction, eps=eps[c.pressed])) for c in eq.contacts)
    return tuple(contact.normal(eq.kin, eq.pressing) for contact in rounded)
