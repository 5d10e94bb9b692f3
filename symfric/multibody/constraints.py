"""Constraints that are no joints: prescribed motion, couplings, expressions of positions.

    phi(q, t) = 0,   phi_q q' + phi_t = 0,   phi_q a + (phi_q q')_q q' + 2 phi_qt q' + phi_tt = 0

A constraint that fixes displacements s_j of joints, phi = f(t) - sum c_j s_j, loads joint j with
c_j lam: a multiplier is a force or moment and has a name that says so. Where a joint closes a loop,
and of all joints in absolute coordinates, the pose gives an angle between -pi and pi. Then phi is
taken modulo its period: full turns are made, and the nearest of equivalent positions is meant.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import pi
from typing import Any, ClassVar, final

import casadi as ca

from symfric.foundation.checks import expression
from symfric.foundation.numeric import Scalar, is_number, is_symbolic
from symfric.multibody.forces import Axial, Load
from symfric.multibody.joint import Joint, Keywords
from symfric.multibody.kinematics import Kinematics, Motion
from symfric.multibody.spatial import GROUND, skew

Loads = Sequence[Load | Axial]


@final
@dataclass(frozen=True, eq=False)
class Held:
    """Equations of a constraint, and the loads of its multipliers.

    Attributes:
        phi: SX (m, 1).
        labels: names of its multipliers.
        loads: multipliers (m, 1) -> loads on the bodies.
        unit: of the multipliers, as text.
        problems: why it cannot be; then it has no rows.
    """

    phi: ca.SX
    labels: tuple[str, ...]
    loads: Callable[[ca.SX], Loads]
    unit: str = ""
    problems: tuple[str, ...] = ()


def impossible(*problems: str) -> Held:
    """No equations, and why."""
    return Held(ca.SX(0, 1), (), lambda lam: (), problems=problems)


@dataclass(frozen=True, eq=False)
class Constraint(Keywords, ABC):
    """Something that restricts the motion of bodies."""

    kind: ClassVar[str] = "constraint"
    """What messages call it."""

    name: str

    def joints(self) -> Iterable[tuple[str, str]]:
        """The joints it names, each with a direction."""
        return ()

    def problems(self) -> Iterator[str]:
        """Problems of its numbers."""
        return iter(())

    @abstractmethod
    def held(self, kin: Kinematics, joints: dict[str, Joint]) -> Held:
        """Its equations and the loads of its multipliers."""


Term = tuple[Joint, str, Scalar]
"""Joint, direction, coefficient c_j."""


def linear(
    kin: Kinematics, name: str, terms: Sequence[Term], rest: Scalar, period: Scalar | None
) -> Held:
    """The constraint rest - sum c_j s_j = 0, modulo `period` if there is one.

    Its multiplier is the force or moment on the last of the joints.
    """
    phi = ca.SX(rest)
    for joint, direction, c in terms:
        phi -= c * kin.along(joint, direction)[0]
    if period is not None:
        # the derivative of floor is zero, so that those of phi stay what they are
        phi -= period * ca.floor(phi / period + 0.5)
    last, along, _ = terms[-1]
    what, unit = ("force", "N") if last.linear(along) else ("moment", "N m")
    return Held(
        phi,
        (f"{name}_{what}",),
        lambda lam: [Axial(joint, direction, c * lam) for joint, direction, c in terms],
        unit,
    )


def wraps(kin: Kinematics, joint: Joint, direction: str) -> bool:
    """Return True if the pose gives the displacement, an angle, between -pi and pi only."""
    return joint.name not in kin.topology.link_of and not joint.linear(direction)


@final
@dataclass(frozen=True, eq=False)
class PrescribedMotion(Constraint):
    """A joint moves as a function of time says: s = motion(t).

    A joint with one direction needs no `direction`; of others it is "turn" where nothing is said.

    `motion` takes the SX symbol of time and returns a displacement [m] or angle [rad], twice
    differentiable; it may contain parameters, but no input, whose derivatives nobody knows. Its
    multiplier is the force `<name>_force` [N] or moment `<name>_moment` [N m] on the joint's child
    that the drive needs for it; the drive's power is that times s'.

    Limits: positions and velocities of the start must be motion(0) and motion'(0); a jump of
    motion' would be an impact and is not seen. Joints that close loops and absolute coordinates
    know the angle modulo 2 pi: full turns are made, motion and motion + 2 pi are the same.
    """

    kind: ClassVar[str] = "drive"

    joint: str
    motion: Callable[[ca.SX], Scalar]
    direction: str = ""

    def joints(self) -> Iterable[tuple[str, str]]:
        """The joint that is driven, and along which direction."""
        return ((self.joint, self.direction),)

    def problems(self) -> Iterator[str]:
        """A motion that is no function."""
        if not callable(self.motion):
            yield f"motion: expected a function of time, got {self.motion!r}; write lambda t: ..."

    def held(self, kin: Kinematics, joints: dict[str, Joint]) -> Held:
        """motion(t) - s = 0."""
        what = "motion: expected a function of time that returns one expression"
        try:
            target = ca.SX(expression("motion", self.motion(kin.t)))
        except (TypeError, ValueError, ArithmeticError, RuntimeError) as error:
            reason = str(error).rpartition(", got ")[2].partition("\n")[0]
            return impossible(f"{what}, got {reason}; write casadi functions for those of math")
        if target.numel() != 1:
            return impossible(f"motion: expected one expression, got {target.numel()}")
        joint = joints[self.joint]
        direction = joint.way(self.direction)
        period = 2 * pi if wraps(kin, joint, direction) else None
        return linear(kin, self.name, [(joint, direction, 1.0)], target, period)


@final
@dataclass(frozen=True, eq=False)
class UserConstraint(Constraint):
    """Expressions of positions and time that vanish.

    `expression` takes the kinematics, which answers `point("body.frame")` with a position (and a
    velocity, which must not be used), `motion["body"]` with R and p, `along(joint, direction)` with
    a displacement, and has the time `t`; it returns one expression or a column of them. Their
    multipliers are `<name>_lambda`, or `_1`, `_2`, ...; bodies are loaded with -phi_p' lam at their
    origins, so that reactions of joints and their friction are right.

    Limits: holonomic constraints only.
    """

    expression: Callable[[Kinematics], Scalar]

    def problems(self) -> Iterator[str]:
        """An expression that is no function."""
        if not callable(self.expression):
            yield f"expression: expected a function of the kinematics, got {self.expression!r}"

    def held(self, kin: Kinematics, joints: dict[str, Joint]) -> Held:
        """The expressions, and their derivatives by the pose of every body."""
        probe = _probe(kin)
        given: Any = self.expression(probe)
        try:
            phi = ca.SX(ca.vertcat(*given) if isinstance(given, tuple | list) else given)
        except (NotImplementedError, RuntimeError):
            return impossible(f"expression: expected one or a column of them, got {given!r}")
        if phi.is_empty() or phi.size2() != 1:
            return impossible(f"expression: expected one or a column of them, got {phi.shape}")
        moving = (m for name, m in probe.motion.items() if name != GROUND)
        rates = [x for m in moving for x in (m.w_B, m.v_B, m.dw_B, m.dv_B)]
        if ca.depends_on(phi, ca.vertcat(kin.qd, *rates)):
            return impossible(
                "expression: expected positions only, got velocities; nonholonomic constraints "
                "are excluded"
            )
        bodies = [name for name in probe.motion if name != GROUND]
        w = ca.SX.sym("w", 3)
        rows = [phi, ca.jacobian(phi, kin.q)]
        for name in bodies:
            R, p = probe.motion[name].R, probe.motion[name].p
            turned = ca.jtimes(phi, ca.vec(R), ca.vec(skew(w) @ R))
            rows += [ca.jacobian(phi, p), ca.jacobian(turned, w)]
        symbols = [x for name in bodies for x in (probe.motion[name].R, probe.motion[name].p)]
        poses = [ca.densify(x) for name in bodies for x in (kin.motion[name].R, kin.motion[name].p)]
        value, by_q, *by_pose = (ca.sparsify(x) for x in ca.substitute(rows, symbols, poses))

        def loads(lam: ca.SX) -> Loads:
            found: list[Load | Axial] = []
            for name, C_v, C_w in zip(bodies, by_pose[::2], by_pose[1::2], strict=True):
                if C_v.nnz() or C_w.nnz():
                    at, arm = kin.motion[name].p, ca.SX(3, 1)
                    found.append(Load(name, -C_v.T @ lam, at, -C_w.T @ lam, arm))
            for link in kin.topology.links:
                for direction, k in link.joint.directions.items():
                    column = by_q[:, link.first + k]
                    if column.nnz():
                        found.append(Axial(link.joint, direction, -ca.dot(column, lam)))
            return found

        m = value.numel()
        label = f"{self.name}_lambda"
        labels = (label,) if m == 1 else tuple(f"{label}_{i + 1}" for i in range(m))
        return Held(ca.densify(value), labels, loads)


def _probe(kin: Kinematics) -> Kinematics:
    """The same kinematics with the motions of all bodies as symbols."""
    motion = {GROUND: kin.motion[GROUND]}
    for name in kin.motion:
        if name != GROUND:
            R, (p, w, v, dw, dv) = ca.SX.sym("R", 3, 3), (ca.SX.sym(x, 3) for x in "pwvab")
            motion[name] = Motion(R, p, w, v, dw, dv)
    return replace(kin, motion=motion)


TEETH = 1000
"""Largest denominator of a ratio where both angles are known modulo 2 pi."""


class Coupling(Constraint):
    """One displacement of a joint follows another: gears, rolling without slipping, screws.

        s_b = ratio s_a + offset

    with displacements [m] or angles [rad] relative to the parents of the joints; a planetary gear
    is described by gears between joints on its carrier. The multiplier is the force or moment on
    the child of b; ratio times its opposite acts on the child of a.

    Joint coordinates count full turns. A joint that closes a loop, and every joint in absolute
    coordinates, knows its angle modulo 2 pi. The coupling still makes full turns, as the gear does
    that cannot tell its teeth from each other: where one of the two angles is known that way for
    every ratio, where both are for ratios of integers.

    Limits: the bearings of the joints feel forces and moments along the axes only, not the pressure
    between teeth; a `UserConstraint` puts that where it acts. No backlash, no friction of teeth.
    """

    kind: ClassVar[str] = "coupling"

    ratio_field: ClassVar[str] = "ratio"
    """The number that is the ratio, or makes it."""

    a: str
    b: str
    offset: Scalar
    direction_a: str
    direction_b: str

    @property
    def _ends(self) -> tuple[tuple[str, str], tuple[str, str]]:
        """Joint and direction of a and of b."""
        return (self.a, self.direction_a), (self.b, self.direction_b)

    @property
    def _ratio(self) -> Scalar:
        return getattr(self, self.ratio_field)

    def joints(self) -> Iterable[tuple[str, str]]:
        """Both joints that are coupled, and along which directions."""
        return self._ends

    def problems(self) -> Iterator[str]:
        """A ratio of zero, numbers that are none, one displacement coupled to itself."""
        name, ratio, offset = self.ratio_field, getattr(self, self.ratio_field), self.offset
        if not is_symbolic(ratio) and not (is_number(ratio) and 0 < abs(ratio) < ca.inf):
            yield f"{name}: expected a finite number other than 0, got {ratio!r}"
        if not is_symbolic(offset) and not (is_number(offset) and abs(offset) < ca.inf):
            yield f"offset: expected a finite number, got {offset!r}"
        a, b = self._ends
        if a == b:
            yield f"expected two displacements, got {a[1]} of {a[0]} twice"

    def held(self, kin: Kinematics, joints: dict[str, Joint]) -> Held:
        """Offset + ratio s_a - s_b = 0."""
        (a, along_a), (b, along_b) = ((joints[name], d) for name, d in self._ends)
        ratio, offset, period = self._ratio, self.offset, None
        cyclic = wraps(kin, a, along_a), wraps(kin, b, along_b)
        if all(cyclic):
            if is_symbolic(ratio) or not _rational(ratio):
                return impossible(
                    f"{self.ratio_field}: expected a ratio of integers up to {TEETH}, as the "
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


@final
@dataclass(frozen=True, eq=False)
class Rolling(Coupling):
    """An angle and a displacement: s_b = radius angle_a + offset.

    A pinion on its rack, a wheel that rolls without slipping, a drum with its rope; a negative
    radius turns the sense. Result: `<name>_force` [N] on the child of b. A disc in a plane has
    both in one `Planar` joint, directions "turn" and "x": then that is the force that the track
    must take without slipping.
    """

    ratio_field = "radius"

    a: str
    b: str
    radius: Scalar
    offset: Scalar = 0.0
    direction_a: str = "turn"
    direction_b: str = "slide"


@final
@dataclass(frozen=True, eq=False)
class Screw(Coupling):
    """A cylindrical joint with a thread: slide = lead / (2 pi) turn + offset.

    Result: `<name>_force` [N] along the axis on its child.
    """

    ratio_field = "lead"

    joint: str
    lead: Scalar
    offset: Scalar = 0.0

    @property
    def _ends(self) -> tuple[tuple[str, str], tuple[str, str]]:
        return (self.joint, "turn"), (self.joint, "slide")

    @property
    def _ratio(self) -> Scalar:
        return self.lead / (2 * pi)
