"""Bliman-Sorine friction: linear in the path, with a break-away peak."""

from dataclasses import dataclass
from math import inf
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, column
from symfric.foundation.parameters import option, param
from symfric.laws.base import smooth
from symfric.laws.base.law import Facts, Law, State


@final
@dataclass(frozen=True, eq=False)
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
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "P"),
        smoothness="C∞ (C0 at v = 0 as v_eps -> 0)",
        confidence="unverified",
        checked="its closed forms hold",
        source="Bliman and Sorine, ECC 1995; Olsson et al. 1998",
        load="proportional in steady sliding",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_2", "mu_1"),)

    mu_1: Scalar = param(
        0.3, unit="1", role="level", doc="coefficient of the fast part", lower=1e-12
    )
    mu_2: Scalar = param(0.2, unit="1", role="level", doc="coefficient of the slow part", lower=0.0)
    eta: Scalar = param(
        0.4, unit="1", role="shape", doc="path ratio, fast to slow", lower=1e-6, upper=0.999
    )
    s_f: Scalar = param(
        1e-5, unit="m", role="length", doc="path constant of the slow part", lower=1e-15
    )
    v_eps: Scalar = param(
        1e-15, unit="m/s", role="width", doc="smoothing velocity of |v|", lower=0.0
    )
    order: str = option("2", choices=("1", "2"), doc="number of states")

    @property
    def states(self) -> tuple[State, ...]:
        """The fast and the slow part of the force."""
        count = range(1, int(self.order) + 1)
        return tuple(State(f"F_{i}", "N", 1.0, doc=f"part {i} of the force") for i in count)

    @property
    def velocity_scale(self) -> Scalar:
        """One path constant a second [m/s]; none without the peak of order 2.

        The force depends on the path alone. But a contact that rings under its peak breaks away
        by the phase in which it meets the peak, and error control must resolve the ringing.
        """
        return self.s_f if self.order == "2" else inf

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Steady sliding force [N] at a speed >= 0."""
        return (self.mu_1 if self.order == "1" else self.mu_1 - self.mu_2) * N

    def static_level(self, N: Scalar, side: int = 1) -> Scalar:
        """The height [N] of the peak at the path s_p, which the order 1 does not have."""
        if self.order == "1":
            return self.mu_1 * N
        q = self.eta * self.mu_2 / self.mu_1  # exp(-s_p (1 - eta)/(eta s_f))
        slow, fast = q ** (self.eta / (1 - self.eta)), q ** (1 / (1 - self.eta))
        return N * (self.mu_1 * (1 - fast) - self.mu_2 * (1 - slow))

    def most_held(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """That of both parts, which point the same way behind a reversal."""
        return N * (self.mu_1 if self.order == "1" else self.mu_1 + self.mu_2)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        return z[0] if self.order == "1" else z[0] + z[1]

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Rates of the parts [N/s]."""
        speed = smooth.magnitude(v, self.v_eps)
        fast = (self.mu_1 * N * v - speed * z[0]) / (self.eta * self.s_f)
        if self.order == "1":
            return column(fast)
        return column(fast, (-self.mu_2 * N * v - speed * z[1]) / self.s_f)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """The parts in steady sliding [N]."""
        direction = smooth.sign(v, self.v_eps)
        parts = self.mu_1 * N * direction, -self.mu_2 * N * direction
        return column(*parts[: int(self.order)])
