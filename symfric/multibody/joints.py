"""The joints: each with its pose, its motion subspace and its constraints.

See `symfric.multibody.joint` for what these are.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, final

import casadi as ca

from symfric.model.sketch import Symbol
from symfric.multibody.closing import (
    Distance,
    PinInSlot,
    PlanarPrismatic,
    PlanarRevolute,
    PointOnLine,
)
from symfric.multibody.joint import FORCE, Joint, Pair, unit
from symfric.multibody.spatial import (
    euler_g,
    rotation,
    rotation_x,
    rotation_y,
    rotation_z,
)

NONE = ca.SX(3, 0)
ANGLE, LENGTH = ("", "rad"), ("", "m")
EULER = tuple((f"e{i}", "1") for i in range(4))


def _z() -> ca.SX:
    return unit(2)


def _parallel(R: ca.SX) -> ca.SX:
    """The axes z of both frames are parallel: 2 equations."""
    return ca.vertcat(R[0, 2], R[1, 2])


@final
@dataclass(frozen=True, eq=False)
class Revolute(Joint):
    """Turns about z; 5 constraints."""

    coordinates: ClassVar[tuple[tuple[str, str], ...]] = (ANGLE,)
    constrains: ClassVar[int] = 5
    rubs: ClassVar[tuple[str, ...]] = ("turn",)
    directions: ClassVar[Mapping[str, int]] = {"turn": 0}
    transmits: ClassVar[tuple[str, ...]] = (*FORCE, "Mx", "My")
    symbol: ClassVar[Symbol] = Symbol("o", axes=(("b", 2),), hinge=True, anchored=True)

    def pose(self, q: ca.SX) -> Pair:
        """Turned by q about z."""
        return rotation_z(q), ca.SX(3, 1)

    def subspace(self, q: ca.SX) -> Pair:
        """Angular velocity along z of the joint, no velocity of its point."""
        return _z(), ca.SX(3, 1)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """One point in common, parallel axes."""
        return ca.vertcat(p, _parallel(R))


@final
@dataclass(frozen=True, eq=False)
class Prismatic(Joint):
    """Slides along z without turning; 5 constraints."""

    coordinates: ClassVar[tuple[tuple[str, str], ...]] = (LENGTH,)
    constrains: ClassVar[int] = 5
    rubs: ClassVar[tuple[str, ...]] = ("slide",)
    directions: ClassVar[Mapping[str, int]] = {"slide": 0}
    transmits: ClassVar[tuple[str, ...]] = ("Fx", "Fy", "Mx", "My", "Mz")
    symbol: ClassVar[Symbol] = Symbol("s", guide=True)

    def pose(self, q: ca.SX) -> Pair:
        """Shifted by q along z."""
        return ca.SX.eye(3), ca.vertcat(0, 0, q)

    def subspace(self, q: ca.SX) -> Pair:
        """No angular velocity, velocity along z of the joint."""
        return ca.SX(3, 1), _z()

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """On one line, parallel axes, no turn."""
        return ca.vertcat(p[0], p[1], _parallel(R), R[1, 0])


@final
@dataclass(frozen=True, eq=False)
class Cylindrical(Joint):
    """Slides along z and turns about it; 4 constraints."""

    coordinates: ClassVar[tuple[tuple[str, str], ...]] = (("slide", "m"), ("angle", "rad"))
    constrains: ClassVar[int] = 4
    rubs: ClassVar[tuple[str, ...]] = ("slide", "turn")
    directions: ClassVar[Mapping[str, int]] = {"slide": 0, "turn": 1}
    transmits: ClassVar[tuple[str, ...]] = ("Fx", "Fy", "Mx", "My")
    symbol: ClassVar[Symbol] = Symbol("s", axes=(("a", 2),), guide=True)

    def pose(self, q: ca.SX) -> Pair:
        """Shifted by q[0] along z and turned by q[1] about it."""
        return rotation_z(q[1]), ca.vertcat(0, 0, q[0])

    def subspace(self, q: ca.SX) -> Pair:
        """Translation along z, rotation about z."""
        return ca.horzcat(ca.SX(3, 1), _z()), ca.horzcat(_z(), ca.SX(3, 1))

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """On one line, parallel axes."""
        return ca.vertcat(p[0], p[1], _parallel(R))


@final
@dataclass(frozen=True, eq=False)
class Spherical(Joint):
    """Turns about a point; Euler parameters as coordinates; 3 constraints."""

    coordinates: ClassVar[tuple[tuple[str, str], ...]] = EULER
    constrains: ClassVar[int] = 3
    rubs: ClassVar[tuple[str, ...]] = ("ball",)
    quaternion: ClassVar[int | None] = 0
    transmits: ClassVar[tuple[str, ...]] = FORCE
    symbol: ClassVar[Symbol] = Symbol("o", anchored=True)

    def pose(self, q: ca.SX) -> Pair:
        """R of the Euler parameters q."""
        return rotation(q), ca.SX(3, 1)

    def subspace(self, q: ca.SX) -> Pair:
        """W' = 2 G q'."""
        return 2 * euler_g(q), ca.SX(3, 4)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """One point in common."""
        return ca.SX(p)


@final
@dataclass(frozen=True, eq=False)
class Universal(Joint):
    """Turns about x of the parent and y of the child, which stay orthogonal; 4 constraints."""

    coordinates: ClassVar[tuple[tuple[str, str], ...]] = (("x", "rad"), ("y", "rad"))
    constrains: ClassVar[int] = 4
    rubs: ClassVar[tuple[str, ...]] = ("x", "y")
    directions: ClassVar[Mapping[str, int]] = {"x": 0, "y": 1}
    transmits: ClassVar[tuple[str, ...]] = (*FORCE, "Mx", "Mz")
    symbol: ClassVar[Symbol] = Symbol("o", axes=(("a", 0), ("b", 1)), anchored=True)

    def pose(self, q: ca.SX) -> Pair:
        """Turned by q[0] about x, then by q[1] about the new y."""
        return rotation_x(q[0]) @ rotation_y(q[1]), ca.SX(3, 1)

    def subspace(self, q: ca.SX) -> Pair:
        """Rotation about y, and about x before it."""
        axes = ca.horzcat(ca.vertcat(ca.cos(q[1]), 0, ca.sin(q[1])), ca.vertcat(0, 1, 0))
        return axes, ca.SX(3, 2)

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """One point in common, orthogonal axes."""
        return ca.vertcat(p, R[0, 1])

    def axis(self, direction: str, R: ca.SX) -> ca.SX:
        """The parent's x, the child's y."""
        return unit(0) if direction == "x" else R[:, 1]

    def bearing(self, direction: str, R: ca.SX) -> ca.SX:
        """One on the parent's x, one on the child's y; a massless cross between them."""
        return R[[1, 2, 0], :] if direction == "x" else ca.SX.eye(3)[[2, 0, 1], :]

    def displacement(self, direction: str, R: ca.SX, p: ca.SX) -> ca.SX:
        """Angle about the parent's x, angle about the child's y."""
        if direction == "x":
            return ca.atan2(R[2, 1], R[1, 1])
        return ca.atan2(R[0, 2], R[0, 0])


@final
@dataclass(frozen=True, eq=False)
class Planar(Joint):
    """Moves in the plane x, y and turns about z; 3 constraints."""

    coordinates: ClassVar[tuple[tuple[str, str], ...]] = (("x", "m"), ("y", "m"), ("angle", "rad"))
    constrains: ClassVar[int] = 3
    directions: ClassVar[Mapping[str, int]] = {"x": 0, "y": 1, "turn": 2}
    transmits: ClassVar[tuple[str, ...]] = ("Fz", "Mx", "My")
    symbol: ClassVar[Symbol] = Symbol("D", plate=True)

    def pose(self, q: ca.SX) -> Pair:
        """Shifted by q[0], q[1] in the plane and turned by q[2] about its normal."""
        return rotation_z(q[2]), ca.vertcat(q[0], q[1], 0)

    def subspace(self, q: ca.SX) -> Pair:
        """Translation along x and y, rotation about z."""
        return ca.horzcat(ca.SX(3, 2), _z()), ca.horzcat(ca.SX.eye(3)[:, :2], ca.SX(3, 1))

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """In one plane, parallel normals."""
        return ca.vertcat(p[2], _parallel(R))


@final
@dataclass(frozen=True, eq=False)
class Fixed(Joint):
    """Holds two bodies together; 6 constraints."""

    constrains: ClassVar[int] = 6
    symbol: ClassVar[Symbol] = Symbol("s", anchored=True)

    def pose(self, q: ca.SX) -> Pair:
        """The frames coincide: identity and zero."""
        return ca.SX.eye(3), ca.SX(3, 1)

    def subspace(self, q: ca.SX) -> Pair:
        """No column: nothing moves."""
        return NONE, NONE

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """One point in common, all axes parallel."""
        return ca.vertcat(p, _parallel(R), R[1, 0])


@final
@dataclass(frozen=True, eq=False)
class Floating(Joint):
    """Lets a body move freely; Euler parameters for its rotation; no constraint."""

    coordinates: ClassVar[tuple[tuple[str, str], ...]] = (
        ("x", "m"),
        ("y", "m"),
        ("z", "m"),
        *EULER,
    )
    quaternion: ClassVar[int | None] = 3
    transmits: ClassVar[tuple[str, ...]] = ()

    def pose(self, q: ca.SX) -> Pair:
        """Shifted by q[:3], R of the Euler parameters q[3:]."""
        return rotation(q[3:]), q[:3]

    def subspace(self, q: ca.SX) -> Pair:
        """V = q[:3]', w' = 2 G q[3:]'."""
        return (
            ca.horzcat(ca.SX(3, 3), 2 * euler_g(q[3:])),
            ca.horzcat(ca.SX.eye(3), ca.SX(3, 4)),
        )

    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """No row: all six directions are free."""
        return ca.SX(0, 1)


ALL_JOINTS: tuple[type[Joint], ...] = (
    Revolute, Prismatic, Cylindrical, Spherical, Universal, Planar, Fixed, Floating, Distance,
    PointOnLine, PlanarRevolute, PlanarPrismatic, PinInSlot,
)  # fmt: skip
"""Every joint that a mechanism takes."""
