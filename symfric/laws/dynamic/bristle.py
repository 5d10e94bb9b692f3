"""What the bristle laws with a Stribeck curve share: parameters, level and steady state."""

from dataclasses import dataclass
from typing import ClassVar

from symfric.foundation.numeric import Scalar, column, is_number
from symfric.foundation.parameters import param
from symfric.laws.base import smooth
from symfric.laws.base.law import Law, State
from symfric.laws.dynamic.element import deflection


@dataclass(frozen=True, eq=False)
class Bristle(Law):
    """A bristle of stiffness sigma_0 and damping sigma_1 that slides at a Stribeck level.

        g = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)]
        F = sigma_0 z + sigma_1 dz/dt + sigma_2 v

    The laws differ in dz/dt and, some, in the damping.
    """

    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_d", "mu_s"),)

    mu_s: Scalar = param(0.15, unit="1", role="level", doc="static friction coefficient", lower=0.0)
    mu_d: Scalar = param(
        0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=1e-12
    )
    v_s: Scalar = param(
        1e-3, unit="m/s", role="velocity scale", doc="Stribeck velocity", lower=1e-12
    )
    delta: Scalar = param(
        2.0, unit="1", role="shape", doc="Stribeck exponent", lower=0.1, upper=10.0
    )
    sigma_0: Scalar = param(1e5, unit="N/m", role="stiffness", doc="bristle stiffness", lower=1e-12)
    sigma_1: Scalar = param(190.0, unit="N s/m", role="damping", doc="bristle damping", lower=0.0)
    sigma_2: Scalar = param(0.0, unit="N s/m", role="viscous", doc="viscous coefficient", lower=0.0)
    v_eps: Scalar = param(
        1e-15, unit="m/s", role="width", doc="smoothing velocity of |v|", lower=0.0
    )

    @property
    def states(self) -> tuple[State, ...]:
        """z: mean deflection of the bristles [m], positive with v."""
        return (State("z", "m", deflection(self.sigma_0), doc="mean bristle deflection"),)

    @property
    def velocity_scale(self) -> Scalar:
        """The Stribeck velocity [m/s]."""
        return self.v_s

    def level(self, v: Scalar, N: Scalar) -> Scalar:
        """The Stribeck curve g(v, N) > 0 [N] that the bristle force tends to."""
        falling = smooth.stribeck(v, self.v_s, self.delta, self.v_eps)
        return N * (self.mu_d + (self.mu_s - self.mu_d) * falling)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Steady sliding force [N] at a speed >= 0."""
        mu = self.mu_d + (self.mu_s - self.mu_d) * smooth.fall(speed, self.v_s, self.delta)
        return mu * N + self.sigma_2 * speed

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        return self.sigma_0 * z[0] + self.sigma_1 * self.rate(v, N, z)[0] + self.sigma_2 * v

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Bristle deflection in steady sliding [m], shape (1, 1)."""
        return column(self.level(v, N) / self.sigma_0 * smooth.sign(v, self.v_eps))

    def warnings(self) -> tuple[str, ...]:
        """Whether the law may push: its passivity needs viscous friction."""
        needed = (self.mu_s - self.mu_d) / self.mu_d * self.sigma_1
        if not is_number(needed) or not is_number(self.sigma_2) or self.sigma_2 >= needed:
            return ()
        return (
            f"not passive from v to F: sigma_2 = {self.sigma_2:g} is below "
            f"sigma_1 (mu_s - mu_d) / mu_d = {needed:g}; the force may point forward for an "
            "instant after a jump in v (lugre_passive does not)",
        )
