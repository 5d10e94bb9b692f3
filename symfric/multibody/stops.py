"""Stops at the limits of joints."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import ClassVar, final

import casadi as ca

from symfric.foundation.numeric import Scalar, equals, is_number
from symfric.laws.base.smooth import positive
from symfric.multibody.forces import Axial, Force, Load
from symfric.multibody.joint import Joint
from symfric.multibody.kinematics import Kinematics


@final
@dataclass(frozen=True, eq=False)
class JointStop(Force):
    """Compliant stops that keep a joint between two positions.

        f = stiffness d max(0, 1 + dissipation d')

    with d >= 0 the displacement [m] or angle [rad] beyond `lower` or `upper`; f acts on the child
    towards the permitted range and never pulls. `direction` is that of a `JointSpringDamper`. An
    impact at the speed v leaves at the speed u that satisfies, with e = dissipation,
    e v - ln(1 + e v) = -e u - ln(1 - e u), for any stiffness and mass; u = v if e = 0.

    Limits: f has a kink at d = 0. The largest d is v sqrt(m / stiffness) for e = 0 and a mass or
    inertia m, less for e > 0.

    Attributes:
        lower, upper: positions of the stops [m] or [rad], lower < upper.
        stiffness: stiffness of the stops [N/m] or [N m/rad], above zero.
        dissipation: dissipation e [s/m] or [s/rad].

    Source: Hunt and Crossley 1975, Coefficient of restitution interpreted as damping in
    vibroimpact, with the exponent 1.
    """

    kind: ClassVar[str] = "stop"

    joint: str
    lower: Scalar
    upper: Scalar
    stiffness: Scalar
    dissipation: Scalar = 0.0
    direction: str = ""

    @property
    def conservative(self) -> bool:
        """True if the stops dissipate nothing."""
        return equals(self.dissipation, 0.0)

    def joints(self) -> Iterable[tuple[str, str]]:
        """Return the joint and the direction in which the stops act."""
        return ((self.joint, self.direction),)

    def problems(self) -> Iterator[str]:
        """Yield messages about numbers, their signs and the order of the stops."""
        yield from super().problems()
        if is_number(self.lower) and is_number(self.upper) and not self.lower < self.upper:
            yield f"lower: expected a position below upper = {self.upper}, got {self.lower!r}"
        if is_number(self.stiffness) and not self.stiffness > 0:
            yield f"stiffness: expected > 0, got {self.stiffness!r}"
        if is_number(self.dissipation) and not self.dissipation >= 0:
            yield f"dissipation: expected >= 0, got {self.dissipation!r}"

    def loads(self, kin: Kinematics) -> Iterator[Load | Axial]:
        """Yield the force of both stops as one load of the joint."""
        joint = kin.topology.joints[self.joint]
        direction = joint.way(self.direction)
        approach = self.dissipation * kin.rate(joint, direction)
        below, above = self._beyond(kin, joint)
        f = below * positive(1 - approach, 0.0) - above * positive(1 + approach, 0.0)
        yield Axial(joint, direction, ca.SX(self.stiffness * f))

    def energy(self, kin: Kinematics) -> ca.SX:
        """Return stiffness d^2 / 2."""
        below, above = self._beyond(kin, kin.topology.joints[self.joint])
        return self.stiffness * (below**2 + above**2) / 2

    def _beyond(self, kin: Kinematics, joint: Joint) -> tuple[ca.SX, ca.SX]:
        """Return the displacements below `lower` and above `upper`, zero between them."""
        s, _ = kin.along(joint, joint.way(self.direction))
        return ca.SX(positive(self.lower - s, 0.0)), ca.SX(positive(s - self.upper, 0.0))
