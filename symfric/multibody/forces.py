"""Applied forces: gravity, springs, dampers, actuators, stops, user expressions.

A force defines its loads on bodies and its potential energy V. The power of a load is the force
times the velocity of its point plus the moment times the angular velocity. For conservative forces,
power = -dV/dt; a test checks this for every force.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any, ClassVar, NamedTuple, final

import casadi as ca

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, equals, is_number, is_symbolic
from symfric.laws.base.smooth import positive
from symfric.multibody.joint import Joint, Keywords
from symfric.multibody.kinematics import Kinematics, Motion
from symfric.multibody.spatial import GROUND, Body, Vector, is_vector, vector
from symfric.multibody.topology import body_of

ZERO = ca.SX(3, 1)


class Load(NamedTuple):
    """Force [N] at a point of a body and moment [N m] on the body, in world components.

    `arm` is the vector from the origin of the body to the point, in body components.
    """

    body: str
    force: ca.SX
    point: ca.SX
    moment: ca.SX = ZERO
    arm: ca.SX | None = None

    def power(self, kin: Kinematics) -> ca.SX:
        """Return the power on the body [W]."""
        motion = kin.motion[self.body]
        v = motion.v + ca.cross(motion.w, self.point - motion.p)
        return ca.dot(self.force, v) + ca.dot(self.moment, motion.w)

    def moment_about(self, body: Body, motion: Motion) -> ca.SX:
        """Return the moment about the centre of mass of the body, in the body's components."""
        if self.arm is None:
            arm = motion.R.T @ (self.point - motion.place(body.c))
        else:
            arm = self.arm - body.c
        return motion.R.T @ self.moment + ca.cross(arm, motion.R.T @ self.force)


class Axial(NamedTuple):
    """Force [N] or moment [N m] on the child of a joint in a direction of the joint.

    The opposite force or moment acts on the parent.
    """

    joint: Joint
    direction: str
    value: ca.SX

    def power(self, kin: Kinematics) -> ca.SX:
        """Return the power on both bodies [W]."""
        return self.value * kin.rate(self.joint, self.direction)

    def loads(self, kin: Kinematics) -> tuple[Load, Load]:
        """Return the loads on both bodies of a joint that closes a loop."""
        joint, relative = self.joint, kin.relative(self.joint)
        along = relative.R_WP @ joint.axis(self.direction, relative.R) * self.value
        force, moment = (along, ZERO) if joint.linear(self.direction) else (ZERO, along)
        return (
            Load(body_of(joint.child), force, relative.p_WC, moment),
            Load(body_of(joint.parent), -force, relative.p_WC, -moment),
        )


FUNCTION_OF = {
    "motion": ("time", "t"),
    "expression": ("the kinematics", "kin"),
    "lift": ("the angle", "angle"),
}
"""Argument of the functions in parts, in words and as a name, by field."""


@dataclass(frozen=True, eq=False)
class Part(Keywords, ABC):
    """Force or constraint of a mechanism."""

    kind: ClassVar[str] = "part"
    """Name of the type in messages."""

    ends: ClassVar[tuple[str, ...]] = ()
    """Fields that contain places, "body" or "body.frame"."""

    name: str

    def places(self) -> list[str]:
        """Return the places, "body" or "body.frame", that the part refers to."""
        return [getattr(self, end) for end in self.ends]

    def joints(self) -> Iterable[tuple[str, str]]:
        """Return the joints that the part refers to, each with a direction."""
        return ()

    def problems(self) -> Iterator[str]:
        """Yield messages about numbers that are not finite and values that are not functions."""
        for item in fields(self):
            value, of = getattr(self, item.name), FUNCTION_OF.get(item.name)
            good = isinstance(value, ca.SX) and is_symbolic(value)
            good = good or (is_number(value) and abs(value) < ca.inf)
            if item.type is Scalar and not good:
                yield f"{item.name}: expected a finite number, got {checks.shown(value)}"
            if of is not None and not callable(value):
                expected = f"expected a function of {of[0]}"
                yield f"{item.name}: {expected}, got {value!r}; write lambda {of[1]}: ..."


def evaluated(part: Any, kin: Kinematics) -> Any:
    """Return `part.expression(kin)`.

    Raises:
        ValueError: the expression uses a name that the mechanism does not have, or Python cannot
            evaluate it.
    """
    where = f"{part.kind} '{part.name}' > expression"
    try:
        return part.expression(kin)
    except KeyError as error:
        raise checks.refused(where, "names of bodies or joints", error.args[0]) from error
    except ValueError as error:
        raise ValueError(f"{where} > {error}") from error
    except (AttributeError, RuntimeError, TypeError) as error:
        what = "expected a function of the kinematics"
        raise ValueError(f"{where}: {what}, got {reason_of(error)}") from error


def reason_of(error: Exception) -> str:
    """Return why a function of the user cannot be evaluated for symbols."""
    if "truth value" in str(error):
        return "a condition that Python evaluates (if, and, or); write casadi.if_else"
    return f"{error}".partition("\n")[0]


class OnJoint(Part):
    """Force or constraint in one direction of a joint."""

    joint: str
    direction: str

    def joints(self) -> Iterable[tuple[str, str]]:
        """Return the joint and the direction."""
        return ((self.joint, self.direction),)

    def place(self, kin: Kinematics) -> tuple[Joint, str]:
        """Return the joint and the direction; an omitted one is the only one, or "turn"."""
        joint = kin.topology.joints[self.joint]
        return joint, joint.way(self.direction)


@dataclass(frozen=True, eq=False)
class Force(Part):
    """Applied force on bodies."""

    kind: ClassVar[str] = "force"

    @property
    def conservative(self) -> bool:
        """True if the power is exactly minus the rate of change of the potential energy."""
        return all(equals(getattr(self, name, 0.0), 0.0) for name in ("damping", "actuator"))

    @abstractmethod
    def loads(self, kin: Kinematics) -> Iterator[Load | Axial]:
        """Yield the loads on the bodies."""

    def energy(self, kin: Kinematics) -> ca.SX:
        """Return the potential energy [J]; zero by default."""
        return ca.SX(0)


@final
@dataclass(frozen=True, eq=False)
class Gravity(Force):
    """Weight m g of every body at its centre of mass, with g [m/s^2] in world components."""

    g: Vector = (0.0, 0.0, -9.81)

    def loads(self, kin: Kinematics) -> Iterator[Load | Axial]:
        """Yield the weight of every body at its centre of mass."""
        for name, body in kin.topology.bodies.items():
            if name != GROUND:
                com = kin.motion[name].place(body.c)
                yield Load(name, body.mass * vector(self.g), com, arm=body.c)

    def energy(self, kin: Kinematics) -> ca.SX:
        """Return -m g . p."""
        weights = self.loads(kin)
        return sum((-ca.dot(w.force, w.point) for w in weights if isinstance(w, Load)), ca.SX(0))


@final
@dataclass(frozen=True, eq=False)
class SpringDamper(Force):
    """Spring, damper and actuator along the line between two points.

        l = |p_b - p_a|,   f = stiffness (l - free_length) + damping l' + actuator

    f > 0 pulls the points together. The force is not defined at l = 0, unless free_length, damping
    and actuator are zero, so that f (p_b - p_a) / l = stiffness (p_b - p_a).
    """

    ends = ("a", "b")

    a: str
    b: str
    stiffness: Scalar = 0.0
    free_length: Scalar = 0.0
    damping: Scalar = 0.0
    actuator: Scalar = 0.0

    def problems(self) -> Iterator[str]:
        """Yield messages about invalid numbers, and about one place given twice."""
        yield from super().problems()
        if self.a == self.b:
            yield f"expected two places, got {self.a} twice"

    def loads(self, kin: Kinematics) -> Iterator[Load | Axial]:
        """Yield opposite forces on the line between the points."""
        (p_a, v_a), (p_b, v_b) = kin.point(self.a), kin.point(self.b)
        d = p_b - p_a
        if all(equals(x, 0.0) for x in (self.free_length, self.damping, self.actuator)):
            pull = self.stiffness * d
        else:
            length = ca.sqrt(ca.dot(d, d))
            f = self.stiffness * (length - self.free_length) + self.actuator
            if not equals(self.damping, 0.0):
                f += self.damping * ca.dot(d, v_b - v_a) / length
            pull = f / length * d
        yield Load(body_of(self.a), pull, p_a, arm=kin.frame(self.a).p)
        yield Load(body_of(self.b), -pull, p_b, arm=kin.frame(self.b).p)

    def energy(self, kin: Kinematics) -> ca.SX:
        """Return stiffness (l - free_length)^2 / 2."""
        d = kin.point(self.b)[0] - kin.point(self.a)[0]
        if equals(self.free_length, 0.0):
            return self.stiffness * ca.dot(d, d) / 2
        return self.stiffness * (ca.sqrt(ca.dot(d, d)) - self.free_length) ** 2 / 2


@final
@dataclass(frozen=True, eq=False)
class JointSpringDamper(OnJoint, Force):
    """Spring, damper and actuator in a direction of a joint: "slide", "turn", ...

    `direction` may be omitted for a joint with one direction; for other joints the default is
    "turn".

        f = -stiffness (s - rest) - damping s' + actuator

    with s the displacement [m] or angle [rad]; f acts on the child, -f on the parent. The angle
    counts full turns. If the joint closes a loop, the angle is a state of the model with the name
    of the joint. If all axes of the loop are parallel, its initial value includes the full turns of
    the other joints; otherwise it is the value nearest to `start` of the joint, because the pose
    gives the angle only modulo 2 pi.
    """

    joint: str
    direction: str = ""
    stiffness: Scalar = 0.0
    rest: Scalar = 0.0
    damping: Scalar = 0.0
    actuator: Scalar = 0.0

    def loads(self, kin: Kinematics) -> Iterator[Load | Axial]:
        """Yield the sum of spring, damper and actuator as one load of the joint."""
        joint, direction = self.place(kin)
        f = ca.SX(self.actuator)
        if not equals(self.stiffness, 0.0):
            f -= self.stiffness * (kin.along(joint, direction)[0] - self.rest)
        if not equals(self.damping, 0.0):
            f -= self.damping * kin.rate(joint, direction)
        yield Axial(joint, direction, f)

    def energy(self, kin: Kinematics) -> ca.SX:
        """Return stiffness (s - rest)^2 / 2."""
        if equals(self.stiffness, 0.0):
            return ca.SX(0)
        s, _ = kin.along(*self.place(kin))
        return self.stiffness * (s - self.rest) ** 2 / 2


@final
@dataclass(frozen=True, eq=False)
class JointStop(OnJoint, Force):
    """Compliant stops that keep a joint between two positions.

        f = stiffness d max(0, 1 + dissipation d')

    with d >= 0 the displacement [m] or angle [rad] beyond `lower` or `upper`; f acts on the child
    towards the permitted range and never pulls. `direction` is that of a `JointSpringDamper`. An
    impact at the speed v leaves at the speed u that satisfies, with e = dissipation,
    e v - ln(1 + e v) = -e u - ln(1 - e u), for any stiffness and mass; u = v if e = 0.

    Limits: f has a kink at d = 0. The largest d is v sqrt(m / stiffness) for e = 0 and a mass or
    inertia m, less for e > 0.

    Attributes:
        lower, upper: positions of the stops [m] or [rad], lower < upper.
        stiffness: stiffness of the stops [N/m] or [N m/rad], above zero.
        dissipation: dissipation e [s/m] or [s/rad].

    Source: Hunt and Crossley 1975, Coefficient of restitution interpreted as damping in
    vibroimpact, with the exponent 1.
    """

    kind: ClassVar[str] = "stop"

    joint: str
    lower: Scalar
    upper: Scalar
    stiffness: Scalar
    dissipation: Scalar = 0.0
    direction: str = ""

    @property
    def conservative(self) -> bool:
        """True if the stops dissipate nothing."""
        return equals(self.dissipation, 0.0)

    def problems(self) -> Iterator[str]:
        """Yield messages about numbers, their signs and the order of the stops."""
        yield from super().problems()
        if is_number(self.lower) and is_number(self.upper) and not self.lower < self.upper:
            yield f"lower: expected a position below upper = {self.upper}, got {self.lower!r}"
        if is_number(self.stiffness) and not self.stiffness > 0:
            yield f"stiffness: expected > 0, got {self.stiffness!r}"
        if is_number(self.dissipation) and not self.dissipation >= 0:
            yield f"dissipation: expected >= 0, got {self.dissipation!r}"

    def loads(self, kin: Kinematics) -> Iterator[Load | Axial]:
        """Yield the force of both stops as one load of the joint."""
        joint, direction = self.place(kin)
        approach = self.dissipation * kin.rate(joint, direction)
        below, above = self._beyond(kin)
        f = below * positive(1 - approach, 0.0) - above * positive(1 + approach, 0.0)
        yield Axial(joint, direction, ca.SX(self.stiffness * f))

    def energy(self, kin: Kinematics) -> ca.SX:
        """Return stiffness d^2 / 2."""
        below, above = self._beyond(kin)
        return self.stiffness * (below**2 + above**2) / 2

    def _beyond(self, kin: Kinematics) -> tuple[ca.SX, ca.SX]:
        """Return the displacements below `lower` and above `upper`, zero between them."""
        s, _ = kin.along(*self.place(kin))
        return ca.SX(positive(self.lower - s, 0.0)), ca.SX(positive(s - self.upper, 0.0))


@final
@dataclass(frozen=True, eq=False)
class UserForce(Force):
    """Force [N] and moment [N m] at a place as expressions of the motion of any bodies.

    `expression` takes the kinematics, with `point("body.frame")` for position and velocity,
    `motion["body"]` with R, p, w, v, and `along("joint", direction)` for a displacement or an angle
    that counts full turns, and its rate. It returns force and moment in world components.
    """

    ends = ("place",)

    place: str
    expression: Callable[[Kinematics], tuple[Vector, Vector]]

    @property
    def conservative(self) -> bool:
        """False, because the expression is arbitrary."""
        return False

    def loads(self, kin: Kinematics) -> Iterator[Load | Axial]:
        """Yield force and moment of the user's expression."""
        given: Any = evaluated(self, kin)
        pair: Sequence[Any] = given if isinstance(given, tuple | list) else ()
        if len(pair) != 2 or not all(map(is_vector, pair)):
            what = "a force and a moment, three numbers or expressions each"
            raise checks.refused(f"force '{self.name}' > expression", what, given)
        force, moment = vector(pair[0]), vector(pair[1])
        at, arm = kin.point(self.place)[0], kin.frame(self.place).p
        yield Load(body_of(self.place), force, at, moment, arm)
