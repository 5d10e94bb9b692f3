"""Bouc-Wen hysteresis as a friction element."""

from dataclasses import dataclass
from math import inf
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, column, is_number
from symfric.foundation.parameters import param
from symfric.laws.base import smooth
from symfric.laws.base.law import Facts, Law, State
from symfric.laws.dynamic.element import onward


@final
@dataclass(frozen=True, eq=False)
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
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "P"),
        smoothness="C∞ (C0 at v = 0 as v_eps -> 0)",
        confidence="one source",
        checked="diegoandresalvarez/BWBN_TMCMC diff_eq_real.m",
        source="Wen, J. Eng. Mech. Div. ASCE 102(2), 1976",
        load="proportional in steady sliding",
    )

    mu_d: Scalar = param(
        0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=1e-12
    )
    sigma_0: Scalar = param(
        1e5, unit="N/m", role="stiffness", doc="initial stiffness for A = 1", lower=1e-12
    )
    A: Scalar = param(1.0, unit="1", role="shape", doc="scale of the stiffness", lower=1e-12)
    beta: Scalar = param(0.5, unit="1", role="shape", doc="yielding while loading", lower=1e-12)
    gamma: Scalar = param(0.5, unit="1", role="shape", doc="yielding in either direction")
    n: Scalar = param(
        2.0, unit="1", role="shape", doc="sharpness of the yielding", lower=1.0, upper=1e3
    )
    v_eps: Scalar = param(
        1e-15, unit="m/s", role="width", doc="smoothing velocity of |v|", lower=0.0
    )
    z_eps: Scalar = param(
        1e-8, unit="1", role="width", doc="smoothing of the load share", lower=1e-12
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if all(map(is_number, (self.beta, self.gamma))) and not (
            -self.beta < self.gamma <= self.beta
        ):
            raise ValueError(
                f"BoucWen: expected -beta < gamma <= beta, got gamma = {self.gamma:g} and "
                f"beta = {self.beta:g}; beyond them the element is unbounded or gives energy"
            )

    @property
    def states(self) -> tuple[State, ...]:
        """z: the share of the limit that the hysteretic part carries, within -1 ... 1."""
        return (State("z", "1", 1.0, doc="friction force over its limit"),)

    @property
    def velocity_scale(self) -> Scalar:
        """None: the force depends on the path alone."""
        return inf

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Steady sliding force [N] at a speed >= 0."""
        share = (self.A / (self.beta + self.gamma)) ** (1 / self.n)
        return self.mu_d * N * share

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        return self.mu_d * N * z[0]

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Rate of the load share [1/s], shape (1, 1)."""
        used = smooth.overload(z[0], self.n, self.z_eps)
        t, s = smooth.sign(v, self.v_eps), smooth.sign(z[0], self.z_eps)
        yielded = (self.beta - self.gamma) * s + self.gamma * onward(t, s)
        stretch = self.A * v - used * (v * t) * yielded
        return column(self.sigma_0 / (self.mu_d * N) * stretch)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Load share in steady sliding, shape (1, 1)."""
        share = (self.A / (self.beta + self.gamma)) ** (1 / self.n)
        return column(share * smooth.sign(v, self.v_eps))
