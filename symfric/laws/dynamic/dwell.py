"""Laws that depend on the time in stick: Gonthier, Armstrong, and rate-and-state friction."""

from symfric.foundation.numeric import (
    Scalar,
    asinh,
    column,
    equals,
    exp,
    expm1,
    is_number,
    log,
    sqrt,
)
from symfric.foundation.parameters import option, parametric
from symfric.foundation.vector import TINY
from symfric.laws.base import fields, smooth
from symfric.laws.base.families import Levels
from symfric.laws.base.law import Facts, Law, State, one_sided
from symfric.laws.dynamic.element import deflection, yielding


@parametric
class Gonthier(Levels):
    """Gonthier friction with dwell time (two states).

        s        = exp(-(v/v_s)^2),   dir = 3/2 u - 1/2 u^3 for u = v/v_d in [-1, 1], else sign(v)
        F_C      = N [mu_d + (mu_s - mu_d) s_dw]
        dz/dt    = s v + (1 - s) [F_C dir - sigma_0 z] / sigma_1
        ds_dw/dt = (s - s_dw) / tau,  tau = tau_dw while dwelling (s > s_dw), else sigma_1 / sigma_0
        F        = sat(sigma_0 z + sigma_1 dz/dt, F_C) + sigma_2 v

    s_dw is the dwell memory: after a rest of duration t, the break-away force is
    N [mu_d + (mu_s - mu_d) (1 - exp(-t/tau_dw))]. sat(x, F_C) equals x up to F_C and rises smoothly
    to (1 + kappa) F_C beyond. Without this saturation, which is not in the paper, the force at
    velocities well below v_s is F_C + sigma_1 v s/(1 - s), 191 N at 1 um/s; kappa = 0 selects this
    original. tau changes smoothly over s_eps.
    Limits: steady state F_C(s(v)) dir + sigma_2 v for v far above v_s; mu_s = mu_d has no dwell
    effect. Needs v_d < v_s. dz/dt does not vanish in creep (v < v_s), where only sat bounds F.
    Source: Gonthier, McPhee, Lange, Piedboeuf, Multibody Syst. Dyn. 11, 2004, 209-233; saturation
    added.
    Checked: the behaviour was checked; the saturation is constructed.
    """

    facts = Facts(
        ("D", "S", "St", "V", "P", "L", "B", "T"),
        "C1 (dir at v_d; C2 elsewhere)",
        "unverified",
        load="proportional in steady sliding",
    )
    strictly_ordered = (("v_d", "v_s"),)

    mu_d: Scalar = fields.MU_D(0.1, lower=1e-12)
    v_s: Scalar = fields.V_S(1e-3)
    v_d: Scalar = fields.VELOCITY(1e-4, doc="velocity of full direction")
    sigma_0: Scalar = fields.SIGMA_0(1e5)
    sigma_1: Scalar = fields.SIGMA_1(190.0, lower=1e-12)
    sigma_2: Scalar = fields.SIGMA_2(0.0)
    tau_dw: Scalar = fields.TIME(0.1, doc="time constant of the dwell")
    kappa: Scalar = fields.WIDTH(1e-3, doc="rounding of the saturation", lower=0.0, upper=1.0)
    s_eps: Scalar = fields.WIDTH(1e-3, doc="smoothing of the dwell switch")

    @property
    def states(self) -> tuple[State, ...]:
        """Bristle deflection and dwell memory."""
        dwell = State("s_dw", "1", 1.0, even=True, doc="memory of the dwell, 1 after long rest")
        return (State("z", "m", deflection(self.sigma_0), doc="bristle deflection"), dwell)

    @property
    def velocity_scale(self) -> Scalar:
        """Velocity of full direction [m/s]."""
        return self.v_d

    def _sticking(self, v: Scalar) -> Scalar:
        """Return s(v), which is 1 at rest and 0 in sliding."""
        return exp(-((v / self.v_s) ** 2))

    def _level(self, N: Scalar, s_dw: Scalar) -> Scalar:
        return N * self.coefficient(s_dw)

    def _direction(self, v: Scalar) -> Scalar:
        u = smooth.clip(v / self.v_d, -1.0, 1.0)
        return u * (1.5 - 0.5 * u * u)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the rates of the deflection [m/s] and of the dwell memory [1/s]."""
        s, fast = self._sticking(v), self.sigma_1 / self.sigma_0
        pull = (self._level(N, z[1]) * self._direction(v) - self.sigma_0 * z[0]) / self.sigma_1
        dwelling = (1 + smooth.sign(s - z[1], self.s_eps)) / 2
        tau = fast + (self.tau_dw - fast) * dwelling
        return column(s * v + (1 - s) * pull, (s - z[1]) / tau)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the steady sliding force [N] at a speed >= 0 in the limit of small v_d."""
        return self._level(N, self._sticking(speed)) + self.sigma_2 * speed

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        bristle = self.sigma_0 * z[0] + self.sigma_1 * self.rate(v, N, z)[0]
        if equals(self.kappa, 0.0):
            return bristle + self.sigma_2 * v
        rounding = self.kappa * self._level(N, z[1])
        return smooth.hold(bristle, self._level(N, z[1]) + rounding, rounding) + self.sigma_2 * v

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the deflection at which the force is constant, and the dwell memory s(v).

        dz/dt vanishes at sigma_0 z = F_C dir + sigma_1 v s/(1 - s). In creep this is far above the
        level F_C, where the force saturates. There the deflection at saturation is returned; z
        continues to grow, but the force changes by at most kappa F_C.
        """
        s, x = self._sticking(v), v / self.v_s
        F_C = self._level(N, s)
        creep = self.sigma_1 * self.v_s * s * x / (TINY - expm1(-x * x))
        z = smooth.clip(F_C * self._direction(v) + creep, -F_C, F_C) / self.sigma_0
        return column(z, s)


@parametric
class Armstrong(Law):
    """Armstrong's seven-parameter friction in differential form (three states).

        L     = N { mu_d + [mu_a + (mu_inf - mu_a) q] / [1 + (w/v_s)^2] }
        xi    : spring of stiffness k_t that yields at L with the sharpness n
        dw/dt = (v - w) / tau_L
        dq/dt = rest (1 - q)^2/gamma - (1 - rest) q/tau_r,   rest = exp(-(v/v_e)^2)
        F     = k_t xi + sigma_2 v

    The seven parameters are k_t, mu_d, sigma_2, mu_inf (static excess over the dynamic level after
    a long rest), v_s, tau_L (lag of the Stribeck curve) and gamma (dwell); mu_a is the excess
    immediately after slip. The paper switches between a stiction spring k_t x and a sliding law
    with a pure delay tau_L and a dwell clock. In this form the spring yields, a filter replaces the
    delay, and q measures the dwell: it is t/(t + gamma) after a rest of duration t and decays
    within tau_r in slip.
    Limits: steady state L(v) sign(v) + sigma_2 v; gamma -> inf, tau_L -> 0, k_t -> inf is the
    Lorentzian law with the excess mu_a. Keep v_e, which separates rest from slip, above the creep
    velocity. Not valid for N = 0.
    Source: Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994, 1083-1138.
    Checked: the differential form is constructed.
    """

    facts = Facts(
        ("D", "S", "St", "V", "P", "L", "T"),
        "C∞ (the original is switched)",
        "unverified",
        load="proportional in steady sliding",
    )
    ordered = (("mu_a", "mu_inf"),)

    k_t: Scalar = fields.STIFFNESS(1e5, doc="tangential stiffness")
    mu_d: Scalar = fields.MU_D(0.1, lower=1e-12)
    sigma_2: Scalar = fields.SIGMA_2(0.0)
    mu_inf: Scalar = fields.COEFFICIENT(0.05, doc="static excess after long rest")
    mu_a: Scalar = fields.COEFFICIENT(0.01, doc="static excess right after slip")
    v_s: Scalar = fields.V_S(1e-3)
    tau_L: Scalar = fields.TIME(0.02, doc="lag of the Stribeck curve")
    gamma: Scalar = fields.TIME(0.2, doc="dwell that recovers half the excess")
    v_e: Scalar = fields.VELOCITY(1e-4, doc="velocity that ends the rest")
    tau_r: Scalar = fields.TIME(0.01, doc="time that forgets the rest in slip")
    n: Scalar = fields.SHARPNESS(20.0)
    v_eps: Scalar = fields.REST_EPS(1e-15)
    r_eps: Scalar = fields.R_EPS(1e-8)

    @property
    def states(self) -> tuple[State, ...]:
        """Stretch of the spring, filtered velocity and dwell memory."""
        return (
            State("xi", "m", 1e-5, doc="stretch of the stiction spring"),
            State("w", "m/s", 1e-2, doc="velocity that the level follows"),
            State("q", "1", 1.0, even=True, doc="share of the rest that is remembered"),
        )

    @property
    def velocity_scale(self) -> Scalar:
        """Velocity v_e [m/s] that separates rest from slip."""
        return self.v_e

    def level(self, N: Scalar, w: Scalar, q: Scalar) -> Scalar:
        """Return the force L > 0 [N] at which the spring yields."""
        excess = self.mu_a + (self.mu_inf - self.mu_a) * q
        return N * (self.mu_d + excess / (1 + (w / self.v_s) ** 2))

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 without dwell memory, as well above v_e."""
        return self.level(N, speed, 0.0) + self.sigma_2 * speed

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the break-away force [N] after a long rest."""
        return self.level(N, 0.0, 1.0)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        return self.k_t * z[0] + self.sigma_2 * v

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the rates of the spring [m/s], the filter [m/s^2] and the dwell memory [1/s]."""
        xi, w, q = z[0], z[1], z[2]
        rest, slip = self._shares(v)
        share = self.k_t * xi / self.level(N, w, q)
        return column(
            yielding(v, share, self.n, self.v_eps, self.r_eps),
            (v - w) / self.tau_L,
            rest * (1 - q) ** 2 / self.gamma - slip * q / self.tau_r,
        )

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the spring at its level, the filter at v and the dwell memory in equilibrium."""
        q = self._balance(v)
        return column(self._yielded(v, N, v, q), v, q)

    def held_rest(self, v: Scalar, N: Scalar, z: Scalar) -> Scalar:
        """Return the equilibria; that of the spring is the level of the present w and q."""
        return column(self._yielded(v, N, z[1], z[2]), v, self._balance(v))

    def _shares(self, v: Scalar) -> tuple[Scalar, Scalar]:
        """Return the shares of rest and slip at v, with the sum 1; each is accurate if small."""
        x = -((v / self.v_e) ** 2)
        return exp(x), -expm1(x)

    def _balance(self, v: Scalar) -> Scalar:
        """Return the dwell memory at which growth equals loss.

        The square root of `slip` gamma is written as a multiple of |v|, so that its one-sided
        derivative exists at rest.
        """
        rest, slip = self._shares(v)
        grow, lose = rest * self.tau_r, slip * self.gamma
        of_speed = self.gamma * smooth.phi1(-((v / self.v_e) ** 2))
        root = smooth.magnitude(v, 0.0) / self.v_e * sqrt(of_speed * (lose + 4 * grow))
        return 2 * grow / (2 * grow + lose + root)

    def _yielded(self, v: Scalar, N: Scalar, w: Scalar, q: Scalar) -> Scalar:
        """Return the stretch of the spring at its level."""
        return self.level(N, w, q) / self.k_t * smooth.sign(v, self.v_eps)


@parametric
class RateAndState(Law):
    """Rate-and-state friction (one state), regularised at rest.

        psi = ln(v_0 theta / D_c)
        F   = N a asinh( v/(2 v_0) exp((mu_0 + b psi)/a) )
        dpsi/dt = v_0/D_c [exp(-psi) - w/v_0]             evolution = "ageing"
        dpsi/dt = -w/D_c [ln(w/v_0) + psi]                evolution = "slip"

    theta [s] is the mean age of the contacts and w = sqrt(v^2 + v_eps^2), so that the age is at
    most D_c/v_eps. For v >> v_0 exp(-mu_0/a) the force is N [mu_0 + a ln(v/v_0) + b psi].
    Limits: steady state N [mu_0 + (a - b) ln(|v|/v_0)] sign(v): weakening for a < b, unstable on a
    spring softer than N (b - a)/D_c. If the velocity is multiplied by e, mu rises by a, then falls
    by b over a few D_c. Creeps under any load; no pre-sliding. The slope at rest is
    N a/(2 v_0) exp((mu_0 + b psi)/a). If it exceeds 1e15 N s/m, it is lost in the rounding errors
    of the velocities of a mechanism, and step sizes decrease without limit. Intended for slow slip:
    for a < b the logarithm makes mu small or negative at velocities far above v_0.
    Source: Dieterich, J. Geophys. Res. 84, 1979; Ruina, J. Geophys. Res. 88, 1983; asinh form:
    Rice, Ben-Zion, PNAS 93, 1996.
    Checked: jrleeman/rsfmodel and public MATLAB code (inverse hyperbolic sine).

    Raises:
        ValueError: mu_0 > 150 a, or mu_0 + b ln(v_0/v_eps) > 200 a; derivatives would overflow.
    """

    facts = Facts(("D", "St", "L", "T"), "C∞", "two sources", load="proportional")

    mu_0: Scalar = fields.COEFFICIENT(0.12, doc="friction coefficient at v_0", lower=1e-12)
    a: Scalar = fields.COEFFICIENT(0.01, doc="direct effect", lower=1e-6)
    b: Scalar = fields.COEFFICIENT(0.015, doc="evolution effect")
    v_0: Scalar = fields.VELOCITY(1e-6, doc="reference velocity", lower=1e-15)
    D_c: Scalar = fields.LENGTH(1e-5, doc="slip that renews the contacts")
    v_eps: Scalar = fields.REST_EPS(
        1e-12, doc="counts as rest; D_c/v_eps is the age of the oldest contact", lower=1e-15
    )
    evolution: str = option("ageing", choices=("ageing", "slip"), doc="Dieterich's or Ruina's law")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not all(map(is_number, (self.mu_0, self.a, self.b, self.v_0, self.v_eps))):
            return
        oldest = self.mu_0 + self.b * max(log(self.v_0 / self.v_eps), 0.0)
        if self.mu_0 > 150 * self.a or oldest > 200 * self.a:
            raise ValueError(
                f"RateAndState: expected mu_0 <= 150 a and, of the oldest contact, "
                f"mu_0 + b ln(v_0/v_eps) <= 200 a, got {self.mu_0:g} and {oldest:g} for "
                f"a = {self.a:g}; the regularisation would overflow"
            )

    @property
    def states(self) -> tuple[State, ...]:
        """Logarithm psi of the age of the contacts."""
        return (State("psi", "1", 1.0, even=True, doc="logarithm of the contacts' age"),)

    def _speed(self, v: Scalar) -> Scalar:
        return sqrt(v * v + self.v_eps * self.v_eps)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Raise an error, since the steady force contains ln v and any load causes creep."""
        raise one_sided(self, "it creeps under any load, and ln v has no limit at rest")

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        argument = v / (2 * self.v_0) * exp((self.mu_0 + self.b * z[0]) / self.a)
        return N * self.a * asinh(argument)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the rate of psi [1/s], shape (1, 1)."""
        w = self._speed(v)
        if self.evolution == "slip":
            return column(-w / self.D_c * (log(w / self.v_0) + z[0]))
        return column(self.v_0 / self.D_c * (exp(-z[0]) - w / self.v_0))

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return psi in steady sliding, shape (1, 1); 0, the age D_c/v_0, for |v| < v_eps.

        A contact at rest has no steady age. The largest age D_c/v_eps is of the order of months; a
        body released under a load above the break-away force of such a contact would accelerate
        faster than a step can resolve.
        """
        moves = smooth.magnitude(v, 0.0) >= self.v_eps
        return column(smooth.choose(moves, -log(self._speed(v) / self.v_0), 0.0))
