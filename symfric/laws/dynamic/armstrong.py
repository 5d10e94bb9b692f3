"""Armstrong's seven-parameter model as differential equations."""

from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, column, exp, expm1, sqrt
from symfric.foundation.parameters import param
from symfric.laws.base import smooth
from symfric.laws.base.law import Facts, Law, State
from symfric.laws.dynamic.element import yielding


@final
@dataclass(frozen=True, eq=False)
class Armstrong(Law):
    """Armstrong's seven-parameter friction in differential form (three states).

        L     = N { mu_d + [mu_a + (mu_inf - mu_a) q] / [1 + (w/v_s)^2] }
        xi    : spring of stiffness k_t that yields at L with the sharpness n
        dw/dt = (v - w) / tau_L
        dq/dt = rest (1 - q)^2/gamma - (1 - rest) q/tau_r,   rest = exp(-(v/v_e)^2)
        F     = k_t xi + sigma_2 v

    The seven are k_t, mu_d, sigma_2, mu_inf (excess of the static over the dynamic level after long
    rest), v_s, tau_L (lag of the Stribeck curve) and gamma (dwell); mu_a is the excess right after
    slip. The paper switches between a stiction spring k_t x and a sliding law with a pure delay
    tau_L and a dwell clock; here one spring yields, a filter makes the delay, and
    q = t/(t + gamma) counts the rest of duration t, forgotten within tau_r of slip.
    Limits: steady state L(v) sign(v) + sigma_2 v; gamma -> inf, tau_L -> 0, k_t -> inf is the
    Lorentzian law with the excess mu_a. v_e tells rest from slip; keep it above the creep.
    Not valid for N = 0.
    Source: Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994, 1083-1138.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "V", "P", "L", "T"),
        smoothness="C∞ (the original is switched)",
        confidence="unverified",
        checked="the differential form is constructed",
        source="Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994",
        load="proportional in steady sliding",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_a", "mu_inf"),)

    k_t: Scalar = param(1e5, unit="N/m", role="stiffness", doc="tangential stiffness", lower=1e-12)
    mu_d: Scalar = param(
        0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=1e-12
    )
    sigma_2: Scalar = param(0.0, unit="N s/m", role="viscous", doc="viscous coefficient", lower=0.0)
    mu_inf: Scalar = param(
        0.05, unit="1", role="level", doc="static excess after long rest", lower=0.0
    )
    mu_a: Scalar = param(
        0.01, unit="1", role="level", doc="static excess right after slip", lower=0.0
    )
    v_s: Scalar = param(
        1e-3, unit="m/s", role="velocity scale", doc="Stribeck velocity", lower=1e-12
    )
    tau_L: Scalar = param(0.02, unit="s", role="time", doc="lag of the Stribeck curve", lower=1e-12)
    gamma: Scalar = param(
        0.2, unit="s", role="time", doc="dwell that recovers half the excess", lower=1e-12
    )
    v_e: Scalar = param(
        1e-4, unit="m/s", role="velocity scale", doc="velocity that ends the rest", lower=1e-12
    )
    tau_r: Scalar = param(
        0.01, unit="s", role="time", doc="time that forgets the rest in slip", lower=1e-12
    )
    n: Scalar = param(
        20.0, unit="1", role="shape", doc="sharpness of the yielding", lower=1.0, upper=1e3
    )
    v_eps: Scalar = param(
        1e-15, unit="m/s", role="width", doc="smoothing velocity of |v|", lower=0.0
    )
    r_eps: Scalar = param(
        1e-8, unit="1", role="width", doc="smoothing of the load share", lower=1e-12
    )

    @property
    def states(self) -> tuple[State, ...]:
        """Spring, filtered velocity and dwell."""
        return (
            State("xi", "m", 1e-5, doc="stretch of the stiction spring"),
            State("w", "m/s", 1e-2, doc="velocity that the level follows"),
            State("q", "1", 1.0, even=True, doc="share of the rest that is remembered"),
        )

    @property
    def velocity_scale(self) -> Scalar:
        """The velocity that ends the rest [m/s]."""
        return self.v_e

    def level(self, N: Scalar, w: Scalar, q: Scalar) -> Scalar:
        """The force L > 0 [N] at which the spring yields."""
        excess = self.mu_a + (self.mu_inf - self.mu_a) * q
        return N * (self.mu_d + excess / (1 + (w / self.v_s) ** 2))

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Steady sliding force [N] at a speed >= 0, above v_e, where no rest is remembered."""
        return self.level(N, speed, 0.0) + self.sigma_2 * speed

    def static_level(self, N: Scalar, side: int = 1) -> Scalar:
        """The force [N] of break-away after a long rest."""
        return self.level(N, 0.0, 1.0)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        return self.k_t * z[0] + self.sigma_2 * v

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Rates of the spring [m/s], the filter [m/s^2] and the dwell [1/s]."""
        xi, w, q = z[0], z[1], z[2]
        rest, slip = self._shares(v)
        share = self.k_t * xi / self.level(N, w, q)
        return column(
            yielding(v, share, self.n, self.v_eps, self.r_eps),
            (v - w) / self.tau_L,
            rest * (1 - q) ** 2 / self.gamma - slip * q / self.tau_r,
        )

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Spring at its level, filter at v, dwell in balance of growth and loss."""
        q = self._balance(v)
        return column(self._yielded(v, N, v, q), v, q)

    def held_rest(self, v: Scalar, N: Scalar, z: Scalar) -> Scalar:
        """The same with the spring at the level of the filter and the dwell that there are."""
        return column(self._yielded(v, N, z[1], z[2]), v, self._balance(v))

    def _shares(self, v: Scalar) -> tuple[Scalar, Scalar]:
        """How much v is rest and how much slip, together 1, each right where it is small."""
        x = -((v / self.v_e) ** 2)
        return exp(x), -expm1(x)

    def _balance(self, v: Scalar) -> Scalar:
        """Where the dwell grows as fast as it is lost.

        The root of what is lost, `slip` gamma, is written with |v|: it has a slope at rest, too.
        """
        rest, slip = self._shares(v)
        grow, lose = rest * self.tau_r, slip * self.gamma
        of_speed = self.gamma * smooth.phi1(-((v / self.v_e) ** 2))
        root = smooth.magnitude(v, 0.0) / self.v_e * sqrt(of_speed * (lose + 4 * grow))
        return 2 * grow / (2 * grow + lose + root)

    def _yielded(self, v: Scalar, N: Scalar, w: Scalar, q: Scalar) -> Scalar:
        """Stretch of the spring at its level."""
        return self.level(N, w, q) / self.k_t * smooth.sign(v, self.v_eps)
