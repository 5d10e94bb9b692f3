"""Cams with translating followers, and the friction between them."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, final

import casadi as ca

from symfric.foundation.checks import shown
from symfric.foundation.numeric import Scalar, sqrt
from symfric.multibody.constraints import Constraint, Held, impossible
from symfric.multibody.contact import Contact, element_contact
from symfric.multibody.element_friction import ElementFriction, Flank
from symfric.multibody.forces import Axial
from symfric.multibody.kinematics import Kinematics

FOLLOWERS = ("flat", "pointed", "roller")


@final
@dataclass(frozen=True, eq=False)
class CamFriction(ElementFriction):
    """Friction between a cam and a follower whose line of motion passes through the cam axis.

    With r = base_radius + s_b, pressure angle alpha, tan(alpha) = slope / r for the slope ds_b/ds_a
    of the lift, angular velocity w of the cam and velocity u of the follower:

        follower   v                                            N
        flat       r w                                          |f|
        pointed    r cos(alpha) w + sin(alpha) u                |f| / cos(alpha)
        roller     k (r cos(alpha) w + sin(alpha) u - R w)      |f| / cos(alpha)

    with the force f of the multiplier. The roller of radius R rolls without slipping and without
    mass; friction acts at its pin, k = pin_radius / R.
    Limits: at constant s_b the moment of friction on the cam is mu f r for a flat follower. To lift
    a load F, a pointed follower needs the moment F r tan(alpha + phi), phi = atan(mu).

    Attributes:
        base_radius: distance at s_b = 0 from the cam axis to the face, the point, or the centre of
            the roller [m].
        follower: "flat", "pointed" or "roller".
        roller_radius, pin_radius: radii of the roller and its pin [m].
    """

    kinds: ClassVar[Mapping[str, str]] = dict.fromkeys(
        ("base_radius", "roller_radius", "pin_radius"), "length"
    )
    optional = ("roller_radius", "pin_radius")

    base_radius: Scalar
    follower: str = "flat"
    roller_radius: Scalar | None = None
    pin_radius: Scalar | None = None

    def problems(self) -> Iterator[str]:
        """Yield messages about invalid values."""
        yield from super().problems()
        follower = vars(self)["follower"]
        if not (isinstance(follower, str) and follower in FOLLOWERS):
            yield f"follower: expected {', '.join(FOLLOWERS)}, got {shown(follower)}"
            return
        for name in self.optional:
            given, rolls = getattr(self, name) is not None, self.follower == "roller"
            if given != rolls:
                expected = "a length [m] of the roller" if rolls else "none without a roller"
                yield f"{name}: expected {expected}, got {shown(getattr(self, name))}"

    def flank(self, slope: Scalar, s: Scalar) -> Flank:
        """Return levers and divisor at the follower displacement `s`."""
        r = self.base_radius + s
        if self.follower == "flat":
            return Flank(r, 0.0, 1.0)
        length = sqrt(r * r + slope * slope)
        along, across = r / length, slope / length
        if self.roller_radius is None:
            return Flank(r * along, across, along)
        k = self.pin_radius / self.roller_radius
        return Flank(k * (r * along - self.roller_radius), k * across, along)


@final
@dataclass(frozen=True, eq=False)
class Cam(Constraint):
    """Cam that moves a translating follower: s_b = lift(angle_a).

    `lift` takes the SX symbol of the cam angle [rad] and returns the displacement [m] of the
    follower, twice differentiable. Result: `<name>_force` [N] on the child of b; `friction` adds
    the results of a contact, `<name>_N`, `<name>_slip`, ...

    Limits: the cam pushes and pulls (a groove, or a spring that holds the follower); where the
    force is negative, a follower on one side of the cam would lift off. The force loads the joints
    along their axes only, not the guide of the follower. If the angle of a is known modulo 2 pi
    (see `Coupling`), the lift must be periodic.
    """

    kind: ClassVar[str] = "coupling"

    a: str
    b: str
    lift: Callable[[ca.SX], Scalar]
    friction: CamFriction | None = None
    direction_a: str = "turn"
    direction_b: str = "slide"

    def joints(self) -> Iterable[tuple[str, str]]:
        """Return the joints of cam and follower with their directions."""
        return (self.a, self.direction_a), (self.b, self.direction_b)

    def problems(self) -> Iterator[str]:
        """Yield messages about invalid friction."""
        yield from super().problems()
        if isinstance(self.friction, CamFriction):
            yield from (f"friction: {text}" for text in self.friction.problems())
        elif self.friction is not None:
            yield f"friction: expected CamFriction(law, ...), got {shown(self.friction)}"

    def held(self, kin: Kinematics) -> Held:
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
        return Held(phi, (f"{self.name}_force",), loads, "N")

    def contacts(self, kin: Kinematics, lam: ca.SX) -> Sequence[Contact]:
        """Return the contact between cam and follower."""
        if self.friction is None or lam.is_empty():
            return ()
        lift, slope = self._profile(kin)
        flank = self.friction.flank(slope, lift)
        return (element_contact(self, kin, self.friction, slope, flank, lam),)

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
