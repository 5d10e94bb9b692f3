"""Laws with a smooth peak, or with a fall that is not exponential."""

from math import e, sqrt

from symfric.foundation.numeric import Scalar, equals, exp, tanh
from symfric.foundation.parameters import param, parametric
from symfric.laws.base import fields, smooth
from symfric.laws.base.families import CurveLaw, Fall, Levels, TwoLevels
from symfric.laws.base.law import Facts, StaticLaw


@parametric
class BrownMcPhee(TwoLevels, StaticLaw):
    """Brown-McPhee friction.

        x = v / v_t
        F = N [mu_d tanh(4x) + (mu_s - mu_d) x / (x^2/4 + 3/4)^2] + mu_v v tanh(4 N / N_t)

    Limits: F(v_t) = N (mu_s - 6.7e-4 mu_d), so the static level is met to 0.1 %. The excess over
    mu_d N decreases as 16 (v_t/v)^3; mu_s = mu_d gives mu_d N tanh(4x). Creeps under load. The
    slope at rest, N [4 mu_d + (16/9)(mu_s - mu_d)] / v_t, determines the stiffness of the equations
    of motion.
    Source: Brown and McPhee, ASME J. Comput. Nonlinear Dynam. 11(5), 2016, 054502.
    Checked: public MATLAB function Friction_B and the code of a railway simulator.
    """

    facts = Facts(("D", "S", "St", "V"), "C∞", "two sources")

    v_t: Scalar = fields.V_T(1e-3)
    mu_v: Scalar = fields.SIGMA_2(0.0)
    N_t: Scalar = fields.LOAD(1.0, doc="transition normal force", lower=1e-12)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 for zero widths."""
        if equals(self.mu_v, 0.0):
            return self.mu_d * N
        return self.mu_d * N + self.mu_v * speed * tanh(4 * N / self.N_t)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        x = v / self.v_t
        bump = x / (0.25 * (x * x) + 0.75) ** 2
        dry = self.mu_d * tanh(4 * x) + (self.mu_s - self.mu_d) * bump
        if equals(self.mu_v, 0.0):
            return dry * N
        return dry * N + self.mu_v * v * tanh(4 * N / self.N_t)


@parametric
class SimscapeBreakaway(TwoLevels, StaticLaw):
    """Breakaway friction of Simscape's translational and rotational friction blocks.

        u = v / (sqrt(2) v_brk)
        F = N {sqrt(2e) (mu_s - mu_d) u exp(-u^2) + mu_d tanh(10 v / v_brk)} + sigma_2 v

    Limits: F(v_brk) = mu_s N to 4e-9 (for sigma_2 = 0), which is the peak for small mu_d. At
    10 v_brk the excess over mu_d N is below 1e-20. The slope at rest is
    N [1.65 (mu_s - mu_d) + 10 mu_d] / v_brk. Creeps under load.
    Source: documentation of Simscape, four pages.
    Checked: documentation of Simscape, four pages.
    """

    facts = Facts(("D", "S", "St", "V"), "C∞", "two sources")

    v_brk: Scalar = fields.VELOCITY(1e-3, width=1, doc="breakaway velocity")
    sigma_2: Scalar = fields.SIGMA_2(0.0)

    @property
    def velocity_scale(self) -> Scalar:
        """One tenth of the breakaway velocity [m/s]."""
        return self.v_brk / 10

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 for zero widths."""
        return self.mu_d * N + self.sigma_2 * speed

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        u = v / (sqrt(2) * self.v_brk)
        peak = (sqrt(2 * e) * (self.mu_s - self.mu_d)) * u * exp(-u * u)
        return N * (peak + self.mu_d * tanh(10 * v / self.v_brk)) + self.sigma_2 * v


@parametric
class Specker(TwoLevels, StaticLaw):
    """Specker-Buchholz-Dietmayer friction.

        F_p = N [mu_s - mu_d tanh(v_sp / v_t)] - sigma_2 v_sp
        F   = F_p (v/v_sp) exp(1/2 - (v/v_sp)^2 / 2) + mu_d N tanh(v / v_t) + sigma_2 v

    Limits: F(v_sp) = mu_s N exactly; with v_t = v_sp/10 it is `SimscapeBreakaway` to 4e-9. If
    sigma_2 v_sp exceeds the static excess, the peak becomes a minimum. Creeps under load.
    Source: Specker, Buchholz, Dietmayer 2014 (not read; the correction by sigma_2 is uncertain).
    Checked: SimscapeBreakaway for v_t = v_sp/10; the correction by sigma_2 is uncertain.
    """

    facts = Facts(("D", "S", "St", "V"), "C∞", "unverified")
    strictly_ordered = (("v_t", "v_sp"),)

    v_sp: Scalar = fields.VELOCITY(1e-3, width=1, doc="velocity of the peak")
    v_t: Scalar = fields.V_T(1e-4)
    sigma_2: Scalar = fields.SIGMA_2(0.0)

    @property
    def velocity_scale(self) -> Scalar:
        """Transition velocity [m/s]."""
        return self.v_t

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 for zero widths."""
        return self.mu_d * N + self.sigma_2 * speed

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        u = v / self.v_sp
        peak = N * (self.mu_s - self.mu_d * tanh(self.v_sp / self.v_t)) - self.sigma_2 * self.v_sp
        dry = peak * u * exp((1 - u * u) / 2) + self.mu_d * N * tanh(v / self.v_t)
        return dry + self.sigma_2 * v


@parametric
class MakkarDixon(StaticLaw):
    """Makkar-Dixon-Sawyer-Hu friction: differences of hyperbolic tangents, in newton.

        F = gamma_1 [tanh(gamma_2 v) - tanh(gamma_3 v)] + gamma_4 tanh(gamma_5 v) + gamma_6 v

    gamma_1 + gamma_4 is approximately the static level, gamma_4 the dynamic level.
    Limits: F -> gamma_4 + gamma_6 v. The peak is below gamma_1 + gamma_4; it is 0.905 of it with
    the default parameters. With gamma_2 > gamma_3 the law is dissipative and its parameters are
    unique. Creeps under load.
    Source: Makkar, Dixon, Sawyer, Hu 2005 (not read), as in public code.
    Checked: public code, in which a parenthesis is misplaced.
    """

    facts = Facts(("D", "S", "St", "V"), "C∞", "one source", load="independent")
    strictly_ordered = (("gamma_3", "gamma_2"),)

    gamma_1: Scalar = fields.LEVEL(0.5, doc="static excess")
    gamma_2: Scalar = fields.STEEPNESS(1e4, width=-1, doc="steepness of the rise")
    gamma_3: Scalar = fields.STEEPNESS(1e3, doc="steepness of the fall")
    gamma_4: Scalar = fields.LEVEL(1.0, doc="dynamic level")
    gamma_5: Scalar = fields.STEEPNESS(1e4, width=-1, doc="steepness of the dynamic part")
    gamma_6: Scalar = fields.SIGMA_2(0.0)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 for zero widths."""
        falling = 1 - tanh(self.gamma_3 * speed)
        return self.gamma_1 * falling + self.gamma_4 + self.gamma_6 * speed

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        bump = self.gamma_1 * (tanh(self.gamma_2 * v) - tanh(self.gamma_3 * v))
        return bump + self.gamma_4 * tanh(self.gamma_5 * v) + self.gamma_6 * v


@parametric
class Lorentzian(Levels, CurveLaw):
    """Lorentzian friction of Hess and Soom.

        F = N [mu_d + (mu_s - mu_d) / (1 + (v/v_s)^2)] sign(v) + sigma_2 v

    sign(v) is smooth over v_eps; the float v_eps = 0 is the original.
    Limits: halfway between the levels at v = v_s; the excess over mu_d N decreases as (v_s/v)^2.
    Creeps under load.
    Source: Hess and Soom, ASME J. Tribol. 112, 1990, as cited by Armstrong-Helouvry (not read).
    Checked: g(v) of jchristopherson/friction README with alpha = 2, for the formula only.
    """

    facts = Facts(("D", "S", "St", "V"), "C∞", "one source")

    v_s: Scalar = fields.V_S(1e-3)
    v_eps: Scalar = fields.V_EPS(1e-4)
    sigma_2: Scalar = fields.SIGMA_2(0.0)

    def formula(self, v: Scalar, N: Scalar, s: Scalar, fall: Fall) -> Scalar:
        """Return the friction force [N] in the direction `s`."""
        u = v / self.v_s
        mu = self.mu_d + (self.mu_s - self.mu_d) / (1 + u * u)
        return mu * N * s + self.sigma_2 * v


@parametric
class PoppStelter(StaticLaw):
    """Popp-Stelter friction: a hyperbolic fall and a quadratic rise.

        F = N {mu_s [(1 - eta) / (1 + d |v|) + eta] + kappa v^2} sign(v)

    sign(v) is smooth over v_eps, |v| over 1e-4 v_eps; the float v_eps = 0 is the original.
    Limits: the fall tends to the level eta mu_s N. The quadratic rise is proportional to the load,
    since it is part of the coefficient mu(v) in braces. Creeps under load.
    Source: Popp and Stelter, Phil. Trans. R. Soc. A 332, 1990 (not read).
    """

    facts = Facts(("D", "S", "St", "V"), "C∞", "unverified")

    mu_s: Scalar = fields.MU_S(0.15)
    eta: Scalar = fields.SHAPE(0.5, doc="share that remains", lower=0.0, upper=1.0)
    d: Scalar = fields.STEEPNESS(1e3, doc="steepness of the fall")
    kappa: Scalar = fields.SIGMA_2(0.0, unit="s^2/m^2", doc="quadratic coefficient")
    v_eps: Scalar = fields.V_EPS(1e-4)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 for zero widths."""
        fall = (1 - self.eta) / (1 + smooth.onward(self.d * speed)) + self.eta
        mu = self.mu_s * fall
        return N * (mu if equals(self.kappa, 0.0) else mu + self.kappa * speed * speed)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        speed = smooth.magnitude(v, smooth.CORNER * self.v_eps)
        fall = (1 - self.eta) / (1 + self.d * speed) + self.eta
        mu = self.mu_s * fall
        if not equals(self.kappa, 0.0):
            mu += self.kappa * v * v
        return mu * N * smooth.sign(v, self.v_eps)


@parametric
class MixedLubrication(CurveLaw):
    """Stribeck curve over the Hersey number: boundary, mixed and hydrodynamic friction.

        p  = N / A,   H = eta |v| / p
        mu = mu_b / (1 + (H/H_m)^2) + H / h_0
        F  = N mu sign(v)

    The Hersey number H [m] is viscosity times sliding velocity over pressure. The first term is the
    share of the load on asperities, the second is shear of a film of the thickness h_0. The force
    of the film, eta A v / h_0, does not depend on the load. In a plain bearing of radius r, length
    L and radial clearance c, v = omega r, A = 2 r L, and Petroff's equation is h_0 = c / pi.
    sign(v) is smooth over v_eps. N^2 is rounded by N_eps^2 in the first term, so that N = 0 is
    valid; the float N_eps = 0 is the equation itself.
    The viscosity eta has the role "viscous": `TemperatureDependent` makes it Reynolds' function of
    the temperature.
    Limits: mu_b at rest; mu_b/2 + H_m/h_0 at H = H_m; mu_b = 0 is `Viscous` with eta A / h_0. The
    friction has a minimum only if h_0 > 1.54 H_m / mu_b. The film thickness is constant, so mu
    rises linearly in the hydrodynamic regime. Creeps under load.
    Source: Hersey, J. Wash. Acad. Sci. 4, 1914; Petroff 1883; the mixed regime as in Hess and Soom,
    ASME J. Tribol. 112(1), 1990 (not read).
    Checked: Petroff's equation; the first term is from memory.
    """

    facts = Facts(("D", "S", "St", "V"), "C∞", "unverified", load="by the Hersey number")

    mu_b: Scalar = fields.COEFFICIENT(0.1, doc="boundary friction coefficient")
    eta: Scalar = fields.SIGMA_2(0.05, unit="Pa s", doc="dynamic viscosity")
    A: Scalar = param(
        1e-3, unit="m^2", role="geometry", doc="projected area of the contact", lower=1e-12
    )
    H_m: Scalar = fields.SHAPE(1e-8, unit="m", doc="Hersey number of the mixed regime", lower=1e-18)
    h_0: Scalar = fields.ANGLE(2e-5, unit="m", doc="film thickness", lower=1e-12)
    v_eps: Scalar = fields.V_EPS(1e-4)
    N_eps: Scalar = fields.WIDTH(1e-3, unit="N", doc="rounding of the load", lower=0.0)

    def formula(self, v: Scalar, N: Scalar, s: Scalar, fall: Fall) -> Scalar:
        """Return the friction force [N] in the direction `s`."""
        drag = self.eta * self.A * v
        film = drag / self.H_m  # load at which H = H_m
        loaded = N * N + self.N_eps * self.N_eps
        return self.mu_b * N * s * loaded / (loaded + film * film) + drag / self.h_0
