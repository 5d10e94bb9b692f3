"""Laws whose friction falls like a rational function of the velocity."""

from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, equals
from symfric.foundation.parameters import param
from symfric.laws.base import smooth
from symfric.laws.base.law import Facts, StaticLaw


@final
@dataclass(frozen=True, eq=False)
class Lorentzian(StaticLaw):
    """Lorentzian friction of Hess and Soom.

        F = N [mu_d + (mu_s - mu_d) / (1 + (v/v_s)^2)] sign(v) + sigma_2 v

    sign(v) is smooth over v_eps; the float v_eps = 0 is the original.
    Limits: halfway between the levels at v = v_s; the excess over mu_d N falls like (v_s/v)^2.
    Creeps under load.
    Source: Hess and Soom, ASME J. Tribol. 112, 1990, as cited by Armstrong-Helouvry (not read).
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "V"),
        smoothness="C∞",
        confidence="one source",
        checked="g(v) of jchristopherson/friction README with alpha = 2; not the name",
        source="Hess and Soom 1990",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_d", "mu_s"),)

    mu_s: Scalar = param(0.15, unit="1", role="level", doc="static friction coefficient", lower=0.0)
    mu_d: Scalar = param(0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=0.0)
    v_s: Scalar = param(
        1e-3, unit="m/s", role="velocity scale", doc="Stribeck velocity", lower=1e-12
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
        u = speed / self.v_s
        mu = self.mu_d + (self.mu_s - self.mu_d) / (1 + u * u)
        return mu * N + self.sigma_2 * speed

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        u = v / self.v_s
        mu = self.mu_d + (self.mu_s - self.mu_d) / (1 + u * u)
        return mu * N * smooth.sign(v, self.v_eps) + self.sigma_2 * v


@final
@dataclass(frozen=True, eq=False)
class PoppStelter(StaticLaw):
    """Popp-Stelter friction: a hyperbolic fall and a quadratic rise.

        F = N {mu_s [(1 - eta) / (1 + d |v|) + eta] + kappa v^2} sign(v)

    sign(v) is smooth over v_eps, |v| over 1e-4 v_eps; the float v_eps = 0 is the original.
    Limits: eta mu_s N is the level that the fall tends to. The braces are the coefficient mu(v),
    so that the quadratic rise is proportional to the load, too. Creeps under load.
    Source: Popp and Stelter, Phil. Trans. R. Soc. A 332, 1990 (not read).
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "V"),
        smoothness="C∞",
        confidence="unverified",
        source="Popp and Stelter 1990",
    )

    mu_s: Scalar = param(0.15, unit="1", role="level", doc="static friction coefficient", lower=0.0)
    eta: Scalar = param(0.5, unit="1", role="shape", doc="share that remains", lower=0.0, upper=1.0)
    d: Scalar = param(
        1e3, unit="s/m", role="velocity scale", doc="steepness of the fall", lower=1e-12
    )
    kappa: Scalar = param(
        0.0, unit="s^2/m^2", role="viscous", doc="quadratic coefficient", lower=0.0
    )
    v_eps: Scalar = param(
        1e-4, unit="m/s", role="width", width=1, doc="smoothing velocity", lower=0.0
    )

    @property
    def velocity_scale(self) -> Scalar:
        """The smoothing velocity [m/s], or 1/d without smoothing."""
        return 1 / self.d if equals(self.v_eps, 0.0) else self.v_eps

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish."""
        fall = (1 - self.eta) / (1 + smooth.onward(self.d * speed)) + self.eta
        mu = self.mu_s * fall
        return N * (mu if equals(self.kappa, 0.0) else mu + self.kappa * speed * speed)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        fall = (1 - self.eta) / (
            1 + self.d * smooth.magnitude(v, smooth.CORNER * self.v_eps)
        ) + self.eta
        mu = self.mu_s * fall
        if not equals(self.kappa, 0.0):
            mu += self.kappa * v * v
        return mu * N * smooth.sign(v, self.v_eps)
