"""LuGre friction: a bristle with stiction, Stribeck effect and viscous friction."""

from dataclasses import dataclass
from typing import ClassVar, final

from symfric.laws import smooth
from symfric.laws.base import Facts, Law, State
from symfric.numeric import Scalar, column
from symfric.parameters import param


@final
@dataclass(frozen=True, eq=False)
class LuGre(Law):
    """LuGre bristle friction (one state).

        g     = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)]
        dz/dt = v - sigma_0 |v| z / g
        F     = sigma_0 z + sigma_1 dz/dt + sigma_2 v

    `z` is the mean bristle deflection [m].
    Limits: steady state g sign(v) + sigma_2 v; drifts under vibration. |v| is smooth over v_eps
    and exactly zero at rest; v_eps = 0 is the original with a kink at v = 0, for which
    |z| <= mu_s N / sigma_0 is invariant. Keep v_eps ten times below the creep while sticking, the
    loading rate over sigma_0 (on a belt k v_belt / sigma_0): at more, the bristle stretches on
    instead of breaking away and stick-slip comes out wrong without a sign of it. Passive from v
    to F only if sigma_2 >= sigma_1 (mu_s - mu_d) / mu_d, which the default set does not meet:
    after a jump in v the force may point forward for an instant. Not valid for N = 0 or a
    fast-varying N, since the deflection does not shrink with the load.
    Source: Canudas de Wit, Olsson, Astrom, Lischinsky, IEEE TAC 40(3), 1995, 419-425.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "V", "P", "L", "B"),
        smoothness="C∞ (C0 at v = 0 as v_eps -> 0)",
        confidence="two sources",
        source="Canudas de Wit, Olsson, Astrom, Lischinsky, IEEE TAC 40(3), 1995",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_d", "mu_s"),)

    mu_s: Scalar = param(0.15, unit="1", doc="static friction coefficient", lower=0.0)
    mu_d: Scalar = param(0.1, unit="1", doc="dynamic friction coefficient", lower=1e-12)
    v_s: Scalar = param(1e-3, unit="m/s", doc="Stribeck velocity", lower=1e-12)
    delta: Scalar = param(2.0, unit="1", doc="Stribeck exponent", lower=0.1, upper=10.0)
    sigma_0: Scalar = param(1e5, unit="N/m", doc="bristle stiffness", lower=1e-12)
    sigma_1: Scalar = param(190.0, unit="N s/m", doc="bristle damping", lower=0.0)
    sigma_2: Scalar = param(0.0, unit="N s/m", doc="viscous coefficient", lower=0.0)
    v_eps: Scalar = param(1e-9, unit="m/s", doc="smoothing velocity of |v|", lower=0.0)

    @property
    def states(self) -> tuple[State, ...]:
        """The bristle deflection."""
        return (State("z", "m", 1e-5),)

    def level(self, v: Scalar, N: Scalar) -> Scalar:
        """The Stribeck curve g(v, N) > 0 [N] that the bristle force tends to."""
        falling = smooth.stribeck(v, self.v_s, self.delta, self.v_eps)
        return N * (self.mu_d + (self.mu_s - self.mu_d) * falling)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Rate of the bristle deflection [m/s], shape (1, 1)."""
        relaxation = self.sigma_0 * smooth.magnitude(v, self.v_eps) / self.level(v, N)
        return column(v - relaxation * z[0])

    @property
    def velocity_scale(self) -> Scalar:
        """The Stribeck velocity [m/s]."""
        return self.v_s

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        return self.sigma_0 * z[0] + self.sigma_1 * self.rate(v, N, z)[0] + self.sigma_2 * v

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Bristle deflection in steady sliding [m], shape (1, 1)."""
        return column(self.level(v, N) / self.sigma_0 * smooth.sign(v, self.v_eps))
