"""Planar four-bar linkage in the vertical plane x, z."""

from dataclasses import dataclass
from typing import Any, ClassVar, final

from symfric.foundation.numeric import Scalar, atan, cos, equals, sin
from symfric.foundation.parameters import param
from symfric.laws import Law
from symfric.multibody import JointFriction, Mechanism, PlanarRevolute, Revolute
from symfric.scenes.base import other_law
from symfric.scenes.mechanism import MechanismScene, reach
from symfric.scenes.pendulum import HINGE


@final
@dataclass(frozen=True, eq=False)
class FourBar(MechanismScene):
    """Crank, coupler and rocker between two hinges of the ground, friction in the hinges.

    crank and rocker are angles against x, coupler the angle of the coupler against the crank. The
    fourth hinge, between coupler and rocker, closes the loop as a `PlanarRevolute`: a `Revolute`
    would fix what the plane fixes already, and leave the reactions out of the plane open. `pin` is
    the law of its friction; without it it has none. Laws of other places have their own parameters,
    with the endings _1, _2, ... where they share a name.

    Defaults: a crank-rocker (0.1 + 0.4 < 0.3 + 0.35 m) that starts with 10 rad/s.
    """

    t_end: ClassVar[float] = 3.0

    hinge_coupler: Law | None = other_law("hinge between crank and coupler; `law` without")
    hinge_rocker: Law | None = other_law("hinge of the rocker at the ground; `law` without")
    pin: Law | None = other_law("pin between coupler and rocker; without friction where not given")
    crank: Scalar = param(0.1, unit="m", role="geometry", doc="length of the crank", lower=1e-12)
    coupler: Scalar = param(
        0.35, unit="m", role="geometry", doc="length of the coupler", lower=1e-12
    )
    rocker: Scalar = param(0.3, unit="m", role="geometry", doc="length of the rocker", lower=1e-12)
    base: Scalar = param(
        0.4, unit="m", role="geometry", doc="distance of the fixed hinges", lower=1e-12
    )
    density: Scalar = param(
        2.0, unit="kg/m", role="mass", doc="mass of the links per length", lower=1e-12
    )
    R: Scalar = param(0.01, unit="m", role="geometry", doc="radius of the hinges", lower=1e-12)
    angle: Scalar = param(1.0, unit="rad", role="motion", doc="angle of the crank at the start")
    omega: Scalar = param(
        10.0, unit="rad/s", role="motion", doc="angular velocity of the crank at the start"
    )
    g: Scalar = param(9.81, unit="m/s^2", role="gravity", doc="gravity", lower=0.0)

    def closed(self) -> tuple[Any, ...]:
        """Angles of crank, coupler and rocker against x at the start, and their rates."""
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
        """Three bodies, three hinges, a pin that closes the loop."""
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
        closing = None if self.pin is None else JointFriction(self.pin, radius=self.R)
        m.joint(PlanarRevolute("pin", "rocker_rod.far", "coupler_rod.far", friction=closing))
        return m
