"""Rate-and-state friction: velocity and age of the contacts."""

from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, asinh, column, exp, is_number, log, sqrt
from symfric.foundation.parameters import option, param
from symfric.laws.base import smooth
from symfric.laws.base.law import Facts, Law, State, one_sided


@final
@dataclass(frozen=True, eq=False)
class RateAndState(Law):
    """Rate-and-state friction (one state), regularised at rest.

        psi = ln(v_0 theta / D_c)
        F   = N a asinh( v/(2 v_0) exp((mu_0 + b psi)/a) )
        dpsi/dt = v_0/D_c [exp(-psi) - w/v_0]             evolution = "ageing"
        dpsi/dt = -w/D_c [ln(w/v_0) + psi]                evolution = "slip"

    theta [s] is the mean age of the contacts and w = sqrt(v^2 + v_eps^2); the age stops growing at
    D_c/v_eps. For v >> v_0 exp(-mu_0/a) the force is N [mu_0 + a ln(v/v_0) + b psi].
    Limits: steady state N [mu_0 + (a - b) ln(|v|/v_0)] sign(v): weakening for a < b, unstable on a
    spring softer than N (b - a)/D_c. A step of the velocity by the factor e raises mu by a, then
    lowers it by b over a few D_c. Creeps under any load; no pre-sliding. At rest the slope
    is N a/(2 v_0) exp((mu_0 + b psi)/a): from 1e15 N s/m on, the rounding of velocities in a
    mechanism hides it, and steps fall without end. Meant for slow slip: at high velocity ratios the
    logarithm makes mu small or negative where a < b.
    Source: Dieterich, J. Geophys. Res. 84, 1979; Ruina, J. Geophys. Res. 88, 1983; asinh form:
    Rice, Ben-Zion, PNAS 93, 1996.

    Raises:
        ValueError: mu_0/a above 150, or with the oldest contact's above 200: derivatives overflow.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "St", "L", "T"),
        smoothness="C∞",
        confidence="two sources",
        checked="jrleeman/rsfmodel and public MATLAB code (inverse hyperbolic sine)",
        source="Dieterich 1979; Ruina 1983; Rice and Ben-Zion 1996",
        load="proportional",
    )

    mu_0: Scalar = param(
        0.12, unit="1", role="level", doc="friction coefficient at v_0", lower=1e-12
    )
    a: Scalar = param(0.01, unit="1", role="level", doc="direct effect", lower=1e-6)
    b: Scalar = param(0.015, unit="1", role="level", doc="evolution effect", lower=0.0)
    v_0: Scalar = param(
        1e-6, unit="m/s", role="velocity scale", doc="reference velocity", lower=1e-15
    )
    D_c: Scalar = param(
        1e-5, unit="m", role="length", doc="slip that renews the contacts", lower=1e-15
    )
    v_eps: Scalar = param(
        1e-12,
        unit="m/s",
        role="width",
        doc="counts as rest; D_c/v_eps is the age of the oldest contact",
        lower=1e-15,
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
        """Logarithm of the age."""
        return (State("psi", "1", 1.0, even=True, doc="logarithm of the contacts' age"),)

    @property
    def velocity_scale(self) -> Scalar:
        """The reference velocity [m/s]."""
        return self.v_0

    def _speed(self, v: Scalar) -> Scalar:
        return sqrt(v * v + self.v_eps * self.v_eps)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Refused: the steady force follows ln v, and no load is held at rest."""
        raise one_sided(self, "it creeps under any load, and ln v has no limit at rest")

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        argument = v / (2 * self.v_0) * exp((self.mu_0 + self.b * z[0]) / self.a)
        return N * self.a * asinh(argument)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Rate of psi [1/s], shape (1, 1)."""
        w = self._speed(v)
        if self.evolution == "slip":
            return column(-w / self.D_c * (log(w / self.v_0) + z[0]))
        return column(self.v_0 / self.D_c * (exp(-z[0]) - w / self.v_0))

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """The psi of steady sliding, shape (1, 1); 0, an age of D_c/v_0, below v_eps.

        A contact at rest has no steady age. The oldest one, D_c/v_eps, is that of months: a body
        that is let go under more than such a contact holds leaves it within no time that a step
        could resolve.
        """
        moves = smooth.magnitude(v, 0.0) >= self.v_eps
        return column(smooth.choose(moves, -log(self._speed(v) / self.v_0), 0.0))
