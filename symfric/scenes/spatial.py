"""Spatial mechanisms: an arm of six joints, four sliders, and a robot from a URDF file."""

from pathlib import Path
from typing import ClassVar

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import param, parametric
from symfric.laws import Law
from symfric.laws.base.law import require_law
from symfric.multibody import (
    Distance,
    JointFriction,
    JointSpringDamper,
    Mechanism,
    Prismatic,
    Revolute,
    SpringDamper,
)
from symfric.multibody.urdf import read_urdf
from symfric.scenes import fields
from symfric.scenes.base import other_law
from symfric.scenes.linkages import MechanismScene

UP, SIDE, OUT = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)
AXES = (UP, SIDE, SIDE, OUT, SIDE, OUT)
"""Axes of the joints if all angles are zero, where the arm extends along x."""
LENGTHS = (0.0, 0.4, 0.35, 0.1, 0.1, 0.08)
MASSES = (8.0, 6.0, 4.0, 1.5, 1.0, 0.4)
STARTS = (0.3, -0.8, 1.2, 0.4, -0.6, 0.2)


@parametric
class Arm(MechanismScene):
    """Arm with six revolute joints (base, shoulder, elbow, three of the wrist) and their torques.

    q1 ... q6 are the joint angles, tau1 ... tau6 the inputs [N m]. The bearing of each joint
    carries the reaction of all subsequent links at two stations, so that the friction of the
    shoulder depends on the motion of the wrist. Defaults: an assumed arm of 21 kg and 1 m that
    falls from rest.
    """

    t_end: ClassVar[float] = 1.0

    q2: Law | None = other_law("joint q2, shoulder; `law` by default")
    q3: Law | None = other_law("joint q3, elbow; `law` by default")
    q4: Law | None = other_law("joint q4, first of the wrist; `law` by default")
    q5: Law | None = other_law("joint q5, second of the wrist; `law` by default")
    q6: Law | None = other_law("joint q6, third of the wrist; `law` by default")
    load: Scalar = fields.MASS(0.0, doc="mass at the end of the arm", lower=0.0)
    R: Scalar = fields.SIZE(0.03, doc="radius of the bearings")
    a: Scalar = fields.STATIONS(0.08)
    g: Scalar = fields.GRAVITY(9.81)

    def mechanism(self) -> Mechanism:
        """Return six bodies in a chain."""
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


X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@parametric
class FourMass(MechanismScene):
    """Four sliders, 1 and 4 on the axis x, 2 on y, 3 on z, with two degrees of freedom.

    Massless rods of 5 and 7 m connect slider 1 to 2 and slider 2 to 3. Springs of rate k connect
    sliders 1, 2, 3 to the ground (unloaded at 3, 4, 3 m), and a spring of rate k_4 connects sliders
    4 and 1 (unloaded at 1 m). The normal force of each guide results from the forces of the rods,
    which depend on friction.

    Defaults: Haug's spatial example with friction; t_end = 4 s.
    """

    t_end: ClassVar[float] = 4.0

    guide_2: Law | None = other_law("guide of slider 2 (y2); `law` by default")
    guide_3: Law | None = other_law("guide of slider 3 (z3); `law` by default")
    guide_4: Law | None = other_law("guide of slider 4 (x4); `law` by default")
    m_1: Scalar = fields.MASS(2.0, doc="mass of sliders 1 and 2")
    m_3: Scalar = fields.MASS(6.0, doc="mass of sliders 3 and 4")
    k: Scalar = fields.SPRING(2.0, doc="rate of the springs to the ground")
    k_4: Scalar = fields.SPRING(10.0, doc="rate of the spring between 1 and 4")
    v_4: Scalar = fields.VELOCITY(-1.0, doc="velocity of slider 4 at the start")
    a: Scalar = fields.STATIONS(0.1)
    g: Scalar = fields.GRAVITY(9.8)

    def mechanism(self) -> Mechanism:
        """Return four bodies, four guides, two rods, four springs."""
        m = Mechanism("four_mass", gravity=(0.0, 0.0, -self.g))
        masses = (self.m_1, self.m_1, self.m_3, self.m_3)
        starts = (("x1", 4.0, 0.0), ("y2", 3.0, 0.0), ("z3", 40.0**0.5, 0.0), ("x4", 5.0, self.v_4))
        axes = ((X, Z), (Y, X), (Z, X), (X, Z))
        laws = (self.law, *(self.law_of(f"guide_{i}") for i in (2, 3, 4)))
        for i, (name, start, rate) in enumerate(starts):
            body, (z, x) = f"slider_{i + 1}", axes[i]
            m.body(body, masses[i], (1.0, 1.0, 1.0))
            friction = JointFriction(laws[i], length=self.a, width=self.a)
            m.frame(f"{body}.guide", z=z, x=x)
            m.frame(f"ground.guide_{i + 1}", z=z, x=x)
            m.joint(
                Prismatic(name, f"ground.guide_{i + 1}", f"{body}.guide", start, rate, friction)
            )
        m.joint(Distance("rod_12", "slider_1", "slider_2", length=5.0))
        m.joint(Distance("rod_23", "slider_2", "slider_3", length=7.0))
        for i, (axis, free) in enumerate(((X, 13.0), (Y, 14.0), (Z, 13.0)), start=1):
            m.frame(f"ground.wall_{i}", at=tuple(-10.0 * a for a in axis))
            m.force(SpringDamper(f"spring_{i}", f"ground.wall_{i}", f"slider_{i}", self.k, free))
        m.frame("slider_4.far", at=(10.0, 0.0, 0.0))
        m.force(SpringDamper("spring_4", "slider_1", "slider_4.far", self.k_4, 11.0))
        return m


@parametric
class Robot(MechanismScene):
    """Robot from a URDF file, with the law scaled to the friction of each joint.

    `source` is the path of the file or its text. The normal force of the law is the
    `<dynamics friction>` of the joint, by default `level`; the law `relative(LuGre())` breaks away
    at this value. `<dynamics damping>` is added. See `read_urdf` for names, inputs and limits.
    With `stop_stiffness`, joints stop at the limits of the file, see `JointStop`.
    `laws` are the laws of `joints`, by default `law`; parameters with the same name get suffixes.
    """

    t_end: ClassVar[float] = 2.0

    source: str | Path
    joints: tuple[str, ...] = ()
    laws: tuple[Law, ...] = ()
    level: Scalar = fields.LOAD(
        0.0, unit="N m", doc="friction of joints without a tag; [N] of those that slide"
    )
    stop_stiffness: Scalar = fields.SHAFT(
        0.0, doc="stiffness of the stops at joint limits, 0 for none; [N/m] of joints that slide"
    )
    stop_dissipation: Scalar = param(
        0.0, unit="s/rad", role="damping", lower=0.0,
        doc="dissipation of the stops, see JointStop; [s/m] of joints that slide",
    )  # fmt: skip
    g: Scalar = fields.GRAVITY(9.81)

    def __post_init__(self) -> None:
        for law in checks.many("Robot: laws", self.laws, "laws"):
            require_law("Robot: laws", law)
        if len(checks.many("Robot: joints", self.joints, "names of joints")) != len(self.laws):
            raise ValueError(
                f"Robot: expected a law for every one of the joints, got {len(self.joints)} joints "
                f"and {len(self.laws)} laws"
            )
        super().__post_init__()

    def mechanism(self) -> Mechanism:
        """Return bodies, joints and motors."""
        gravity = (0.0, 0.0, -self.g)
        laws = dict(zip(self.joints, self.laws, strict=True))
        return read_urdf(
            self.source, law=self.law, laws=laws, level=self.level, gravity=gravity,
            stop_stiffness=self.stop_stiffness, stop_dissipation=self.stop_dissipation,
        )  # fmt: skip
