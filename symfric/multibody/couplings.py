"""Gears, rolling without slipping and screws: one displacement of a joint follows another.

    s_b = ratio s_a + offset

with displacements [m] or angles [rad] relative to the parents of the joints; a planetary gear is
described by gears between joints on its carrier. The multiplier is the force or moment on the child
of b; ratio times its opposite acts on the child of a.

Joint coordinates count full turns. A joint that closes a loop, and every joint in absolute
coordinates, knows its angle modulo 2 pi. The coupling still makes full turns, as the gear does that
cannot tell its teeth from each other: where one of the two angles is known that way for every
ratio, where both are for ratios of integers.

Limits: the bearings of the joints feel forces and moments along the axes only, not the pressure
between teeth; a `UserConstraint` puts that where it acts. No backlash, no friction of teeth.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from math import pi
from typing import ClassVar, final

import casadi as ca

from symfric.foundation.numeric import Scalar, is_number, is_symbolic
from symfric.multibody.constraints import Constraint, Held, impossible, linear, wraps
from symfric.multibody.joint import Joint
from symfric.multibody.kinematics import Kinematics

TEETH = 1000
"""Largest denominator of a ratio where both angles are known modulo 2 pi."""


@dataclass(frozen=True, eq=False)
class Coupling(Constraint):
    """s_b = ratio s_a + offset between two joints, or two directions of one."""

    kind: ClassVar[str] = "coupling"

    @property
    def _ends(self) -> tuple[tuple[str, str], tuple[str, str]]:
        """Joint and direction of a and of b."""
        raise NotImplementedError

    @property
    def _numbers(self) -> tuple[tuple[str, Scalar], tuple[str, Scalar]]:
        """Names and values of ratio and offset."""
        raise NotImplementedError

    @property
    def _ratio(self) -> Scalar:
        return self._numbers[0][1]

    def joints(self) -> Iterable[tuple[str, str]]:
        """Both joints that are coupled, and along which directions."""
        return self._ends

    def problems(self) -> Iterator[str]:
        """A ratio of zero, numbers that are none, one displacement coupled to itself."""
        (name, ratio), (second, offset) = self._numbers
        if not is_symbolic(ratio) and not (is_number(ratio) and 0 < abs(ratio) < ca.inf):
            yield f"{name}: expected a finite number other than 0, got {ratio!r}"
        if not is_symbolic(offset) and not (is_number(offset) and abs(offset) < ca.inf):
            yield f"{second}: expected a finite number, got {offset!r}"
        a, b = self._ends
        if a == b:
            yield f"expected two displacements, got {a[1]} of {a[0]} twice"

    def held(self, kin: Kinematics, joints: dict[str, Joint]) -> Held:
        """Offset + ratio s_a - s_b = 0."""
        (a, along_a), (b, along_b) = ((joints[name], d) for name, d in self._ends)
        ratio, offset, period = self._ratio, self._numbers[1][1], None
        cyclic = wraps(kin, a, along_a), wraps(kin, b, along_b)
        if all(cyclic):
            if is_symbolic(ratio) or not _rational(ratio):
                return impossible(
                    f"{self._numbers[0][0]}: expected a ratio of integers up to {TEETH}, as the "
                    f"angles of {a.name} and {b.name} are known modulo 2 pi only, got {ratio}; in "
                    "joint coordinates joints that close no loop take any number"
                )
            fraction = _fraction(ratio)
            ratio, period = float(fraction), 2 * pi / fraction.denominator
        elif any(cyclic):
            period = 2 * pi * ratio if cyclic[0] else 2 * pi
        return linear(kin, self.name, [(a, along_a, -ratio), (b, along_b, 1.0)], offset, period)


def _fraction(ratio: Scalar) -> Fraction:
    return Fraction(float(ratio)).limit_denominator(TEETH)


def _rational(ratio: Scalar) -> bool:
    return abs(float(_fraction(ratio)) - float(ratio)) <= 1e-14 * abs(float(ratio))


@final
@dataclass(frozen=True, eq=False)
class Gear(Coupling):
    """Two angles: angle_b = ratio angle_a + offset.

    `ratio` is -z_a/z_b for gears with z teeth that mesh from outside, +z_a/z_b for a belt or an
    internal gear, if both axes point the same way. Result: `<name>_moment` [N m] on the child of b.
    """

    a: str
    b: str
    ratio: Scalar
    offset: Scalar = 0.0
    direction_a: str = "turn"
    direction_b: str = "turn"

    @property
    def _ends(self) -> tuple[tuple[str, str], tuple[str, str]]:
        return (self.a, self.direction_a), (self.b, self.direction_b)

    @property
    def _numbers(self) -> tuple[tuple[str, Scalar], tuple[str, Scalar]]:
        return ("ratio", self.ratio), ("offset", self.offset)


@final
@dataclass(frozen=True, eq=False)
class Rolling(Coupling):
    """An angle and a displacement: s_b = radius angle_a + offset.

    A pinion on its rack, a wheel that rolls without slipping, a drum with its rope; a negative
    radius turns the sense. Result: `<name>_force` [N] on the child of b. A disc in a plane has
    both in one `Planar` joint, directions "turn" and "x": then that is the force that the track
    must take without slipping.
    """

    a: str
    b: str
    radius: Scalar
    offset: Scalar = 0.0
    direction_a: str = "turn"
    direction_b: str = "slide"

    @property
    def _ends(self) -> tuple[tuple[str, str], tuple[str, str]]:
        return (self.a, self.direction_a), (self.b, self.direction_b)

    @property
    def _numbers(self) -> tuple[tuple[str, Scalar], tuple[str, Scalar]]:
        return ("radius", self.radius), ("offset", self.offset)


@final
@dataclass(frozen=True, eq=False)
class Screw(Coupling):
    """A cylindrical joint with a thread: slide = lead / (2 pi) turn + offset.

    Result: `<name>_force` [N] along the axis on its child.
    """

    joint: str
    lead: Scalar
    offset: Scalar = 0.0

    @property
    def _ends(self) -> tuple[tuple[str, str], tuple[str, str]]:
        return (self.joint, "turn"), (self.joint, "slide")

    @property
    def _numbers(self) -> tuple[tuple[str, Scalar], tuple[str, Scalar]]:
        return ("lead", self.lead), ("offset", self.offset)

    @property
    def _ratio(self) -> Scalar:
        return self.lead / (2 * pi)
