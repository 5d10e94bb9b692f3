"""Applied forces: gravity, springs, dampers, actuators, user expressions.

A force says which loads it puts on which bodies and what potential energy it has. The power of a
load is force times velocity of its point plus moment times angular velocity; where the energy is
conservative, power = -dV/dt (a test checks it for every force).
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
    """A force [N] at a point and a moment [N m] on a body, in world components.

    `arm` is the point from the origin of the body in its own components, where it is fixed to it.
    """

    body: str
    force: ca.SX
    point: ca.SX
    moment: ca.SX = ZERO
    arm: ca.SX | None = None

    def power(self, kin: Kinematics) -> ca.SX:
        """Power on the body [W]."""
        motion = kin.motion[self.body]
        v = motion.v + ca.cross(motion.w, self.point - motion.p)
        return ca.dot(self.force, v) + ca.dot(self.moment, motion.w)


@final
@dataclass(frozen=True, eq=False)
class Axial:
    """A force [N] or moment [N m] on the child of a joint in one of its directions.

    Its opposite acts on the parent.
    """

    joint: Joint
    direction: str
    value: ca.SX


@dataclass(frozen=True, eq=False)
class Force(ABC):
    """Something that loads bodies."""

    name: str

    def places(self) -> Iterable[str]:
        """The "body.frame" texts it names."""
        return ()

    def joints(self) -> Iterable[tuple[str, str]]:
        """The joints it names, each with a direction."""
        return ()

    def problems(self) -> Iterator[str]:
        """Numbers that are not finite."""
        for item in fields(self):
            value = getattr(self, item.name)
            good = is_symbolic(value) or (is_number(value) and abs(value) < ca.inf)
            if item.type is Scalar and not good:
                yield f"{item.name}: expected a finite number, got {value!r}"

    @property
    def conservative(self) -> bool:
        """Return True if its power is nothing but the change of its potential energy."""
        return False

    @abstractmethod
    def loads(self, kin: Kinematics, joints: dict[str, Joint]) -> Iterator[Load | Axial]:
        """Loads on the bodies."""

    def energy(self, kin: Kinematics, joints: dict[str, Joint]) -> ca.SX:
        """Potential energy [J]; zero where it has none."""
        return ca.SX(0)


@final
@dataclass(frozen=True, eq=False)
class Gravity(Force):
    """The weight m g of every body at its centre of mass; g [m/s^2] in world components."""

    g: Vector = (0.0, 0.0, -9.81)

    @property
    def conservative(self) -> bool:
        """Gravity always is: what it takes comes back."""
        return True

    def loads(self, kin: Kinematics, joints: dict[str, Joint]) -> Iterator[Load | Axial]:
        """The weight of every body at its centre of mass."""
        for name, body in kin.topology.bodies.items():
            if name != GROUND:
                com, _ = kin.motion[name].point(body.c)
                yield Load(name, body.mass * vector(self.g), com, arm=body.c)

    def energy(self, kin: Kinematics, joints: dict[str, Joint]) -> ca.SX:
        """-m g . p."""
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
        """The two places between which it acts."""
        return (self.a, self.b)

    @property
    def conservative(self) -> bool:
        """As a spring alone."""
        return equals(self.damping, 0.0) and equals(self.actuator, 0.0)

    @property
    def _linear(self) -> bool:
        return all(equals(x, 0.0) for x in (self.free_length, self.damping, self.actuator))

    def loads(self, kin: Kinematics, joints: dict[str, Joint]) -> Iterator[Load | Axial]:
        """Opposite forces on the line between the points."""
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
        """Stiffness (l - free_length)^2 / 2."""
        d = kin.point(self.b)[0] - kin.point(self.a)[0]
        if equals(self.free_length, 0.0):
            return self.stiffness * ca.dot(d, d) / 2
        return self.stiffness * (ca.sqrt(ca.dot(d, d)) - self.free_length) ** 2 / 2


@final
@dataclass(frozen=True, eq=False)
class JointSpringDamper(Force):
    """Spring, damper and actuator in one of the directions of a joint: "slide", "turn", ...

    A joint with one direction needs none; of others it is "turn" where nothing is said.

        f = -stiffness (s - rest) - damping s' + actuator

    with s the displacement [m] or angle [rad]; f acts on the child, its opposite on the parent.
    The angle counts full turns. Where the joint closes a loop, it is a state of the model with the
    joint's name. It starts with the turns that the joints of the loop have made, if all axes of the
    loop are parallel; else nearest to the joint's `start`, as the pose tells it modulo a turn.
    """

    joint: str
    direction: str = ""
    stiffness: Scalar = 0.0
    rest: Scalar = 0.0
    damping: Scalar = 0.0
    actuator: Scalar = 0.0

    def joints(self) -> Iterable[tuple[str, str]]:
        """The joint along whose direction it acts."""
        return ((self.joint, self.direction),)

    @property
    def conservative(self) -> bool:
        """As a spring alone."""
        return equals(self.damping, 0.0) and equals(self.actuator, 0.0)

    def loads(self, kin: Kinematics, joints: dict[str, Joint]) -> Iterator[Load | Axial]:
        """One load along the direction of its joint: actuator, spring and damper."""
        joint = joints[self.joint]
        direction = joint.way(self.direction)
        f = ca.SX(self.actuator)
        if not equals(self.stiffness, 0.0):
            f -= self.stiffness * (kin.along(joint, direction)[0] - self.rest)
        if not equals(self.damping, 0.0):
            f -= self.damping * kin.rate(joint, direction)
        yield Axial(joint, direction, f)

    def energy(self, kin: Kinematics, joints: dict[str, Joint]) -> ca.SX:
        """Stiffness (s - rest)^2 / 2."""
        if equals(self.stiffness, 0.0):
            return ca.SX(0)
        joint = joints[self.joint]
        s, _ = kin.along(joint, joint.way(self.direction))
        return self.stiffness * (s - self.rest) ** 2 / 2


@final
@dataclass(frozen=True, eq=False)
class UserForce(Force):
    """A force [N] and a moment [N m] on a place, expressions of any body's motion.

    `expression` takes the kinematics, which answers `point("body.frame")` with position and
    velocity, `motion["body"]` with R, p, w, v, `along(joint, direction)` with a displacement or an
    angle over full turns and its rate, and returns force and moment in world components.
    """

    place: str
    expression: Callable[[Kinematics], tuple[Vector, Vector]]

    def problems(self) -> Iterator[str]:
        """An expression that is no function."""
        if not callable(self.expression):
            yield f"expression: expected a function of the kinematics, got {self.expression!r}"

    def places(self) -> Iterable[str]:
        """The place at which it acts."""
        return (self.place,)

    def loads(self, kin: Kinematics, joints: dict[str, Joint]) -> Iterator[Load | Axial]:
        """Force and moment as the user's expression gives them."""
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
