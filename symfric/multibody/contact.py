"""Contacts with friction of a mechanism: sliding velocity, normal force, loads on the bodies.

Only the contacts of this module apply friction laws to bodies, with the minus sign of their loads.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, final

import casadi as ca

from symfric.foundation.numeric import Scalar, equals
from symfric.foundation.units import turned
from symfric.laws import Law
from symfric.laws.composed.isotropic import SpatialSlip
from symfric.multibody.dynamics import Wrench
from symfric.multibody.element_friction import ElementFriction
from symfric.multibody.forces import ZERO, Axial, Load
from symfric.multibody.joint import Joint, JointFriction
from symfric.multibody.kinematics import Kinematics
from symfric.multibody.topology import body_of

Lever = tuple[Joint, str, Scalar]
"""Joint, direction and l of a sliding velocity v = sum l s' [m/s]."""


@dataclass(frozen=True, eq=False)
class Contact(ABC):
    """Place in a mechanism where a friction law acts.

    Attributes:
        name: prefix of the results of the contact.
        part: name of the joint or of the element.
        friction: law and geometry.
        law: the law; for a ball its vector form.
        pressed: name of the normal force, which directions of one bearing share.
        slip: sliding velocity [m/s], shape (1, 1); for a ball (3, 1).
        F: symbols of the friction force [N], of the same shape.
    """

    kind: ClassVar[str]
    """Type of the part in messages."""

    name: str
    part: str
    friction: JointFriction | ElementFriction
    law: Law | SpatialSlip
    pressed: str
    slip: ca.SX
    F: ca.SX

    @property
    def place(self) -> str:
        """Type and name of the part, for messages."""
        return f"{self.kind} '{self.part}'"

    def unit(self, of_sliding: str) -> str:
        """Return a unit of the law; that of rotation if the law is one of moment and rate."""
        return turned(of_sliding) if self.friction.turning else of_sliding

    @abstractmethod
    def loads(self, kin: Kinematics) -> Sequence[Load | Axial]:
        """Return the loads of the friction force on the bodies."""

    @abstractmethod
    def normal(self, kin: Kinematics, pressing: Mapping[str, Wrench]) -> ca.SX:
        """Return the normal force [N]; `pressing` is that of `Equations`."""


def places_of(contacts: Iterable[Contact]) -> str:
    """Return the types and names of the parts of several contacts, for messages."""
    parts: dict[str, dict[str, None]] = {}
    for contact in contacts:
        parts.setdefault(contact.kind, {})[f"'{contact.part}'"] = None
    return " and ".join(f"{kind} {', '.join(names)}" for kind, names in parts.items())


@final
@dataclass(frozen=True, eq=False)
class JointContact(Contact):
    """Friction of a joint in one direction: "slide", "turn", "x", "y" or "ball"."""

    kind = "joint"

    friction: JointFriction
    direction: str

    @property
    def load(self) -> ca.SX:
        """Force [N] along or moment [N m] about the axis on the child; a vector for a ball."""
        return -self.F if self.direction == "slide" else -self.friction.arm * self.F

    def loads(self, kin: Kinematics) -> Sequence[Load | Axial]:
        """Return the loads on the child and the parent of the joint."""
        joint = kin.topology.joints[self.part]
        if self.direction != "ball":
            return [Axial(joint, self.direction, self.load)]
        parent, child = body_of(joint.parent), body_of(joint.child)
        moment = kin.motion[parent].R @ kin.frame(joint.parent).R @ self.load
        return [
            Load(body, ZERO, kin.motion[body].p, sign * moment, ZERO)
            for body, sign in ((child, 1), (parent, -1))
        ]

    def normal(self, kin: Kinematics, pressing: Mapping[str, Wrench]) -> ca.SX:
        """Return the normal force of the bearing under the reaction of the joint."""
        joint, (F, T) = kin.topology.joints[self.part], pressing[self.part]
        if self.direction not in ("x", "y"):
            return joint.normal_force(self.friction, F, T)
        R = joint.bearing(self.direction, kin.rotation(joint))
        return self.friction.normal_force(("turn",), R @ F, R @ T)


def joint_contacts(kin: Kinematics) -> Iterator[JointContact]:
    """Yield the contacts of all joints with friction."""
    for joint in kin.topology.joints.values():
        if (friction := joint.friction) is None:
            continue
        for direction in joint.rubs:
            name = joint.name if len(joint.rubs) == 1 else f"{joint.name}_{direction}"
            rate = kin.spin(joint) if direction == "ball" else kin.rate(joint, direction)
            slip = rate if direction == "slide" else friction.arm * rate
            law = SpatialSlip(friction.law) if direction == "ball" else friction.law
            pressed = name if direction in ("x", "y") else joint.name
            F = ca.SX.sym(f"{name}_friction", slip.numel())
            yield JointContact(name, joint.name, friction, law, pressed, slip, F, direction)


@final
@dataclass(frozen=True, eq=False)
class ElementContact(Contact):
    """Friction of an element that couples displacements s_j of joints.

        v = sum l_j s_j',   load on joint j: -l_j F,   N = preload + |f|

    Attributes:
        levers: joint, direction and l_j of each displacement.
        pressing: normal force f between the flanks [N], in terms of the multiplier of the element.
    """

    kind = "coupling"

    friction: ElementFriction
    levers: tuple[Lever, ...]
    pressing: ca.SX

    def loads(self, kin: Kinematics) -> Sequence[Load | Axial]:
        """Return the loads on the joints along their axes."""
        own = ((joint, way, lever) for joint, way, lever in self.levers if not equals(lever, 0.0))
        return [Axial(joint, way, -lever * self.F) for joint, way, lever in own]

    def normal(self, kin: Kinematics, pressing: Mapping[str, Wrench]) -> ca.SX:
        """Return the normal force between the flanks."""
        return self.friction.preload + self.friction.magnitude(self.pressing)


def element_contact(
    name: str, kin: Kinematics, friction: ElementFriction, levers: Sequence[Lever],
    pressing: ca.SX,
) -> ElementContact:  # fmt: skip
    """Return the contact of the element `name`."""
    slip = sum((lever * kin.rate(joint, way) for joint, way, lever in levers), ca.SX(0))
    F = ca.SX.sym(f"{name}_friction")
    return ElementContact(
        name, name, friction, friction.law, name, slip, F, tuple(levers), pressing
    )
