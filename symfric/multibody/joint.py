"""The base of all joints: pose and motion subspace, its constraints, and how it is shown.

A joint connects a frame P on its parent body with a frame C on its child body. Its pose (R_PC,
p_PC) is a function of the joint coordinates q; its motion subspace (H_w, H_v) gives the relative
angular velocity w_PC_C = H_w q' in components of C, where Euler parameters have it simplest, and
the velocity p_PC' = H_v q' in those of P. The constraints are
expressions of the pose that vanish for every q; they close a loop, where the joint has no
coordinates. The axis of a joint is z of both frames.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Self

import casadi as ca
import numpy as np

from symfric.foundation.numeric import Scalar, is_number
from symfric.model.sketch import Symbol
from symfric.multibody.friction import JointFriction

HINTS = {
    "axis": "the axis of a joint is the z axis of both frames, m.frame('arm.pin', z=(0, 1, 0))",
    "friction": "friction acts in joints, such as Revolute(..., friction=JointFriction(law))",
    "damping": "damping is a part of its own, m.force(JointSpringDamper(...))",
}
"""What to do instead of giving a keyword that other tools have."""


class Keywords:
    """A dataclass that answers an unknown keyword with those that it has."""

    def __new__(cls, *_: object, **given: object) -> Self:
        """Refuse unknown keywords.

        Raises:
            ValueError: a keyword that is not a field.
        """
        kind: Any = cls
        known = [item.name for item in fields(kind) if item.init]
        if wrong := [name for name in given if name not in known]:
            hints = "".join(f"; {HINTS[name]}" for name in wrong if name in HINTS)
            raise ValueError(
                f"{cls.__name__}: expected {', '.join(known)}, got {', '.join(wrong)}{hints}"
            )
        return super().__new__(cls)


Pair = tuple[ca.SX, ca.SX]
FORCE = ("Fx", "Fy", "Fz")
COMPONENTS = (*FORCE, "Mx", "My", "Mz")


def unit(k: int) -> ca.SX:
    """Motion along or about the axis k, shape (3, 1)."""
    column = ca.SX(3, 1)
    column[k] = 1
    return column


@dataclass(frozen=True, eq=False)
class Joint(Keywords, ABC):
    """A joint between two bodies.

    Attributes:
        name: C identifier; coordinates and results carry it.
        parent, child: "body" or "body.frame"; "ground" is the body that does not move.
        start: joint coordinates at the start [m, rad]; a number where there is one coordinate.
            What closes a loop needs none.
        rate: their rates [m/s, rad/s].
        friction: law and geometry of the bearing, or None.
    """

    coordinates: ClassVar[tuple[tuple[str, str], ...]] = ()
    """Suffix and unit of each joint coordinate."""
    constrains: ClassVar[int] = 0
    """Number of constraints; the spanning tree keeps the joints with most."""
    closes: ClassVar[bool] = False
    """Whether it can only close loops, having no coordinates of its own."""
    rubs: ClassVar[tuple[str, ...]] = ()
    """Directions in which friction acts; "ball" is that of a ball in its socket."""
    directions: ClassVar[Mapping[str, int]] = {}
    """Where forces and motions may be prescribed: "slide", "turn", ... -> joint coordinate."""
    quaternion: ClassVar[int | None] = None
    """Index of the first of four Euler parameters among the coordinates."""
    plane: ClassVar[int | None] = None
    """Axis of both frames that is normal to the plane of a planar joint."""
    transmits: ClassVar[tuple[str, ...]] = COMPONENTS
    """Components of force and moment that it can transmit, in the axes of the child's frame."""
    symbol: ClassVar[Symbol] = Symbol()
    """How it is drawn."""

    name: str
    parent: str
    child: str
    start: Scalar | tuple[Scalar, ...] | None = None
    rate: Scalar | tuple[Scalar, ...] | None = None
    friction: JointFriction | None = None

    @abstractmethod
    def pose(self, q: ca.SX) -> Pair:
        """(R_PC, p_PC) at the joint coordinates q."""

    @abstractmethod
    def subspace(self, q: ca.SX) -> Pair:
        """(H_w, H_v), shape (3, n) each."""

    @abstractmethod
    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Expressions of R_PC and p_PC that must vanish, shape (m, 1)."""

    def problems(self) -> Iterator[str]:
        """What is wrong with its own numbers."""
        return iter(())

    def way(self, direction: str) -> str:
        """The direction that is meant; of none, the only one, else "turn" where it can turn."""
        if direction:
            return direction
        (only,) = self.directions if len(self.directions) == 1 else ("turn",)
        return only

    def linear(self, direction: str) -> bool:
        """Whether motion in this direction is a translation [m], not a rotation [rad]."""
        return self.coordinates[self.directions[direction]][1] == "m"

    def coordinate(self, k: int) -> str:
        """Name of a joint coordinate."""
        suffix = self.coordinates[k][0]
        return f"{self.name}_{suffix}" if suffix else self.name

    def axis(self, direction: str, R: ca.SX) -> ca.SX:
        """Axis of a direction in P, shape (3, 1)."""
        return unit("xyz".index(direction) if direction in "xyz" else 2)

    def bearing(self, direction: str, R: ca.SX) -> ca.SX:
        """Turns components in C into those of the bearing, whose own axis is the last."""
        return ca.SX.eye(3)

    def displacement(self, direction: str, R: ca.SX, p: ca.SX) -> ca.SX:
        """The coordinate of a direction at a pose; an angle between -pi and pi."""
        if self.linear(direction):
            return p["xyz".index(direction) if direction in "xyz" else 2]
        return ca.atan2(R[1, 0], R[0, 0])

    def normal_force(self, friction: JointFriction, F: ca.SX, T: ca.SX) -> ca.SX:
        """What presses its bearing [N] under the reaction F, T on the child.

        In the axes of the child's frame, of a joint that only closes loops in the parent's.
        """
        return friction.normal_force(self.rubs, F, T)

    @property
    def starts(self) -> tuple[Scalar, ...]:
        """Joint coordinates at the start; zero, or no rotation, where none are given."""
        return _several(self.start, len(self.coordinates), self.quaternion)

    @property
    def rates(self) -> tuple[Scalar, ...]:
        """Their rates at the start; zero where none are given."""
        return _several(self.rate, len(self.coordinates), None)


def _several(given: object, n: int, quaternion: int | None) -> tuple[Scalar, ...]:
    if given is None:
        return tuple(1.0 if i == quaternion else 0.0 for i in range(n))
    if isinstance(given, tuple):
        return given
    if n > 1 and isinstance(given, list | np.ndarray | ca.SX | ca.DM) and not is_number(given):
        return tuple(given)  # type: ignore[arg-type]
    return (given,)
