"""Couplings of the displacements of two joints: gears, racks, screws, cams."""

from abc import abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import pi
from typing import Any, ClassVar, final

import casadi as ca

from symfric.foundation.checks import shown
from symfric.foundation.numeric import Scalar, equals, is_symbolic
from symfric.multibody.constraints import Constraint, ConstraintLoads, impossible, linear, wraps
from symfric.multibody.contact import Contact, element_contact
from symfric.multibody.element_friction import (
    CamFriction,
    ElementFriction,
    Flank,
    FlankFriction,
    MeshFriction,
    ThreadFriction,
)
from symfric.multibody.forces import Axial
from symfric.multibody.kinematics import Kinematics

TEETH = 1000
"""Largest denominator of a ratio if both angles are known modulo 2 pi."""


class Coupling(Constraint):
    """Coupling of the displacements of two joints, with or without friction.

    The multiplier does not contain the friction; the results of the friction have the names of
    those of a joint, `<name>_N`, `<name>_slip`, ...
    """

    kind: ClassVar[str] = "coupling"

    accepts: ClassVar[tuple[type[ElementFriction], ...]] = (MeshFriction, ThreadFriction)
    """Types of friction."""
    linear: ClassVar[bool] = True
    """True if s_b is a displacement [m] where the element has friction; s_a is an angle."""

    a: str
    b: str
    direction_a: str
    direction_b: str
    friction: Any

    def joints(self) -> tuple[tuple[str, str], tuple[str, str]]:
        """Return both coupled joints with their directions."""
        return (self.a, self.direction_a), (self.b, self.direction_b)

    def problems(self) -> Iterator[str]:
        """Yield messages about invalid numbers, identical displacements, or invalid friction."""
        yield from super().problems()
        a, b = self.joints()
        if a == b:
            yield f"expected two displacements, got {a[1]} of {a[0]} twice"
        if isinstance(self.friction, self.accepts):
            own = (*self.friction.problems(), *self.friction.fit(self.linear))
            yield from (f"friction: {text}" for text in own)
        elif self.friction is not None:
            kinds = " or ".join(f"{kind.__name__}(law, ...)" for kind in self.accepts)
            yield f"friction: expected {kinds}, got {shown(self.friction)}"

    @abstractmethod
    def slope_and_flank(self, kin: Kinematics, friction: Any) -> tuple[Scalar, Flank]:
        """Return ds_b/ds_a, and the geometry of the contact with the given friction."""

    def contacts(self, kin: Kinematics, lam: ca.SX) -> Sequence[Contact]:
        """Return the contact between the coupled parts."""
        if self.friction is None or lam.is_empty():
            return ()
        slope, flank = self.slope_and_flank(kin, self.friction)
        return (element_contact(self, kin, self.friction, slope, flank, lam),)


class RatioCoupling(Coupling):
    """Coupling of the displacements of two joints: gears, rolling without slipping, screws.

        s_b = ratio s_a + offset

    where s_a and s_b are displacements [m] or angles [rad] relative to the parents of the joints. A
    planetary gear is described by gears between joints on its carrier. The multiplier is the force
    or moment on the child of b; minus ratio times the multiplier acts on the child of a.

    Joint coordinates count full turns. The angle of a joint that closes a loop, and of every joint
    in absolute coordinates, is known modulo 2 pi. The coupling still allows full turns: for any
    ratio if one of the two angles is known modulo 2 pi, for ratios of integers if both are.

    With `friction`, the flanks rub under the force that the coupling transmits, see
    `ThreadFriction` and `MeshFriction`. The multiplier then does not contain the friction; the
    results of the friction have the names of those of a joint, `<name>_N`, `<name>_slip`, ...

    Limits: the coupling loads the joints with forces and moments along their axes only, not with
    the pressure between teeth; use a `UserConstraint` for that. There is no backlash.
    """

    ratio_field: ClassVar[str] = "ratio"
    """Name of the field that is or determines the ratio."""

    offset: Scalar
    friction: FlankFriction | None

    @property
    def _ratio(self) -> Scalar:
        return getattr(self, self.ratio_field)

    def problems(self) -> Iterator[str]:
        """Yield messages about invalid values and a zero ratio."""
        yield from super().problems()
        given = getattr(self, self.ratio_field)
        if equals(given, 0.0):
            yield f"{self.ratio_field}: expected a finite number other than 0, got {given!r}"

    def held(self, kin: Kinematics) -> ConstraintLoads:
        """Return offset + ratio s_a - s_b = 0."""
        (a, along_a), (b, along_b) = ((kin.topology.joints[name], d) for name, d in self.joints())
        ratio, offset, period = self._ratio, self.offset, None
        cyclic = wraps(kin, a, along_a), wraps(kin, b, along_b)
        ways = a.linear(along_a), b.linear(along_b)
        if self.friction is not None and ways != (False, self.linear):
            found = " and ".join("a displacement" if way else "an angle" for way in ways)
            wanted = "a displacement" if self.linear else "an angle"
            return impossible(f"friction: expected an angle a and {wanted} b, got {found}")
        if all(cyclic):
            fraction = Fraction(0.0 if is_symbolic(ratio) else float(ratio)).limit_denominator(
                TEETH
            )
            if is_symbolic(ratio) or abs(float(fraction) - ratio) > 1e-14 * abs(ratio):
                return impossible(
                    f"{self.ratio_field}: expected a ratio of integers up to {TEETH}, as the "
                    f"angles of {a.name} and {b.name} are known modulo 2 pi only, got {ratio}; in "
                    "joint coordinates, joints outside loops allow any number"
                )
            ratio, period = float(fraction), 2 * pi / fraction.denominator
        elif any(cyclic):
            period = 2 * pi * ratio if cyclic[0] else 2 * pi
        return linear(kin, self.name, [(a, along_a, -ratio), (b, along_b, 1.0)], offset, period)

    def slope_and_flank(self, kin: Kinematics, friction: Any) -> tuple[Scalar, Flank]:
        """Return the ratio and the geometry of the flanks."""
        return self._ratio, friction.flank(self._ratio, self.linear)


@final
@dataclass(frozen=True, eq=False)
class Gear(RatioCoupling):
    """Coupling of two angles: angle_b = ratio angle_a + offset.

    With z the number of teeth and axes in the same direction, `ratio` is -z_a/z_b for external
    gears and +z_a/z_b for a belt or an internal gear. `friction` is a `MeshFriction`, or a
    `ThreadFriction` if a is a worm and b its wheel. Result: `<name>_moment` [N m] on the child of
    b.
    """

    linear = False

    a: str
    b: str
    ratio: Scalar
    offset: Scalar = 0.0
    direction_a: str = "turn"
    direction_b: str = "turn"
    friction: FlankFriction | None = None


@final
@dataclass(frozen=True, eq=False)
class Rolling(RatioCoupling):
    """Coupling of an angle and a displacement: s_b = radius angle_a + offset.

    Examples are a pinion on its rack, a wheel that rolls without slipping, and a drum with its
    rope. A negative radius reverses the direction. Result: `<name>_force` [N] on the child of b.
    For a disc in a plane, angle and displacement are the directions "turn" and "x" of one `Planar`
    joint; the result is then the force that the track must transmit without slipping. `friction` is
    a `MeshFriction` for a rack, or a `ThreadFriction` for a spindle a that moves a guided nut b.
    """

    ratio_field = "radius"

    a: str
    b: str
    radius: Scalar
    offset: Scalar = 0.0
    direction_a: str = "turn"
    direction_b: str = "slide"
    friction: FlankFriction | None = None


@final
@dataclass(frozen=True, eq=False)
class Screw(RatioCoupling):
    """Thread of a cylindrical joint: slide = lead / (2 pi) turn + offset.

    `friction` is a `ThreadFriction`; friction of the joint itself is that of its bearing, which the
    thread does not load. Result: `<name>_force` [N] along the axis on the child of the joint.
    """

    ratio_field = "lead"

    accepts = (ThreadFriction,)

    joint: str
    lead: Scalar
    offset: Scalar = 0.0
    friction: FlankFriction | None = None

    def joints(self) -> tuple[tuple[str, str], tuple[str, str]]:
        """Return both directions of the joint."""
        return (self.joint, "turn"), (self.joint, "slide")

    @property
    def _ratio(self) -> Scalar:
        return self.lead / (2 * pi)


@final
@dataclass(frozen=True, eq=False)
class Cam(Coupling):
    """Cam that moves a translating follower: s_b = lift(angle_a).

    `lift` takes the SX symbol of the cam angle [rad] and returns the displacement [m] of the
    follower, twice differentiable. Result: `<name>_force` [N] on the child of b; `friction` adds
    the results of a contact, `<name>_N`, `<name>_slip`, ...

    Limits: the cam pushes and pulls (a groove, or a spring that holds the follower); where the
    force is negative, a follower on one side of the cam would lift off. The force loads the joints
    along their axes only, not the guide of the follower. If the angle of a is known modulo 2 pi
    (see `RatioCoupling`), the lift must be periodic.
    """

    accepts = (CamFriction,)

    a: str
    b: str
    lift: Callable[[ca.SX], Scalar]
    friction: CamFriction | None = None
    direction_a: str = "turn"
    direction_b: str = "slide"

    def held(self, kin: Kinematics) -> ConstraintLoads:
        """Return lift(angle) - s_b = 0."""
        a, b = (kin.topology.joints[name] for name in (self.a, self.b))
        if a.linear(self.direction_a) or not b.linear(self.direction_b):
            return impossible("expected an angle a and a displacement b")
        try:
            lift, slope = self._profile(kin)
        except (TypeError, ValueError, ArithmeticError, RuntimeError, NotImplementedError):
            return impossible(
                "lift: expected a function of the angle that returns one expression of it; use "
                "casadi functions, not those of math"
            )

        def loads(lam: ca.SX) -> Sequence[Axial]:
            return [Axial(a, self.direction_a, -slope * lam), Axial(b, self.direction_b, lam)]

        phi = lift - kin.along(b, self.direction_b)[0]
        return ConstraintLoads(phi, (f"{self.name}_force",), loads, "N")

    def slope_and_flank(self, kin: Kinematics, friction: Any) -> tuple[Scalar, Flank]:
        """Return the slope of the lift and the geometry of cam and follower."""
        lift, slope = self._profile(kin)
        return slope, friction.flank(slope, lift)

    def _profile(self, kin: Kinematics) -> tuple[ca.SX, ca.SX]:
        """Return lift and slope at the angle of the cam."""
        angle = ca.SX.sym("angle")
        lift = ca.SX(self.lift(angle))
        if lift.numel() != 1 or not ca.depends_on(lift, angle):
            raise ValueError
        slope = ca.gradient(lift, angle)
        now = kin.along(kin.topology.joints[self.a], self.direction_a)[0]
        lift, slope = ca.substitute([lift, slope], [angle], [now])
        return lift, slope
