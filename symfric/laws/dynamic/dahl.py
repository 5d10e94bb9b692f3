"""Dahl friction: a bristle without stiction."""

from dataclasses import dataclass
from math import inf
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, column, equals
from symfric.foundation.parameters import param
from symfric.laws.base import smooth
from symfric.laws.base.law import Facts, Law, State
from symfric.laws.dynamic.element import deflection, spent


@final
@dataclass(frozen=True, eq=False)
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
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "P"),
        smoothness="C∞ (C0 at v = 0 as v_eps -> 0)",
        confidence="two sources",
        checked="n = 1: Altair MotionSolve's manual and public code; n is unverified",
        source="Dahl 1968, 1976",
    )

    sigma_0: Scalar = param(1e5, unit="N/m", role="stiffness", doc="bristle stiffness", lower=1e-12)
    mu_d: Scalar = param(
        0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=1e-12
    )
    n: Scalar = param(1.0, unit="1", role="shape", doc="exponent", lower=0.0, upper=10.0)
    v_eps: Scalar = param(
        1e-15, unit="m/s", role="width", doc="smoothing velocity of |v|", lower=0.0
    )
    rho_eps: Scalar = param(
        1e-3, unit="1", role="width", doc="smoothing of |rho|, for n != 1", lower=1e-12
    )

    @property
    def states(self) -> tuple[State, ...]:
        """z: deflection of the contact [m], positive with v."""
        return (State("z", "m", deflection(self.sigma_0), doc="mean bristle deflection"),)

    @property
    def velocity_scale(self) -> Scalar:
        """None: the force depends on the path alone."""
        return inf

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Steady sliding force [N] at a speed >= 0."""
        return self.mu_d * N

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        return self.sigma_0 * z[0]

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Rate of the bristle deflection [m/s], shape (1, 1)."""
        level = self.sigma_0 * z[0] / (self.mu_d * N)
        if equals(self.n, 1.0):
            return column(v - smooth.magnitude(v, self.v_eps) * level)
        t = smooth.sign(v, self.v_eps)
        lost = spent(lambda r: 1 - smooth.signed_power(1 - r, self.n, self.rho_eps), v, t, level)
        return column(v - lost)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Bristle deflection in steady sliding [m], shape (1, 1)."""
        return column(self.mu_d * N / self.sigma_0 * smooth.sign(v, self.v_eps))
