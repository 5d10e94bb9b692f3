"""Friction of machine elements whose normal force is their own reaction: threads, teeth, cams.

An element that couples s_b to s_a, such as s_b = ratio s_a + offset, transmits the multiplier lam,
a force or moment on b. The contact of its flanks has the sliding velocity v and normal force N

    v = l_a s_a' + l_b s_b',   N = preload + sqrt((lam / d)^2 + eps^2)

and the friction force F(v, N) loads a with -l_a F and b with -l_b F. The levers l_a, l_b and the
divisor d follow from the geometry; they separate the normal direction of the flanks from the
sliding direction, so lam contains no friction.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from math import inf, pi
from typing import ClassVar, NamedTuple, final

import casadi as ca

from symfric.foundation.checks import as_number, number, refused, shown
from symfric.foundation.numeric import Scalar, cos, sqrt
from symfric.foundation.variable import take_si
from symfric.laws import Law
from symfric.laws.base import smooth
from symfric.laws.base.law import require_law
from symfric.multibody.joint import RANGES, Keywords, needs_more, out_of_range


class Flank(NamedTuple):
    """Levers l_a, l_b of the sliding velocity, and divisor d of the multiplier."""

    lever_a: Scalar
    lever_b: Scalar
    divisor: Scalar


@dataclass(frozen=True, eq=False)
class ElementFriction(Keywords, ABC):
    """Friction law and geometry of a machine element.

    Attributes:
        law: friction law of v, N and the applied force. Laws with true sticking (`ExactCoulomb`)
            work wherever they work in joints, see `JointFriction`.
        preload: normal force in addition to the reaction [N].
        eps: smoothing width of the magnitude of the reaction [N]; N is at least preload + eps, so
            reduce it for loads below 0.01 N, as in micromechanisms.
    """

    kinds: ClassVar[dict[str, str]] = {}
    """Kind of each number of the geometry, see `out_of_range`."""
    turning: ClassVar[bool] = False
    normal: ClassVar[Scalar | None] = None

    law: Law
    preload: Scalar = field(default=0.0, kw_only=True)
    eps: Scalar = field(default=1e-4, kw_only=True)

    def __post_init__(self) -> None:
        require_law("friction", self.law)
        numbers = (item.name for item in fields(self) if item.type in (Scalar, Scalar | None))
        take_si("friction", self, *numbers)

    def magnitude(self, *components: ca.SX) -> ca.SX:
        """Return the smoothed magnitude of a force with the given components [N]."""
        return ca.sqrt(sum((f * f for f in components), start=ca.SX(self.eps * self.eps)))

    def problems(self) -> Iterator[str]:
        """Yield messages about invalid values."""
        if reason := needs_more(self.law):
            yield reason
        yield from out_of_range(self, self.kinds | {"preload": "level", "eps": "length"})

    def fit(self, linear: bool) -> Iterator[str]:
        """Yield messages if the friction does not fit a motion of b; `linear` if b slides."""
        yield from ()


@dataclass(frozen=True, eq=False)
class FlankFriction(ElementFriction):
    """Friction between the flanks of two elements with a constant ratio."""

    of_angle: ClassVar[str] = ""
    """Length [m] that the friction needs if b turns, and that is known if b slides."""

    @abstractmethod
    def flank(self, ratio: Scalar, linear: bool) -> Flank:
        """Return levers and divisor; `linear` is True if s_b is a displacement, not an angle."""

    def fit(self, linear: bool) -> Iterator[str]:
        """Yield a message about the length `of_angle`; `linear` is that of `flank`."""
        given = getattr(self, self.of_angle) is not None
        if linear and given:
            yield f"{self.of_angle}: expected none for a screw or rack, which have it, got a value"
        if not linear and not given:
            yield f"{self.of_angle}: expected a length [m] where b turns, got none"


@final
@dataclass(frozen=True, eq=False)
class ThreadFriction(FlankFriction):
    """Friction between the flanks of a screw and its nut, or of a worm and its wheel.

    With mean radius r, lead angle lambda, tan(lambda) = lead / (2 pi r), and flank angle alpha in
    the normal section, the sliding velocity is along the helix and the normal force is that on the
    flank:

        v = r cos(lambda) w + sin(lambda) u,   N = |f| / (cos(lambda) cos(alpha))

    with w the angular velocity of the screw, u the velocity along its axis (of the nut, or of the
    pitch circle of the wheel), and f the axial force of the multiplier. Source: Shigley's
    Mechanical Engineering Design, chapters on power screws and worm gears.

    Limits: with phi = atan(mu / cos(alpha)), lifting an axial load F takes the moment
    F r tan(lambda + phi) and lowering F r tan(phi - lambda); the thread is self-locking if
    phi >= lambda. A rigid self-locking thread whose screw has little inertia J jams when the load m
    drives it (Painleve): 1 > mu tan(lambda) (m r^2 - J) / (J + m r^2 tan(lambda)^2) is necessary.

    Attributes:
        radius: mean radius of the thread, or pitch radius of the worm [m].
        flank_angle: flank angle in the normal section [rad]: 0 for square threads, 15 deg for
            trapezoidal and 30 deg for ISO threads, the pressure angle for worms. An angle beta in
            the axial section is atan(tan(beta) cos(lambda)) in the normal section.
        lead: lead of the worm [m], for a `Gear`, in which a is the worm; otherwise None.
    """

    kinds: ClassVar = {"radius": "length", "flank_angle": "angle", "lead": "length"}
    of_angle = "lead"

    radius: Scalar
    flank_angle: Scalar = 0.0
    lead: Scalar | None = None

    def flank(self, ratio: Scalar, linear: bool) -> Flank:
        """Return levers along the helix, and the divisor of the force on the flank."""
        h = ratio if self.lead is None else self.lead / (2 * pi)
        length = sqrt(self.radius * self.radius + h * h)
        along, across = self.radius / length, h / length
        pitch_radius = 1.0 if linear else h / ratio
        divisor = pitch_radius * along * cos(self.flank_angle)
        return Flank(self.radius * along, pitch_radius * across, divisor)


@final
@dataclass(frozen=True, eq=False)
class MeshFriction(FlankFriction):
    """Mean friction between the teeth of two gears on parallel axes, or of a pinion and a rack.

    Teeth slide with the relative angular velocity times the distance of their contact from the
    pitch point. The friction is that of the mean distance, the arm e, so it has no ripple:

        v = e (w_a - w_b),   N = |f| / (cos(alpha) cos(beta))

    with w the angular velocities, f the tangential force at the pitch circle of the multiplier,
    alpha the normal pressure angle and beta the helix angle. A rack does not turn. For contact
    ratios eps_1 + eps_2 = eps before and behind the pitch point and the base pitch p_b,

        e = p_b / 2 (1 - eps + eps_1^2 + eps_2^2)        (p_b = pi m cos(alpha) for module m)

    and `mesh_arm` returns the arm for a given efficiency. Source: Niemann, Winter,
    Maschinenelemente II, tooth loss factor.

    Limits: with x = mu e / (cos(alpha) cos(beta)) and pitch radii r, the efficiency is
    (1 - x / r_b) / (1 + x / r_a) if a drives an external pair, and 1 / (1 + x / r_a) for a rack.

    Attributes:
        arm: mean distance of the contact from the pitch point [m].
        radius: pitch radius of b [m], for a `Gear`; None for a rack.
        pressure_angle, helix_angle: alpha and beta [rad].
        internal: True if one gear has internal teeth; the sign of the ratio is not used.
    """

    kinds: ClassVar = {
        "arm": "length", "radius": "length", "pressure_angle": "angle", "helix_angle": "angle",
    }  # fmt: skip
    of_angle = "radius"

    arm: Scalar
    radius: Scalar | None = None
    pressure_angle: Scalar = pi / 9
    helix_angle: Scalar = 0.0
    internal: bool = False

    def problems(self) -> Iterator[str]:
        """Yield messages about invalid values."""
        yield from super().problems()
        internal = vars(self)["internal"]
        if not isinstance(internal, bool):
            yield f"internal: expected True or False, got {shown(internal)}"

    def flank(self, ratio: Scalar, linear: bool) -> Flank:
        """Return levers of the relative angular velocity, and the divisor of the tooth force."""
        slope = cos(self.pressure_angle) * cos(self.helix_angle)
        if self.radius is None:
            return Flank(self.arm, 0.0, slope)
        lever = self.arm * smooth.sign(ratio, 0.0)
        return Flank(self.arm, -lever if self.internal else lever, self.radius * slope)


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

    kinds = dict.fromkeys(("base_radius", "roller_radius", "pin_radius"), "length")

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
        for name in ("roller_radius", "pin_radius"):
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


def mesh_arm(
    efficiency: float, mu: float, radius_a: float, radius_b: float = inf,
    pressure_angle: float = pi / 9, helix_angle: float = 0.0,
) -> float:  # fmt: skip
    """Return the arm [m] of a `MeshFriction` whose efficiency is given.

    Args:
        efficiency: mean efficiency if a drives, between 0 and 1.
        mu: friction coefficient of the law in sliding.
        radius_a, radius_b: pitch radii [m]; radius_b is inf for a rack and negative for an internal
            gear b, which is larger than a.
        pressure_angle, helix_angle: angles [rad] of the `MeshFriction`.

    Raises:
        ValueError: a number out of range.
    """
    where = "mesh_arm"
    efficiency = number(f"{where}: efficiency", efficiency, above=0.0, upper=1.0)
    mu, radius_a = (
        number(f"{where}: {name}", value, above=0.0)
        for name, value in (("mu", mu), ("radius_a", radius_a))
    )
    far = as_number(radius_b)
    if far is None or not (far > 0 or far < -radius_a):
        expected = f"a number > 0, or < -{radius_a:g} for an internal gear [m]"
        raise refused(f"{where}: radius_b", expected, radius_b)
    for name, value in (("pressure_angle", pressure_angle), ("helix_angle", helix_angle)):
        good, what = RANGES["angle"]
        if (size := as_number(value)) is None or not good(size):
            raise refused(f"{where}: {name}", what, value)
    loss = (1.0 - efficiency) / (1.0 / far + efficiency / radius_a)
    return float(loss * cos(pressure_angle) * cos(helix_angle) / mu)
