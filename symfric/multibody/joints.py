"""Joints with their pose, motion subspace and constraints; see `symfric.multibody.joint`."""

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
    """Joint that only closes loops: no coordinates, and no redundant constraints.

    A planar loop closed by a hinge or a guide of 5 constraints has three constraints that the plane
    implies already; the reactions out of the plane are then undetermined, and friction that depends
    on them is refused. The planar joints here have only the constraints of a hinge or a guide in
    the plane, so that every joint of the loop can have friction. The motion does not depend on
    which of them closes the loop.

        joint             constraints                        friction        normal force N
        PlanarRevolute    p_x = p_y = 0; plane x, y          turn about z    |(F_x, F_y)|
        PlanarPrismatic   p_x = 0, no turn; plane x, z       slide along z   at two stations
        PinInSlot         p_x = 0; plane x, z                slide along z   |F_x|
        PointOnLine       p_x = p_y = 0, in space            slide along z   |(F_x, F_y)|

    p is the origin of the child's frame in the parent's. Sliding is measured in the parent's frame,
    which may move: v = p_z'. F is the reaction in the parent's axes, of the multipliers only.
    Limits: in a mechanism that is not planar they have only the constraints of the table.
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

    Its multiplier [N/m] times the length is the force in the rod, positive under tension.
    """

    constrains = 1
    transmits = FORCE_NAMES
    symbol = Symbol(line="rod", anchored=True)

    length: Scalar = 1.0

    def problems(self) -> Iterator[str]:
        """Yield a message about an invalid length."""
        if not is_symbolic(self.length) and not (is_number(self.length) and self.length > 0):
            yield f"length: expected > 0 m, got {self.length!r}"

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return (p'p - length^2)/2 = 0: the squared distance has a gradient everywhere."""
        return (ca.dot(p, p) - self.length * self.length) / 2


@final
@dataclass(frozen=True, eq=False)
class PointOnLine(Closing):
    """Origin of the child's frame stays on the parent's axis z; 2 constraints.

    Example: a bead on a wire, with friction along the line. The pin that closes a planar loop, with
    the same constraints, is `PlanarRevolute`, with friction of the rotation.
    """

    constrains = 2
    rubs = ("slide",)
    directions: ClassVar[Mapping[str, int]] = {"slide": 0}
    transmits = FORCE_NAMES
    symbol = Symbol("o", axes=(("a", 2),), anchored=True)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return p_x = p_y = 0: the point is on the z axis of the line."""
        return ca.vertcat(p[0], p[1])

    def normal_force(self, friction: JointFriction, F: ca.SX, T: ca.SX) -> ca.SX:
        """Return the magnitude of the reaction: the wire is round."""
        return friction.normal_force(("ball",), F, T)


@final
@dataclass(frozen=True, eq=False)
class PlanarRevolute(Closing):
    """Hinge that closes a planar loop: a pin that turns about z; 2 constraints.

    z is normal to the plane.
    """

    constrains = 2
    rubs = ("turn",)
    directions: ClassVar[Mapping[str, int]] = {"turn": 0}
    plane = 2
    transmits = ("Fx", "Fy")
    symbol = Symbol("o", axes=(("b", 2),), hinge=True, anchored=True)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return p_x = p_y = 0: one common point in the plane."""
        return ca.vertcat(p[0], p[1])


@final
@dataclass(frozen=True, eq=False)
class PlanarPrismatic(Closing):
    """Guide that closes a planar loop: slides along z without turning; 2 constraints.

    y is normal to the plane. With `JointFriction.length` the moment acts at two stations.
    """

    constrains = 2
    rubs = ("slide",)
    directions: ClassVar[Mapping[str, int]] = {"slide": 0}
    plane = 1
    transmits = ("Fx", "Fz", "My")
    symbol = Symbol("s", guide=True)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return the constraints: on one line, and the child's z has no component along the
        parent's x.
        """
        return ca.vertcat(p[0], R[0, 2])


@final
@dataclass(frozen=True, eq=False)
class PinInSlot(Closing):
    """Pin of the child in a straight slot of the parent along z, in a plane; 1 constraint.

    y is normal to the plane. The pin may turn in the slot, without friction.
    """

    constrains = 1
    rubs = ("slide",)
    directions: ClassVar[Mapping[str, int]] = {"slide": 0}
    plane = 1
    transmits = ("Fx", "Fz")
    symbol = Symbol("o", slot=True)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return p_x = 0: between the walls of the slot."""
        return ca.SX(p[0])


ANGLE, LENGTH = ("", "rad"), ("", "m")
EULER = tuple((f"e{i}", "1") for i in range(4))


def _parallel(R: ca.SX) -> ca.SX:
    """Return 2 equations for parallel axes z of both frames."""
    return ca.vertcat(R[0, 2], R[1, 2])


@final
@dataclass(frozen=True, eq=False)
class Revolute(Joint):
    """Hinge joint: turns about z; 5 constraints."""

    coordinates = (ANGLE,)
    constrains = 5
    rubs = ("turn",)
    directions: ClassVar[Mapping[str, int]] = {"turn": 0}
    transmits = (*FORCE_NAMES, "Mx", "My")
    symbol = Symbol("o", axes=(("b", 2),), hinge=True, anchored=True)

    def pose(self, q: ca.SX) -> Pair:
        """Return a rotation by q about z."""
        return rotation_z(q), ca.SX(3, 1)

    def subspace(self, q: ca.SX) -> Pair:
        """Return the angular velocity along z of the joint, no velocity of its point."""
        return unit(2), ca.SX(3, 1)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return the constraints: one common point, parallel axes."""
        return ca.vertcat(p, _parallel(R))


@final
@dataclass(frozen=True, eq=False)
class Prismatic(Joint):
    """Sliding joint: slides along z without turning; 5 constraints."""

    coordinates = (LENGTH,)
    constrains = 5
    rubs = ("slide",)
    directions: ClassVar[Mapping[str, int]] = {"slide": 0}
    transmits = ("Fx", "Fy", "Mx", "My", "Mz")
    symbol = Symbol("s", guide=True)

    def pose(self, q: ca.SX) -> Pair:
        """Return a shift by q along z."""
        return ca.SX.eye(3), ca.vertcat(0, 0, q)

    def subspace(self, q: ca.SX) -> Pair:
        """Return no angular velocity, velocity along z of the joint."""
        return ca.SX(3, 1), unit(2)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return the constraints: on one line, parallel axes, no rotation."""
        return ca.vertcat(p[0], p[1], _parallel(R), R[1, 0])


@final
@dataclass(frozen=True, eq=False)
class Cylindrical(Joint):
    """Cylindrical joint: slides along z and turns about it; 4 constraints."""

    coordinates = (("slide", "m"), ("angle", "rad"))
    constrains = 4
    rubs = ("slide", "turn")
    directions: ClassVar[Mapping[str, int]] = {"slide": 0, "turn": 1}
    transmits = ("Fx", "Fy", "Mx", "My")
    symbol = Symbol("s", axes=(("a", 2),), guide=True)

    def pose(self, q: ca.SX) -> Pair:
        """Return a shift by q[0] along z and a rotation by q[1] about it."""
        return rotation_z(q[1]), ca.vertcat(0, 0, q[0])

    def subspace(self, q: ca.SX) -> Pair:
        """Return translation along z, rotation about z."""
        return ca.horzcat(ca.SX(3, 1), unit(2)), ca.horzcat(unit(2), ca.SX(3, 1))

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return the constraints: on one line, parallel axes."""
        return ca.vertcat(p[0], p[1], _parallel(R))


@final
@dataclass(frozen=True, eq=False)
class Spherical(Joint):
    """Ball joint: turns about a point; Euler parameters as coordinates; 3 constraints."""

    coordinates = EULER
    constrains = 3
    rubs = ("ball",)
    quaternion = 0
    transmits = FORCE_NAMES
    symbol = Symbol("o", anchored=True)

    def pose(self, q: ca.SX) -> Pair:
        """Return R of the Euler parameters q."""
        return rotation(q), ca.SX(3, 1)

    def subspace(self, q: ca.SX) -> Pair:
        """Return w' = 2 G q'."""
        return 2 * euler_g(q), ca.SX(3, 4)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return the constraints: one common point."""
        return ca.SX(p)


@final
@dataclass(frozen=True, eq=False)
class Universal(Joint):
    """Universal joint: turns about x of the parent and y of the child, which stay orthogonal.

    It has 4 constraints.
    """

    coordinates = (("x", "rad"), ("y", "rad"))
    constrains = 4
    rubs = ("x", "y")
    directions: ClassVar[Mapping[str, int]] = {"x": 0, "y": 1}
    transmits = (*FORCE_NAMES, "Mx", "Mz")
    symbol = Symbol("o", axes=(("a", 0), ("b", 1)), anchored=True)

    def pose(self, q: ca.SX) -> Pair:
        """Return a rotation by q[0] about x, then by q[1] about the new y."""
        return rotation_x(q[0]) @ rotation_y(q[1]), ca.SX(3, 1)

    def subspace(self, q: ca.SX) -> Pair:
        """Return rotation about y, and about x before it."""
        axes = ca.horzcat(ca.vertcat(ca.cos(q[1]), 0, ca.sin(q[1])), ca.vertcat(0, 1, 0))
        return axes, ca.SX(3, 2)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return the constraints: one common point, orthogonal axes."""
        return ca.vertcat(p, R[0, 1])

    def axis(self, direction: str, R: ca.SX) -> ca.SX:
        """Return the parent's x, the child's y."""
        return unit(0) if direction == "x" else R[:, 1]

    def bearing(self, direction: str, R: ca.SX) -> ca.SX:
        """Return the bearing on the parent's x or on the child's y, with a massless cross
        between.
        """
        return R[[1, 2, 0], :] if direction == "x" else ca.SX.eye(3)[[2, 0, 1], :]

    def displacement(self, direction: str, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return the angle about the parent's x, or about the child's y."""
        if direction == "x":
            return ca.atan2(R[2, 1], R[1, 1])
        return ca.atan2(R[0, 2], R[0, 0])


@final
@dataclass(frozen=True, eq=False)
class Planar(Joint):
    """Planar joint: moves in the plane x, y and turns about z; 3 constraints."""

    coordinates = (("x", "m"), ("y", "m"), ("angle", "rad"))
    constrains = 3
    directions: ClassVar[Mapping[str, int]] = {"x": 0, "y": 1, "turn": 2}
    transmits = ("Fz", "Mx", "My")
    symbol = Symbol("D", plate=True)

    def pose(self, q: ca.SX) -> Pair:
        """Return a shift by q[0], q[1] in the plane and a rotation by q[2] about its normal."""
        return rotation_z(q[2]), ca.vertcat(q[0], q[1], 0)

    def subspace(self, q: ca.SX) -> Pair:
        """Return translation along x and y, rotation about z."""
        return ca.horzcat(ca.SX(3, 2), unit(2)), ca.horzcat(ca.SX.eye(3)[:, :2], ca.SX(3, 1))

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return the constraints: in one plane, parallel normals."""
        return ca.vertcat(p[2], _parallel(R))


@final
@dataclass(frozen=True, eq=False)
class Fixed(Joint):
    """Rigid connection of two bodies; 6 constraints."""

    constrains = 6
    symbol = Symbol("s", anchored=True)

    def pose(self, q: ca.SX) -> Pair:
        """Return coincident frames: identity and zero."""
        return ca.SX.eye(3), ca.SX(3, 1)

    def subspace(self, q: ca.SX) -> Pair:
        """Return no columns: nothing moves."""
        return ca.SX(3, 0), ca.SX(3, 0)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return the constraints: one common point, all axes parallel."""
        return ca.vertcat(p, _parallel(R), R[1, 0])


@final
@dataclass(frozen=True, eq=False)
class Floating(Joint):
    """Free joint; Euler parameters for the rotation; no constraint."""

    coordinates = (("x", "m"), ("y", "m"), ("z", "m"), *EULER)
    quaternion = 3
    transmits = ()

    def pose(self, q: ca.SX) -> Pair:
        """Return a shift by q[:3], R of the Euler parameters q[3:]."""
        return rotation(q[3:]), q[:3]

    def subspace(self, q: ca.SX) -> Pair:
        """Return v = q[:3]', w' = 2 G q[3:]'."""
        turning = ca.horzcat(ca.SX(3, 3), 2 * euler_g(q[3:]))
        return turning, ca.horzcat(ca.SX.eye(3), ca.SX(3, 4))

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return no rows: all six directions are free."""
        return ca.SX(0, 1)


ALL_JOINTS: tuple[type[Joint], ...] = (
    Revolute, Prismatic, Cylindrical, Spherical, Universal, Planar, Fixed, Floating, Distance,
    PointOnLine, PlanarRevolute, PlanarPrismatic, PinInSlot,
)  # fmt: skip
"""Joints that a mechanism accepts."""
