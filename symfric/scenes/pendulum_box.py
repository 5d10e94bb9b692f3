"""A pendulum hinged to a box that slides on the ground."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import param
from symfric.laws import Law
from symfric.multibody import JointFriction, Mechanism, Prismatic, Revolute
from symfric.scenes import jing_mi
from symfric.scenes.base import other_law
from symfric.scenes.mechanism import MechanismScene
from symfric.scenes.pendulum import HINGE
from symfric.scenes.presets import Preset


@final
@dataclass(frozen=True, eq=False)
class PendulumBox(MechanismScene):
    """A box on rough ground and a pendulum on it, friction under the box and in the hinge.

    x is the position of the box, phi the angle of the pendulum from hanging; the normal force
    under the box is the whole vertical reaction, that of the hinge the size of its reaction.
    `hinge` is the law of the hinge, with its own parameters (endings _1 and _2 where box and hinge
    share a name); without it the hinge has the law of the box.

    Defaults: Jing and Mi, Selection Mechanism of Friction Models, tables 6 and 7 (box 6 kg,
    pendulum 20 kg on 0.3 m, from 30 degrees), with a point mass. Its 1.8 kg m^2 are m L^2, so that
    they may be the inertia of that about the hinge; the preset has them about the mass, where the
    standard deviation of positions at equal times is that of its table 8. The text does not decide.
    No radius of the hinge is given; 0.01 m here.
    Limits: the ground does not pull: while N > 0 the box does not lift off, which is not checked.
    """

    t_end: ClassVar[float] = 15.0
    presets: ClassVar[Mapping[str, Preset]] = {
        "jing_mi_table_7": Preset(
            "box and pendulum of table 6, every law with its own numbers in floor and hinge; its "
            "1.8 kg m^2 are about the mass (the text does not say where), and the radius of the "
            "hinge, over which those of the hinge act, is not given: 0.01 m here",
            jing_mi.SOURCE + "6 and 7",
            {"m_box": 6.0, "m": 20.0, "L": 0.3, "J": 1.8, "R": 0.01, "phi_0": pi / 6, "g": 9.81},
            {"law": jing_mi.BOX, "hinge": jing_mi.HINGE},
        )
    }

    hinge: Law | None = other_law("hinge of the pendulum; the law of the box without")
    m_box: Scalar = param(6.0, unit="kg", role="mass", doc="mass of the box", lower=1e-12)
    m: Scalar = param(20.0, unit="kg", role="mass", doc="mass of the pendulum", lower=1e-12)
    L: Scalar = param(0.3, unit="m", role="geometry", doc="distance of hinge and mass", lower=1e-12)
    J: Scalar = param(
        1e-9, unit="kg m^2", role="inertia", doc="inertia about the mass", lower=1e-12
    )
    R: Scalar = param(0.01, unit="m", role="geometry", doc="radius of the hinge", lower=1e-12)
    phi_0: Scalar = param(pi / 6, unit="rad", role="motion", doc="angle at the start")
    g: Scalar = param(9.81, unit="m/s^2", role="gravity", doc="gravity", lower=0.0)

    def mechanism(self) -> Mechanism:
        """Two bodies, a slide and a hinge."""
        m = Mechanism("pendulum_box", gravity=(0.0, 0.0, -self.g))
        along, down = (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)
        m.body("box", self.m_box, (0.1, 0.1, 0.1))
        m.body("pendulum", self.m, (self.J, self.J, self.J))
        m.frame("ground.floor", z=along, x=(0.0, 0.0, 1.0))
        m.frame("box.floor", z=along, x=(0.0, 0.0, 1.0))
        m.frame("box.hinge", at=(0.0, 0.0, 0.4), z=HINGE, x=down)
        m.frame("pendulum.hinge", at=(0.0, 0.0, self.L), z=HINGE, x=down)
        floor = JointFriction(self.law)
        bearing = JointFriction(self.law_of("hinge"), radius=self.R)
        m.joint(Prismatic("x", "ground.floor", "box.floor", friction=floor))
        m.joint(Revolute("phi", "box.hinge", "pendulum.hinge", start=self.phi_0, friction=bearing))
        return m
