"""Base classes of laws with two levels, one formula for both directions, or stick; `Exact`."""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import fields as fields_of
from functools import partial
from math import inf

from symfric.foundation.numeric import Scalar, column, empty, tanh
from symfric.foundation.parameters import parameters, parametric
from symfric.laws.base import fields, smooth
from symfric.laws.base.law import (
    APPLIED_FORCE,
    FORCE,
    Facts,
    Input,
    Law,
    State,
    StaticLaw,
    Switch,
    chosen,
    require_law,
)

Fall = Callable[[Scalar, Scalar, Scalar], Scalar]
"""Function that maps (v, v_s, delta) to the Stribeck weight exp(-|v / v_s|^delta)."""


@parametric
class Levels(Law):
    """Law with a static level mu_s N and a dynamic level mu_d N, where mu_s >= mu_d."""

    ordered = (("mu_d", "mu_s"),)

    mu_s: Scalar = fields.MU_S(0.15)
    mu_d: Scalar = fields.MU_D(0.1)

    def coefficient(self, share: Scalar) -> Scalar:
        """Return the friction coefficient mu_d + (mu_s - mu_d) share."""
        return self.mu_d + (self.mu_s - self.mu_d) * share


class TwoLevels(Levels):
    """Law with the static level mu_s N at rest and the limit mu_d N in sliding."""

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 in the limit of zero widths."""
        return self.mu_d * N

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the break-away force [N], mu_s N."""
        return self.mu_s * N


@parametric
class CurveLaw(StaticLaw):
    """Law without states with one formula for both directions s of slip.

        F = formula(v, N, s, fall)

    `force` uses s = tanh(v / v_eps) and a Stribeck weight in which |v| is rounded over 1e-4 v_eps.
    `outside` uses s = 1 and the Stribeck weight for speeds >= 0. v_eps is the first parameter that
    is a width, or the inverse of the first steepness.
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
"""Largest relative tolerance of runs with a law with modes, which is a reference for others."""


class WithModes(Law):
    """Law whose state is a mode: the direction of sliding, or 0 in stick.

        F = slip force in the direction `mode`   while sliding
        F = F_e                                  in stick, mode = 0, up to the static level

    A form of the law without modes (`has_mode` is False) has no states.
    """

    @property
    def has_mode(self) -> bool:
        """True if stick is a mode; False if it is a band of velocities."""
        return True

    @property
    def states(self) -> tuple[State, ...]:
        """Direction of sliding, or 0 at rest; no states if `has_mode` is False."""
        mode = State("mode", "1", 1.0, doc="direction of sliding, 0 at rest", whole=True)
        return (mode,) if self.has_mode else ()

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Applied force F_e [N], which the contact carries in stick."""
        return (APPLIED_FORCE,)

    def level_towards(self, direction: Scalar, N: Scalar, **inputs: Scalar) -> Scalar:
        """Return the static level [N] against a pull with the sign of `direction`."""
        return self.static_level(N, **inputs)

    def rate(
        self, v: Scalar, N: Scalar, z: Scalar = (), *, F_e: Scalar = 0.0, **inputs: Scalar
    ) -> Scalar:
        """Return zero [1/s], or (F_e -+ level) / (|F_e| + 1 N) in stick above the static level.

        The nonzero rate has no effect on the motion, since stick ends when |F_e| reaches the static
        level. Its purpose is error control: steps are long in stick, and without this rate a step
        could skip a short overload.
        """
        if not self.has_mode:
            return empty(v)
        static = self.level_towards(F_e, N, **inputs)
        beyond = F_e - smooth.clip(F_e, -static, static)
        share = beyond / (smooth.magnitude(F_e, 0.0) + APPLIED_FORCE.nominal)
        return column(smooth.choose(rests(z[0]), share, 0.0 * v))

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the direction of sliding."""
        return column(smooth.sign(v, 0.0)) if self.has_mode else empty(v)

    def switches(
        self, v: Scalar, N: Scalar, z: Scalar = (), *, F_e: Scalar = 0.0, **inputs: Scalar
    ) -> tuple[Switch, ...]:
        """Return two switches: to stick at v = 0, and to slip where |F_e| exceeds the static level.

        At v = 0, sliding continues in the other direction if the contact cannot hold `F_e`. If
        |F_e| exceeds the static level at the start of a run, stick ends immediately. While such a
        force pulls in the direction of sliding, v = 0 does not end the sliding.
        """
        if not self.has_mode:
            return ()
        mode = z[0]
        onward, still = smooth.choose(F_e < 0, -1.0, 1.0), rests(mode)
        excess = smooth.magnitude(F_e, 0.0) - self.level_towards(F_e, N, **inputs)
        after = smooth.choose(excess <= 0, 0.0, onward)
        pull = mode * F_e - self.level_towards(mode, N, **inputs)
        ahead = smooth.choose(mode * v > pull, mode * v, pull)
        stick, slip = smooth.choose(still, 1.0, ahead), smooth.choose(still, excess, -1.0)
        return (
            Switch("stick", stick, -1, {"mode": after}, halts=True),
            Switch("slip", slip, 1, {"mode": onward}, at_start=True, rtol=FINEST),
        )


@parametric
class Sticking(WithModes):
    """Law with modes whose static level is mu_s N; stick is a mode in form = "event"."""

    mu_s: Scalar = fields.MU_S(0.15)

    @property
    def has_mode(self) -> bool:
        """True if stick is a mode, as in form = "event"; False if it is a band of velocities."""
        return getattr(self, "form", "event") == "event"

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the break-away force mu_s N [N], which is the largest force in stick."""
        return self.mu_s * N


def rests(mode: Scalar) -> Scalar:
    """Return True if `mode` is stick; apart from the overload in `Sticking.rate` it is -1, 0, 1."""
    return smooth.magnitude(mode, 0.0) < 0.5


def carried(mode: Scalar, F_e: Scalar, slip: Scalar) -> Scalar:
    """Return the force [N] of the contact: `slip` while sliding, the applied force in stick.

    The force in stick is not limited to the static level. Therefore the equations stay smooth
    beyond the end of stick, as does the dense output on which this end is located.
    """
    return smooth.choose(rests(mode), F_e, slip)


@parametric
class Exact(WithModes):
    """Set-valued form of a law, with stick and slip as modes instead of smoothing (one state).

        F = sliding force of the law to the side of the mode   slip, until v passes through zero
        F = F_e                                                stick, up to the static level

    `Law.sliding` and `Law.static_level` are the limits of the law for zero widths. A law with
    states is replaced by its steady sliding, without presliding and lag. For the modes, F_e and the
    tolerance see `ExactCoulomb`, which is `Exact` of Coulomb friction with a static level.
    Limits: the smooth law for v far from its width. Each side of an asymmetric law has its own
    sliding force and static level. Requires a model with events.
    Source: Acary and Brogliato, Numerical Methods for Nonsmooth Dynamical Systems, 2008, 2.
    """

    facts = Facts(("D", "S"), "set-valued at v = 0, exact by modes", "constructed")

    law: Law

    def __post_init__(self) -> None:
        require_law("Exact", self.law)
        super().__post_init__()
        self.law.sliding(0.0, 1.0, 1)  # raises an error if it is not defined
        self.law.static_level(1.0)

    @property
    def inner(self) -> Law:
        """Law whose sliding force and static level are used."""
        return self.law

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Applied force F_e [N], and the further inputs of the law."""
        return *super().inputs, *(i for i in self.law.inputs if i.name != FORCE)

    @property
    def velocity_scale(self) -> Scalar:
        """First velocity scale of the law that is not a width [m/s]; inf without one."""
        known = parameters(self.law).values()
        scales = [p for p in known if p.role == "velocity scale" and not p.width]
        return scales[0].value if scales else inf

    @property
    def widths(self) -> dict[str, int]:
        """Empty, since widths of the law are not used."""
        return {}

    def sliding(self, v: Scalar, N: Scalar, side: int, **inputs: Scalar) -> Scalar:
        """Return the sliding force [N] of the law to one side."""
        return self.law.sliding(v, N, side, **chosen(self.law, inputs))

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the static level [N] of the law against a pull to one side."""
        return self.law.static_level(N, side, **chosen(self.law, inputs))

    def level_towards(self, direction: Scalar, N: Scalar, **inputs: Scalar) -> Scalar:
        """Return the static level [N] of the law on the side of `direction`."""
        back, ahead = (self.static_level(N, side, **inputs) for side in (-1, 1))
        return smooth.choose(direction < 0, back, ahead)

    def force(
        self, v: Scalar, N: Scalar, z: Scalar = (), *, F_e: Scalar = 0.0, **inputs: Scalar
    ) -> Scalar:
        """Return the friction force [N]."""
        back, ahead = (self.sliding(v, N, side, **inputs) for side in (-1, 1))
        return carried(z[0], F_e, smooth.choose(z[0] < 0, back, ahead))
