"""Joints that only close loops: no coordinates, and no more constraints than a loop needs.

A planar loop that is closed by a hinge or a guide of 5 constraints fixes three times what the
plane fixes already, and leaves the reactions out of the plane open: friction that depends on them
is refused. The planar joints here have what is left of a hinge or a guide in the plane, so that
every joint of the loop can rub. The motion is the same whichever of them closes the loop.

    joint             constraints                        rubs            normal force N
    PlanarRevolute    p_x = p_y = 0; plane x, y          turn about z    |(F_x, F_y)|
    PlanarPrismatic   p_x = 0, no turn; plane x, z       slide along z   at two stations, as a guide
    PinInSlot         p_x = 0; plane x, z                slide along z   |F_x|
    PointOnLine       p_x = p_y = 0, in space            slide along z   |(F_x, F_y)|

p is the origin of the child's frame in the parent's. Sliding is measured in the parent's frame,
which may move: v = p_z'. F is the reaction in the parent's axes, of the multipliers alone.
Limits: in a mechanism that is not planar they hold what the table says, and no more.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar, final

import casadi as ca

from symfric.foundation.numeric import Scalar, is_number, is_symbolic
from symfric.model.sketch import Symbol
from symfric.multibody.friction import JointFriction
from symfric.multibody.joint import FORCE, Joint, Pair


@dataclass(frozen=True, eq=False)
class Closing(Joint):
    """A joint that only closes loops."""

    closes: ClassVar[bool] = True

    def linear(self, direction: str) -> bool:
        """Whether motion in this direction is a translation."""
        return direction == "slide"

    def pose(self, q: ca.SX) -> Pair:
        """Not asked for: the joint always closes a loop and has no coordinates."""
        raise NotImplementedError

    def subspace(self, q: ca.SX) -> Pair:
        """Not asked for: the joint always closes a loop and has no coordinates."""
        raise NotImplementedError


@final
@dataclass(frozen=True, eq=False)
class Distance(Closing):
    """A massless rod with ball joints at both ends: (d'd - length^2) / 2 = 0; 1 constraint.

    Its multiplier [N/m] times the length is the force in the rod, positive under tension.
    """

    constrains: ClassVar[int] = 1
    transmits: ClassVar[tuple[str, ...]] = FORCE
    symbol: ClassVar[Symbol] = Symbol(line="rod", anchored=True)

    length: Scalar = 1.0

    def problems(self) -> Iterator[str]:
        """A length that is none."""
        if not is_symbolic(self.length) and not (is_number(self.length) and self.length > 0):
            yield f"length: expected > 0 m, got {self.length!r}"

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """(p'p - length^2)/2 = 0: the squared distance has a gradient everywhere."""
        return (ca.dot(p, p) - self.length * self.length) / 2


@final
@dataclass(frozen=True, eq=False)
class PointOnLine(Closing):
    """The origin of the child's frame stays on the parent's axis z; 2 constraints.

    A bead on a wire: it rubs along the line. The pin that closes a planar loop, which has the same
    constraints, is `PlanarRevolute`; it rubs as it turns.
    """

    constrains: ClassVar[int] = 2
    rubs: ClassVar[tuple[str, ...]] = ("slide",)
    directions: ClassVar[Mapping[str, int]] = {"slide": 0}
    transmits: ClassVar[tuple[str, ...]] = FORCE
    symbol: ClassVar[Symbol] = Symbol("o", axes=(("a", 2),), anchored=True)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """p_x = p_y = 0: the point is on the z axis of the line."""
        return ca.vertcat(p[0], p[1])

    def normal_force(self, friction: JointFriction, F: ca.SX, T: ca.SX) -> ca.SX:
        """The size of the reaction: the wire is round."""
        return friction.normal_force(("ball",), F, T)


@final
@dataclass(frozen=True, eq=False)
class PlanarRevolute(Closing):
    """The hinge that closes a planar loop: a pin that turns about z; 2 constraints.

    z is normal to the plane.
    """

    constrains: ClassVar[int] = 2
    rubs: ClassVar[tuple[str, ...]] = ("turn",)
    directions: ClassVar[Mapping[str, int]] = {"turn": 0}
    plane: ClassVar[int | None] = 2
    transmits: ClassVar[tuple[str, ...]] = ("Fx", "Fy")
    symbol: ClassVar[Symbol] = Symbol("o", axes=(("b", 2),), hinge=True, anchored=True)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """p_x = p_y = 0: one point of the plane in common."""
        return ca.vertcat(p[0], p[1])


@final
@dataclass(frozen=True, eq=False)
class PlanarPrismatic(Closing):
    """The guide that closes a planar loop: slides along z without turning; 2 constraints.

    y is normal to the plane. With `JointFriction.length` the moment presses at two stations.
    """

    constrains: ClassVar[int] = 2
    rubs: ClassVar[tuple[str, ...]] = ("slide",)
    directions: ClassVar[Mapping[str, int]] = {"slide": 0}
    plane: ClassVar[int | None] = 1
    transmits: ClassVar[tuple[str, ...]] = ("Fx", "Fz", "My")
    symbol: ClassVar[Symbol] = Symbol("s", guide=True)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """On one line, and the child's z has no component along the parent's x."""
        return ca.vertcat(p[0], R[0, 2])


@final
@dataclass(frozen=True, eq=False)
class PinInSlot(Closing):
    """A pin of the child in a straight slot of the parent along z, in a plane; 1 constraint.

    y is normal to the plane. The pin may turn in the slot, without friction.
    """

    constrains: ClassVar[int] = 1
    rubs: ClassVar[tuple[str, ...]] = ("slide",)
    directions: ClassVar[Mapping[str, int]] = {"slide": 0}
    plane: ClassVar[int | None] = 1
    transmits: ClassVar[tuple[str, ...]] = ("Fx", "Fz")
    symbol: ClassVar[Symbol] = Symbol("o", slot=True)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """p_x = 0: between the walls of the slot."""
        return ca.SX(p[0])
