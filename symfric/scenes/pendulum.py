"""A pendulum, one or two links, with friction in its hinges."""

from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import param
from symfric.laws import Law
from symfric.multibody import JointFriction, Mechanism, Revolute
from symfric.scenes.base import other_law
from symfric.scenes.mechanism import MechanismScene

HINGE = (0.0, -1.0, 0.0)
"""Axis of a hinge: angles turn x towards z, against the clock as seen on the page."""


@final
@dataclass(frozen=True, eq=False)
class Pendulum(MechanismScene):
    """A rod on a hinge with friction.

        (J + m L^2) phi'' = -m g L sin(phi) - R F(R phi', N)

    phi is the angle from hanging; N is the size of the bearing force, weight and centrifugal force
    together. Defaults: a rod of 1 kg and 1 m.
    """

    t_end: ClassVar[float] = 10.0

    m: Scalar = param(1.0, unit="kg", role="mass", doc="mass", lower=1e-12)
    L: Scalar = param(
        0.5, unit="m", role="geometry", doc="distance of hinge and centre of mass", lower=1e-12
    )
    J: Scalar = param(
        1 / 12, unit="kg m^2", role="inertia", doc="inertia about the centre", lower=1e-12
    )
    R: Scalar = param(0.02, unit="m", role="geometry", doc="radius of the bearing", lower=1e-12)
    phi_0: Scalar = param(1.0, unit="rad", role="motion", doc="angle at the start")
    g: Scalar = param(9.81, unit="m/s^2", role="gravity", doc="gravity", lower=0.0)

    def mechanism(self) -> Mechanism:
        """One body, one hinge."""
        m = Mechanism("pendulum", gravity=(0.0, 0.0, -self.g))
        m.body("rod", self.m, (self.J, self.J, self.J))
        m.frame("ground.hinge", z=HINGE, x=(0.0, 0.0, -1.0))
        m.frame("rod.hinge", at=(0.0, 0.0, self.L), z=HINGE, x=(0.0, 0.0, -1.0))
        friction = JointFriction(self.law, radius=self.R)
        m.joint(Revolute("phi", "ground.hinge", "rod.hinge", start=self.phi_0, friction=friction))
        return m


@final
@dataclass(frozen=True, eq=False)
class DoublePendulum(MechanismScene):
    """Two equal rods, the second one hinged to the end of the first, with friction in both hinges.

    phi_1 is the angle of the first rod from hanging, phi_2 that of the second from the first. Its
    motion is chaotic: small tolerances show the same path for a few seconds only.
    """

    t_end: ClassVar[float] = 5.0

    lower: Law | None = other_law("hinge phi_2 between the rods; `law` without")
    m: Scalar = param(1.0, unit="kg", role="mass", doc="mass of each rod", lower=1e-12)
    L: Scalar = param(1.0, unit="m", role="geometry", doc="length of each rod", lower=1e-12)
    R: Scalar = param(0.02, unit="m", role="geometry", doc="radius of the bearings", lower=1e-12)
    phi_0: Scalar = param(
        2.0, unit="rad", role="motion", doc="angle of the straight pendulum at the start"
    )
    g: Scalar = param(9.81, unit="m/s^2", role="gravity", doc="gravity", lower=0.0)

    def mechanism(self) -> Mechanism:
        """Two bodies in a chain."""
        m = Mechanism("double_pendulum", gravity=(0.0, 0.0, -self.g))
        J = self.m * self.L * self.L / 12
        down = (0.0, 0.0, -1.0)
        m.frame("ground.hinge", z=HINGE, x=down)
        for body in ("upper", "lower"):
            m.body(body, self.m, (J, J, J))
            m.frame(f"{body}.top", at=(0.0, 0.0, self.L / 2), z=HINGE, x=down)
            m.frame(f"{body}.end", at=(0.0, 0.0, -self.L / 2), z=HINGE, x=down)
        upper, lower = (JointFriction(of, radius=self.R) for of in (self.law, self.law_of("lower")))
        m.joint(Revolute("phi_1", "ground.hinge", "upper.top", start=self.phi_0, friction=upper))
        m.joint(Revolute("phi_2", "upper.end", "lower.top", friction=lower))
        return m
