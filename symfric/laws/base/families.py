"""Families of laws: with two levels, with one formula for both directions, with a stick mode."""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import fields as fields_of
from functools import partial

from symfric.foundation.numeric import Scalar, column, empty, tanh
from symfric.foundation.parameters import parametric
from symfric.laws.base import fields, smooth
from symfric.laws.base.law import APPLIED_FORCE, Input, Law, State, StaticLaw, Switch

Fall = Callable[[Scalar, Scalar, Scalar], Scalar]
"""(v, v_s, delta) -> the Stribeck weight exp(-|v / v_s|^delta)."""


@parametric
class Levels(Law):
    """Law with a static level mu_s N that is not below its dynamic level mu_d N."""

    ordered = (("mu_d", "mu_s"),)

    mu_s: Scalar = fields.MU_S(0.15)
    mu_d: Scalar = fields.MU_D(0.1)

    def coefficient(self, share: Scalar) -> Scalar:
        """Return mu_d + (mu_s - mu_d) share, the coefficient at a share of the static excess."""
        return self.mu_d + (self.mu_s - self.mu_d) * share


class TwoLevels(Levels):
    """Law with mu_s N at rest and mu_d N as its limit in sliding."""

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 in the limit of zero widths."""
        return self.mu_d * N

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the break-away force [N], mu_s N."""
        return self.mu_s * N


@parametric
class Curve(StaticLaw):
    """Law without states with one formula for both directions s of slip.

        F = formula(v, N, s, fall)

    `force` uses s = tanh(v / v_eps), and a fall that rounds |v| over 1e-4 v_eps; `outside` uses
    s = 1 and the fall on one side of rest. v_eps is the first parameter that is a width, or the
    inverse of a steepness.
    """

    @abstractmethod
    def formula(self, v: Scalar, N: Scalar, s: Scalar, fall: Fall) -> Scalar:
        """Return the friction force [N] at the velocity `v` with the direction `s`."""

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 in the limit of zero widths."""
        return self.formula(speed, N, 1.0, smooth.fall)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        width = next(item for item in fields_of(self) if item.metadata.get("width"))
        value = getattr(self, width.name)
        if width.metadata["width"] > 0:
            s, corner = smooth.sign(v, value), smooth.CORNER * value
        else:
            s, corner = tanh(value * v), smooth.CORNER / value
        return self.formula(v, N, s, partial(smooth.stribeck, eps=corner))


FINEST = 1e-7
"""Largest relative tolerance of runs with such a law, a reference for other laws."""


@parametric
class Sticking(Law):
    """Law with a mode: the direction of sliding, or 0 in stick.

        F = slip force in the direction `mode`   while sliding
        F = F_e                                  in stick, mode = 0, up to the static level

    A form without modes (`has_mode` false) has no states.
    """

    mu_s: Scalar = fields.MU_S(0.15)

    @property
    @abstractmethod
    def has_mode(self) -> bool:
        """True if stick is a mode and not a band of velocities."""

    @property
    def states(self) -> tuple[State, ...]:
        """Mode: direction of sliding, or 0 at rest."""
        mode = State("mode", "1", 1.0, doc="direction of sliding, 0 at rest", whole=True)
        return (mode,) if self.has_mode else ()

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Applied force F_e [N], which is carried in stick."""
        return (APPLIED_FORCE,)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = (), *, F_e: Scalar = 0.0) -> Scalar:
        """Return zero [1/s]; in stick beyond the static level (F_e -+ level) / (|F_e| + 1 N).

        Nothing depends on this overload, and stick ends at the instant where it would become
        nonzero. It lets error control detect a short overload, which a long step would otherwise
        skip: in stick nothing moves.
        """
        if not self.has_mode:
            return empty(v)
        static = self.static_level(N)
        beyond = F_e - smooth.clip(F_e, -static, static)
        share = beyond / (smooth.magnitude(F_e, 0.0) + APPLIED_FORCE.nominal)
        return column(smooth.choose(rests(z[0]), share, 0.0 * v))

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the break-away force [N], mu_s N, the largest force in stick."""
        return self.mu_s * N

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the direction of sliding."""
        return column(smooth.sign(v, 0.0)) if self.has_mode else empty(v)

    def switches(
        self, v: Scalar, N: Scalar, z: Scalar = (), *, F_e: Scalar = 0.0
    ) -> tuple[Switch, ...]:
        """Return the end of sliding at v = 0, and its start where the load exceeds the level.

        Sliding continues in the other direction if the contact cannot hold `F_e`; stick ends at
        once if the load exceeds the static level from the start. While such a load pulls forward,
        v = 0 is a start of sliding, not an end.
        """
        if not self.has_mode:
            return ()
        mode, static = z[0], self.static_level(N)
        onward, still = smooth.choose(F_e < 0, -1.0, 1.0), rests(mode)
        excess = smooth.magnitude(F_e, 0.0) - static
        after = smooth.choose(excess <= 0, 0.0, onward)
        pull = mode * F_e - static
        ahead = smooth.choose(mode * v > pull, mode * v, pull)
        stick, slip = smooth.choose(still, 1.0, ahead), smooth.choose(still, excess, -1.0)
        return (
            Switch("stick", stick, -1, {"mode": after}, halts=True),
            Switch("slip", slip, 1, {"mode": onward}, at_start=True, rtol=FINEST),
        )


def rests(mode: Scalar) -> Scalar:
    """Return True if `mode`, up to the overload for error control -1, 0 or 1, is stick."""
    return smooth.magnitude(mode, 0.0) < 0.5


def carried(mode: Scalar, F_e: Scalar, slip: Scalar) -> Scalar:
    """Return the force [N] of the contact: `slip` while sliding, the applied force in stick.

    It is not clipped to the static level: the equations of stick stay smooth beyond its end, and so
    does the dense output on which that end is located.
    """
    return smooth.choose(rests(mode), F_e, slip)
