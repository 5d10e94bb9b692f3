"""Smooth laws whose static peak is met by construction."""

from dataclasses import dataclass
from math import e, sqrt
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, exp, tanh
from symfric.foundation.parameters import param
from symfric.laws.base.law import Facts, StaticLaw


@final
@dataclass(frozen=True, eq=False)
class SimscapeBreakaway(StaticLaw):
    """Breakaway friction of Simscape's translational and rotational friction blocks.

        u = v / (sqrt(2) v_brk)
        F = N {sqrt(2e) (mu_s - mu_d) u exp(-u^2) + mu_d tanh(10 v / v_brk)} + sigma_2 v

    Limits: F(v_brk) = mu_s N to 4e-9 (without sigma_2), the peak for small mu_d; at 10 v_brk the
    excess over mu_d N is below 1e-20. Slope at rest N [1.65 (mu_s - mu_d) + 10 mu_d] / v_brk.
    Creeps under load.
    Source: documentation of Simscape, four pages.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "V"),
        smoothness="C∞",
        confidence="two sources",
        checked="documentation of Simscape, four pages",
        source="documentation of Simscape",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_d", "mu_s"),)

    mu_s: Scalar = param(0.15, unit="1", role="level", doc="static friction coefficient", lower=0.0)
    mu_d: Scalar = param(0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=0.0)
    v_brk: Scalar = param(
        1e-3, unit="m/s", role="velocity scale", width=1, doc="breakaway velocity", lower=1e-12
    )
    sigma_2: Scalar = param(0.0, unit="N s/m", role="viscous", doc="viscous coefficient", lower=0.0)

    @property
    def velocity_scale(self) -> Scalar:
        """A tenth of the breakaway velocity [m/s]."""
        return self.v_brk / 10

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish."""
        return self.mu_d * N + self.sigma_2 * speed

    def static_level(self, N: Scalar, side: int = 1) -> Scalar:
        """The force [N] of break-away, mu_s N."""
        return self.mu_s * N

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        u = v / (sqrt(2) * self.v_brk)
        peak = (sqrt(2 * e) * (self.mu_s - self.mu_d)) * u * exp(-u * u)
        return N * (peak + self.mu_d * tanh(10 * v / self.v_brk)) + self.sigma_2 * v


@final
@dataclass(frozen=True, eq=False)
class Specker(StaticLaw):
    """Specker-Buchholz-Dietmayer friction.

        F_p = N [mu_s - mu_d tanh(v_sp / v_t)] - sigma_2 v_sp
        F   = F_p (v/v_sp) exp(1/2 - (v/v_sp)^2 / 2) + mu_d N tanh(v / v_t) + sigma_2 v

    Limits: F(v_sp) = mu_s N exactly; with v_t = v_sp/10 it is `SimscapeBreakaway` to 4e-9. With
    sigma_2 v_sp above the static excess the peak turns into a dip. Creeps under load.
    Source: Specker, Buchholz, Dietmayer 2014 (not read; the correction by sigma_2 is uncertain).
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "V"),
        smoothness="C∞",
        confidence="unverified",
        checked="v_t = v_sp/10 is SimscapeBreakaway; the part of sigma_2 is uncertain",
        source="Specker, Buchholz, Dietmayer 2014",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_d", "mu_s"),)
    strictly_ordered: ClassVar[tuple[tuple[str, str], ...]] = (("v_t", "v_sp"),)

    mu_s: Scalar = param(0.15, unit="1", role="level", doc="static friction coefficient", lower=0.0)
    mu_d: Scalar = param(0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=0.0)
    v_sp: Scalar = param(
        1e-3, unit="m/s", role="velocity scale", width=1, doc="velocity of the peak", lower=1e-12
    )
    v_t: Scalar = param(
        1e-4, unit="m/s", role="velocity scale", width=1, doc="transition velocity", lower=1e-12
    )
    sigma_2: Scalar = param(0.0, unit="N s/m", role="viscous", doc="viscous coefficient", lower=0.0)

    @property
    def velocity_scale(self) -> Scalar:
        """The transition velocity [m/s]."""
        return self.v_t

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish."""
        return self.mu_d * N + self.sigma_2 * speed

    def static_level(self, N: Scalar, side: int = 1) -> Scalar:
        """The force [N] of break-away, mu_s N."""
        return self.mu_s * N

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        u = v / self.v_sp
        peak = N * (self.mu_s - self.mu_d * tanh(self.v_sp / self.v_t)) - self.sigma_2 * self.v_sp
        dry = peak * u * exp((1 - u * u) / 2) + self.mu_d * N * tanh(v / self.v_t)
        return dry + self.sigma_2 * v


@final
@dataclass(frozen=True, eq=False)
class MakkarDixon(StaticLaw):
    """Makkar-Dixon-Sawyer-Hu friction: differences of hyperbolic tangents, in newton.

        F = gamma_1 [tanh(gamma_2 v) - tanh(gamma_3 v)] + gamma_4 tanh(gamma_5 v) + gamma_6 v

    gamma_1 + gamma_4 is about the static level, gamma_4 the dynamic one.
    Limits: F -> gamma_4 + gamma_6 v. The peak stays below gamma_1 + gamma_4, at 0.905 of it with
    the default steepnesses. gamma_2 > gamma_3 makes it dissipative and the parameters unique.
    Creeps under load.
    Source: Makkar, Dixon, Sawyer, Hu 2005 (not read), as in public code.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "V"),
        smoothness="C∞",
        confidence="one source",
        checked="public code, in which a parenthesis is misplaced",
        source="Makkar, Dixon, Sawyer, Hu 2005, as in public code",
        load="independent",
    )
    strictly_ordered: ClassVar[tuple[tuple[str, str], ...]] = (("gamma_3", "gamma_2"),)

    gamma_1: Scalar = param(0.5, unit="N", role="level", doc="static excess", lower=0.0)
    gamma_2: Scalar = param(
        1e4, unit="s/m", role="velocity scale", width=-1, doc="steepness of the rise", lower=1e-12
    )
    gamma_3: Scalar = param(
        1e3, unit="s/m", role="velocity scale", doc="steepness of the fall", lower=1e-12
    )
    gamma_4: Scalar = param(1.0, unit="N", role="level", doc="dynamic level", lower=0.0)
    gamma_5: Scalar = param(
        1e4,
        unit="s/m",
        role="velocity scale",
        width=-1,
        doc="steepness of the dynamic part",
        lower=1e-12,
    )
    gamma_6: Scalar = param(0.0, unit="N s/m", role="viscous", doc="viscous coefficient", lower=0.0)

    @property
    def velocity_scale(self) -> Scalar:
        """The velocity 1/gamma_2 [m/s]."""
        return 1 / self.gamma_2

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish."""
        falling = 1 - tanh(self.gamma_3 * speed)
        return self.gamma_1 * falling + self.gamma_4 + self.gamma_6 * speed

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        bump = self.gamma_1 * (tanh(self.gamma_2 * v) - tanh(self.gamma_3 * v))
        return bump + self.gamma_4 * tanh(self.gamma_5 * v) + self.gamma_6 * v
