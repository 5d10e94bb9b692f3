"""Stribeck friction: the general exponential law with exponent delta."""

from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, equals
from symfric.foundation.parameters import param
from symfric.laws.base import smooth
from symfric.laws.base.law import Facts, StaticLaw


@final
@dataclass(frozen=True, eq=False)
class Stribeck(StaticLaw):
    """Stribeck friction with exponent delta (Bo-Pavelescu), smooth at rest.

        F = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)] tanh(v / v_eps) + sigma_2 v

    delta = 1 is Tustin's law, delta = 2 the Gaussian one. For other delta |v| is rounded over
    1e-4 v_eps, which changes F by less than 1e-4 (mu_s - mu_d) N. Keep v_eps << v_s: for delta = 2
    the peak is 0.968 mu_s N at v_eps = v_s/10 and tends to mu_s N as v_eps -> 0; the float
    v_eps = 0 is the original with sign(v), 0 at rest.
    Limits: mu_s = mu_d gives `Coulomb` + `Viscous`; at |v| = v_s the bracket is
    mu_d + (mu_s - mu_d)/e for every delta. Creeps under load like `Coulomb`.
    Source: Stribeck 1902; Hess and Soom 1990; Bo and Pavelescu, Wear 82, 1982 (exponent).
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "V"),
        smoothness="C∞",
        confidence="two sources",
        checked="jchristopherson/friction (delta = 2); the Lund thesis on laminator nips (delta)",
        source="Stribeck 1902; Bo and Pavelescu 1982 (exponent)",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_d", "mu_s"),)

    mu_s: Scalar = param(0.15, unit="1", role="level", doc="static friction coefficient", lower=0.0)
    mu_d: Scalar = param(0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=0.0)
    v_s: Scalar = param(
        1e-3, unit="m/s", role="velocity scale", doc="Stribeck velocity", lower=1e-12
    )
    delta: Scalar = param(
        2.0, unit="1", role="shape", doc="Stribeck exponent", lower=0.1, upper=10.0
    )
    v_eps: Scalar = param(
        1e-4, unit="m/s", role="width", width=1, doc="smoothing velocity", lower=0.0
    )
    sigma_2: Scalar = param(0.0, unit="N s/m", role="viscous", doc="viscous coefficient", lower=0.0)

    @property
    def velocity_scale(self) -> Scalar:
        """The smoothing velocity [m/s], or the Stribeck velocity without smoothing."""
        return self.v_s if equals(self.v_eps, 0.0) else self.v_eps

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish."""
        mu = self.mu_d + (self.mu_s - self.mu_d) * smooth.fall(speed, self.v_s, self.delta)
        return mu * N + self.sigma_2 * speed

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        falling = smooth.stribeck(v, self.v_s, self.delta, smooth.CORNER * self.v_eps)
        mu = self.mu_d + (self.mu_s - self.mu_d) * falling
        return mu * N * smooth.sign(v, self.v_eps) + self.sigma_2 * v
