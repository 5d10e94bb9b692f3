"""Base class of joints: pose, motion subspace, constraints, drawing style, and friction.

A joint connects a frame P on its parent body with a frame C on its child body. Its pose (R_PC,
p_PC) is a function of the joint coordinates q. Its motion subspace (H_w, H_v) gives the relative
angular velocity w_PC_C = H_w q' in components of C, which are the simplest for Euler parameters,
and the velocity p_PC' = H_v q' in components of P. The constraints are expressions of the pose that
vanish for every q; they replace the coordinates of a joint that closes a loop. The axis of a joint
is z of both frames.

The reaction of a joint on its child, force F and moment T about the joint point in the axes of the
child's frame, loads the bearing at two stations at distance a on z:

    f_x2 = -T_y / a,  f_y2 = T_x / a,  f_x1 = -F_x - f_x2,  f_y1 = -F_y - f_y2

    cylindrical: N = |f_1| + |f_2|
    revolute:    N = |f_1| + |f_2| + |F_z|                   (thrust face)
    prismatic:   N = |f_x1 + T_z/b| + |f_y1| + |f_x2| + |f_y2| + |T_z/b|    (guide of width b)
    universal:   as a revolute joint for each of the two axes; the cross between them is massless
    spherical:   N = |F|
    joints that only close loops: see `symfric.multibody.joints`

Friction opposes sliding with -F(v, N) along z, and rotation about z with the moment -R F(R w, N).
The ball of a spherical joint slips with the vector v = R w in the axes of the socket, which is the
parent's frame. The moment is -R F(v, N); F is parallel to v for laws without states, and the
bristles of other laws are vectors, see `Isotropic`. Source: Haug, Mech. Based Des. Struct. Mach.,
2018, joint friction from multipliers.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from math import inf, pi
from typing import Any, ClassVar, Self, final

import casadi as ca
import numpy as np

from symfric.foundation.checks import as_number, shown
from symfric.foundation.numeric import Scalar, is_number, is_symbolic
from symfric.foundation.variable import take_si
from symfric.laws import Law
from symfric.laws.base.law import FORCE, require_law
from symfric.laws.composed.isotropic import anisotropy
from symfric.model.sketch import Symbol

OFFERED = (FORCE,)
"""Inputs in addition to v and N that a joint other than a ball provides for a law."""


def needs_more(law: Law, offered: Sequence[str] = OFFERED) -> str:
    """Return a message if a law has inputs other than v, N and `offered`; otherwise ""."""
    strange = ", ".join(i.name for i in law.inputs if i.name not in offered)
    known = ", ".join(("v", "N", *offered))
    expected = f"law: expected one that needs only {known}, got {type(law).__name__}"
    return f"{expected}, which also needs {strange}" if strange else ""


RANGES: dict[str, tuple[Callable[[float], bool], str]] = {
    "length": (lambda x: 0.0 < x < inf, "a number > 0"),
    "level": (lambda x: 0.0 <= x < inf, "a number >= 0"),
    "angle": (lambda x: 0.0 <= x < pi / 2, "an angle [rad] >= 0 and < pi/2"),
}
"""Test and description of the numbers of each kind."""

BEARING = {
    "radius": "length", "length": "length", "width": "length", "preload": "level",
    "normal": "level", "eps": "length",
}  # fmt: skip
"""Kind of each number of a `JointFriction`."""


def out_of_range(friction: Any, kinds: Mapping[str, str]) -> Iterator[str]:
    """Yield messages about fields that are not numbers of their kind, a key of `RANGES`.

    Symbols are accepted, and None in fields whose default is None.
    """
    optional = [item.name for item in fields(friction) if item.default is None]
    for name, kind in kinds.items():
        value, (good, what) = getattr(friction, name), RANGES[kind]
        size = as_number(value)
        absent = value is None and name in optional
        symbol = isinstance(value, ca.SX) and is_symbolic(value)
        if not (absent or symbol or (size is not None and good(size))):
            yield f"{name}: expected {what}, got {shown(value)}"


@final
@dataclass(frozen=True, eq=False)
class JointFriction:
    """Friction law and bearing geometry of a joint.

    Both bearings of a universal joint have the same law and geometry.

    If the normal force becomes negative, through an input, a parameter or a negative preload, the
    simulation stops with an error at that time.

    Laws with true sticking (`ExactCoulomb`, `Karnopp`, `LeineSwitch`, `Awrejcewicz`) obtain the
    applied force F_e from the constraints, see `symfric.multibody.applied`. With modes, a contact
    that stops sticks, and a sticking contact breaks away when |F_e| exceeds the static level. After
    each change of mode the whole mechanism is solved again; contacts that then cannot hold break
    away at the same instant, and contacts that would slide in the wrong direction stick again. For
    mu_s > mu_d several states of stick and slip may be valid; the history selects one, and
    overloaded contacts break away at the start. The contacts of a loop of one degree of freedom
    stick and break away together, when all of them reach their static levels. Smooth laws with
    mu_s > mu_d break away slightly earlier there, because the contact with the largest sliding
    velocity passes its peak first; for mu_s = mu_d they tend to the same motion. Limits: laws with
    true sticking are not available in a ball, nor where a drive prescribes the sliding; in a loop
    of several degrees of freedom their contacts must be independent. Forms that jump without modes
    (`Karnopp`, `LeineSwitch` with form = "original") end a run at the jump. Other terms of a `Sum`
    must vanish in stick.

    Attributes:
        law: any friction law of v, N and F_e; in a spherical joint an isotropic law of v and N, see
            `SpatialSlip`.
        radius: radius of the bearing or ball [m], for friction about an axis or a point.
        length: distance a of the two bearing stations [m]; the first is at the origin of the frame,
            the second on the positive z axis. With None, moments do not load the bearing.
        width: width b of a guide that supports the moment about z [m]; with None, this moment does
            not load the guide.
        preload: normal force in addition to the reactions [N].
        normal: constant normal force [N] that replaces the reactions; no unknown is then added.
        turning: True if the law takes the joint rate [rad/s] and returns a moment [N m]; `normal`
            is then the level of the moment [N m], and there is no radius. Robot description files
            use this form.
        eps: smoothing width of |f|, sqrt(f^2 + eps^2) - eps [N]. Laws that divide by the normal
            force (bristles) need a preload above zero if the reactions can vanish.
    """

    law: Law
    radius: Scalar | None = None
    length: Scalar | None = None
    width: Scalar | None = None
    preload: Scalar = 0.0
    normal: Scalar | None = None
    eps: Scalar = 1e-4
    turning: bool = False

    def __post_init__(self) -> None:
        require_law("friction", self.law)
        take_si("friction", self, "radius", "length", "width", "preload", "normal", "eps")

    def problems(self, rubs: Sequence[str]) -> Iterator[str]:
        """Yield messages about invalid values for friction in the directions `rubs`."""
        if not rubs:
            yield "expected a joint with friction, such as a hinge, a guide or a ball"
        offered = () if "ball" in rubs else OFFERED
        if reason := needs_more(self.law, offered):
            yield f"{reason}; a {'ball' if 'ball' in rubs else 'joint'} has no such input"
        elif "ball" in rubs and (reason := anisotropy(self.law)):
            yield (
                f"law: expected an isotropic one, got {type(self.law).__name__}; a ball slips in "
                f"any direction, and {reason}"
            )
        turns = any(direction != "slide" for direction in rubs)
        if self.turning:
            if "slide" in rubs or "ball" in rubs:
                yield "turning: expected a joint that turns about an axis only"
            if self.radius is not None:
                yield f"radius: expected none with turning, got {self.radius!r}"
            if self.normal is None:
                yield "normal: expected the level of the friction moment [N m], got none"
        elif turns and self.radius is None:
            yield "radius: expected the bearing's radius [m], got none"
        yield from out_of_range(self, BEARING)

    @property
    def arm(self) -> Scalar:
        """Radius of the bearing [m]; 1 without a radius (sliding only, or `turning`)."""
        return 1.0 if self.radius is None else self.radius

    def magnitude(self, *components: ca.SX) -> ca.SX:
        """Return the smoothed magnitude of a force with the given components [N]."""
        squares = sum((f * f for f in components), start=self.eps * self.eps)
        return ca.sqrt(squares) - self.eps

    def normal_force(self, rubs: Sequence[str], F: ca.SX, T: ca.SX) -> ca.SX:
        """Return the sum of the bearing forces [N] under the reaction F, T.

        Components are those of the child's frame, and for a universal joint those of the bearing.
        """
        if self.normal is not None:
            return ca.SX(self.normal)
        fx1, fy1, fx2, fy2 = -F[0], -F[1], ca.SX(0), ca.SX(0)
        if self.length is not None:
            fx2, fy2 = -T[1] / self.length, T[0] / self.length
            fx1, fy1 = fx1 - fx2, fy1 - fy2
        forces: list[tuple[ca.SX, ...]]
        if "ball" in rubs:
            forces = [(F[0], F[1], F[2])]
        elif rubs != ("slide",):
            thrust = ca.SX(0) if "slide" in rubs else F[2]
            forces = [(fx1, fy1), (fx2, fy2), (thrust,)]
        else:
            f3 = ca.SX(0) if self.width is None else T[2] / self.width
            forces = [(fx1 + f3,), (fy1,), (fx2,), (fy2,), (f3,)]
        pressing = [f for f in forces if not ca.vertcat(*f).is_zero()]
        return sum((self.magnitude(*f) for f in pressing), start=ca.SX(self.preload))


HINTS = {
    "axis": "the axis of a joint is the z axis of both frames, m.frame('arm.pin', z=(0, 1, 0))",
    "friction": "friction acts in joints, such as Revolute(..., friction=JointFriction(law))",
    "damping": "damping is a separate part, m.force(JointSpringDamper(...))",
}
"""Advice about keywords of other tools."""


class Keywords:
    """Base of dataclasses that list their keywords if an unknown keyword is given."""

    def __new__(cls, *_: object, **given: object) -> Self:
        """Create an object after a check of the keywords.

        Raises:
            ValueError: a keyword is not a field.
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
FORCE_NAMES = ("Fx", "Fy", "Fz")
COMPONENTS = (*FORCE_NAMES, "Mx", "My", "Mz")


def unit(k: int) -> ca.SX:
    """Return the unit vector of axis k, shape (3, 1)."""
    return ca.SX.eye(3)[:, k]


@dataclass(frozen=True, eq=False)
class Joint(Keywords, ABC):
    """Joint between two bodies.

    Attributes:
        name: C identifier; coordinates and results contain it.
        parent, child: "body" or "body.frame"; "ground" is the fixed body.
        start: joint coordinates at the start [m, rad]; a number for a single coordinate. Joints
            that close a loop need none.
        rate: rates of the joint coordinates at the start [m/s, rad/s].
        friction: law and geometry of the bearing, or None.
    """

    coordinates: ClassVar[tuple[tuple[str, str], ...]] = ()
    """Suffix and unit of each joint coordinate."""
    closes: ClassVar[bool] = False
    """True if the joint has no coordinates and can only close loops."""
    rubs: ClassVar[tuple[str, ...]] = ()
    """Directions in which friction acts; "ball" stands for a ball in its socket."""
    directions: ClassVar[Mapping[str, int]] = {}
    """Joint coordinate of each direction of forces and motions: "slide", "turn", ..."""
    quaternion: ClassVar[int | None] = None
    """Index of the first of four Euler parameters among the coordinates."""
    transmits: ClassVar[tuple[str, ...]] = COMPONENTS
    """Components of force and moment that the joint can transmit, in axes of the child's frame."""
    symbol: ClassVar[Symbol] = Symbol()
    """Drawing style."""

    name: str
    parent: str
    child: str
    start: Scalar | tuple[Scalar, ...] | None = None
    rate: Scalar | tuple[Scalar, ...] | None = None
    friction: JointFriction | None = None

    @abstractmethod
    def pose(self, q: ca.SX) -> Pair:
        """Return (R_PC, p_PC) at the joint coordinates q."""

    @abstractmethod
    def subspace(self, q: ca.SX) -> Pair:
        """Return (H_w, H_v), shape (3, n) each."""

    @abstractmethod
    def constraints(self, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return expressions of R_PC and p_PC that must vanish, shape (m, 1)."""

    @property
    def freedoms(self) -> int:
        """Number of independent coordinates; 0 if the joint only closes loops."""
        return len(self.coordinates) - (self.quaternion is not None)

    def problems(self) -> Iterator[str]:
        """Yield messages about invalid values."""
        return iter(())

    def way(self, direction: str) -> str:
        """Return the given direction; if it is empty, the only direction or else "turn"."""
        if direction:
            return direction
        (only,) = self.directions if len(self.directions) == 1 else ("turn",)
        return only

    def linear(self, direction: str) -> bool:
        """Return True if motion in this direction is a translation [m], not a rotation [rad]."""
        return self.coordinates[self.directions[direction]][1] == "m"

    def coordinate(self, k: int) -> str:
        """Return the name of a joint coordinate."""
        suffix = self.coordinates[k][0]
        return f"{self.name}_{suffix}" if suffix else self.name

    def axis(self, direction: str, R: ca.SX) -> ca.SX:
        """Return the axis of a direction in P, shape (3, 1)."""
        return unit("xyz".index(direction) if direction in "xyz" else 2)

    def bearing(self, direction: str, R: ca.SX) -> ca.SX:
        """Return the rotation from components in C to those of the bearing, with its axis last."""
        return ca.SX.eye(3)

    def displacement(self, direction: str, R: ca.SX, p: ca.SX) -> ca.SX:
        """Return the coordinate of a direction at a pose; angles are between -pi and pi."""
        if self.linear(direction):
            return p["xyz".index(direction) if direction in "xyz" else 2]
        return ca.atan2(R[1, 0], R[0, 0])

    def normal_force(self, friction: JointFriction, F: ca.SX, T: ca.SX) -> ca.SX:
        """Return the normal force [N] of the bearing under the reaction F, T on the child.

        F and T are in the axes of the child's frame; for a joint that only closes loops they are in
        those of the parent's frame.
        """
        return friction.normal_force(self.rubs, F, T)

    @property
    def starts(self) -> tuple[Scalar, ...]:
        """Joint coordinates at the start; by default zero, and Euler parameters of no rotation."""
        return _several(self.start, len(self.coordinates), self.quaternion)

    @property
    def rates(self) -> tuple[Scalar, ...]:
        """Joint rates at the start; zero by default."""
        return _several(self.rate, len(self.coordinates), None)


def _several(given: Any, n: int, quaternion: int | None) -> tuple[Scalar, ...]:
    if given is None:
        return tuple(1.0 if i == quaternion else 0.0 for i in range(n))
    several = n > 1 and isinstance(given, list | np.ndarray | ca.SX | ca.DM)
    several = isinstance(given, tuple) or (several and not is_number(given))
    return tuple(given) if several else (given,)
