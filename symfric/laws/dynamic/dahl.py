"""Rate-independent friction laws: Dahl, Bliman-Sorine and Bouc-Wen."""

from math import inf

from symfric.foundation.numeric import Scalar, column, equals, is_number
from symfric.foundation.parameters import option, parametric
from symfric.laws.base import fields, smooth
from symfric.laws.base.law import Facts, Law, State
from symfric.laws.dynamic.element import deflection, onward, spent


@parametric
class Dahl(Law):
    """Dahl friction (one state), exponent n.

        rho   = 1 - sigma_0 z / (mu_d N) sign(v)
        dz/dt = v rho |rho|^(n-1)            (n = 1: dz/dt = v - sigma_0 |v| z / (mu_d N))
        F     = sigma_0 z

    `z` is the mean bristle deflection [m].
    Limits: steady state mu_d N sign(v); rate-independent; drifts under vibration; n = 1 has the
    virgin curve F = mu_d N (1 - exp(-sigma_0 x / (mu_d N))). |v| and sign(v) are smooth over
    v_eps, to be kept ten times below the slowest motion of interest; v_eps = 0 is
    the original with a kink at v = 0. n < 1 reaches the level within a finite distance, with a
    corner that rho_eps rounds to a layer of z as wide as rho_eps^(1-n) of its level: keep that
    ten times above rtol, or the element is so stiff there that a step leaps over a reversal of
    slip and no error is estimated (n = 0.1 with the default at rtol 1e-3). Not valid for N = 0.
    Source: Dahl, Aerospace Corp. TOR-0158(3107-18)-1, 1968; exponent: Dahl, AIAA J. 14, 1976.
    Checked: n = 1: Altair MotionSolve's manual and public code; n is unverified.
    """

    facts = Facts(("D", "P"), "C∞ (C0 at v = 0 as v_eps -> 0)", "two sources")

    sigma_0: Scalar = fields.SIGMA_0(1e5)
    mu_d: Scalar = fields.MU_D(0.1, lower=1e-12)
    n: Scalar = fields.SHAPE(1.0, doc="exponent", lower=0.0, upper=10.0)
    v_eps: Scalar = fields.REST_EPS(1e-15)
    rho_eps: Scalar = fields.WIDTH(1e-3, doc="smoothing of |rho|, for n != 1")

    @property
    def states(self) -> tuple[State, ...]:
        """Deflection z of the contact [m], positive with v."""
        return (State("z", "m", deflection(self.sigma_0), doc="mean bristle deflection"),)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the steady sliding force [N] at a speed >= 0."""
        return self.mu_d * N

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        return self.sigma_0 * z[0]

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the rate of the bristle deflection [m/s], shape (1, 1)."""
        level = self.sigma_0 * z[0] / (self.mu_d * N)
        if equals(self.n, 1.0):
            return column(v - smooth.magnitude(v, self.v_eps) * level)
        t = smooth.sign(v, self.v_eps)
        lost = spent(lambda r: 1 - smooth.signed_power(1 - r, self.n, self.rho_eps), v, t, level)
        return column(v - lost)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the bristle deflection in steady sliding [m], shape (1, 1)."""
        return column(self.mu_d * N / self.sigma_0 * smooth.sign(v, self.v_eps))


@parametric
class BlimanSorine(Law):
    """Bliman-Sorine friction of second order (two states), or of first order (one).

        dF_1/dt = ( mu_1 N v - |v| F_1) / (eta s_f)
        dF_2/dt = (-mu_2 N v - |v| F_2) / s_f
        F = F_1 + F_2

    Linear in the path |v| t, hence rate-independent: each reversal is followed by a peak at the
    path s_p = eta s_f/(1 - eta) ln(mu_1/(eta mu_2)), of the height
    N [mu_1 (1 - exp(-s_p/(eta s_f))) - mu_2 (1 - exp(-s_p/s_f))].
    order = "1" keeps F_1 alone, with mu_2 = 0 and the path eta s_f: that is `Dahl`.
    Limits: steady state (mu_1 - mu_2) N sign(v), no Stribeck effect in steady sliding; initial
    stiffness N (mu_1/eta - mu_2)/s_f. Weakly damped at velocity reversals, so that a block on
    a belt rings, and its break-away magnifies errors; dissipative for the
    default set, not for every one. |v| is smooth over v_eps.
    Source: Bliman and Sorine, Proc. European Control Conf. 1995; Olsson et al., Eur. J. Control 4,
    1998.
    Checked: its closed forms hold.
    """

    facts = Facts(
        ("D", "S", "P"),
        "C∞ (C0 at v = 0 as v_eps -> 0)",
        "unverified",
        load="proportional in steady sliding",
    )
    ordered = (("mu_2", "mu_1"),)

    mu_1: Scalar = fields.COEFFICIENT(0.3, doc="coefficient of the fast part", lower=1e-12)
    mu_2: Scalar = fields.COEFFICIENT(0.2, doc="coefficient of the slow part")
    eta: Scalar = fields.SHAPE(0.4, doc="path ratio, fast to slow", lower=1e-6, upper=0.999)
    s_f: Scalar = fields.LENGTH(1e-5, doc="path constant of the slow part")
    v_eps: Scalar = fields.REST_EPS(1e-15)
    order: str = option("2", choices=("1", "2"), doc="number of states")

    @property
    def states(self) -> tuple[State, ...]:
        """Fast and slow part of the force."""
        count = range(1, int(self.order) + 1)
        return tuple(State(f"F_{i}", "N", 1.0, doc=f"part {i} of the force") for i in count)

    @property
    def velocity_scale(self) -> Scalar:
        """Path constant per second [m/s]; inf without the peak of order 2.

        The force depends on the path only. However, a contact that rings below its peak breaks away
        by the phase in which it meets the peak, and error control must resolve the ringing.
        """
        return self.s_f if self.order == "2" else inf

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the steady sliding force [N] at a speed >= 0."""
        return (self.mu_1 if self.order == "1" else self.mu_1 - self.mu_2) * N

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the height [N] of the peak at the path s_p, which the order 1 does not have."""
        if self.order == "1":
            return self.mu_1 * N
        q = self.eta * self.mu_2 / self.mu_1  # exp(-s_p (1 - eta)/(eta s_f))
        slow, fast = q ** (self.eta / (1 - self.eta)), q ** (1 / (1 - self.eta))
        return N * (self.mu_1 * (1 - fast) - self.mu_2 * (1 - slow))

    def most_held(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the sum of both parts, which have the same sign after a reversal."""
        return N * (self.mu_1 if self.order == "1" else self.mu_1 + self.mu_2)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        return z[0] if self.order == "1" else z[0] + z[1]

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the rates of the parts [N/s]."""
        speed = smooth.magnitude(v, self.v_eps)
        fast = (self.mu_1 * N * v - speed * z[0]) / (self.eta * self.s_f)
        if self.order == "1":
            return column(fast)
        return column(fast, (-self.mu_2 * N * v - speed * z[1]) / self.s_f)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the parts in steady sliding [N]."""
        direction = smooth.sign(v, self.v_eps)
        parts = self.mu_1 * N * direction, -self.mu_2 * N * direction
        return column(*parts[: int(self.order)])


@parametric
class BoucWen(Law):
    """Bouc-Wen element (one state).

        dz/dt = (v / x_0) [A - |z|^n (beta sign(v z) + gamma)]
        F     = mu_d N z

    z is the friction force over its limit; x_0 = mu_d N / sigma_0 is the stretch at which an
    elastic element would reach it. A = 1, beta = gamma = 1/2 unloads elastically; n = 1 then has
    the virgin curve of `Dahl`, n -> inf is an element of `MaxwellSlip`.
    Limits: steady state mu_d N (A / (beta + gamma))^(1/n) sign(v); rate-independent. n = 1,
    beta = 1, gamma = 0 is `Dahl`. Dissipates for -beta < gamma <= beta; one element
    has no non-local memory and drifts under vibration with an offset. sign(v) and sign(z) are
    smooth over v_eps and z_eps; v_eps ten times below the slowest motion. Not valid for N = 0.
    Source: Bouc 1967; Wen, J. Eng. Mech. Div. ASCE 102(2), 1976, 249-263.
    Checked: diegoandresalvarez/BWBN_TMCMC diff_eq_real.m.
    """

    facts = Facts(
        ("D", "P"),
        "C∞ (C0 at v = 0 as v_eps -> 0)",
        "one source",
        load="proportional in steady sliding",
    )

    mu_d: Scalar = fields.MU_D(0.1, lower=1e-12)
    sigma_0: Scalar = fields.STIFFNESS(1e5, doc="initial stiffness for A = 1")
    A: Scalar = fields.SHAPE(1.0, doc="scale of the stiffness", lower=1e-12)
    beta: Scalar = fields.SHAPE(0.5, doc="yielding while loading", lower=1e-12)
    gamma: Scalar = fields.SHAPE(0.5, doc="yielding in either direction")
    n: Scalar = fields.SHARPNESS(2.0)
    v_eps: Scalar = fields.REST_EPS(1e-15)
    z_eps: Scalar = fields.R_EPS(1e-8)

    def __post_init__(self) -> None:
        super().__post_init__()
        if all(map(is_number, (self.beta, self.gamma))) and not (
            -self.beta < self.gamma <= self.beta
        ):
            raise ValueError(
                f"BoucWen: expected -beta < gamma <= beta, got gamma = {self.gamma:g} and "
                f"beta = {self.beta:g}; otherwise the element is unbounded or generates energy"
            )

    @property
    def states(self) -> tuple[State, ...]:
        """Fraction z of the limit that the hysteretic part carries, within -1 ... 1."""
        return (State("z", "1", 1.0, doc="friction force over its limit"),)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the steady sliding force [N] at a speed >= 0."""
        share = (self.A / (self.beta + self.gamma)) ** (1 / self.n)
        return self.mu_d * N * share

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        return self.mu_d * N * z[0]

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the rate of the load share [1/s], shape (1, 1)."""
        used = smooth.overload(z[0], self.n, self.z_eps)
        t, s = smooth.sign(v, self.v_eps), smooth.sign(z[0], self.z_eps)
        yielded = (self.beta - self.gamma) * s + self.gamma * onward(t, s)
        stretch = self.A * v - used * (v * t) * yielded
        return column(self.sigma_0 / (self.mu_d * N) * stretch)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the load share in steady sliding, shape (1, 1)."""
        share = (self.A / (self.beta + self.gamma)) ** (1 / self.n)
        return column(share * smooth.sign(v, self.v_eps))
