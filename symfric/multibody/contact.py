"""Contacts with friction of a mechanism: sliding velocity, normal force, loads on the bodies.

Only contacts apply friction laws to bodies, with the minus sign of their loads.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, final

import casadi as ca

from symfric.foundation.numeric import Scalar, equals
from symfric.foundation.units import turned
from symfric.laws import Law
from symfric.laws.base import smooth
from symfric.laws.composed.isotropic import SpatialSlip
from symfric.multibody.dynamics import Wrench
from symfric.multibody.element_friction import ElementFriction, Flank
from symfric.multibody.forces import ZERO, Axial, Load, Part
from symfric.multibody.joint import Joint, JointFriction
from symfric.multibody.kinematics import Kinematics
from symfric.multibody.topology import body_of

UNLOADED = 1e-12
"""Force [N] that keeps ratios of contact forces finite without load; negligible under load."""


class End(NamedTuple):
    """Displacement s of a joint on which an element acts.

    Attributes:
        joint, direction: the joint and the direction of s.
        lever: l of the sliding velocity v = sum l s' [m/s].
        share: generalised force on s per unit multiplier of the element.
    """

    joint: Joint
    direction: str
    lever: Scalar
    share: Scalar = 0.0


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

    @property
    def law_place(self) -> str:
        """Field of the law, for messages."""
        return f"{self.place} > friction > law"

    @property
    def link(self) -> str:
        """Joint after which the unknowns of the contact are eliminated."""
        return self.part

    @property
    def rate(self) -> str:
        """Name of the joint rate that is zero if the slip is; other names have no effect."""
        return f"{self.name}_rate"

    @property
    def normal_symbol(self) -> ca.SX:
        """Symbol of the normal force that `normal` contains; by default without rows."""
        return ca.SX(0, 1)

    def explicit_normal(self, normal: ca.SX, force: ca.SX, N: ca.SX) -> ca.SX:
        """Return the normal force `normal` without F, given the friction force in terms of N."""
        return normal

    @abstractmethod
    def loads(self, kin: Kinematics) -> Sequence[Load | Axial]:
        """Return the loads of the friction force on the bodies."""

    @abstractmethod
    def normal(self, kin: Kinematics, pressing: Mapping[str, Wrench]) -> ca.SX:
        """Return the normal force [N]; `pressing` is that of `Equations`."""


def depends_on_load(law: Law) -> bool:
    """Return True if the friction force or the rates of `law` depend on the normal force."""
    N, z = ca.SX.sym("N"), ca.SX.sym("z", len(law.states))
    v = ca.SX.sym("v")
    return ca.depends_on(ca.vertcat(law.force(v, N, z), law.rate(v, N, z)), N)


def law_places(contacts: Sequence[Contact]) -> str:
    """Return the fields of the laws of several contacts, for messages."""
    if len(contacts) == 1:
        return contacts[0].law_place
    return f"{places_of(contacts)} > friction > law"


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


@dataclass(frozen=True, eq=False)
class LeverContact(Contact):
    """Friction of an element that acts on displacements s_j of joints.

        v = sum l_j s_j',   load on joint j = -l_j F

    Attributes:
        ends: displacements with their levers l_j.
    """

    measure: ClassVar[str]
    """Meaning of `locking`."""

    ends: tuple[End, ...]

    @property
    @abstractmethod
    def locking(self) -> ca.SX:
        """Ratio `measure` [1]; the element locks itself from 1 on."""

    def loads(self, kin: Kinematics) -> Sequence[Load | Axial]:
        """Return the loads of friction on the joints along their axes."""
        own = (end for end in self.ends if not equals(end.lever, 0.0))
        return [Axial(end.joint, end.direction, -end.lever * self.F) for end in own]

    def transmitted(self, kin: Kinematics) -> list[Axial]:
        """Return the loads on the joints along their axes, including friction."""
        return [Axial(end.joint, end.direction, -end.lever * self.F) for end in self.ends]

    def tensions(self) -> dict[str, ca.SX]:
        """Return the tensions [N] of a band, rope or belt by end; none by default."""
        return {}


def slip_of(kin: Kinematics, ends: Iterable[End]) -> ca.SX:
    """Return the sliding velocity sum l_j s_j' [m/s]."""
    return sum((end.lever * kin.rate(end.joint, end.direction) for end in ends), ca.SX(0))


@final
@dataclass(frozen=True, eq=False)
class ElementContact(LeverContact):
    """Friction of an element that couples two displacements, whose reaction is the multiplier lam.

        load on joint j: c_j lam - l_j F,   N = preload + |lam / divisor|

    Attributes:
        lam: multiplier of the element; c_j are the shares of `ends`.
        divisor: multiplier per unit normal force.
    """

    kind = "coupling"
    measure = "static friction over that which holds a load on b"

    friction: ElementFriction
    lam: ca.SX
    divisor: Scalar

    @property
    def pressing(self) -> ca.SX:
        """Magnitude of the normal force by the multiplier [N]."""
        return self.friction.magnitude(self.lam / self.divisor)

    def transmitted(self, kin: Kinematics) -> list[Axial]:
        """Return the loads on the joints along their axes, including friction."""
        return [
            Axial(end.joint, end.direction, end.share * self.lam - end.lever * self.F)
            for end in self.ends
        ]

    @property
    def locking(self) -> ca.SX:
        """Ratio `measure` [1]."""
        a, friction = self.ends[0], self.friction
        held = friction.law.static_level(friction.preload + self.pressing)
        pull = a.share * self.divisor * self.pressing
        return ca.SX(smooth.magnitude(held * a.lever / pull, 0.0))

    def normal(self, kin: Kinematics, pressing: Mapping[str, Wrench]) -> ca.SX:
        """Return the normal force between the flanks."""
        return self.friction.preload + self.pressing


def element_contact(
    part: Part, kin: Kinematics, friction: ElementFriction, slope: Scalar, flank: Flank, lam: ca.SX
) -> ElementContact:
    """Return the contact of an element that couples joints with ds_b/ds_a = `slope`."""
    rows = zip(part.joints(), (flank.lever_a, flank.lever_b), (-slope, 1.0), strict=True)
    ends = tuple(End(kin.topology.joints[j], way, lever, share) for (j, way), lever, share in rows)
    F, name, slip = ca.SX.sym(f"{part.name}_friction"), part.name, slip_of(kin, ends)
    return ElementContact(
        name, name, friction, friction.law, name, slip, F, ends, lam, flank.divisor
    )
