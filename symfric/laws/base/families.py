"""Families of laws: two levels, one formula for both sides of rest, rest as a mode."""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from dataclasses import fields as fields_of
from functools import partial

from symfric.foundation.numeric import Scalar, column, empty, tanh
from symfric.laws.base import fields, smooth
from symfric.laws.base.law import APPLIED_FORCE, Input, Law, State, StaticLaw, Switch

Fall = Callable[[Scalar, Scalar, Scalar], Scalar]
"""(v, v_s, delta) -> the Stribeck weight exp(-|v / v_s|^delta)."""


@dataclass(frozen=True, eq=False)
class Levels(Law):
    """A law with a static level mu_s N that is not below its dynamic level mu_d N."""

    ordered = (("mu_d", "mu_s"),)

    mu_s: Scalar = fields.MU_S(0.15)
    mu_d: Scalar = fields.MU_D(0.1)


class TwoLevels(Levels, StaticLaw):
    """A law without states that holds mu_s N at rest and tends to mu_d N in sliding."""

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish."""
        return self.mu_d * N

    def static_level(self, N: Scalar, side: int = 1) -> Scalar:
        """The force [N] of break-away, mu_s N."""
        return self.mu_s * N


@dataclass(frozen=True, eq=False)
class Curve(StaticLaw):
    """A law without states that is written once, with the direction s of slip and a fall.

        F = formula(v, N, s, fall)

    `force` takes s = tanh(v / v_eps), and a fall that rounds |v| over 1e-4 v_eps; `outside` takes
    s = 1 and the fall on one side of rest. v_eps is the first parameter that is a width, or the
    inverse of a steepness.
    """

    @abstractmethod
    def formula(self, v: Scalar, N: Scalar, s: Scalar, fall: Fall) -> Scalar:
        """Friction force [N] at the velocity `v` with the direction `s`."""

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish."""
        return self.formula(speed, N, 1.0, smooth.fall)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        width = next(item for item in fields_of(self) if item.metadata.get("width"))
        value = getattr(self, width.name)
        if width.metadata["width"] > 0:
            s, corner = smooth.sign(v, value), smooth.CORNER * value
        else:
            s, corner = tanh(value * v), smooth.CORNER / value
        return self.formula(v, N, s, partial(smooth.stribeck, eps=corner))


FINEST = 1e-7
"""Relative tolerance of runs with such a law at most: they are what other laws are measured by."""


@dataclass(frozen=True, eq=False)
class Sticking(Law):
    """A law whose mode is the direction of sliding, or 0 for a contact at rest.

        F = slip force in the direction `mode`   while sliding
        F = F_e                                  at rest, mode = 0, which ends at the static level

    A form without modes (`has_mode` false) has no states.
    """

    mu_s: Scalar = fields.MU_S(0.15)

    @property
    @abstractmethod
    def has_mode(self) -> bool:
        """Return True if rest is a mode and not a band of velocities."""

    @property
    def states(self) -> tuple[State, ...]:
        """The mode: direction of sliding, or 0 at rest."""
        return (
            (State("mode", "1", 1.0, doc="direction of sliding, 0 at rest", whole=True),)
            if self.has_mode
            else ()
        )

    @property
    def inputs(self) -> tuple[Input, ...]:
        """The applied force F_e [N], which rest has to carry."""
        return (APPLIED_FORCE,)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = (), *, F_e: Scalar = 0.0) -> Scalar:
        """Zero; beyond the static level at rest the overload (F_e -+ level)/(|F_e| + 1 N) [1/s].

        Nothing depends on it, and rest ends at the instant where it would begin. It is there for
        error control, which would else step over a short overload: at rest nothing else moves.
        """
        if not self.has_mode:
            return empty(v)
        static = self.static_level(N)
        beyond = F_e - smooth.clip(F_e, -static, static)
        share = beyond / (smooth.magnitude(F_e, 0.0) + APPLIED_FORCE.nominal)
        return column(smooth.choose(rests(z[0]), share, 0.0 * v))

    def static_level(self, N: Scalar, side: int = 1) -> Scalar:
        """The force [N] of break-away, mu_s N: the largest that rest holds."""
        return self.mu_s * N

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """The direction of sliding."""
        return column(smooth.sign(v, 0.0)) if self.has_mode else empty(v)


def rests(mode: Scalar) -> Scalar:
    """Return True if `mode`, -1, 0 or 1 but for the overload that error control sees, says rest."""
    return smooth.magnitude(mode, 0.0) < 0.5


def carried(mode: Scalar, F_e: Scalar, slip: Scalar) -> Scalar:
    """The force [N] of the contact: `slip` while it slides, at rest whatever is applied.

    Not clipped to the static level: the equations of rest stay smooth beyond its end, and so does
    the dense output on which that end is found.
    """
    return smooth.choose(rests(mode), F_e, slip)


def stick_and_slip(v: Scalar, mode: Scalar, F_e: Scalar, static: Scalar) -> tuple[Switch, ...]:
    """End of sliding at v = 0, and its beginning where the load passes `static`.

    Sliding goes on in the other direction where the contact cannot hold `F_e`; rest ends at once
    where the load is beyond `static` from the very start. While the load beyond `static` pulls
    forward v = 0 is a beginning, and no end.
    """
    onward, still = smooth.choose(F_e < 0, -1.0, 1.0), rests(mode)
    excess = smooth.magnitude(F_e, 0.0) - static
    after = smooth.choose(excess <= 0, 0.0, onward)
    pull = mode * F_e - static
    ahead = smooth.choose(mode * v > pull, mode * v, pull)
    return (
        Switch("stick", smooth.choose(still, 1.0, ahead), -1, {"mode": after}, halts=True),
        Switch(
            "slip",
            smooth.choose(still, excess, -1.0),
            1,
            {"mode": onward},
            at_start=True,
            rtol=FINEST,
        ),
    )
