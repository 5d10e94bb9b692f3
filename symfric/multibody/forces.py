"""Applied forces: gravity, springs, dampers, actuators, user expressions.

A force defines its loads on bodies and its potential energy. The power of a load is force times
velocity of its point plus moment times angular velocity; for conservative forces power = -dV/dt (a
test checks it for every force).
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any, final

import casadi as ca

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, equals, is_number, is_symbolic
from symfric.multibody.joint import Joint
from symfric.multibody.kinematics import Kinematics
from symfric.multibody.spatial import GROUND, Vector, is_finite, is_vector, vector
from symfric.multibody.topology import body_of

ZERO = ca.SX(3, 1)


@final
@dataclass(frozen=True, eq=False)
class Load:
    """Force [N] at a point and a moment [N m] on a body, in world components.

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


@final
@dataclass(frozen=True, eq=False)
class Axial:
    """Force [N] or moment [N m] on the child of a joint in one of its directions.

    Its opposite acts on the parent.
    """

    joint: Joint
    direction: str
    value: ca.SX


@dataclass(frozen=True, eq=False)
class Force(ABC):
    """Applied force on bodies."""

    name: str

    def places(self) -> Iterable[str]:
        """Yield the "body.frame" texts it names."""
        return ()

    def joints(self) -> Iterable[tuple[str, str]]:
        """Yield the joints it names, each with a direction."""
        return ()

    def problems(self) -> Iterator[str]:
        """Yield messages about numbers that are not finite."""
        for item in fields(self):
            value = getattr(self, item.name)
            good = is_symbolic(value) or (is_number(value) and abs(value) < ca.inf)
            if item.type is Scalar and not good:
                yield f"{item.name}: expected a finite number, got {value!r}"

    @property
    def conservative(self) -> bool:
        """True if its power is exactly the change of its potential energy."""
        return False

    @abstractmethod
    def loads(self, kin: Kinematics, joints: dict[str, Joint]) -> Iterator[Load | Axial]:
        """Yield the loads on the bodies."""

    def energy(self, kin: Kinematics, joints: dict[str, Joint]) -> ca.SX:
        """Return the potential energy [J]; zero if it has none."""
        return ca.SX(0)


@final
@dataclass(frozen=True, eq=False)
class Gravity(Force):
    """Weight m g of every body at its centre of mass; g [m/s^2] in world components."""

    g: Vector = (0.0, 0.0, -9.81)

    @property
    def conservative(self) -> bool:
        """Always True for gravity."""
        return True

    def loads(self, kin: Kinematics, joints: dict[str, Joint]) -> Iterator[Load | Axial]:
        """Yield the weight of every body at its centre of mass."""
        for name, body in kin.topology.bodies.items():
            if name != GROUND:
                com, _ = kin.motion[name].point(body.c)
                yield Load(name, body.mass * vector(self.g), com, arm=body.c)

    def energy(self, kin: Kinematics, joints: dict[str, Joint]) -> ca.SX:
        """Return -m g . p."""
        weights = self.loads(kin, joints)
        return sum((-ca.dot(w.force, w.point) for w in weights if isinstance(w, Load)), ca.SX(0))


@final
@dataclass(frozen=True, eq=False)
class SpringDamper(Force):
    """Spring, damper and actuator along the line between two points.

        l = |p_b - p_a|,   f = stiffness (l - free_length) + damping l' + actuator

    f > 0 pulls the points together. Not defined at l = 0, unless spring and damper reduce to
    f (p_b - p_a) / l = stiffness (p_b - p_a) because free_length, damping and actuator are zero.
    """

    a: str
    b: str
    stiffness: Scalar = 0.0
    free_length: Scalar = 0.0
    damping: Scalar = 0.0
    actuator: Scalar = 0.0

    def places(self) -> Iterable[str]:
        """Yield the two places between which it acts."""
        return (self.a, self.b)

    @property
    def conservative(self) -> bool:
        """True for a pure spring."""
        return equals(self.damping, 0.0) and equals(self.actuator, 0.0)

    @property
    def _linear(self) -> bool:
        return all(equals(x, 0.0) for x in (self.free_length, self.damping, self.actuator))

    def loads(self, kin: Kinematics, joints: dict[str, Joint]) -> Iterator[Load | Axial]:
        """Yield opposite forces on the line between the points."""
        (p_a, v_a), (p_b, v_b) = kin.point(self.a), kin.point(self.b)
        d = p_b - p_a
        if self._linear:
            pull = self.stiffness * d
        else:
            length = ca.sqrt(ca.dot(d, d))
            f = self.stiffness * (length - self.free_length) + self.actuator
            if not equals(self.damping, 0.0):
                f += self.damping * ca.dot(d, v_b - v_a) / length
            pull = f / length * d
        yield Load(body_of(self.a), pull, p_a, arm=kin.offset(self.a))
        yield Load(body_of(self.b), -pull, p_b, arm=kin.offset(self.b))

    def energy(self, kin: Kinematics, joints: dict[str, Joint]) -> ca.SX:
        """Return stiffness (l - free_length)^2 / 2."""
        d = kin.point(self.b)[0] - kin.point(self.a)[0]
        if equals(self.free_length, 0.0):
            return self.stiffness * ca.dot(d, d) / 2
        return self.stiffness * (ca.sqrt(ca.dot(d, d)) - self.free_length) ** 2 / 2


@final
@dataclass(frozen=True, eq=False)
class JointSpringDamper(Force):
    """Spring, damper and actuator in one of the directions of a joint: "slide", "turn", ...

    A joint with one direction needs no `direction`; for others the default is "turn".

        f = -stiffness (s - rest) - damping s' + actuator

    with s the displacement [m] or angle [rad]; f acts on the child, its opposite on the parent. The
    angle counts full turns. If the joint closes a loop, the angle is a state of the model with the
    joint's name. It starts with the turns that the joints of the loop have made, if all axes of the
    loop are parallel; otherwise nearest to the joint's `start`, as the pose gives it modulo a turn.
    """

    joint: str
    direction: str = ""
    stiffness: Scalar = 0.0
    rest: Scalar = 0.0
    damping: Scalar = 0.0
    actuator: Scalar = 0.0

    def joints(self) -> Iterable[tuple[str, str]]:
        """Yield the joint along whose direction it acts."""
        return ((self.joint, self.direction),)

    @property
    def conservative(self) -> bool:
        """True for a pure spring."""
        return equals(self.damping, 0.0) and equals(self.actuator, 0.0)

    def loads(self, kin: Kinematics, joints: dict[str, Joint]) -> Iterator[Load | Axial]:
        """Yield one load along the direction of its joint: actuator, spring and damper."""
        joint = joints[self.joint]
        direction = joint.way(self.direction)
        f = ca.SX(self.actuator)
        if not equals(self.stiffness, 0.0):
            f -= self.stiffness * (kin.along(joint, direction)[0] - self.rest)
        if not equals(self.damping, 0.0):
            f -= self.damping * kin.rate(joint, direction)
        yield Axial(joint, direction, f)

    def energy(self, kin: Kinematics, joints: dict[str, Joint]) -> ca.SX:
        """Return stiffness (s - rest)^2 / 2."""
        if equals(self.stiffness, 0.0):
            return ca.SX(0)
        joint = joints[self.joint]
        s, _ = kin.along(joint, joint.way(self.direction))
        return self.stiffness * (s - self.rest) ** 2 / 2


@final
@dataclass(frozen=True, eq=False)
class UserForce(Force):
    """Force [N] and moment [N m] on a place, expressions of the motion of any body.

    `expression` takes the kinematics, with `point("body.frame")` for position and velocity,
    `motion["body"]` with R, p, w, v, `along(joint, direction)` for a displacement or an angle over
    full turns and its rate, and returns force and moment in world components.
    """

    place: str
    expression: Callable[[Kinematics], tuple[Vector, Vector]]

    def problems(self) -> Iterator[str]:
        """Yield a message if the expression is not a function."""
        if not callable(self.expression):
            yield f"expression: expected a function of the kinematics, got {self.expression!r}"

    def places(self) -> Iterable[str]:
        """Yield the place at which it acts."""
        return (self.place,)

    def loads(self, kin: Kinematics, joints: dict[str, Joint]) -> Iterator[Load | Axial]:
        """Yield force and moment of the user's expression."""
        given: Any = self.expression(kin)
        pair: Sequence[Any] = given if isinstance(given, tuple | list) else ()
        if len(pair) != 2 or not all(is_vector(x) and is_finite(vector(x)) for x in pair):
            raise checks.refused(
                f"force '{self.name}' > expression",
                "a force and a moment, three numbers or expressions each",
                given,
            )
        force, moment = vector(pair[0]), vector(pair[1])
        at, arm = kin.point(self.place)[0], kin.offset(self.place)
        yield Load(body_of(self.place), force, at, moment, arm)
