"""Rui-Wang static friction: a sine of an arctangent, without a normal force."""

from dataclasses import dataclass
from math import pi
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, atan, equals, sin
from symfric.foundation.parameters import param
from symfric.laws.base import smooth
from symfric.laws.base.law import Facts, StaticLaw


@final
@dataclass(frozen=True, eq=False)
class RuiWang(StaticLaw):
    """Rui-Wang static friction, a reconstruction: the magic formula with constant level.

        y = B v,   phi = (1 - E) y + E atan(y)
        F = D sin(C atan(phi))

    Recorded of the original are only that it is continuously differentiable in v and knows neither
    mu_d, nor N, nor a transition velocity, and that `SelfTuning` modifies it and keeps sine and
    arctangent; the equation is presumed.
    Limits: `SelfTuning` with D = mu_s N and its C; F -> D sin(C pi/2). `N` has no effect. C <= 1 is
    monotone, C > 1 has a peak. Creeps under load.
    Source: reconstruction; the equation of Wang and Rui 2000 is lost and was not read.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St"),
        smoothness="C∞",
        confidence="rebuilt",
        source="after Wang and Rui 2000 (equation lost)",
        load="independent",
    )

    D: Scalar = param(1.5, unit="N", role="level", doc="peak", lower=0.0)
    C: Scalar = param(1.5, unit="1", role="shape", doc="shape factor", lower=0.0, upper=2.0)
    B: Scalar = param(
        1000.0, unit="s/m", role="velocity scale", width=-1, doc="stiffness factor", lower=1e-12
    )
    E: Scalar = param(0.0, unit="1", role="shape", doc="curvature factor", upper=0.999)

    @property
    def velocity_scale(self) -> Scalar:
        """The velocity 1/B [m/s]."""
        return 1 / self.B

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish."""
        return self.D * sin(self.C * pi / 2)

    def static_level(self, N: Scalar, side: int = 1) -> Scalar:
        """The peak [N]; what a curve without one tends to."""
        return self.D * sin(smooth.clip(self.C, 0.0, 1.0) * pi / 2)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        y = self.B * v
        phi = y if equals(self.E, 0.0) else (1 - self.E) * y + self.E * atan(y)
        return self.D * sin(self.C * atan(phi))
