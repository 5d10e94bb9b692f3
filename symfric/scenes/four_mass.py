"""Spatial four-mass system: sliders on three axes, coupled by rods and springs."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import param
from symfric.laws import BrownMcPhee, Law
from symfric.multibody import Distance, JointFriction, Mechanism, Prismatic, SpringDamper
from symfric.scenes.base import other_law
from symfric.scenes.mechanism import MechanismScene
from symfric.scenes.presets import Numbers, Preset

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@final
@dataclass(frozen=True, eq=False)
class FourMass(MechanismScene):
    """Four sliders: 1 and 4 on the axis x, 2 on y, 3 on z; two degrees of freedom.

    Massless rods of lengths 5 and 7 m hold 1 to 2 and 2 to 3; springs of rate k hold 1, 2, 3 to
    the ground (free at 3, 4, 3 m), and one of rate k_4 holds 4 to 1 (free at 1 m). The normal
    force of every guide follows from the forces in the rods, so friction acts back on itself.

    Defaults: Haug's spatial example, with friction; t_end = 4 s.
    """

    t_end: ClassVar[float] = 4.0
    presets: ClassVar[Mapping[str, Preset]] = {
        "haug": Preset(
            "sliders of the spatial example with friction in all guides; laws without a transition "
            "velocity get the coefficients",
            "Haug, spatial four-mass example, data as in public codes",
            {"m_1": 2.0, "m_3": 6.0, "k": 2.0, "k_4": 10.0, "v_4": -1.0, "a": 0.1, "g": 9.8},
            {"law": Numbers({"mu_s": 0.12, "mu_d": 0.1}, {BrownMcPhee: {"v_t": 0.01}})},
        )
    }

    guide_2: Law | None = other_law("guide of slider 2 (y2); `law` without")
    guide_3: Law | None = other_law("guide of slider 3 (z3); `law` without")
    guide_4: Law | None = other_law("guide of slider 4 (x4); `law` without")
    m_1: Scalar = param(2.0, unit="kg", role="mass", doc="mass of sliders 1 and 2", lower=1e-12)
    m_3: Scalar = param(6.0, unit="kg", role="mass", doc="mass of sliders 3 and 4", lower=1e-12)
    k: Scalar = param(
        2.0, unit="N/m", role="stiffness", doc="rate of the springs to the ground", lower=0.0
    )
    k_4: Scalar = param(
        10.0, unit="N/m", role="stiffness", doc="rate of the spring between 1 and 4", lower=0.0
    )
    v_4: Scalar = param(-1.0, unit="m/s", role="motion", doc="velocity of slider 4 at the start")
    a: Scalar = param(
        0.1, unit="m", role="geometry", doc="distance of the bearing stations", lower=1e-12
    )
    g: Scalar = param(9.8, unit="m/s^2", role="gravity", doc="gravity", lower=0.0)

    def mechanism(self) -> Mechanism:
        """Four bodies, four guides, two rods, four springs."""
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
