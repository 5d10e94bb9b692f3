"""All joints, each with pose, motion subspace and constraints; see `symfric.multibody.joint`."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar, final

import casadi as ca

from symfric.foundation.numeric import Scalar, is_number, is_symbolic
from symfric.model.sketch import Symbol
from symfric.multibody.joint import FORCE_NAMES, Joint, JointFriction, Pair, unit
from symfric.multibody.spatial import euler_g, rotation, rotation_x, rotation_y, rotation_z


@dataclass(frozen=True, eq=False)
class Closing(Joint):
    """Joint that only closes loops; it has no coordinates and no redundant constraints.

    If a hinge or a guide of 5 constraints closes a planar loop, three of its constraints are
    redundant: the reactions out of the plane are undetermined, and friction that depends on them is
    rejected. The planar joints below have only the constraints of a hinge or a guide in the plane,
    so that every joint of the loop can have friction. The motion does not depend on which joint
    closes the loop.

        joint             constraints                        friction        normal force N
        PlanarRevolute    p_x = p_y = 0; plane x, y          turn about z    |(F_x, F_y)|
        PlanarPrismatic   p_x = 0, no turn; plane x, z       slide along z   at two stations
        PinInSlot         p_x = 0; plane x, z                slide along z   |F_x|
        PointOnLine       p_x = p_y = 0, in space            slide along z   |(F_x, F_y)|

    p is the origin of the child's frame in the parent's frame. Sliding v = p_z' is relative to the
    parent's frame, which may move. F is the reaction of the multipliers in the parent's axes.
    Limits: in a mechanism that is not planar they also have only the constraints of the table.
    """

    closes = True

    def linear(self, direction: str) -> bool:
        """Return True if motion in this direction is a translation."""
        return direction == "slide"

    def pose(self, q: ca.SX) -> Pair:
        """Raise an error: the joint always closes a loop and has no coordinates."""
        raise NotImplementedError

    subspace = pose


@final
@dataclass(frozen=True, eq=False)
class Distance(Closing):
    """Massless rod with ball joints at both ends: (d'd - length^2) / 2 = 0; 1 constraint.

    The multiplier [N/m] times the length is the force in the rod, positive under tension.
    """

    transmits = FORCE_NAMES
    symbol = Symbol(line="rod", anchored=True)

    length: Scalar = 1.0

    def problems(self) -> Iterator[str]:
        """Yield a message about an invalid length."""
        if not is_symbolic(self.length) and not (is_number(self.length) and self.length > 0):
            yield f"length: expected > 0 m, got {self.length!r}"

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return (p'p - length^2)/2 = 0; the squared distance is differentiable everywhere."""
        return (ca.dot(p, p) - self.length * self.length) / 2


@final
@dataclass(frozen=True, eq=False)
class PointOnLine(Closing):
    """Joint that keeps the origin of the child's frame on the parent's z axis; 2 constraints.

    An example is a bead on a wire. Friction acts along the line. `PlanarRevolute` has the same
    constraints, but friction of rotation; it models the pin that closes a planar loop.
    """

    rubs = ("slide",)
    directions: ClassVar[Mapping[str, int]] = {"slide": 0}
    transmits = FORCE_NAMES
    symbol = Symbol("o", axes=(("a", 2),), anchored=True)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return p_x = p_y = 0: the point is on the line."""
        return ca.vertcat(p[0], p[1])

    def normal_force(self, friction: JointFriction, F: ca.SX, T: ca.SX) -> ca.SX:
        """Return the magnitude of the reaction, as for a round wire."""
        return friction.normal_force(("ball",), F, T)


@final
@dataclass(frozen=True, eq=False)
class PlanarRevolute(Closing):
    """Hinge that closes a planar loop, a pin that turns about z; 2 constraints.

    z is normal to the plane.
    """

    rubs = ("turn",)
    directions: ClassVar[Mapping[str, int]] = {"turn": 0}
    transmits = ("Fx", "Fy")
    symbol = Symbol("o", axes=(("b", 2),), hinge=True, anchored=True)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return p_x = p_y = 0: the frames have a common point in the plane."""
        return ca.vertcat(p[0], p[1])


@final
@dataclass(frozen=True, eq=False)
class PlanarPrismatic(Closing):
    """Guide that closes a planar loop, sliding along z without turning; 2 constraints.

    y is normal to the plane. With `JointFriction.length` the moment loads two bearing stations.
    """

    rubs = ("slide",)
    directions: ClassVar[Mapping[str, int]] = {"slide": 0}
    transmits = ("Fx", "Fz", "My")
    symbol = Symbol("s", guide=True)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return p_x = 0 and R_xz = 0: the child moves on a line and does not turn."""
        return ca.vertcat(p[0], R[0, 2])


@final
@dataclass(frozen=True, eq=False)
class PinInSlot(Closing):
    """Pin of the child in a straight slot of the parent along z, in a plane; 1 constraint.

    y is normal to the plane. The pin may turn in the slot, without friction.
    """

    rubs = ("slide",)
    directions: ClassVar[Mapping[str, int]] = {"slide": 0}
    transmits = ("Fx", "Fz")
    symbol = Symbol("o", slot=True)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return p_x = 0: the pin is between the walls of the slot."""
        return ca.SX(p[0])


ANGLE, LENGTH = ("", "rad"), ("", "m")
EULER = tuple((f"e{i}", "1") for i in range(4))


def _parallel(R: ca.SX) -> ca.SX:
    """Return the two constraints that keep the z axes of both frames parallel."""
    return ca.vertcat(R[0, 2], R[1, 2])


@final
@dataclass(frozen=True, eq=False)
class Revolute(Joint):
    """Hinge joint that turns about z; 5 constraints."""

    coordinates = (ANGLE,)
    rubs = ("turn",)
    directions: ClassVar[Mapping[str, int]] = {"turn": 0}
    transmits = (*FORCE_NAMES, "Mx", "My")
    symbol = Symbol("o", axes=(("b", 2),), hinge=True, anchored=True)

    def pose(self, q: ca.SX) -> Pair:
        """Return the rotation by q about z."""
        return rotation_z(q), ca.SX(3, 1)

    def subspace(self, q: ca.SX) -> Pair:
        """Return the subspace of rotations about z."""
        return unit(2), ca.SX(3, 1)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return the constraints of a common point and parallel axes."""
        return ca.vertcat(p, _parallel(R))


@final
@dataclass(frozen=True, eq=False)
class Prismatic(Joint):
    """Sliding joint that slides along z without turning; 5 constraints."""

    coordinates = (LENGTH,)
    rubs = ("slide",)
    directions: ClassVar[Mapping[str, int]] = {"slide": 0}
    transmits = ("Fx", "Fy", "Mx", "My", "Mz")
    symbol = Symbol("s", guide=True)

    def pose(self, q: ca.SX) -> Pair:
        """Return the translation by q along z."""
        return ca.SX.eye(3), ca.vertcat(0, 0, q)

    def subspace(self, q: ca.SX) -> Pair:
        """Return the subspace of translations along z."""
        return ca.SX(3, 1), unit(2)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return the constraints of a common line, parallel axes and no rotation."""
        return ca.vertcat(p[0], p[1], _parallel(R), R[1, 0])


@final
@dataclass(frozen=True, eq=False)
class Cylindrical(Joint):
    """Cylindrical joint that slides along z and turns about z; 4 constraints."""

    coordinates = (("slide", "m"), ("angle", "rad"))
    rubs = ("slide", "turn")
    directions: ClassVar[Mapping[str, int]] = {"slide": 0, "turn": 1}
    transmits = ("Fx", "Fy", "Mx", "My")
    symbol = Symbol("s", axes=(("a", 2),), guide=True)

    def pose(self, q: ca.SX) -> Pair:
        """Return the translation by q[0] along z and the rotation by q[1] about z."""
        return rotation_z(q[1]), ca.vertcat(0, 0, q[0])

    def subspace(self, q: ca.SX) -> Pair:
        """Return the subspace of translations along z and rotations about z."""
        return ca.horzcat(ca.SX(3, 1), unit(2)), ca.horzcat(unit(2), ca.SX(3, 1))

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return the constraints of a common line and parallel axes."""
        return ca.vertcat(p[0], p[1], _parallel(R))


@final
@dataclass(frozen=True, eq=False)
class Spherical(Joint):
    """Ball joint that turns about a point, with Euler parameters as coordinates; 3 constraints."""

    coordinates = EULER
    rubs = ("ball",)
    quaternion = 0
    transmits = FORCE_NAMES
    symbol = Symbol("o", anchored=True)

    def pose(self, q: ca.SX) -> Pair:
        """Return the rotation with the Euler parameters q."""
        return rotation(q), ca.SX(3, 1)

    def subspace(self, q: ca.SX) -> Pair:
        """Return the subspace of all rotations, with the angular velocity 2 G q'."""
        return 2 * euler_g(q), ca.SX(3, 4)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return the constraints of a common point."""
        return ca.SX(p)


@final
@dataclass(frozen=True, eq=False)
class Universal(Joint):
    """Universal joint that turns about the parent's x and the child's y; 4 constraints.

    The two axes remain orthogonal.
    """

    coordinates = (("x", "rad"), ("y", "rad"))
    rubs = ("x", "y")
    directions: ClassVar[Mapping[str, int]] = {"x": 0, "y": 1}
    transmits = (*FORCE_NAMES, "Mx", "Mz")
    symbol = Symbol("o", axes=(("a", 0), ("b", 1)), anchored=True)

    def pose(self, q: ca.SX) -> Pair:
        """Return the rotation by q[0] about x and then by q[1] about the new y."""
        return rotation_x(q[0]) @ rotation_y(q[1]), ca.SX(3, 1)

    def subspace(self, q: ca.SX) -> Pair:
        """Return the subspace of rotations about x and about the new y."""
        axes = ca.horzcat(ca.vertcat(ca.cos(q[1]), 0, ca.sin(q[1])), ca.vertcat(0, 1, 0))
        return axes, ca.SX(3, 2)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return the constraints of a common point and orthogonal axes."""
        return ca.vertcat(p, R[0, 1])

    def axis(self, direction: str, R: ca.SX) -> ca.SX:
        """Return the parent's x axis or the child's y axis."""
        return unit(0) if direction == "x" else R[:, 1]

    def bearing(self, direction: str, R: ca.SX) -> ca.SX:
        """Return the rotation to the bearing on the parent's x or the child's y, axis last."""
        return R[[1, 2, 0], :] if direction == "x" else ca.SX.eye(3)[[2, 0, 1], :]

    def displacement(self, direction: str, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return the angle about the parent's x or about the child's y."""
        if direction == "x":
            return ca.atan2(R[2, 1], R[1, 1])
        return ca.atan2(R[0, 2], R[0, 0])


@final
@dataclass(frozen=True, eq=False)
class Planar(Joint):
    """Planar joint that moves in the plane x, y and turns about z; 3 constraints."""

    coordinates = (("x", "m"), ("y", "m"), ("angle", "rad"))
    directions: ClassVar[Mapping[str, int]] = {"x": 0, "y": 1, "turn": 2}
    transmits = ("Fz", "Mx", "My")
    symbol = Symbol("D", plate=True)

    def pose(self, q: ca.SX) -> Pair:
        """Return the translation by q[0], q[1] in the plane and the rotation by q[2] about z."""
        return rotation_z(q[2]), ca.vertcat(q[0], q[1], 0)

    def subspace(self, q: ca.SX) -> Pair:
        """Return the subspace of translations along x and y and rotations about z."""
        return ca.horzcat(ca.SX(3, 2), unit(2)), ca.horzcat(ca.SX.eye(3)[:, :2], ca.SX(3, 1))

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return the constraints of a common plane and parallel normals."""
        return ca.vertcat(p[2], _parallel(R))


@final
@dataclass(frozen=True, eq=False)
class Fixed(Joint):
    """Rigid connection of two bodies; 6 constraints."""

    symbol = Symbol("s", anchored=True)

    def pose(self, q: ca.SX) -> Pair:
        """Return the identity and zero: the frames coincide."""
        return ca.SX.eye(3), ca.SX(3, 1)

    def subspace(self, q: ca.SX) -> Pair:
        """Return the empty subspace, matrices without columns."""
        return ca.SX(3, 0), ca.SX(3, 0)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return the constraints of a common point and parallel axes."""
        return ca.vertcat(p, _parallel(R), R[1, 0])


@final
@dataclass(frozen=True, eq=False)
class Floating(Joint):
    """Free joint without constraints, with Euler parameters for the rotation."""

    coordinates = (("x", "m"), ("y", "m"), ("z", "m"), *EULER)
    quaternion = 3
    transmits = ()

    def pose(self, q: ca.SX) -> Pair:
        """Return the rotation with the Euler parameters q[3:] and the translation q[:3]."""
        return rotation(q[3:]), q[:3]

    def subspace(self, q: ca.SX) -> Pair:
        """Return the subspace of all motions, with angular velocity 2 G q[3:]', velocity q[:3]'."""
        turning = ca.horzcat(ca.SX(3, 3), 2 * euler_g(q[3:]))
        return turning, ca.horzcat(ca.SX.eye(3), ca.SX(3, 4))

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return a column without rows."""
        return ca.SX(0, 1)


ALL_JOINTS: tuple[type[Joint], ...] = (
    Revolute, Prismatic, Cylindrical, Spherical, Universal, Planar, Fixed, Floating, Distance,
    PointOnLine, PlanarRevolute, PlanarPrismatic, PinInSlot,
)  # fmt: skip
"""Joints that a mechanism accepts."""
