"""Capstan and belt: ropes and belts that slip on drums."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi, sin
from typing import final

import casadi as ca

from symfric.foundation.checks import as_number
from symfric.foundation.numeric import Scalar, equals, is_number
from symfric.laws import Law
from symfric.multibody.actuated import ActuatedElement, overwound, wrapped
from symfric.multibody.forces import Axial, Load
from symfric.multibody.kinematics import Kinematics


class _Wound(ActuatedElement):
    """Rope or belt in a groove."""

    actuator = "tension"

    angle: Scalar
    groove: Scalar

    @property
    def wrap(self) -> Scalar:
        """Wrap angle [rad]; a groove increases the normal force by 1/sin of its half angle."""
        return self.angle if equals(self.groove, pi / 2) else self.angle / ca.sin(self.groove)

    def problems(self) -> Iterator[str]:
        """Yield a message about an impossible groove."""
        yield from super().problems()
        half, angle = as_number(self.groove), as_number(self.angle)
        if half is not None and half > pi / 2:
            yield f"groove: expected at most pi/2 rad, got {half:g}; angles are in radians"
        elif half is not None and half > 0 and angle is not None:
            yield from overwound(self.law, angle / sin(half))


@final
@dataclass(frozen=True, eq=False)
class CapstanDrum(_Wound):
    """Rope that is wound around a drum and held at its free end with a tension.

        v = radius w - s',   F = T - tension,   T = tension exp(m angle / sin(groove))

    w is the rate of the drum and s' that of the rope, positive towards the drum. T is the tension
    that pulls the load of the rope. If the drum is faster than the rope, or the load pulls the rope
    out, v > 0 and T = tension exp(mu angle); for v < 0, T = tension exp(-mu angle) (Eytelwein). The
    moment on the drum is -radius F. Results on request: `<name>_load`, T [N], and
    `<name>_work_rate`, the power of the tension at the free end [W].

    Attributes:
        rope: joint that slides with the load of the rope, positive towards the drum.
        law: friction law of the rope on the drum.
        tension: tension of the free end [N].
        radius: radius of the drum [m]; negative if positive rotation pays out the rope.
        angle: wrap angle [rad], 2 pi for each turn.
        drum: joint of the drum; "" for a bollard, which does not turn.
        groove: half angle of the groove [rad]; pi/2 for a smooth drum.
        preload: additional tension of the free end, also at zero actuation [N].

    Limits: |m| angle / sin(groove) is at most 50. A rope without stiffness and mass; only its load
    end moves a body.
    Source: Euler 1769, Eytelwein 1808.
    """

    above_zero = ("angle", "groove")
    other_than_zero = ("radius",)

    name: str
    rope: str
    law: Law
    tension: Scalar
    radius: Scalar
    angle: Scalar
    drum: str = ""
    groove: Scalar = pi / 2
    preload: Scalar = 0.0

    def joints(self) -> tuple[tuple[str, str], ...]:
        """Return the rope and, if it is given, the drum."""
        return ((self.rope, "slide"), *([(self.drum, "turn")] if self.drum else ()))

    def levers(self) -> tuple[Scalar, ...]:
        """Return -1 for the rope and the radius of the drum."""
        return (-1.0, self.radius) if self.drum else (-1.0,)

    def pressing(self, m: ca.SX) -> tuple[Scalar, Scalar]:
        """Return N over the tension of the free end, and 0."""
        return wrapped(m, self.wrap)[1], 0.0

    def tensions(self, F: ca.SX) -> dict[str, ca.SX]:
        """Return the tension of the load [N]."""
        return {"load": self.actuation + F}

    @property
    def conservative(self) -> bool:
        """False, because the tension of the free end does work."""
        return False

    def loads(self, kin: Kinematics) -> Iterator[Load | Axial]:
        """Yield the tension of the free end, which pulls the load if there is no friction."""
        yield Axial(kin.topology.joints[self.rope], "slide", self.actuation)


@final
@dataclass(frozen=True, eq=False)
class Belt(_Wound):
    """Belt between two pulleys that slips on one of them.

        v = radius_a w_a - radius_b w_b,   F = T_1 - T_2,   T_1 + T_2 = 2 tension
        T_1 = T_2 exp(m angle / sin(groove)),   F = 2 tension tanh(m angle / (2 sin(groove)))

    F > 0 if pulley a drives. The moment on a is -radius_a F, that on b is radius_b F. Results on
    request: `<name>_tight`, `<name>_slack`, T_1 and T_2 [N].

    Attributes:
        a, b: joints of the pulleys; both have the same parent.
        law: friction law on the pulley that slips.
        tension: mean tension of both strands [N], that of the belt at rest.
        radius_a, radius_b: radii [m]; of opposite signs for a crossed belt.
        angle: wrap angle on the pulley that slips, the smaller product of coefficient and angle.
        groove: half angle of the groove of a wedge belt [rad]; pi/2 for a flat belt.
        preload: additional mean tension, also at zero actuation [N].

    Limits: |m| angle / sin(groove) is at most 50. A belt without stiffness (no creep) and without
    mass (no centrifugal force), at a constant distance of the axes.
    Source: Eytelwein 1808; Shigley, Mechanical Engineering Design, flexible elements.
    """

    above_zero = ("angle", "groove")
    other_than_zero = ("radius_a", "radius_b")

    name: str
    a: str
    b: str
    law: Law
    tension: Scalar
    radius_a: Scalar
    radius_b: Scalar
    angle: Scalar
    groove: Scalar = pi / 2
    preload: Scalar = 0.0

    def problems(self) -> Iterator[str]:
        """Yield messages about invalid numbers, and about an angle of more than a turn."""
        yield from super().problems()
        if is_number(self.angle) and self.angle > 2 * pi:
            yield f"angle: expected at most 2 pi rad, got {self.angle:g}; angles are in radians"

    def joints(self) -> tuple[tuple[str, str], ...]:
        """Return both pulleys."""
        return (self.a, "turn"), (self.b, "turn")

    def levers(self) -> tuple[Scalar, ...]:
        """Return the radius of a and minus that of b."""
        return self.radius_a, -self.radius_b

    def pressing(self, m: ca.SX) -> tuple[Scalar, Scalar]:
        """Return N over the mean tension, and 0."""
        ratio, arc = wrapped(m, self.wrap)
        return 2 * arc / (1 + ratio), 0.0

    def tensions(self, F: ca.SX) -> dict[str, ca.SX]:
        """Return the tensions of both strands [N]."""
        return {"tight": self.actuation + F / 2, "slack": self.actuation - F / 2}
