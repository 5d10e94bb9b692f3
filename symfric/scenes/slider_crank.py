"""Spatial slider-crank: a crank that turns about x drives a slider along x over a skew rod."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import param
from symfric.laws import BrownMcPhee, Law
from symfric.multibody import Distance, JointFriction, Mechanism, Prismatic, Revolute
from symfric.scenes import fields
from symfric.scenes.base import other_law
from symfric.scenes.mechanism import MechanismScene, reach
from symfric.scenes.presets import Numbers, Preset

BEARING = Numbers({"mu_s": 0.1, "mu_d": 0.08}, {BrownMcPhee: {"v_t": 0.01}})
X, Z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


@final
@dataclass(frozen=True, eq=False)
class SliderCrank(MechanismScene):
    """A crank, a slider and a massless rod between them; one degree of freedom.

    The crank turns about x through (0, b, c); its pin stands at r, above at the start. The rod of
    length l ends at the height e on the slider:

        slider^2 = l^2 - (b - r sin(crank))^2 - (c - e + r cos(crank))^2

    The slider swings back and forth and gathers and returns most of the crank's energy, so the
    rod's force changes its sign and its size by orders of magnitude.

    `guide` is the law of the slider's guide, whose stations and width are `a`; without it only the
    crank's bearing rubs.

    Defaults: Haug's spatial example, friction in the bearing of the crank; t_end = 0.25 s.
    """

    t_end: ClassVar[float] = 0.25
    presets: ClassVar[Mapping[str, Preset]] = {
        "haug": Preset(
            "crank of the spatial example with friction in its bearing",
            "Haug, spatial slider-crank example, data as in public codes",
            {"m_crank": 0.5, "m_slider": 5.0, "J": 0.2, "r": 0.08, "l": 0.3, "b": 0.1, "c": 0.12}
            | {"e": 0.02, "a": 0.1, "R": 0.1, "omega": 120.0, "g": 9.8},
            {"law": BEARING},
        ),
        "haug_with_guide": Preset(
            "the same with friction in the guide of the slider, too",
            "Haug, spatial slider-crank example; the coefficients of its bearing",
            {"omega": 120.0, "g": 9.8},
            {"law": BEARING, "guide": BEARING},
        ),
    }

    guide: Law | None = other_law("guide of the slider; without friction where not given")
    m_crank: Scalar = fields.MASS(0.5, doc="mass of the crank")
    m_slider: Scalar = fields.MASS(5.0, doc="mass of the slider")
    J: Scalar = fields.INERTIA(0.2, doc="inertia of the crank about x")
    r: Scalar = fields.SIZE(0.08, doc="crank radius")
    l: Scalar = fields.SIZE(0.3, doc="length of the rod")  # noqa: E741
    b: Scalar = param(0.1, unit="m", role="geometry", doc="position of the crank along y")
    c: Scalar = param(0.12, unit="m", role="geometry", doc="position of the crank along z")
    e: Scalar = param(0.02, unit="m", role="geometry", doc="height of the rod's end on the slider")
    a: Scalar = fields.STATIONS(0.1)
    R: Scalar = fields.SIZE(0.1, doc="radius of the crank's bearing")
    omega: Scalar = fields.TURN(120.0, doc="angular velocity at the start")
    g: Scalar = fields.GRAVITY(9.8)

    def mechanism(self) -> Mechanism:
        """Two bodies, a bearing, a guide and a rod."""
        m = Mechanism("slider_crank", gravity=(0.0, 0.0, -self.g))
        m.body("wheel", self.m_crank, (self.J, self.J, self.J))
        m.body("block", self.m_slider, (0.2, 0.2, 0.2))
        m.frame("ground.bearing", at=(0.0, self.b, self.c), z=X, x=Z)
        m.frame("ground.guide", z=X, x=Z)
        m.frame("wheel.bearing", z=X, x=Z)
        m.frame("wheel.pin", at=(0.0, 0.0, self.r))
        m.frame("block.guide", z=X, x=Z)
        m.frame("block.pin", at=(0.0, 0.0, self.e))
        rise = self.c + self.r - self.e
        square = self.l * self.l - self.b * self.b - rise * rise
        start = reach("SliderCrank", square, "l^2 > b^2 + (c + r - e)^2")
        speed = self.b * self.r * self.omega / start
        bearing = JointFriction(self.law, radius=self.R, length=self.a)
        m.joint(Revolute("crank", "ground.bearing", "wheel.bearing", 0.0, self.omega, bearing))
        guide = (
            None if self.guide is None else JointFriction(self.guide, length=self.a, width=self.a)
        )
        m.joint(Prismatic("slider", "ground.guide", "block.guide", start, speed, guide))
        m.joint(Distance("rod", "wheel.pin", "block.pin", length=self.l))
        return m
