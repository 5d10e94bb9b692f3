"""Brakes and clutches: discs and cones, drums with shoes, bands."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import cos, inf, pi, sin
from types import MappingProxyType
from typing import final

import casadi as ca

from symfric.foundation import checks
from symfric.foundation.checks import as_number
from symfric.foundation.numeric import Scalar, equals
from symfric.laws import Law
from symfric.multibody.actuated import ActuatedElement, overwound, wrapped

PRESSURES = ("uniform pressure", "uniform wear")


@final
@dataclass(frozen=True, eq=False)
class DiscClutch(ActuatedElement):
    """Disc or cone clutch between the children of joints a and b; without b a brake of joint a.

        v = r (w_a - w_b),   N = faces force / sin(half_angle)
        r = 2/3 (R^3 - r_i^3) / (R^2 - r_i^2)     uniform pressure, new linings
        r = (R + r_i) / 2                         uniform wear, worn linings

    w_a and w_b are joint rates, R and r_i the radii of the ring. The torque is r F. It acts on the
    child of a with the sign of -v and on the child of b with the opposite sign; both joints must
    have the same parent. `<name>_locking` is 0.

    Attributes:
        a, b: joints that turn; b = "" is a part that does not turn.
        law: friction law at the mean radius.
        force: axial force that presses the faces together [N].
        outer, inner: radii R and r_i of the ring [m].
        faces: number of faces in contact, each with the axial force.
        half_angle: half angle of the cone [rad]; pi/2 is a flat disc.
        pressure: "uniform pressure" or "uniform wear".
        preload: additional axial force, also at zero actuation [N].

    Limits: the sliding velocity is that at the mean radius, so a law whose coefficient depends on
    the velocity is not integrated over the ring. A cone releases without a force. For outer = inner
    both radii agree.
    Source: Shigley, Mechanical Engineering Design, chapter on clutches and brakes.
    """

    above_zero = ("outer", "faces", "half_angle")

    name: str
    a: str
    law: Law
    force: Scalar
    outer: Scalar
    inner: Scalar
    b: str = ""
    faces: Scalar = 1
    half_angle: Scalar = pi / 2
    pressure: str = PRESSURES[0]
    preload: Scalar = 0.0

    @property
    def radius(self) -> Scalar:
        """Mean radius [m] at which the friction force acts."""
        R, r = self.outer, self.inner
        if self.pressure == PRESSURES[1]:
            return (R + r) / 2
        return 2 * (R * R + R * r + r * r) / (3 * (R + r))

    def joints(self) -> tuple[tuple[str, str], ...]:
        """Return a and, if it is given, b."""
        return tuple((name, "turn") for name in (self.a, self.b) if name)

    def levers(self) -> tuple[Scalar, ...]:
        """Return the mean radius for a, and minus that for b."""
        return (self.radius, -self.radius) if self.b else (self.radius,)

    def pressing(self, m: ca.SX) -> tuple[Scalar, Scalar]:
        """Return the gain of faces and wedge, and 0."""
        flat = equals(self.half_angle, pi / 2)
        return self.faces * 1.0 if flat else self.faces / ca.sin(self.half_angle), 0.0

    def problems(self) -> Iterator[str]:
        """Yield messages about the ring and the distribution of the pressure."""
        yield from super().problems()
        inner, outer, angle = map(as_number, (self.inner, self.outer, self.half_angle))
        if inner is not None and inner < 0:
            yield f"inner: expected a number >= 0, got {inner:g}"
        elif inner is not None and outer is not None and 0 < outer < inner < inf:
            yield f"inner: expected a radius from 0 to outer = {outer:g} m, got {inner:g}"
        if angle is not None and angle > pi / 2:
            yield f"half_angle: expected at most pi/2 rad, got {angle:g}; angles are in radians"
        if self.pressure not in PRESSURES:
            yield f"pressure: expected {' or '.join(PRESSURES)}, got {self.pressure}"


def shoe_arms(radius: float, pivot: float, start: float, end: float) -> tuple[float, float]:
    """Return the arms (arm_normal, arm_friction) [m] of a long shoe with the pressure p ~ sin.

        arm_normal = pivot  int sin^2 / int sin
        arm_friction = radius - pivot  int sin cos / int sin     integrals from start to end

    The normal force is then that of all elements of the lining, so that the torque remains r F.

    Args:
        radius: radius of the drum [m].
        pivot: distance of the pivot of the shoe from the axis of the drum [m].
        start, end: angles of the lining [rad], from the line between axis and pivot.

    Raises:
        ValueError: a number is not positive, or not 0 <= start < end <= pi.

    Limits: a rigid shoe on a rigid drum with a linear lining.
    Source: Shigley, Mechanical Engineering Design, internal expanding shoes.
    """
    where = "shoe_arms"
    radius, pivot = (
        checks.number(f"{where}: {name}", x, unit="m", above=0.0)
        for name, x in (("radius", radius), ("pivot", pivot))
    )
    end = checks.number(f"{where}: end", end, unit="rad", above=0.0, upper=pi)
    start = checks.number(f"{where}: start", start, unit="rad", lower=0.0)
    if not start < end:
        raise checks.refused(f"{where}: start", f"an angle below end = {end:g} rad", start)
    load = cos(start) - cos(end)
    squares = (end - start) / 2 - (sin(2 * end) - sin(2 * start)) / 4
    mixed = (sin(end) ** 2 - sin(start) ** 2) / 2
    return pivot * squares / load, radius - pivot * mixed / load


SHOES: Mapping[str, tuple[int, int]] = MappingProxyType(
    {"leading": (1, 0), "trailing": (0, 1), "leading and trailing": (1, 1), "two leading": (2, 0)}
)
"""Numbers of leading and trailing shoes in positive rotation."""


class _OnDrum(ActuatedElement):
    """Brake on a drum."""

    joint: str
    radius: Scalar

    def joints(self) -> tuple[tuple[str, str], ...]:
        """Return the joint of the drum."""
        return ((self.joint, "turn"),)

    def levers(self) -> tuple[Scalar, ...]:
        """Return the radius of the drum."""
        return (self.radius,)


@final
@dataclass(frozen=True, eq=False)
class DrumBrake(_OnDrum):
    """Drum brake with pivoted shoes on the child of a joint.

        v = radius w,   torque = radius F,   k = arm_friction / arm_normal
        one shoe:  N arm_normal = force arm_force +- F arm_friction

    with + for the leading shoe, whose friction presses it on (self-energising), and - for the
    trailing one. In sliding with the coefficient mu each shoe has N = force arm_force / arm_normal
    / (1 -+ mu k). With a shoe of each kind N = 2 force arm_force / arm_normal / (1 - (mu k)^2), and
    F is the sum over both. A leading shoe locks itself if mu k >= 1. In negative rotation leading
    and trailing are exchanged.

    Attributes:
        joint: joint of the drum.
        law: friction law of the lining.
        force: force on each shoe [N].
        radius: radius of the drum [m].
        arm_force, arm_normal, arm_friction: arms of the force, of the normal force and of the
            friction force about the pivot of the shoe [m]; see `shoe_arms` for long shoes.
        shoes: "leading", "trailing", "leading and trailing" or "two leading", as named for positive
            rotation.
        preload: additional force on each shoe, also at zero actuation [N].

    Limits: both shoes have the same coefficient m in stick.
    Source: Shigley, Mechanical Engineering Design, chapter on clutches and brakes.
    """

    above_zero = ("radius", "arm_force", "arm_normal", "arm_friction")

    name: str
    joint: str
    law: Law
    force: Scalar
    radius: Scalar
    arm_force: Scalar
    arm_normal: Scalar
    arm_friction: Scalar
    shoes: str = "leading and trailing"
    preload: Scalar = 0.0

    def pressing(self, m: ca.SX) -> tuple[Scalar, Scalar]:
        """Return the gains of the levers of all shoes."""
        leading, trailing = SHOES[self.shoes]
        k = self.arm_friction / self.arm_normal
        share = k * k * m if leading and trailing else k if leading else -k
        return (leading + trailing) * self.arm_force / self.arm_normal, share

    def problems(self) -> Iterator[str]:
        """Yield a message about unknown shoes."""
        yield from super().problems()
        if self.shoes not in SHOES:
            yield f"shoes: expected {', '.join(SHOES)}, got {self.shoes}"


@final
@dataclass(frozen=True, eq=False)
class BandBrake(_OnDrum):
    """Band brake on a drum, whose ends are on one lever.

        v = radius w,   torque = radius F,   F = T_1 - T_2,   T_1 = T_2 exp(m angle)
        force lever + T_1 arm_tight = T_2 arm_slack

    T_1 is the tension of the end that is tight in positive rotation. In sliding with the
    coefficient mu, T_2 = force lever / (arm_slack - arm_tight exp(mu angle)). The brake locks
    itself if arm_tight exp(mu angle) >= arm_slack. In negative rotation exp(-mu angle) replaces
    exp(mu angle). Results on request: `<name>_tight`, `<name>_slack`, T_1 and T_2 [N].

    Attributes:
        joint: joint of the drum.
        law: friction law of the lining.
        force: force on the lever [N].
        radius: radius of the drum [m].
        angle: angle of the arc in contact [rad].
        lever: arm of the force [m].
        arm_slack: arm of T_2, which releases the lever [m].
        arm_tight: arm of T_1, which pulls the lever on [m]; 0 for an end at the pivot (simple band
            brake), negative for an end that also releases it (both directions brake alike at
            -arm_slack).
        preload: additional force on the lever, also at zero actuation [N].

    Limits: |m| angle is at most 50. A band without stiffness and mass.
    Source: Eytelwein 1808; Shigley, Mechanical Engineering Design.
    """

    above_zero = ("radius", "angle", "lever", "arm_slack")

    name: str
    joint: str
    law: Law
    force: Scalar
    radius: Scalar
    angle: Scalar
    lever: Scalar
    arm_slack: Scalar
    arm_tight: Scalar = 0.0
    preload: Scalar = 0.0

    def pressing(self, m: ca.SX) -> tuple[Scalar, Scalar]:
        """Return the gains of the lever, times N / T_2 of the arc."""
        _, arc = wrapped(m, self.angle)
        free = self.arm_slack - self.arm_tight
        return self.lever / free * arc, self.arm_tight / free * arc

    def tensions(self, F: ca.SX) -> dict[str, ca.SX]:
        """Return the tensions T_1 and T_2 [N]."""
        free = self.arm_slack - self.arm_tight
        slack = (self.lever * self.actuation + self.arm_tight * F) / free
        return {"tight": slack + F, "slack": slack}

    def problems(self) -> Iterator[str]:
        """Yield a message about a lever that locks without friction."""
        yield from super().problems()
        yield from overwound(self.law, self.angle)
        tight, slack = as_number(self.arm_tight), as_number(self.arm_slack)
        if tight is not None and slack is not None and inf > tight >= slack > 0:
            yield (
                f"arm_tight: expected a number < arm_slack = {slack:g} m, got {tight:g}; the "
                "lever would lock without friction"
            )
