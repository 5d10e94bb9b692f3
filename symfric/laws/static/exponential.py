"""Laws whose friction falls exponentially from the static to the dynamic level."""

from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, equals, tanh
from symfric.foundation.parameters import param
from symfric.laws.base import smooth
from symfric.laws.base.law import Facts, StaticLaw


@final
@dataclass(frozen=True, eq=False)
class Tustin(StaticLaw):
    """Tustin friction: Coulomb, viscous and an exponential fall.

        F = N [mu_d + (mu_s - mu_d) exp(-|v|/v_s)] sign(v) + sigma_2 v

    sign(v) is smooth over v_eps, |v| over 1e-4 v_eps; the float v_eps = 0 is the original.
    Limits: `Stribeck` with delta = 1; mu_s = mu_d gives Coulomb + viscous, which some papers call
    Tustin's law. Keep v_eps << v_s, as there. Creeps under load.
    Source: Tustin, J. IEE 94, 1947, in the form of Armstrong-Helouvry 1994 (neither was read).
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "V"),
        smoothness="C∞",
        confidence="one source",
        checked="MassWithStopAndFriction of the Modelica Standard Library; not the name",
        source="Tustin 1947, as cited in control literature",
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
        mu = self.mu_d + (self.mu_s - self.mu_d) * smooth.fall(speed, self.v_s, 1.0)
        return mu * N + self.sigma_2 * speed

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        falling = smooth.stribeck(v, self.v_s, 1.0, smooth.CORNER * self.v_eps)
        mu = self.mu_d + (self.mu_s - self.mu_d) * falling
        return mu * N * smooth.sign(v, self.v_eps) + self.sigma_2 * v


@final
@dataclass(frozen=True, eq=False)
class Benson(StaticLaw):
    """Benson-Hallquist exponential friction of finite-element codes.

        F = N [mu_d + (mu_s - mu_d) exp(-d_c |v|)] sign(v)

    sign(v) is smooth over v_eps, |v| over 1e-4 v_eps; the float v_eps = 0 is the original.
    Limits: `Tustin` with v_s = 1/d_c and without viscous friction. Creeps under load.
    Source: Benson and Hallquist 1990 (not read), as documented in LS-DYNA (FS, FD, DC) and COMSOL.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St"),
        smoothness="C∞",
        confidence="two sources",
        checked="documentation of LS-DYNA and of COMSOL",
        source="Benson and Hallquist 1990, as in LS-DYNA and COMSOL",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_d", "mu_s"),)

    mu_s: Scalar = param(0.15, unit="1", role="level", doc="static friction coefficient", lower=0.0)
    mu_d: Scalar = param(0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=0.0)
    d_c: Scalar = param(
        1e3, unit="s/m", role="velocity scale", doc="decay coefficient", lower=1e-12
    )
    v_eps: Scalar = param(
        1e-4, unit="m/s", role="width", width=1, doc="smoothing velocity", lower=0.0
    )

    @property
    def velocity_scale(self) -> Scalar:
        """The smoothing velocity [m/s], or 1/d_c without smoothing."""
        return 1 / self.d_c if equals(self.v_eps, 0.0) else self.v_eps

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish."""
        falling = smooth.fall(speed, 1 / self.d_c, 1.0)
        return (self.mu_d + (self.mu_s - self.mu_d) * falling) * N

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        falling = smooth.stribeck(v, 1 / self.d_c, 1.0, smooth.CORNER * self.v_eps)
        mu = self.mu_d + (self.mu_s - self.mu_d) * falling
        return mu * N * smooth.sign(v, self.v_eps)


@final
@dataclass(frozen=True, eq=False)
class Berger(StaticLaw):
    """Berger friction, an interpretation: the exponential fall of his review, with a smooth sign.

        F = N [mu_d + (mu_s - mu_d) exp(-|v|/v_s)] tanh(v / v_t)

    |v| is smooth over 1e-4 v_t. Berger's paper is a review that lists mu(v) laws and proposes no
    single one; this is the choice here for papers that compare "Berger's model".
    Limits: `Tustin` with v_eps = v_t, without viscous friction. Creeps under load.
    Source: interpretation of Berger, Appl. Mech. Rev. 55(6), 2002 (not read).
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St"),
        smoothness="C∞",
        confidence="rebuilt",
        checked="an interpretation of a review that proposes no law",
        source="after Berger 2002",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_d", "mu_s"),)

    mu_s: Scalar = param(0.15, unit="1", role="level", doc="static friction coefficient", lower=0.0)
    mu_d: Scalar = param(0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=0.0)
    v_s: Scalar = param(
        1e-3, unit="m/s", role="velocity scale", doc="Stribeck velocity", lower=1e-12
    )
    v_t: Scalar = param(
        1e-4, unit="m/s", role="velocity scale", width=1, doc="transition velocity", lower=1e-12
    )

    @property
    def velocity_scale(self) -> Scalar:
        """The transition velocity [m/s]."""
        return self.v_t

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish."""
        mu = self.mu_d + (self.mu_s - self.mu_d) * smooth.fall(speed, self.v_s, 1.0)
        return mu * N

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        falling = smooth.stribeck(v, self.v_s, 1.0, smooth.CORNER * self.v_t)
        return (self.mu_d + (self.mu_s - self.mu_d) * falling) * N * tanh(v / self.v_t)


@final
@dataclass(frozen=True, eq=False)
class DuanSingh(StaticLaw):
    """Duan-Singh friction: conditioned dry friction with a static to kinetic ratio.

        F = mu_d N [1 + (mu_s/mu_d - 1) exp(-c |v|)] tanh(sigma v)

    |v| is smooth over 1e-4/sigma.
    Limits: mu_s = mu_d gives mu_d N tanh(sigma v); F -> mu_d N; `Andersson` with p = 1, k_t = sigma
    and v_s = 1/c. Creeps under load.
    Source: Duan and Singh 2006 (not read).
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S"),
        smoothness="C∞",
        confidence="unverified",
        checked="the expression is that of Andersson with p = 1",
        source="Duan and Singh 2006",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_d", "mu_s"),)

    mu_s: Scalar = param(0.15, unit="1", role="level", doc="static friction coefficient", lower=0.0)
    mu_d: Scalar = param(0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=0.0)
    c: Scalar = param(1e3, unit="s/m", role="velocity scale", doc="decay coefficient", lower=1e-12)
    sigma: Scalar = param(
        1e4, unit="s/m", role="velocity scale", width=-1, doc="conditioning factor", lower=1e-12
    )

    @property
    def velocity_scale(self) -> Scalar:
        """The velocity 1/sigma [m/s]."""
        return 1 / self.sigma

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish."""
        falling = smooth.fall(speed, 1 / self.c, 1.0)
        return (self.mu_d + (self.mu_s - self.mu_d) * falling) * N

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        falling = smooth.stribeck(v, 1 / self.c, 1.0, smooth.CORNER / self.sigma)
        return (self.mu_d + (self.mu_s - self.mu_d) * falling) * N * tanh(self.sigma * v)


@final
@dataclass(frozen=True, eq=False)
class Andersson(StaticLaw):
    """Andersson-Soderberg-Bjorklund friction.

        F = N [mu_d + (mu_s - mu_d) exp(-(|v|/v_s)^p)] tanh(k_t v) + sigma_2 v

    |v|^p is smooth over 1e-4/k_t; p = 2 is exact.
    Limits: `Stribeck` with v_eps = 1/k_t, and its original form as k_t -> inf. The peak is 0.968
    mu_s N at k_t v_s = 10, p = 2. Creeps under load.
    Source: Andersson, Soderberg, Bjorklund, Tribol. Int. 40, 2007 (not read), as in public code.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "V"),
        smoothness="C∞",
        confidence="one source",
        checked="public MATLAB function Friction_A",
        source="Andersson, Soderberg, Bjorklund 2007, as in public code",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_d", "mu_s"),)

    mu_s: Scalar = param(0.15, unit="1", role="level", doc="static friction coefficient", lower=0.0)
    mu_d: Scalar = param(0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=0.0)
    v_s: Scalar = param(
        1e-3, unit="m/s", role="velocity scale", doc="Stribeck velocity", lower=1e-12
    )
    p: Scalar = param(2.0, unit="1", role="shape", doc="exponent", lower=0.1, upper=10.0)
    k_t: Scalar = param(
        1e4, unit="s/m", role="velocity scale", width=-1, doc="steepness at rest", lower=1e-12
    )
    sigma_2: Scalar = param(0.0, unit="N s/m", role="viscous", doc="viscous coefficient", lower=0.0)

    @property
    def velocity_scale(self) -> Scalar:
        """The velocity 1/k_t [m/s]."""
        return 1 / self.k_t

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish."""
        mu = self.mu_d + (self.mu_s - self.mu_d) * smooth.fall(speed, self.v_s, self.p)
        return mu * N + self.sigma_2 * speed

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        falling = smooth.stribeck(v, self.v_s, self.p, smooth.CORNER / self.k_t)
        mu = self.mu_d + (self.mu_s - self.mu_d) * falling
        return mu * N * tanh(self.k_t * v) + self.sigma_2 * v


@final
@dataclass(frozen=True, eq=False)
class SteadyStateLuGre(StaticLaw):
    """Steady-state LuGre friction with exponent delta, in newton.

        F = [F_C + (F_S - F_C) exp(-|v/v_s|^delta)] sign(v) + sigma_2 v

    sign(v) is smooth over v_eps, |v| over 1e-4 v_eps; the float v_eps = 0 is the original. The
    levels are forces, since the normal force of the published sets is not reported. The sets
    `pilot` and `main` hold from 140 to 500 mm/min only: at 1 m/s the viscous term of `pilot` alone
    is 230 N.
    Limits: `LuGre` in steady sliding; `Stribeck` with N mu = F.
    Source: A Friction Model for Laminator Nips, MSc thesis, Lund 2015, equation 4.1, tables 5.1
    and 5.2.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "V"),
        smoothness="C∞",
        confidence="two sources",
        checked="the thesis, equation 4.1; auralius/LuGre lugre.m (delta = 2)",
        source="A Friction Model for Laminator Nips, MSc thesis, Lund 2015; LuGre",
        load="independent",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("F_C", "F_S"),)

    F_S: Scalar = param(4.4861, unit="N", role="level", doc="static level", lower=0.0)
    F_C: Scalar = param(2.5498, unit="N", role="level", doc="dynamic level", lower=0.0)
    v_s: Scalar = param(
        1.2e-3, unit="m/s", role="velocity scale", doc="Stribeck velocity", lower=1e-12
    )
    sigma_2: Scalar = param(
        230.0, unit="N s/m", role="viscous", doc="viscous coefficient", lower=0.0
    )
    delta: Scalar = param(
        2.0, unit="1", role="shape", doc="Stribeck exponent", lower=0.1, upper=10.0
    )
    v_eps: Scalar = param(
        1e-5, unit="m/s", role="width", width=1, doc="smoothing velocity", lower=0.0
    )

    @property
    def velocity_scale(self) -> Scalar:
        """The smoothing velocity [m/s], or the Stribeck velocity without smoothing."""
        return self.v_s if equals(self.v_eps, 0.0) else self.v_eps

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish."""
        falling = smooth.fall(speed, self.v_s, self.delta)
        return self.F_C + (self.F_S - self.F_C) * falling + self.sigma_2 * speed

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        falling = smooth.stribeck(v, self.v_s, self.delta, smooth.CORNER * self.v_eps)
        level = self.F_C + (self.F_S - self.F_C) * falling
        return level * smooth.sign(v, self.v_eps) + self.sigma_2 * v

    @classmethod
    def pilot(cls) -> "SteadyStateLuGre":
        """The set of the pilot plant, table 5.1; it is the default."""
        return cls()

    @classmethod
    def main(cls) -> "SteadyStateLuGre":
        """The set of the main plant, table 5.2."""
        return cls(F_S=4.2672, F_C=2.6063, v_s=4.9e-3, sigma_2=5.0, delta=3.2)
