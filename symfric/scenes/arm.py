"""A serial arm of six joints with friction in every one."""

from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import param
from symfric.laws import Law
from symfric.multibody import JointFriction, JointSpringDamper, Mechanism, Revolute
from symfric.scenes.base import other_law
from symfric.scenes.mechanism import MechanismScene

UP, SIDE, OUT = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)
AXES = (UP, SIDE, SIDE, OUT, SIDE, OUT)
"""Axes of the joints while all angles are zero and the arm reaches along x."""
LENGTHS = (0.0, 0.4, 0.35, 0.1, 0.1, 0.08)
MASSES = (8.0, 6.0, 4.0, 1.5, 1.0, 0.4)
STARTS = (0.3, -0.8, 1.2, 0.4, -0.6, 0.2)


@final
@dataclass(frozen=True, eq=False)
class Arm(MechanismScene):
    """Six revolute joints: base, shoulder, elbow and three of the wrist, with a torque in each.

    q1 ... q6 are the joint angles, tau1 ... tau6 the inputs [N m]. The bearing of every joint
    carries the reaction of all links beyond it at two stations, so the friction of the shoulder
    depends on what the wrist does. Defaults: a made-up arm of 21 kg and 1 m that falls from rest.
    """

    t_end: ClassVar[float] = 1.0

    q2: Law | None = other_law("joint q2, shoulder; `law` without")
    q3: Law | None = other_law("joint q3, elbow; `law` without")
    q4: Law | None = other_law("joint q4, first of the wrist; `law` without")
    q5: Law | None = other_law("joint q5, second of the wrist; `law` without")
    q6: Law | None = other_law("joint q6, third of the wrist; `law` without")
    load: Scalar = param(0.0, unit="kg", role="mass", doc="mass at the end of the arm", lower=0.0)
    R: Scalar = param(0.03, unit="m", role="geometry", doc="radius of the bearings", lower=1e-12)
    a: Scalar = param(
        0.08, unit="m", role="geometry", doc="distance of the bearing stations", lower=1e-12
    )
    g: Scalar = param(9.81, unit="m/s^2", role="gravity", doc="gravity", lower=0.0)

    def mechanism(self) -> Mechanism:
        """Six bodies in a chain."""
        m = Mechanism("arm", gravity=(0.0, 0.0, -self.g))
        m.frame("ground.tip", at=(0.0, 0.0, 0.5), z=UP)
        before = "ground"
        for i, (axis, length, mass) in enumerate(zip(AXES, LENGTHS, MASSES, strict=True), start=1):
            body = f"link{i}"
            total = mass + self.load if i == len(AXES) else mass
            slender = mass * (length * length / 12 + 0.002)
            m.body(body, total, (0.002 * mass, slender, slender), com=(length / 2, 0.0, 0.0))
            m.frame(f"{body}.root", z=axis)
            if i < len(AXES):
                m.frame(f"{body}.tip", at=(length, 0.0, 0.0), z=AXES[i])
            law = self.law if i == 1 else self.law_of(f"q{i}")
            friction = JointFriction(law, radius=self.R, length=self.a)
            joint = Revolute(f"q{i}", f"{before}.tip", f"{body}.root", STARTS[i - 1], 0.0, friction)
            m.joint(joint)
            torque = m.input(f"tau{i}", "N m", nominal=10.0)
            m.force(JointSpringDamper(f"motor{i}", f"q{i}", actuator=torque))
            before = body
        return m
