"""Constraints other than joints: prescribed motion, expressions of positions.

    phi(q, t) = 0,   phi_q q' + phi_t = 0,   phi_q a + (phi_q q')_q q' + 2 phi_qt q' + phi_tt = 0

A constraint on displacements s_j of joints, phi = f(t) - sum c_j s_j, loads joint j with c_j lam:
the multiplier is a force or a moment and is named accordingly. The angle of a joint that closes a
loop, and of every joint in absolute coordinates, is computed from the pose and lies between -pi and
pi. In this case phi is taken modulo its period, so that full turns are possible.
"""

from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import Any, ClassVar, NamedTuple, final

import casadi as ca

from symfric.foundation import checks
from symfric.foundation.checks import expression
from symfric.foundation.numeric import Scalar
from symfric.multibody.contact import Contact
from symfric.multibody.dynamics import numbered, twist_jacobian
from symfric.multibody.forces import Axial, Load, OnJoint, Part, evaluated, reason_of
from symfric.multibody.joint import Joint
from symfric.multibody.kinematics import Kinematics, Motion
from symfric.multibody.spatial import GROUND

Loads = Sequence[Load | Axial]
COMPARISONS = (ca.OP_EQ, ca.OP_LT, ca.OP_LE, ca.OP_NE)


class ConstraintLoads(NamedTuple):
    """Equations of a constraint, and the loads of its multipliers.

    Attributes:
        phi: expressions that must vanish, SX (m, 1).
        labels: names of the multipliers.
        loads: function of the multipliers (m, 1) that returns the loads on the bodies.
        unit: unit of the multipliers.
        problems: reasons why the constraint is invalid; phi then has no rows.
    """

    phi: ca.SX
    labels: tuple[str, ...]
    loads: Callable[[ca.SX], Loads] = lambda _: ()
    unit: str = ""
    problems: tuple[str, ...] = ()

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the multipliers."""
        return (self.unit,) * len(self.labels)


def impossible(*problems: str) -> ConstraintLoads:
    """Return a constraint without equations that reports the problems."""
    return ConstraintLoads(ca.SX(0, 1), (), problems=problems)


@dataclass(frozen=True, eq=False)
class Constraint(Part):
    """Constraint on the motion of bodies."""

    kind: ClassVar[str] = "constraint"

    @abstractmethod
    def held(self, kin: Kinematics) -> ConstraintLoads:
        """Return the equations of the constraint and the loads of its multipliers."""

    def contacts(self, kin: Kinematics, lam: ca.SX) -> Sequence[Contact]:
        """Return the contacts whose friction depends on the multipliers `lam`; none by default."""
        return ()


Term = tuple[Joint, str, Scalar]
"""Joint, direction, coefficient c_j."""


def linear(
    kin: Kinematics, name: str, terms: Sequence[Term], rest: Scalar, period: Scalar | None
) -> ConstraintLoads:
    """Return the constraint rest - sum c_j s_j = 0, modulo `period` unless it is None.

    The multiplier is the force or moment on the last of the joints.
    """
    phi = ca.SX(rest)
    for joint, direction, c in terms:
        phi -= c * kin.along(joint, direction)[0]
    if period is not None:
        # derivatives of phi are unchanged: the derivative of floor is zero
        phi -= period * ca.floor(phi / period + 0.5)
    last, along, _ = terms[-1]
    what, unit = ("force", "N") if last.linear(along) else ("moment", "N m")

    def loads(lam: ca.SX) -> Loads:
        return [Axial(joint, direction, c * lam) for joint, direction, c in terms]

    return ConstraintLoads(phi, (f"{name}_{what}",), loads, unit)


def wraps(kin: Kinematics, joint: Joint, direction: str) -> bool:
    """Return True if the displacement is an angle that is known between -pi and pi only."""
    return joint.name not in kin.topology.link_of and not joint.linear(direction)


@final
@dataclass(frozen=True, eq=False)
class PrescribedMotion(OnJoint, Constraint):
    """Prescribed motion of a joint: s = motion(t).

    `direction` may be omitted for a joint with one direction; for other joints the default is
    "turn".

    `motion` takes the SX symbol of time and returns a displacement [m] or angle [rad], twice
    differentiable. It may contain parameters, but no inputs, because their derivatives are unknown.
    The multiplier is the force `<name>_force` [N] or moment `<name>_moment` [N m] that the drive
    exerts on the child of the joint; the power of the drive is the multiplier times s'.

    Limits: positions and velocities at the start must be motion(0) and motion'(0); a jump of
    motion' would be an impact and is not detected. For joints that close loops, and in absolute
    coordinates, the angle is known modulo 2 pi: full turns are possible, but motion and
    motion + 2 pi are equivalent.
    """

    kind: ClassVar[str] = "drive"

    joint: str
    motion: Callable[[ca.SX], Scalar]
    direction: str = ""

    def held(self, kin: Kinematics) -> ConstraintLoads:
        """Return motion(t) - s = 0."""
        what = "motion: expected a function of time that returns one expression"
        try:
            target = ca.SX(expression("motion", self.motion(kin.t)))
        except (TypeError, ValueError, ArithmeticError, RuntimeError) as error:
            reason = reason_of(error).rpartition(", got ")[2]
            return impossible(f"{what}, got {reason}; use casadi functions, not those of math")
        if target.numel() != 1:
            return impossible(f"motion: expected one expression, got {target.numel()}")
        joint, direction = self.place(kin)
        period = 2 * pi if wraps(kin, joint, direction) else None
        return linear(kin, self.name, [(joint, direction, 1.0)], target, period)


@final
@dataclass(frozen=True, eq=False)
class UserConstraint(Constraint):
    """Constraint that sets expressions of positions and time to zero.

    `expression` takes the kinematics, with `point("body.frame")` for a position (and a velocity,
    which must not be used), `motion["body"]` with R and p, `along("joint", direction)` for a
    displacement, and the time `t`. It returns one expression or a column of expressions. The
    multipliers are `<name>_lambda`, or `<name>_lambda_1`, `<name>_lambda_2`, ... The bodies are
    loaded with -phi_p' lam at their origins, so that joint reactions and friction are correct.

    Limits: holonomic constraints only.
    """

    expression: Callable[[Kinematics], Scalar]

    def held(self, kin: Kinematics) -> ConstraintLoads:
        """Return the expressions, and the loads from their derivatives by the pose of each body."""
        # replace poses by symbols, to differentiate the expression by them
        motion = {GROUND: kin.motion[GROUND]}
        for name in (n for n in kin.motion if n != GROUND):
            motion[name] = Motion(ca.SX.sym("R", 3, 3), *(ca.SX.sym(x, 3) for x in "pwvab"))
        probe = replace(kin, motion=motion)
        given: Any = evaluated(self, probe)
        try:
            phi = ca.SX(ca.vertcat(*given) if isinstance(given, tuple | list) else given)
        except (NotImplementedError, RuntimeError):
            return impossible(f"expression: expected one or a column of them, got {given!r}")
        if phi.is_empty() or phi.size2() != 1:
            return impossible(f"expression: expected one or a column of them, got {phi.shape}")
        if any(phi[i].op() in COMPARISONS for i in range(phi.numel())):
            return impossible("expression: expected a difference a - b, got a comparison")
        moving = [m for name, m in probe.motion.items() if name != GROUND]
        rates = [x for m in moving for x in (m.w_B, m.v_B, m.dw_B, m.dv_B)]
        if ca.depends_on(phi, ca.vertcat(kin.qd, *rates)):
            return impossible(
                "expression: expected positions only, got velocities; nonholonomic constraints "
                "are excluded"
            )
        if not ca.depends_on(phi, ca.veccat(kin.q, *(x for m in moving for x in (m.R, m.p)))):
            return impossible(f"expression: expected one of positions, got {checks.shown(phi)}")
        rows, bodies = [phi, ca.jacobian(phi, kin.q)], [n for n in probe.motion if n != GROUND]
        symbols, poses = list[ca.SX](), list[ca.SX]()
        for name in bodies:
            (R, p, *_), (R_now, p_now, *_) = probe.motion[name], kin.motion[name]
            by_p, by_w = twist_jacobian(phi, R, p)
            rows += [by_p, by_w]
            symbols += [R, p]
            poses += [ca.densify(R_now), ca.densify(p_now)]
        value, by_q, *by_pose = (ca.sparsify(x) for x in ca.substitute(rows, symbols, poses))

        def loads(lam: ca.SX) -> Loads:
            found: list[Load | Axial] = []
            for name, C_v, C_w in zip(bodies, by_pose[::2], by_pose[1::2], strict=True):
                if C_v.nnz() or C_w.nnz():
                    at = kin.motion[name].p
                    found.append(Load(name, -C_v.T @ lam, at, -C_w.T @ lam, ca.SX(3, 1)))
            for link in kin.topology.links:
                for direction, k in link.joint.directions.items():
                    column = by_q[:, link.first + k]
                    if column.nnz():
                        found.append(Axial(link.joint, direction, -ca.dot(column, lam)))
            return found

        return ConstraintLoads(ca.densify(value), numbered(self.name, value.numel()), loads)
