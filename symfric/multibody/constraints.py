"""Constraints that are no joints: prescribed motion and expressions of positions and time.

    phi(q, t) = 0,   phi_q q' + phi_t = 0,   phi_q a + (phi_q q')_q q' + 2 phi_qt q' + phi_tt = 0

A constraint that fixes displacements s_j of joints, phi = f(t) - sum c_j s_j, loads joint j with
c_j lam: a multiplier is a force or moment and has a name that says so. Where a joint closes a loop,
and of all joints in absolute coordinates, the pose gives an angle between -pi and pi. Then phi is
taken modulo its period: full turns are made, and the nearest of equivalent positions is meant.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import Any, ClassVar, final

import casadi as ca

from symfric.foundation.checks import expression
from symfric.foundation.numeric import Scalar
from symfric.multibody.body import GROUND
from symfric.multibody.forces import Axial, Load
from symfric.multibody.joint import Joint
from symfric.multibody.keywords import Keywords
from symfric.multibody.kinematics import Kinematics, Motion
from symfric.multibody.spatial import skew

Loads = Sequence[Load | Axial]


@final
@dataclass(frozen=True, eq=False)
class Held:
    """What a constraint does to a mechanism.

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
        """What is wrong with its numbers."""
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
    """Whether the pose gives the displacement, an angle, between -pi and pi only."""
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
