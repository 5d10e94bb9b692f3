"""Stick-slip friction of Cha: a coefficient blended from velocity and stiction deformation."""

from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, column
from symfric.foundation.parameters import option, param
from symfric.laws.base import smooth
from symfric.laws.base.law import Facts, Law, State
from symfric.laws.dynamic.element import yielding

ROOT_STEPS = 10
"""Steps of Newton's method that reach a root to rounding for every sharpness allowed."""


@final
@dataclass(frozen=True, eq=False)
class StickSlip(Law):
    """Stick-slip friction with stiction deformation (one state).

        beta  = 1 - step(|v|/v_s)                     1 in stick, 0 in slip
        mu_v  = sign(v) [mu_s - (mu_s - mu_d) step((|v| - v_s)/(v_d - v_s))]
        mu_D  = mu_s (2 step((D/D_max + 1)/2) - 1)
        F     = N [(1 - beta) mu_v + beta mu_D]
        dD/dt = beta v [1 - |D/D_max|^n (1 + sign(v D))/2] - (1 - beta) |v| D/D_max

    D [m] is the stiction deformation, forgotten in slip over the path D_max. The step is the
    quintic one. branch = "published" lets mu_v fall to zero within v_s, as in mu_v of
    `VelocityBased`: the blend then dips below mu_s, which leaves a second, creeping equilibrium
    under load; "plateau" keeps mu_s there.
    Limits: mu_v N for |v| >= v_s; holds any load below mu_s N at rest. The spring at rest,
    15/8 mu_s N / D_max, is stiff and undamped. An interpretation: the structure is published, the
    formulas of the blend and of D are not known here.
    Source: Cha, Choi, Ryu, Choi, J. Mech. Sci. Technol. 25, 2011 (abstract).
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "P"),
        smoothness="C2",
        confidence="rebuilt",
        checked="the structure is that of the abstract, the formulas are made here",
        source="Cha, Choi, Ryu, Choi, J. Mech. Sci. Technol. 25, 2011",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_d", "mu_s"),)
    strictly_ordered: ClassVar[tuple[tuple[str, str], ...]] = (("v_s", "v_d"),)

    mu_s: Scalar = param(0.15, unit="1", role="level", doc="static friction coefficient", lower=0.0)
    mu_d: Scalar = param(0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=0.0)
    v_s: Scalar = param(
        1e-3, unit="m/s", role="velocity scale", doc="velocity of full slip", lower=1e-12
    )
    v_d: Scalar = param(
        1.5e-3, unit="m/s", role="velocity scale", doc="velocity of the dynamic level", lower=1e-12
    )
    D_max: Scalar = param(
        1e-6, unit="m", role="length", doc="largest stiction deformation", lower=1e-15
    )
    n: Scalar = param(
        20.0, unit="1", role="shape", doc="sharpness of the yielding", lower=1.0, upper=1e3
    )
    v_eps: Scalar = param(
        1e-15, unit="m/s", role="width", doc="smoothing velocity of |v|", lower=0.0
    )
    r_eps: Scalar = param(
        1e-8, unit="1", role="width", doc="smoothing of the deformation", lower=1e-12
    )
    branch: str = option("plateau", choices=("plateau", "published"), doc="mu_v within v_s")

    @property
    def states(self) -> tuple[State, ...]:
        """D: deformation of the contact while it sticks [m]."""
        return (State("D", "m", 1e-6, doc="stiction deformation"),)

    @property
    def velocity_scale(self) -> Scalar:
        """The velocity of full slip [m/s]."""
        return self.v_s

    def _slipping(self, v: Scalar) -> Scalar:
        return smooth.step5(smooth.magnitude(v, self.v_eps) / self.v_s)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Steady sliding force [N] at a speed >= 0, the plateau mu_s N within v_s."""
        fallen = smooth.step5((speed - self.v_s) / (self.v_d - self.v_s))
        return N * (self.mu_s - (self.mu_s - self.mu_d) * fallen)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        slip, speed = self._slipping(v), smooth.magnitude(v, self.v_eps)
        fallen = smooth.step5((speed - self.v_s) / (self.v_d - self.v_s))
        mu = self.mu_s - (self.mu_s - self.mu_d) * fallen
        if self.branch == "published":
            direction = smooth.sign(v, self.v_eps) * slip
        else:
            direction = smooth.sign(v, self.v_eps)
        u = smooth.clip(z[0] / self.D_max, -1.0, 1.0)
        stiction = self.mu_s * u * (15 - u * u * (10 - 3 * (u * u))) / 8  # 2 step((u + 1)/2) - 1
        return N * (slip * mu * direction + (1 - slip) * stiction)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Rate of the stiction deformation [m/s], shape (1, 1)."""
        slip, r = self._slipping(v), z[0] / self.D_max
        stretch = yielding(v, r, self.n, self.v_eps, self.r_eps)
        forgotten = smooth.magnitude(v, self.v_eps) * r
        return column((1 - slip) * stretch - slip * forgotten)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Where growth and loss are equal, none left beyond v_s, shape (1, 1).

        The root of slip r + (1 - slip) (r^n - 1), convex, by Newton's method from r = 1.
        """
        slip, r = self._slipping(v), 1.0 + 0.0 * v
        for _ in range(ROOT_STEPS):
            spent = (1 - slip) * smooth.power(r, self.n, self.r_eps)
            r = r - (slip * r + spent - (1 - slip)) / (slip + self.n * spent / (r + self.r_eps))
        return column(self.D_max * r * smooth.sign(v, self.v_eps))
