"""Linkages with friction in their joints: pendulums, a pendulum on a box, and closed loops."""

from abc import abstractmethod
from math import pi
from typing import Any, ClassVar

from symfric.foundation.numeric import Scalar, atan, cos, equals, is_number, sin, sqrt
from symfric.foundation.parameters import parametric
from symfric.laws import Law
from symfric.model import Model, Variables
from symfric.multibody import (
    Distance,
    JointFriction,
    Mechanism,
    PlanarRevolute,
    Prismatic,
    Revolute,
)
from symfric.scenes import fields
from symfric.scenes.base import Scene, other_law


@parametric
class MechanismScene(Scene):
    """Machine described by a `Mechanism`; the result of `mechanism()` may be modified."""

    @abstractmethod
    def mechanism(self) -> Mechanism:
        """Return bodies, joints and forces."""

    def equations(self, p: Variables) -> Model:
        """Return the model in joint coordinates."""
        return self.mechanism().build(p)


def reach(scene: str, square: Scalar, expected: str) -> Scalar:
    """Return the root of `square`, a distance that results from closing a loop at the start.

    Raises:
        ValueError: `square` <= 0: the links are too short to close the loop, or they are collinear
            and do not determine its rates.
    """
    if is_number(square) and not float(square) > 0.0:
        raise ValueError(f"{scene}: expected {expected} at the start, got links that do not reach")
    return sqrt(square)


X, Z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


@parametric
class SliderCrank(MechanismScene):
    """Crank and slider connected by a massless rod, with one degree of freedom.

    The crank rotates about x through (0, b, c). Its pin has the radius r and is at the top at the
    start. The rod of length l is attached to the slider at the height e:

        slider^2 = l^2 - (b - r sin(crank))^2 - (c - e + r cos(crank))^2

    The slider stores and returns most of the energy of the crank. Therefore the force of the rod
    changes its sign, and its magnitude varies by orders of magnitude.

    `guide` is the law of the guide of the slider, whose stations and width are `a`; by default only
    the bearing of the crank has friction.

    Defaults: Haug's spatial example with friction in the bearing of the crank; t_end = 0.25 s.
    """

    t_end: ClassVar[float] = 0.25

    guide: Law | None = other_law("guide of the slider; no friction by default")
    m_crank: Scalar = fields.MASS(0.5, doc="mass of the crank")
    m_slider: Scalar = fields.MASS(5.0, doc="mass of the slider")
    J: Scalar = fields.INERTIA(0.2, doc="inertia of the crank about x")
    r: Scalar = fields.SIZE(0.08, doc="crank radius")
    l: Scalar = fields.SIZE(0.3, doc="length of the rod")  # noqa: E741
    b: Scalar = fields.PLACE(0.1, doc="position of the crank along y")
    c: Scalar = fields.PLACE(0.12, doc="position of the crank along z")
    e: Scalar = fields.PLACE(0.02, doc="height of the rod's end on the slider")
    a: Scalar = fields.STATIONS(0.1)
    R: Scalar = fields.SIZE(0.1, doc="radius of the crank's bearing")
    omega: Scalar = fields.TURN(120.0, doc="angular velocity at the start")
    g: Scalar = fields.GRAVITY(9.8)

    def mechanism(self) -> Mechanism:
        """Return two bodies, a bearing, a guide and a rod."""
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
        guide = self.guide and JointFriction(self.guide, length=self.a, width=self.a)
        m.joint(Prismatic("slider", "ground.guide", "block.guide", start, speed, guide))
        m.joint(Distance("rod", "wheel.pin", "block.pin", length=self.l))
        return m


HINGE = (0.0, -1.0, 0.0)
"""Axis of a hinge: angles rotate x towards z, which is counterclockwise in drawings."""


@parametric
class Pendulum(MechanismScene):
    """Rod on a hinge with friction.

        (J + m L^2) phi'' = -m g L sin(phi) - R F(R phi', N)

    phi is the angle from the hanging position. N is the magnitude of the bearing force, which
    includes weight and centrifugal force. Defaults: a rod of 1 kg and 1 m.
    """

    t_end: ClassVar[float] = 10.0

    m: Scalar = fields.MASS(1.0, doc="mass")
    L: Scalar = fields.SIZE(0.5, doc="distance of hinge and centre of mass")
    J: Scalar = fields.INERTIA(1 / 12, doc="inertia about the centre")
    R: Scalar = fields.SIZE(0.02, doc="radius of the bearing")
    phi_0: Scalar = fields.ANGLE(1.0, doc="angle at the start")
    g: Scalar = fields.GRAVITY(9.81)

    def mechanism(self) -> Mechanism:
        """Return one body and one hinge."""
        m = Mechanism("pendulum", gravity=(0.0, 0.0, -self.g))
        m.body("rod", self.m, (self.J, self.J, self.J))
        m.frame("ground.hinge", z=HINGE, x=(0.0, 0.0, -1.0))
        m.frame("rod.hinge", at=(0.0, 0.0, self.L), z=HINGE, x=(0.0, 0.0, -1.0))
        friction = JointFriction(self.law, radius=self.R)
        m.joint(Revolute("phi", "ground.hinge", "rod.hinge", start=self.phi_0, friction=friction))
        return m


@parametric
class DoublePendulum(MechanismScene):
    """Two equal rods, the second hinged to the end of the first, with friction in both hinges.

    phi_1 is the angle of the first rod from the hanging position, phi_2 that of the second rod
    relative to the first. The motion is chaotic: runs at small tolerances agree for a few seconds
    only.
    """

    t_end: ClassVar[float] = 5.0

    lower: Law | None = other_law("hinge phi_2 between the rods; `law` by default")
    m: Scalar = fields.MASS(1.0, doc="mass of each rod")
    L: Scalar = fields.SIZE(1.0, doc="length of each rod")
    R: Scalar = fields.SIZE(0.02, doc="radius of the bearings")
    phi_0: Scalar = fields.ANGLE(2.0, doc="angle of the straight pendulum at the start")
    g: Scalar = fields.GRAVITY(9.81)

    def mechanism(self) -> Mechanism:
        """Return two bodies in a chain."""
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


@parametric
class PendulumBox(MechanismScene):
    """Box on rough ground with a pendulum, and friction under the box and in the hinge.

    x is the position of the box, phi the angle of the pendulum from the hanging position. The
    normal force under the box is the whole vertical reaction, and that of the hinge is the
    magnitude of its reaction. `hinge` is the law of the hinge, by default that of the box;
    parameters with the same name get the suffixes _1 and _2.

    Defaults: Jing and Mi, Selection Mechanism of Friction Models, tables 6 and 7 (box 6 kg,
    pendulum 20 kg at 0.3 m, starting at 30 degrees), with a point mass. The paper's inertia of
    1.8 kg m^2 equals m L^2, and its text does not state whether it is about the hinge. The preset
    has it about the mass, which reproduces the standard deviation of positions in table 8. The
    paper gives no radius of the hinge; 0.01 m is assumed.
    Limits: the ground cannot pull the box, but its lift-off, at N < 0, is not checked.
    """

    t_end: ClassVar[float] = 15.0

    hinge: Law | None = other_law("hinge of the pendulum; the law of the box by default")
    m_box: Scalar = fields.MASS(6.0, doc="mass of the box")
    m: Scalar = fields.MASS(20.0, doc="mass of the pendulum")
    L: Scalar = fields.SIZE(0.3, doc="distance of hinge and mass")
    J: Scalar = fields.INERTIA(1e-9, doc="inertia about the mass")
    R: Scalar = fields.SIZE(0.01, doc="radius of the hinge")
    phi_0: Scalar = fields.ANGLE(pi / 6, doc="angle at the start")
    g: Scalar = fields.GRAVITY(9.81)

    def mechanism(self) -> Mechanism:
        """Return two bodies, a slide and a hinge."""
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


@parametric
class FourBar(MechanismScene):
    """Crank, coupler and rocker between two hinges on the ground, with friction in the hinges.

    The angles of crank and rocker are relative to x, that of the coupler is relative to the crank.
    The fourth hinge, between coupler and rocker, closes the loop as a `PlanarRevolute`; with a
    `Revolute` the reactions normal to the plane would be undetermined. `pin` is the friction law of
    this hinge; by default it has no friction. Parameters of several laws with the same name get the
    suffixes _1, _2, ...

    Defaults: a crank-rocker (0.1 + 0.4 < 0.3 + 0.35 m) that starts with 10 rad/s.
    """

    t_end: ClassVar[float] = 3.0

    hinge_coupler: Law | None = other_law("hinge between crank and coupler; `law` by default")
    hinge_rocker: Law | None = other_law("hinge of the rocker at the ground; `law` by default")
    pin: Law | None = other_law("pin between coupler and rocker; no friction by default")
    crank: Scalar = fields.SIZE(0.1, doc="length of the crank")
    coupler: Scalar = fields.SIZE(0.35, doc="length of the coupler")
    rocker: Scalar = fields.SIZE(0.3, doc="length of the rocker")
    base: Scalar = fields.SIZE(0.4, doc="distance of the fixed hinges")
    density: Scalar = fields.MASS(2.0, unit="kg/m", doc="mass of the links per length")
    R: Scalar = fields.SIZE(0.01, doc="radius of the hinges")
    angle: Scalar = fields.ANGLE(1.0, doc="angle of the crank at the start")
    omega: Scalar = fields.TURN(10.0, doc="angular velocity of the crank at the start")
    g: Scalar = fields.GRAVITY(9.81)

    def closed(self) -> tuple[Any, ...]:
        """Return the start angles of coupler and rocker relative to x, and their rates."""
        theta = self.angle
        x, z = self.base - self.crank * cos(theta), -self.crank * sin(theta)
        square = x * x + z * z
        if equals(square, 0.0):
            raise ValueError("FourBar: expected a crank whose end is not on the far hinge")
        # the pin lies above the line from the crank's end to the far hinge
        along = (square + self.coupler * self.coupler - self.rocker * self.rocker) / (2 * square)
        across = reach(
            "FourBar", self.coupler * self.coupler / square - along * along,
            "coupler and rocker that meet, not in line,",
        )  # fmt: skip
        px, pz = along * x - across * z, along * z + across * x
        beta = 2 * atan(pz / (px + self.coupler))
        qx, qz = px - x, pz - z
        gamma = 2 * atan(qz / (qx + self.rocker))
        # crank' + coupler' - rocker' = 0 as velocities of the pin
        turn = self.crank * self.omega / sin(gamma - beta)
        return (
            beta,
            gamma,
            -turn * sin(gamma - theta) / self.coupler,
            turn * sin(theta - beta) / self.rocker,
        )

    def mechanism(self) -> Mechanism:
        """Return three bodies, three hinges and a pin that closes the loop."""
        m = Mechanism("four_bar", gravity=(0.0, 0.0, -self.g))
        lengths = {"crank": self.crank, "coupler": self.coupler, "rocker": self.rocker}
        m.frame("ground.left", z=HINGE, x=(1.0, 0.0, 0.0))
        m.frame("ground.right", at=(self.base, 0.0, 0.0), z=HINGE, x=(1.0, 0.0, 0.0))
        for name, length in lengths.items():
            mass = self.density * length
            J = mass * length * length / 12
            m.body(f"{name}_rod", mass, (J, J, J), com=(length / 2, 0.0, 0.0))
            m.frame(f"{name}_rod.near", z=HINGE, x=(1.0, 0.0, 0.0))
            m.frame(f"{name}_rod.far", at=(length, 0.0, 0.0), z=HINGE, x=(1.0, 0.0, 0.0))
        beta, gamma, beta_rate, gamma_rate = self.closed()
        hinges = (
            ("theta_crank", "ground.left", "crank_rod.near", self.angle, self.omega, self.law),
            ("theta_coupler", "crank_rod.far", "coupler_rod.near",
             beta - self.angle, beta_rate - self.omega, self.law_of("hinge_coupler")),
            ("theta_rocker", "ground.right", "rocker_rod.near", gamma, gamma_rate,
             self.law_of("hinge_rocker")),
        )  # fmt: skip
        for name, parent, child, start, rate, law in hinges:
            friction = JointFriction(law, radius=self.R)
            m.joint(Revolute(name, parent, child, start, rate, friction))
        closing = self.pin and JointFriction(self.pin, radius=self.R)
        m.joint(PlanarRevolute("pin", "rocker_rod.far", "coupler_rod.far", friction=closing))
        return m
