"""Base class of brakes, clutches and belts: friction under an actuating force.

An element acts in joints j with displacements s_j and levers c_j. Its normal force N follows from
the actuating force P and, where friction presses by itself, from the friction force F:

    v = sum c_j s_j',   load on joint j = -c_j F(v, N)
    N = G(m) P + B(m) F,   m = F / N,   P = preload + max(actuation, 0)

G is the gain of the lever or wedge, B that of the friction force; m is the mobilised coefficient,
which in sliding is the friction coefficient. With it, N = G P / (1 - B m): the element locks itself
if B m reaches 1. A negative actuation releases the element, which cannot pull.
"""

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from math import inf
from typing import ClassVar, final

import casadi as ca

from symfric.foundation.checks import as_number
from symfric.foundation.numeric import Scalar, is_number
from symfric.foundation.variable import take_si
from symfric.laws import Law
from symfric.laws.base import smooth
from symfric.laws.base.law import require_law
from symfric.multibody.contact import UNLOADED, End, LeverContact, depends_on_load, slip_of
from symfric.multibody.dynamics import Wrench
from symfric.multibody.forces import Axial, Force, Load
from symfric.multibody.joint import JointFriction, needs_more
from symfric.multibody.kinematics import Kinematics

EXPONENT = 50.0
"""Largest |m| times the wrap angle in exp(m angle), so that no iterate of a solver overflows."""


def wrapped(m: ca.SX, angle: Scalar) -> tuple[ca.SX, ca.SX]:
    """Return exp(m angle), the ratio of the tensions, and N / T of an arc with slack tension T.

    N = T (exp(m angle) - 1) / m is the integral of the tension over the wrap angle.
    """
    x = smooth.clip(m * angle, -EXPONENT, EXPONENT)
    return ca.exp(x), angle * ca.SX(smooth.phi1(x))


def overwound(law: Law, angle: Scalar) -> Iterator[str]:
    """Yield a message if static friction would exceed the bound of `wrapped`."""
    try:
        m = as_number(law.static_level(1.0))
    except ValueError:
        return
    size = as_number(angle)
    if m is not None and size is not None and EXPONENT < m * size < inf:
        yield (
            f"angle: expected coefficient times angle <= {EXPONENT:g}, got {m * size:.3g}; the "
            "tension would grow by more than exp(50)"
        )


class ActuatedElement(Force):
    """Brake, clutch or belt whose normal force follows from an actuating force.

    Any law of v, N and F_e whose force depends on the normal force is possible, with bristles and
    with true sticking. The actuating force and the geometry may be numbers or parameters, the
    actuating force also an input of the mechanism. A negative number is refused; an input or a
    parameter below zero releases the element.

    Results: `<name>_N`, `<name>_slip`, `<name>_friction`, `<name>_power` as of a joint; on request
    the loads `<name>_load_a` [N m or N] and powers `<name>_power_a` [W] of friction on the child of
    the first joint, `<name>_load_b` and `<name>_power_b` on that of the second one, and
    `<name>_locking` = B m with m from the static level, the part of the normal force that friction
    causes. The element locks itself from 1 on: at rest it holds any load in this direction, and a
    run in which it slides ends with an error, because its equilibrium has no solution. `efficiency`
    is the ratio of the energies over a run.

    Limits: bearings are loaded by moments and forces about and along the axes only.
    """

    kind: ClassVar[str] = "element"
    actuator: ClassVar[str] = "force"
    """Name of the field with the actuating force."""
    above_zero: ClassVar[tuple[str, ...]] = ()
    """Names of the fields that must be above zero."""
    other_than_zero: ClassVar[tuple[str, ...]] = ()
    """Names of the fields whose sign is a direction."""

    law: Law
    preload: Scalar

    def __post_init__(self) -> None:
        name = type(self).__name__
        require_law(f"{name}: law", self.law)
        take_si(name, self, *(item.name for item in fields(self) if item.type is Scalar))

    @abstractmethod
    def joints(self) -> tuple[tuple[str, str], ...]:
        """Return the joints of the element with their directions."""

    @abstractmethod
    def levers(self) -> tuple[Scalar, ...]:
        """Return the lever c_j of each joint."""

    @abstractmethod
    def pressing(self, m: ca.SX) -> tuple[Scalar, Scalar]:
        """Return the gains G and B at the mobilised coefficient m."""

    def tensions(self, F: ca.SX) -> dict[str, ca.SX]:
        """Return the tensions [N] of a band, rope or belt under the friction force F, by end."""
        return {}

    @property
    def conservative(self) -> bool:
        """True if the element has no load apart from friction, whose work is counted there."""
        return True

    @property
    def actuation(self) -> ca.SX:
        """Actuating force P [N], at least the preload."""
        given = getattr(self, self.actuator)
        return ca.SX(self.preload + (given if is_number(given) else smooth.positive(given, 0.0)))

    def contact(self, kin: Kinematics) -> "ActuatedContact":
        """Return the contact of the element."""
        pairs = zip(self.joints(), self.levers(), strict=True)
        ends = tuple(End(kin.topology.joints[name], way, c) for (name, way), c in pairs)
        F, N = (ca.SX.sym(f"{self.name}_{what}") for what in ("friction", "N"))
        name, friction, slip = self.name, JointFriction(self.law), slip_of(kin, ends)
        return ActuatedContact(name, name, friction, self.law, name, slip, F, ends, self, N)

    def loads(self, kin: Kinematics) -> Iterator[Load | Axial]:
        """Yield nothing: an actuating force inside a brake does not load the bodies."""
        yield from ()

    def problems(self) -> Iterator[str]:
        """Yield messages about invalid numbers and laws, and about a joint that occurs twice."""
        yield from super().problems()
        size = {name: as_number(getattr(self, name)) for name in vars(self)}
        for name in self.above_zero:
            if (x := size[name]) is not None and x <= 0:
                yield f"{name}: expected a number > 0, got {x:g}"
        for name in self.other_than_zero:
            if size[name] == 0:
                yield f"{name}: expected a number other than 0, got 0"
        for name in (self.actuator, "preload"):
            if (x := size[name]) is not None and x < 0:
                yield f"{name}: expected a number >= 0, got {x:g}; friction needs pressure"
        if reason := needs_more(self.law):
            yield reason
        elif not depends_on_load(self.law):
            yield (
                f"law: expected one that depends on the normal force, got {type(self.law).__name__}"
                "; no actuation would change its friction"
            )
        ends = self.joints()
        if len(set(ends)) < len(ends):
            yield f"expected two joints, got {ends[0][0]} twice"


@final
@dataclass(frozen=True, eq=False)
class ActuatedContact(LeverContact):
    """Friction of an element under an actuating force.

    Attributes:
        element: brake, clutch or belt.
        N: symbol of the normal force [N].
    """

    kind = "element"
    measure = "part of the normal force that static friction causes"

    element: ActuatedElement
    N: ca.SX

    @property
    def law_place(self) -> str:
        """Field of the law, for messages."""
        return f"{self.place} > law"

    @property
    def link(self) -> str:
        """First joint."""
        return self.ends[0].joint.name

    @property
    def rate(self) -> str:
        """Name of the rate of the only joint; empty if there are two."""
        joint, direction, *_ = self.ends[0]
        own = f"{joint.coordinate(joint.directions[direction])}_rate"
        return own if len(self.ends) == 1 else ""

    @property
    def normal_symbol(self) -> ca.SX:
        """Symbol of the normal force."""
        return self.N

    @property
    def mobilised(self) -> ca.SX:
        """Mobilised coefficient m = F / N."""
        return self.F / (self.N + UNLOADED)

    def tensions(self) -> dict[str, ca.SX]:
        """Return the tensions [N] of a band, rope or belt by end."""
        return self.element.tensions(self.F)

    @property
    def locking(self) -> ca.SX:
        """Ratio `measure` [1], B m for static friction in the direction of F."""
        held = self.friction.law.static_level(self.N)
        m = smooth.choose(self.F < 0, -1.0, 1.0) * held / (self.N + UNLOADED)
        return ca.SX(self.element.pressing(m)[1]) * m

    def normal(self, kin: Kinematics, pressing: Mapping[str, Wrench]) -> ca.SX:
        """Return N = G(m) P + B(m) F."""
        G, B = self.element.pressing(self.mobilised)
        return G * self.element.actuation + B * self.F

    def explicit_normal(self, normal: ca.SX, force: ca.SX, N: ca.SX) -> ca.SX:
        """Return N = G P / (1 - B m) for a friction force m N; otherwise `normal`."""
        if not ca.depends_on(normal, self.F):
            return normal
        m = ca.jacobian(force, N)
        if ca.depends_on(m, N) or not ca.substitute(force, N, ca.SX(0)).is_zero():
            return normal
        G, B = self.element.pressing(m)
        return ca.SX(G * self.element.actuation / (1 - B * m))
