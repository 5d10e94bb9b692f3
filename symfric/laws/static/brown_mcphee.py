"""Brown-McPhee friction: one smooth expression with stiction peak and Stribeck fall."""

from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, equals, tanh
from symfric.foundation.parameters import param
from symfric.laws.base.law import Facts, StaticLaw


@final
@dataclass(frozen=True, eq=False)
class BrownMcPhee(StaticLaw):
    """Brown-McPhee friction.

        x = v / v_t
        F = N [mu_d tanh(4x) + (mu_s - mu_d) x / (x^2/4 + 3/4)^2] + mu_v v tanh(4 N / N_t)

    Limits: F(v_t) = N (mu_s - 6.7e-4 mu_d), so the static level is met to 0.1 %; the excess over
    mu_d N falls like 16 (v_t/v)^3; mu_s = mu_d gives mu_d N tanh(4x). Creeps under load. Slope at
    rest N [4 mu_d + (16/9)(mu_s - mu_d)] / v_t sets the stiffness of the scene.
    Source: Brown and McPhee, ASME J. Comput. Nonlinear Dynam. 11(5), 2016, 054502.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "V"),
        smoothness="C∞",
        confidence="two sources",
        checked="public MATLAB function Friction_B and the code of a railway simulator",
        source="Brown and McPhee, J. Comput. Nonlinear Dynam. 11(5), 2016",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_d", "mu_s"),)

    mu_s: Scalar = param(0.15, unit="1", role="level", doc="static friction coefficient", lower=0.0)
    mu_d: Scalar = param(0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=0.0)
    v_t: Scalar = param(
        1e-3, unit="m/s", role="velocity scale", width=1, doc="transition velocity", lower=1e-12
    )
    mu_v: Scalar = param(0.0, unit="N s/m", role="viscous", doc="viscous coefficient", lower=0.0)
    N_t: Scalar = param(1.0, unit="N", role="load", doc="transition normal force", lower=1e-12)

    @property
    def velocity_scale(self) -> Scalar:
        """The transition velocity [m/s]."""
        return self.v_t

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish."""
        if equals(self.mu_v, 0.0):
            return self.mu_d * N
        return self.mu_d * N + self.mu_v * speed * tanh(4 * N / self.N_t)

    def static_level(self, N: Scalar, side: int = 1) -> Scalar:
        """The force [N] of break-away, mu_s N."""
        return self.mu_s * N

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        x = v / self.v_t
        bump = x / (0.25 * (x * x) + 0.75) ** 2
        dry = self.mu_d * tanh(4 * x) + (self.mu_s - self.mu_d) * bump
        if equals(self.mu_v, 0.0):
            return dry * N
        return dry * N + self.mu_v * v * tanh(4 * N / self.N_t)
