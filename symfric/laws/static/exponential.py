"""Laws whose friction falls exponentially from the static to the dynamic level."""

from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import parametric
from symfric.laws.base import fields
from symfric.laws.base.families import CurveLaw, Fall, Levels
from symfric.laws.base.law import Facts


@parametric
class Stribeck(Levels, CurveLaw):
    """Stribeck friction with exponent delta (Bo-Pavelescu), smooth at rest.

        F = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)] tanh(v / v_eps) + sigma_2 v

    delta = 1 is Tustin's law, delta = 2 the Gaussian form. For other delta |v| is rounded over
    1e-4 v_eps, which changes F by less than 1e-4 (mu_s - mu_d) N. Keep v_eps << v_s: for delta = 2
    the peak is 0.968 mu_s N at v_eps = v_s/10 and tends to mu_s N as v_eps -> 0. The float
    v_eps = 0 is the original with sign(v), 0 at rest.
    Limits: mu_s = mu_d gives `Coulomb` + `Viscous`; at |v| = v_s the bracket is
    mu_d + (mu_s - mu_d)/e for every delta. Creeps under load like `Coulomb`.
    Source: Stribeck 1902; Hess and Soom 1990; Bo and Pavelescu, Wear 82, 1982 (exponent).
    Checked: jchristopherson/friction (delta = 2); the Lund thesis on laminator nips (delta).
    """

    facts = Facts(("D", "S", "St", "V"), "C∞", "two sources")

    v_s: Scalar = fields.V_S(1e-3)
    delta: Scalar = fields.DELTA(2.0)
    v_eps: Scalar = fields.V_EPS(1e-4)
    sigma_2: Scalar = fields.SIGMA_2(0.0)

    def formula(self, v: Scalar, N: Scalar, s: Scalar, fall: Fall) -> Scalar:
        """Return the friction force [N] in the direction `s`."""
        return self.coefficient(fall(v, self.v_s, self.delta)) * N * s + self.sigma_2 * v


@parametric
class Tustin(Levels, CurveLaw):
    """Tustin friction: Coulomb and viscous friction with an exponential fall.

        F = N [mu_d + (mu_s - mu_d) exp(-|v|/v_s)] sign(v) + sigma_2 v

    sign(v) is smooth over v_eps, |v| over 1e-4 v_eps; the float v_eps = 0 is the original.
    Limits: `Stribeck` with delta = 1; mu_s = mu_d gives Coulomb + viscous, which some papers call
    Tustin's law. Keep v_eps << v_s. Creeps under load.
    Source: Tustin, J. IEE 94, 1947, in the form of Armstrong-Helouvry 1994 (neither was read).
    Checked: MassWithStopAndFriction of the Modelica Standard Library, for the formula only.
    """

    facts = Facts(("D", "S", "St", "V"), "C∞", "one source")

    v_s: Scalar = fields.V_S(1e-3)
    v_eps: Scalar = fields.V_EPS(1e-4)
    sigma_2: Scalar = fields.SIGMA_2(0.0)

    def formula(self, v: Scalar, N: Scalar, s: Scalar, fall: Fall) -> Scalar:
        """Return the friction force [N] in the direction `s`."""
        return self.coefficient(fall(v, self.v_s, 1.0)) * N * s + self.sigma_2 * v


@parametric
class Benson(Levels, CurveLaw):
    """Benson-Hallquist exponential friction of finite-element codes.

        F = N [mu_d + (mu_s - mu_d) exp(-d_c |v|)] sign(v)

    sign(v) is smooth over v_eps, |v| over 1e-4 v_eps; the float v_eps = 0 is the original.
    Limits: `Tustin` with v_s = 1/d_c and without viscous friction. Creeps under load.
    Source: Benson and Hallquist 1990 (not read), as documented in LS-DYNA (FS, FD, DC) and COMSOL.
    Checked: documentation of LS-DYNA and of COMSOL.
    """

    facts = Facts(("D", "S", "St"), "C∞", "two sources")

    d_c: Scalar = fields.STEEPNESS(1e3, doc="decay coefficient")
    v_eps: Scalar = fields.V_EPS(1e-4)

    def formula(self, v: Scalar, N: Scalar, s: Scalar, fall: Fall) -> Scalar:
        """Return the friction force [N] in the direction `s`."""
        return self.coefficient(fall(v, 1 / self.d_c, 1.0)) * N * s


@parametric
class Berger(Levels, CurveLaw):
    """Berger friction, an interpretation: an exponential fall with a smooth sign.

        F = N [mu_d + (mu_s - mu_d) exp(-|v|/v_s)] tanh(v / v_t)

    |v| is smooth over 1e-4 v_t. Berger's paper is a review that lists laws mu(v) and proposes none.
    This law is intended for papers that compare "Berger's model".
    Limits: `Tustin` with v_eps = v_t, without viscous friction. Creeps under load.
    Source: interpretation of Berger, Appl. Mech. Rev. 55(6), 2002 (not read).
    Checked: an interpretation of a review that proposes no law.
    """

    facts = Facts(("D", "S", "St"), "C∞", "rebuilt")

    v_s: Scalar = fields.V_S(1e-3)
    v_t: Scalar = fields.V_T(1e-4)

    def formula(self, v: Scalar, N: Scalar, s: Scalar, fall: Fall) -> Scalar:
        """Return the friction force [N] in the direction `s`."""
        return self.coefficient(fall(v, self.v_s, 1.0)) * N * s


@parametric
class DuanSingh(Levels, CurveLaw):
    """Duan-Singh friction: smoothed dry friction with a ratio of static to kinetic friction.

        F = mu_d N [1 + (mu_s/mu_d - 1) exp(-c |v|)] tanh(sigma v)

    |v| is smooth over 1e-4/sigma.
    Limits: mu_s = mu_d gives mu_d N tanh(sigma v); F -> mu_d N; `Andersson` with p = 1, k_t = sigma
    and v_s = 1/c. Creeps under load.
    Source: Duan and Singh 2006 (not read).
    Checked: the expression is that of Andersson with p = 1.
    """

    facts = Facts(("D", "S"), "C∞", "unverified")

    c: Scalar = fields.STEEPNESS(1e3, doc="decay coefficient")
    sigma: Scalar = fields.STEEPNESS(1e4, width=-1, doc="conditioning factor")

    def formula(self, v: Scalar, N: Scalar, s: Scalar, fall: Fall) -> Scalar:
        """Return the friction force [N] in the direction `s`."""
        return self.coefficient(fall(v, 1 / self.c, 1.0)) * N * s


@parametric
class Andersson(Levels, CurveLaw):
    """Andersson-Soderberg-Bjorklund friction.

        F = N [mu_d + (mu_s - mu_d) exp(-(|v|/v_s)^p)] tanh(k_t v) + sigma_2 v

    |v|^p is smooth over 1e-4/k_t; p = 2 is exact.
    Limits: `Stribeck` with v_eps = 1/k_t, and its original form as k_t -> inf. The peak is 0.968
    mu_s N at k_t v_s = 10, p = 2. Creeps under load.
    Source: Andersson, Soderberg, Bjorklund, Tribol. Int. 40, 2007 (not read), as in public code.
    Checked: public MATLAB function Friction_A.
    """

    facts = Facts(("D", "S", "St", "V"), "C∞", "one source")

    v_s: Scalar = fields.V_S(1e-3)
    p: Scalar = fields.SHAPE(2.0, doc="exponent", lower=0.1, upper=10.0)
    k_t: Scalar = fields.STEEPNESS(1e4, width=-1, doc="steepness at rest")
    sigma_2: Scalar = fields.SIGMA_2(0.0)

    def formula(self, v: Scalar, N: Scalar, s: Scalar, fall: Fall) -> Scalar:
        """Return the friction force [N] in the direction `s`."""
        return self.coefficient(fall(v, self.v_s, self.p)) * N * s + self.sigma_2 * v


@parametric
class SteadyStateLuGre(CurveLaw):
    """Steady-state LuGre friction with exponent delta, in newton.

        F = [F_C + (F_S - F_C) exp(-|v/v_s|^delta)] sign(v) + sigma_2 v

    sign(v) is smooth over v_eps, |v| over 1e-4 v_eps; the float v_eps = 0 is the original. The
    levels are forces, since the thesis does not report the normal force. The parameter sets `pilot`
    and `main` are valid from 140 to 500 mm/min only: at 1 m/s the viscous term of `pilot` alone is
    230 N.
    Limits: `LuGre` in steady sliding; `Stribeck` with N mu = F.
    Source: A Friction Model for Laminator Nips, MSc thesis, Lund 2015, equation 4.1, tables 5.1
    and 5.2.
    Checked: the thesis, equation 4.1; auralius/LuGre lugre.m (delta = 2).
    """

    facts = Facts(("D", "S", "St", "V"), "C∞", "two sources", load="independent")
    ordered = (("F_C", "F_S"),)

    F_S: Scalar = fields.LEVEL(4.4861, doc="static level")
    F_C: Scalar = fields.LEVEL(2.5498, doc="dynamic level")
    v_s: Scalar = fields.V_S(1.2e-3)
    sigma_2: Scalar = fields.SIGMA_2(230.0)
    delta: Scalar = fields.DELTA(2.0)
    v_eps: Scalar = fields.V_EPS(1e-5)

    def formula(self, v: Scalar, N: Scalar, s: Scalar, fall: Fall) -> Scalar:
        """Return the friction force [N] in the direction `s`."""
        level = self.F_C + (self.F_S - self.F_C) * fall(v, self.v_s, self.delta)
        return level * s + self.sigma_2 * v

    @classmethod
    def pilot(cls) -> "SteadyStateLuGre":
        """Return the law with the parameters of the pilot plant, table 5.1, the defaults."""
        return cls()

    @classmethod
    def main(cls) -> "SteadyStateLuGre":
        """Return the law with the parameters of the main plant, table 5.2."""
        return cls(F_S=4.2672, F_C=2.6063, v_s=4.9e-3, sigma_2=5.0, delta=3.2)
