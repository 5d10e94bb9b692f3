"""Gonthier friction: a bristle whose level grows with the dwell time."""

from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, column, equals, exp, expm1
from symfric.foundation.parameters import param
from symfric.foundation.vector import TINY
from symfric.laws.base import smooth
from symfric.laws.base.law import Facts, Law, State
from symfric.laws.dynamic.element import deflection


@final
@dataclass(frozen=True, eq=False)
class Gonthier(Law):
    """Gonthier friction with dwell time (two states).

        s        = exp(-(v/v_s)^2),   dir = 3/2 u - 1/2 u^3 for u = v/v_d in [-1, 1], else sign(v)
        F_C      = N [mu_d + (mu_s - mu_d) s_dw]
        dz/dt    = s v + (1 - s) [F_C dir - sigma_0 z] / sigma_1
        ds_dw/dt = (s - s_dw) / tau,  tau = tau_dw while dwelling (s > s_dw), else sigma_1 / sigma_0
        F        = sat(sigma_0 z + sigma_1 dz/dt, F_C) + sigma_2 v

    s_dw is the memory of the dwell: after a rest of duration t, break-away takes
    N [mu_d + (mu_s - mu_d) (1 - exp(-t/tau_dw))]. sat(x, F_C) is x up to F_C and bends over to
    (1 + kappa) F_C. Without it the printed law creeps under any load when v_s is above the
    creep velocity: its force there is F_C + sigma_1 v s/(1 - s), 191 N at 1 um/s; kappa = 0 asks
    for that original. tau changes smoothly over s_eps.
    Limits: steady state F_C(s(v)) dir + sigma_2 v for v far above v_s; mu_s = mu_d has no dwell
    effect. Needs v_d < v_s. dz/dt does not vanish in creep (v < v_s), where only sat bounds F.
    Source: Gonthier, McPhee, Lange, Piedboeuf, Multibody Syst. Dyn. 11, 2004, 209-233; the
    saturation is added here.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "V", "P", "L", "B", "T"),
        smoothness="C1 (dir at v_d; C2 elsewhere)",
        confidence="unverified",
        checked="behaviour checked; the saturation is constructed",
        source="Gonthier, McPhee, Lange, Piedboeuf, Multibody Syst. Dyn. 11, 2004",
        load="proportional in steady sliding",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_d", "mu_s"),)
    strictly_ordered: ClassVar[tuple[tuple[str, str], ...]] = (("v_d", "v_s"),)

    mu_s: Scalar = param(0.15, unit="1", role="level", doc="static friction coefficient", lower=0.0)
    mu_d: Scalar = param(
        0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=1e-12
    )
    v_s: Scalar = param(
        1e-3, unit="m/s", role="velocity scale", doc="Stribeck velocity", lower=1e-12
    )
    v_d: Scalar = param(
        1e-4, unit="m/s", role="velocity scale", doc="velocity of full direction", lower=1e-12
    )
    sigma_0: Scalar = param(1e5, unit="N/m", role="stiffness", doc="bristle stiffness", lower=1e-12)
    sigma_1: Scalar = param(190.0, unit="N s/m", role="damping", doc="bristle damping", lower=1e-12)
    sigma_2: Scalar = param(0.0, unit="N s/m", role="viscous", doc="viscous coefficient", lower=0.0)
    tau_dw: Scalar = param(
        0.1, unit="s", role="time", doc="time constant of the dwell", lower=1e-12
    )
    kappa: Scalar = param(
        1e-3, unit="1", role="width", doc="rounding of the saturation", lower=0.0, upper=1.0
    )
    s_eps: Scalar = param(
        1e-3, unit="1", role="width", doc="smoothing of the dwell switch", lower=1e-12
    )

    @property
    def states(self) -> tuple[State, ...]:
        """Bristle deflection and dwell memory."""
        dwell = State("s_dw", "1", 1.0, even=True, doc="memory of the dwell, 1 after long rest")
        return (State("z", "m", deflection(self.sigma_0), doc="bristle deflection"), dwell)

    @property
    def velocity_scale(self) -> Scalar:
        """The velocity of full direction [m/s]."""
        return self.v_d

    def _sticking(self, v: Scalar) -> Scalar:
        return exp(-((v / self.v_s) ** 2))

    def _level(self, N: Scalar, s_dw: Scalar) -> Scalar:
        return N * (self.mu_d + (self.mu_s - self.mu_d) * s_dw)

    def _direction(self, v: Scalar) -> Scalar:
        u = smooth.clip(v / self.v_d, -1.0, 1.0)
        return u * (1.5 - 0.5 * u * u)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Rates of the deflection [m/s] and of the dwell memory [1/s]."""
        s, fast = self._sticking(v), self.sigma_1 / self.sigma_0
        pull = (self._level(N, z[1]) * self._direction(v) - self.sigma_0 * z[0]) / self.sigma_1
        dwelling = (1 + smooth.sign(s - z[1], self.s_eps)) / 2
        tau = fast + (self.tau_dw - fast) * dwelling
        return column(s * v + (1 - s) * pull, (s - z[1]) / tau)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Steady sliding force [N] at a speed >= 0, in its limit of small v_d."""
        return self._level(N, self._sticking(speed)) + self.sigma_2 * speed

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        bristle = self.sigma_0 * z[0] + self.sigma_1 * self.rate(v, N, z)[0]
        if equals(self.kappa, 0.0):
            return bristle + self.sigma_2 * v
        rounding = self.kappa * self._level(N, z[1])
        return smooth.hold(bristle, self._level(N, z[1]) + rounding, rounding) + self.sigma_2 * v

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Dwell memory s(v), and the deflection at which the force stays.

        dz/dt vanishes at sigma_0 z = F_C dir + sigma_1 v s/(1 - s). In creep that is far beyond
        the level F_C, at which the saturated force is reached: the deflection stands there, and
        goes on growing without effect on the force but for kappa F_C.
        """
        s, x = self._sticking(v), v / self.v_s
        F_C = self._level(N, s)
        creep = self.sigma_1 * self.v_s * s * x / (TINY - expm1(-x * x))
        z = smooth.clip(F_C * self._direction(v) + creep, -F_C, F_C) / self.sigma_0
        return column(z, s)
