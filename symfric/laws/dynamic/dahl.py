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
    virgin curve F = mu_d N (1 - exp(-sigma_0 x / (mu_d N))). |v| and sign(v) are smooth over v_eps.
    Keep v_eps ten times below the slowest motion of interest. v_eps = 0 is the original, with a
    kink at v = 0. For n < 1 the force reaches its level within a finite distance, with a corner
    that rho_eps smooths over the fraction rho_eps^(1-n) of the level of z. This fraction should be
    ten times above rtol. Otherwise the element is so stiff in the corner that a step can skip a
    reversal of slip without an error estimate (n = 0.1, default rho_eps, rtol 1e-3). Not valid for
    N = 0.
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
        """Mean bristle deflection z [m], positive for v > 0."""
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
    """Bliman-Sorine friction of second order (two states) or first order (one state).

        dF_1/dt = ( mu_1 N v - |v| F_1) / (eta s_f)
        dF_2/dt = (-mu_2 N v - |v| F_2) / s_f
        F = F_1 + F_2

    The law is linear in the path |v| t and hence rate-independent. Each reversal is followed by a
    peak at the path s_p = eta s_f/(1 - eta) ln(mu_1/(eta mu_2)), of the height
    N [mu_1 (1 - exp(-s_p/(eta s_f))) - mu_2 (1 - exp(-s_p/s_f))].
    order = "1" uses F_1 only, which is `Dahl` with the level mu_1 N and the path constant eta s_f.
    Limits: steady state (mu_1 - mu_2) N sign(v), no Stribeck effect in steady sliding; initial
    stiffness N (mu_1/eta - mu_2)/s_f. Weakly damped at velocity reversals: a block on a belt
    oscillates, and the instant of its break-away is sensitive to errors. Dissipative for the
    default parameters, but not for all. |v| is smooth over v_eps.
    Source: Bliman and Sorine, Proc. European Control Conf. 1995; Olsson et al., Eur. J. Control 4,
    1998.
    Checked: the closed forms of peak and steady state hold.
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
        """Fast and slow part of the force [N]."""
        count = range(1, int(self.order) + 1)
        return tuple(State(f"F_{i}", "N", 1.0, doc=f"part {i} of the force") for i in count)

    @property
    def velocity_scale(self) -> Scalar:
        """Path constant per second [m/s]; inf for the order 1, which has no peak.

        Although the force depends on the path only, error control must resolve oscillations of a
        sticking contact, because their phase determines when it passes the peak and breaks away.
        """
        return self.s_f if self.order == "2" else inf

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the steady sliding force [N] at a speed >= 0."""
        return (self.mu_1 if self.order == "1" else self.mu_1 - self.mu_2) * N

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the height [N] of the peak at the path s_p; mu_1 N for the order 1."""
        if self.order == "1":
            return self.mu_1 * N
        q = self.eta * self.mu_2 / self.mu_1  # exp(-s_p (1 - eta)/(eta s_f))
        slow, fast = q ** (self.eta / (1 - self.eta)), q ** (1 / (1 - self.eta))
        return N * (self.mu_1 * (1 - fast) - self.mu_2 * (1 - slow))

    def most_held(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the bound [N]: the sum of both parts, which have equal signs after a reversal."""
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

    z is the ratio of the friction force to its limit, and x_0 = mu_d N / sigma_0 is the stretch at
    which an elastic element reaches the limit. With A = 1 and beta = gamma = 1/2 it unloads
    elastically; n = 1 then has the virgin curve of `Dahl`, and n -> inf is an element of
    `MaxwellSlip`.
    Limits: steady state mu_d N (A / (beta + gamma))^(1/n) sign(v); rate-independent. n = 1,
    beta = 1, gamma = 0 is `Dahl`. Dissipative for -beta < gamma <= beta. One element has no
    non-local memory and drifts under vibration with an offset. sign(v) and sign(z) are smooth over
    v_eps and z_eps. Keep v_eps ten times below the slowest motion. Not valid for N = 0.
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
        """Ratio z of the friction force to its limit."""
        return (State("z", "1", 1.0, doc="friction force over its limit"),)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the steady sliding force [N] at a speed >= 0."""
        share = (self.A / (self.beta + self.gamma)) ** (1 / self.n)
        return self.mu_d * N * share

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        return self.mu_d * N * z[0]

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the rate of z [1/s], shape (1, 1)."""
        used = smooth.overload(z[0], self.n, self.z_eps)
        t, s = smooth.sign(v, self.v_eps), smooth.sign(z[0], self.z_eps)
        yielded = (self.beta - self.gamma) * s + self.gamma * onward(t, s)
        stretch = self.A * v - used * (v * t) * yielded
        return column(self.sigma_0 / (self.mu_d * N) * stretch)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return z in steady sliding, shape (1, 1)."""
        share = (self.A / (self.beta + self.gamma)) ** (1 / self.n)
        return column(share * smooth.sign(v, self.v_eps))
