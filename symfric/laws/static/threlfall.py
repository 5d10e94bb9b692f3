"""Threlfall friction: an exponential rise to the dynamic level, and its modification."""

from dataclasses import dataclass
from math import exp
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, tanh
from symfric.foundation.parameters import option, param
from symfric.laws.base import smooth
from symfric.laws.base.law import Facts, StaticLaw

RISE = 1 - exp(-3.0)
"""What the rise 1 - exp(-3 |v|/v_r) has reached at v_r."""


def _rise(u: Scalar) -> Scalar:
    """(1 - exp(-3 |u|)) sign(u) with its slope 3 at zero."""
    return 3 * u * smooth.phi1(-3 * smooth.magnitude(u, 0.0))


@final
@dataclass(frozen=True, eq=False)
class Threlfall(StaticLaw):
    """Threlfall friction.

        original:  F = mu_d N (1 - exp(-3 |v|/v_r)) sign(v)   for |v| <= v_r
                   F = 0.95 mu_d N sign(v)                    beyond
        smooth:    F = mu_d N tanh(3 v / v_r)

    Both have the slope 3 mu_d N / v_r at rest.
    Limits: the original never reaches mu_d N, being 5 % short for ever, and jumps by
    -2.1e-4 mu_d N at v_r; the smooth form tends to mu_d N. Creeps under load.
    Source: Threlfall, Mech. Mach. Theory 13, 1978 (not read), as in public multibody code.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D",),
        smoothness="C∞ (original: jump at |v| = v_r, C1 at 0)",
        confidence="one source",
        checked="public Python code of a multibody simulation",
        source="Threlfall 1978, as in public multibody code",
    )

    mu_d: Scalar = param(0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=0.0)
    v_r: Scalar = param(
        1e-3,
        unit="m/s",
        role="velocity scale",
        width=1,
        doc="velocity of the transition",
        lower=1e-12,
    )
    form: str = option("smooth", choices=("smooth", "original"), doc="form of the rise")

    @property
    def velocity_scale(self) -> Scalar:
        """The velocity v_r / 3 [m/s]."""
        return self.v_r / 3

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish."""
        reached = 1.0 if self.form == "smooth" else 0.95
        return self.mu_d * N * reached

    def static_level(self, N: Scalar, side: int = 1) -> Scalar:
        """The largest force [N]: the original drops by 2e-4 mu_d N behind it."""
        return self.mu_d * N * (1.0 if self.form == "smooth" else RISE)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        u = v / self.v_r
        if self.form == "smooth":
            return self.mu_d * N * tanh(3 * u)
        within = smooth.magnitude(u, 0.0) <= 1
        return self.mu_d * N * smooth.choose(within, _rise(u), 0.95 * smooth.sign(v, 0.0))


@final
@dataclass(frozen=True, eq=False)
class ModifiedThrelfall(StaticLaw):
    """Threlfall friction modified by Marques et al., so that it reaches the dynamic level.

        original:  F = mu_d N (1 - exp(-3 |v|/v_r)) / (1 - exp(-3)) sign(v)   for |v| <= v_r
                   F = mu_d N sign(v)                                         beyond
        smooth:    F = mu_d N tanh(3 v / v_r)

    Limits: F(v_r) = mu_d N in the original, 0.995 mu_d N in the smooth form, which is that of
    `Threlfall`. The coefficient is an interpretation: with it the law is continuous; with 0.95
    instead of 1 - exp(-3) it would overshoot by 2.2e-4. Creeps under load.
    Source: Marques et al., Nonlinear Dynam. 86, 2016 (not read).
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D",),
        smoothness="C∞ (original: C0 at |v| = v_r, C1 at 0)",
        confidence="unverified",
        checked="the coefficient is an interpretation",
        source="Marques et al. 2016",
    )

    mu_d: Scalar = param(0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=0.0)
    v_r: Scalar = param(
        1e-3,
        unit="m/s",
        role="velocity scale",
        width=1,
        doc="velocity of the transition",
        lower=1e-12,
    )
    form: str = option("smooth", choices=("smooth", "original"), doc="form of the rise")

    @property
    def velocity_scale(self) -> Scalar:
        """The velocity v_r / 3 [m/s]."""
        return self.v_r / 3

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish."""
        return self.mu_d * N

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        u = v / self.v_r
        if self.form == "smooth":
            return self.mu_d * N * tanh(3 * u)
        return self.mu_d * N * (_rise(smooth.clip(u, -1.0, 1.0)) / RISE)
