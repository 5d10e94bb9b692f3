"""Piecewise laws of multibody codes, which consist of ramps, steps and falls."""

from abc import abstractmethod
from math import exp as exp_of_float

from symfric.foundation.numeric import Scalar, exp, tanh
from symfric.foundation.parameters import option, parametric
from symfric.laws.base import fields, smooth
from symfric.laws.base.families import Levels, TwoLevels
from symfric.laws.base.law import Facts, StaticLaw

FORMS = ("smooth", "original")
RISE = 1 - exp_of_float(-3.0)
"""Value of the rise 1 - exp(-3 |v|/v_r) at v_r."""


@parametric
class Rise(StaticLaw):
    """Law that rises to mu_d N over the velocity v_r; the smooth form is tanh(3 v / v_r)."""

    mu_d: Scalar = fields.MU_D(0.1)
    v_r: Scalar = fields.VELOCITY(1e-3, width=1, doc="velocity of the transition")
    form: str = option("smooth", choices=FORMS, doc="form of the rise")

    @property
    def velocity_scale(self) -> Scalar:
        """One third of the transition velocity [m/s]."""
        return self.v_r / 3

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 for zero widths."""
        return self.mu_d * N

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        if self.form == "smooth":
            return self.mu_d * N * tanh(3 * (v / self.v_r))
        return self.mu_d * N * self.original(v)

    @abstractmethod
    def original(self, v: Scalar) -> Scalar:
        """Return the original form of the force, divided by mu_d N."""


def rise(u: Scalar) -> Scalar:
    """Return (1 - exp(-3 |u|)) sign(u), which has the slope 3 at zero."""
    return 3 * u * smooth.phi1(-3 * smooth.magnitude(u, 0.0))


@parametric
class Threlfall(Rise):
    """Threlfall friction.

        original:  F = mu_d N (1 - exp(-3 |v|/v_r)) sign(v)   for |v| <= v_r
                   F = 0.95 mu_d N sign(v)                    for |v| > v_r
        smooth:    F = mu_d N tanh(3 v / v_r)

    Both forms have the slope 3 mu_d N / v_r at rest.
    Limits: the original remains 5 % below mu_d N at all speeds above v_r, and jumps by
    -2.1e-4 mu_d N at v_r; the smooth form tends to mu_d N. Creeps under load.
    Source: Threlfall, Mech. Mach. Theory 13, 1978 (not read), as in public multibody code.
    Checked: public Python code of a multibody simulation.
    """

    facts = Facts(("D",), "C∞ (original: jump at |v| = v_r, C1 at 0)", "one source")

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 for zero widths."""
        return self.mu_d * N * (1.0 if self.form == "smooth" else 0.95)

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the largest force [N]; the original falls by 2e-4 mu_d N beyond it."""
        return self.mu_d * N * (1.0 if self.form == "smooth" else RISE)

    def original(self, v: Scalar) -> Scalar:
        """Return the original form of the force, divided by mu_d N."""
        u = v / self.v_r
        within = smooth.magnitude(u, 0.0) <= 1
        return smooth.choose(within, rise(u), 0.95 * smooth.sign(v, 0.0))


@parametric
class ModifiedThrelfall(Rise):
    """Threlfall friction modified by Marques et al., so that it reaches the dynamic level.

        original:  F = mu_d N (1 - exp(-3 |v|/v_r)) / (1 - exp(-3)) sign(v)   for |v| <= v_r
                   F = mu_d N sign(v)                                         for |v| > v_r
        smooth:    F = mu_d N tanh(3 v / v_r)

    Limits: F(v_r) = mu_d N in the original, 0.995 mu_d N in the smooth form, which is that of
    `Threlfall`. The coefficient 1 - exp(-3) is an interpretation that makes the law continuous;
    with 0.95 it would overshoot by 2.2e-4. Creeps under load.
    Source: Marques et al., Nonlinear Dynam. 86, 2016 (not read).
    Checked: the coefficient 1 - exp(-3) is an interpretation.
    """

    facts = Facts(("D",), "C∞ (original: C0 at |v| = v_r, C1 at 0)", "unverified")

    def original(self, v: Scalar) -> Scalar:
        """Return the original form of the force, divided by mu_d N."""
        return rise(smooth.clip(v / self.v_r, -1.0, 1.0)) / RISE


@parametric
class BengisuAkay(Levels, StaticLaw):
    """Bengisu-Akay friction: a parabola up to the static level, followed by a fall.

        F = mu_s N u (2 - |u|)                                  u = v/v_0, for |u| <= 1
        F = N [mu_d + (mu_s - mu_d) exp(-xi (|v| - v_0))] sign(v)       beyond, original
        F = N [mu_d + (mu_s - mu_d) exp(-xi^2 (|v| - v_0)^2)] sign(v)   beyond, smooth

    Limits: the peak F(v_0) = mu_s N is exact; F -> mu_d N. At v_0 the slope of the original jumps
    from 0 to -xi (mu_s - mu_d) N; the slope of the smooth form is 0 on both sides. Creeps under
    load.
    Source: Bengisu and Akay, J. Sound Vib. 171, 1994 (not read).
    Checked: parabola and fall join at the static level.
    """

    facts = Facts(
        ("D", "S", "St"), "C1 at 0 and |v| = v_0 (original: C0 at |v| = v_0)", "unverified"
    )

    v_0: Scalar = fields.VELOCITY(1e-3, width=1, doc="velocity of the peak")
    xi: Scalar = fields.STEEPNESS(1e3, doc="steepness of the fall", lower=0.0)
    form: str = option("smooth", choices=FORMS, doc="fall behind the peak")

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 for zero widths."""
        whole = 2.0 if self.form == "smooth" else 1.0
        return self.coefficient(smooth.fall(self.xi * speed, 1.0, whole)) * N

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        u = smooth.clip(v / self.v_0, -1.0, 1.0)
        beyond = self.xi * smooth.positive(smooth.magnitude(v, 0.0) - self.v_0, 0.0)
        fall = exp(-beyond * beyond) if self.form == "smooth" else exp(-beyond)
        return self.coefficient(fall) * N * (u * (2 - smooth.magnitude(u, 0.0)))


@parametric
class VelocityBased(TwoLevels, StaticLaw):
    """Velocity-based friction of MSC ADAMS: a step up to the static level, then a step down.

        F = N [2 S((v + v_s) / (2 v_s)) - 1] [mu_s - (mu_s - mu_d) S((|v| - v_s) / (v_d - v_s))]
        S(t) = t^2 (3 - 2t) original,   t^3 (10 - 15t + 6t^2) smooth,   0 <= t <= 1

    With u = v/v_s the first bracket is u (3 - u^2)/2 or u (15 - 10 u^2 + 3 u^4)/8, |u| <= 1.
    Limits: F(v_s) = mu_s N, and F = mu_d N for v >= v_d, both exactly. The slope at rest is
    1.5 mu_s N / v_s in the original and 1.875 mu_s N / v_s in the smooth form. Joints of ADAMS use
    v_d = 1.5 v_s. Creeps under load.
    Source: documentation of MSC ADAMS, contact friction and STEP, two pages.
    Checked: two pages of the documentation of MSC ADAMS.
    """

    facts = Facts(("D", "S"), "C2 at |v| = v_s and v_d (original: C1)", "two sources")
    strictly_ordered = (("v_s", "v_d"),)

    v_s: Scalar = fields.VELOCITY(1e-3, width=1, doc="stiction transition velocity")
    v_d: Scalar = fields.VELOCITY(1.5e-3, width=1, doc="friction transition velocity")
    form: str = option("smooth", choices=FORMS, doc="quintic or cubic steps")

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        u = smooth.clip(v / self.v_s, -1.0, 1.0)
        beyond = (smooth.magnitude(v, 0.0) - self.v_s) / (self.v_d - self.v_s)
        if self.form == "smooth":
            rise, fall = u * (15 - u * u * (10 - 3 * u * u)) / 8, smooth.step5(beyond)
        else:
            rise, fall = u * (3 - u * u) / 2, smooth.step3(beyond)
        return rise * N * (self.mu_s - (self.mu_s - self.mu_d) * fall)


@parametric
class Ambrosio(StaticLaw):
    """Ambrosio friction: zero below v_0, then a ramp to the dynamic level at v_1.

        F = mu_d N sign(v) s((|v| - v_0) / (v_1 - v_0)),   0 <= v_0 < v_1
        s(t) = t original,   t^3 (10 - 15t + 6t^2) smooth,   0 <= t <= 1

    Limits: F = mu_d N for v >= v_1. Below v_0 there is no friction, so that a loaded contact creeps
    freely and the linearisation at rest is singular. The original with v_0 = 0 is `Coulomb` with
    the shape "saturation".
    Source: Ambrosio 2003 (not read), as in public multibody code.
    Checked: public Python code of a multibody simulation.
    """

    facts = Facts(("D",), "C2 at |v| = v_0 and v_1 (original: C0)", "one source")
    strictly_ordered = (("v_0", "v_1"),)

    mu_d: Scalar = fields.MU_D(0.1)
    v_0: Scalar = fields.VELOCITY(2e-4, width=1, doc="velocity below which nothing acts", lower=0.0)
    v_1: Scalar = fields.VELOCITY(1e-3, width=1, doc="velocity of full friction")
    form: str = option("smooth", choices=FORMS, doc="quintic step or ramp")

    @property
    def velocity_scale(self) -> Scalar:
        """Width of the ramp [m/s]."""
        return self.v_1 - self.v_0

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 for zero widths."""
        return self.mu_d * N

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        forward, backward = ((w - self.v_0) / (self.v_1 - self.v_0) for w in (v, -v))
        if self.form == "smooth":
            return self.mu_d * N * (smooth.step5(forward) - smooth.step5(backward))
        return self.mu_d * N * (smooth.clip(forward, 0.0, 1.0) - smooth.clip(backward, 0.0, 1.0))


@parametric
class Hollars(TwoLevels, StaticLaw):
    """Hollars friction of Simbody.

        u = |v| / v_t
        F = N {min(u, 1) [mu_d + 2 (mu_s - mu_d) / (1 + u^2)] + mu_v |v|} sign(v)

    min(u, 1) is rounded over 1 +- u_eps; the float u_eps = 0 is the original.
    Limits: F(v_t) = mu_s N in the original, (1 - 0.19 u_eps) mu_s N with rounding. The excess over
    mu_d N decreases as 2/u^2. The slope at rest is N (2 mu_s - mu_d) / v_t. Creeps under load.
    Source: Simbody, three public headers.
    Checked: simbody/simbody HuntCrossleyForce.h.
    """

    facts = Facts(
        ("D", "S", "St", "V"), "C2 at |v| = v_t (1 -+ u_eps) (u_eps = 0: C0 at v_t)", "one source"
    )

    v_t: Scalar = fields.V_T(1e-2)
    mu_v: Scalar = fields.MU_V(0.0)
    u_eps: Scalar = fields.U_EPS(0.2)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 for zero widths."""
        return N * (self.mu_d + self.mu_v * speed)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        u = v / self.v_t
        mu = self.mu_d + 2 * (self.mu_s - self.mu_d) / (1 + u * u)
        return N * (smooth.hold(u, 1.0, self.u_eps) * mu + self.mu_v * v)


@parametric
class Exudyn(TwoLevels, StaticLaw):
    """Regularised friction of Exudyn: a ramp up to the static level, then an exponential fall.

        F = N mu_s u                                                u = v/v_reg, for |u| <= 1
        F = N {mu_d + (mu_s - mu_d) exp(-w/v_exp) + mu_v w} sign(v),   w = |v| - v_reg, beyond

    The corner of the ramp at |u| = 1 is rounded over 1 +- u_eps, and w accordingly; the float
    u_eps = 0 is the original, with a kink.
    Limits: F(v_reg) = mu_s N in the original, lower by about 0.19 u_eps with rounding; F -> mu_d N
    for mu_v = 0; v_reg -> 0 is `Benson`. The slope at rest is mu_s N / v_reg. Creeps under load.
    Source: Exudyn, public source; its manual omits the division by v_reg in the ramp.
    Checked: jgerstmayr/EXUDYN, source of its regularised friction.
    """

    facts = Facts(
        ("D", "S", "St", "V"),
        "C2 at |v| = v_reg (1 -+ u_eps) (u_eps = 0: C0 at v_reg)",
        "one source",
    )

    v_reg: Scalar = fields.VELOCITY(1e-3, width=1, doc="velocity of the ramp's end")
    v_exp: Scalar = fields.VELOCITY(1e-3, doc="velocity of the fall")
    mu_v: Scalar = fields.MU_V(0.0)
    u_eps: Scalar = fields.U_EPS(0.2)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 for zero widths."""
        falling = smooth.fall(speed, self.v_exp, 1.0)
        return N * (self.coefficient(falling) + self.mu_v * speed)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        u = v / self.v_reg
        ramp = smooth.hold(u, 1.0, self.u_eps)
        beyond = self.v_reg * (u - ramp)
        falling = exp(-smooth.magnitude(beyond, 0.0) / self.v_exp)
        return N * (ramp * self.coefficient(falling) + self.mu_v * beyond)


@parametric
class Step5(TwoLevels, StaticLaw):
    """Quintic-step Stribeck friction of Simbody and of early versions of Drake.

        u = |v| / v_t,   S(t) = t^3 (10 - 15t + 6t^2) for 0 <= t <= 1
        F = N {mu_s S(u) - (mu_s - mu_d) S((u - 1)/2) + mu_v |v|} sign(v)

    Limits: F(v_t) = mu_s N, F(3 v_t) = mu_d N exactly (for mu_v = 0). The slope at rest is zero, so
    that slow creep meets no resistance and the linearisation at rest is singular. The viscous
    coefficient of Simbody is mu_v v_t.
    Source: Simbody, public source.
    Checked: simbody/simbody CompliantContactSubsystem.cpp, function stribeck.
    """

    facts = Facts(("D", "S", "St", "V"), "C2 at |v| = v_t and 3 v_t", "one source")

    v_t: Scalar = fields.V_T(1e-3)
    mu_v: Scalar = fields.MU_V(0.0)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 for zero widths."""
        return N * (self.mu_d + self.mu_v * speed)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        u, speed = v / self.v_t, smooth.magnitude(v / self.v_t, 0.0)
        inner, size = smooth.clip(u, -1.0, 1.0), smooth.clip(speed, 0.0, 1.0)
        rise = inner * inner * inner * (10 - size * (15 - 6 * size))
        fall = smooth.step5((speed - 1) / 2)
        return N * (rise * (self.mu_s - (self.mu_s - self.mu_d) * fall) + self.mu_v * v)
