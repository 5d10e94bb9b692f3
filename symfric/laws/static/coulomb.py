"""Laws without a formula for the Stribeck effect: Coulomb, viscous, and measured coefficients."""

from collections.abc import Callable
from functools import cached_property
from itertools import pairwise
from math import inf, pi

import numpy as np

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, atan, equals, erf, sqrt, tanh
from symfric.foundation.parameters import option, parametric
from symfric.laws.base import fields, smooth
from symfric.laws.base.law import Facts, StaticLaw


def _quadratic(u: Scalar) -> Scalar:
    held = smooth.clip(u, -1.0, 1.0)
    return held * (2 - smooth.magnitude(held, 0.0))


SHAPES: dict[str, Callable[[Scalar], Scalar]] = {
    "tanh": tanh,
    "atan": lambda u: 2 / pi * atan(u),
    "erf": erf,
    "sqrt": lambda u: u / sqrt(1 + u * u),
    "saturation": lambda u: smooth.clip(u, -1.0, 1.0),
    "quadratic": _quadratic,
}
"""Approximations of sign(u): odd functions that increase from -1 to 1."""


@parametric
class Coulomb(StaticLaw):
    """Smooth Coulomb friction.

        F = mu_d N s(v / v_eps)

    shape        s(u)                         slope at 0   s(10)   smoothness
    tanh         tanh u                       1            1.000   C∞
    atan         (2/pi) atan u                2/pi         0.937   C∞
    erf          erf u                        2/sqrt(pi)   1.000   C∞
    sqrt         u / sqrt(1 + u^2)            1            0.995   C∞
    saturation   u, limited to +-1            1            1       C0, kinks at u = +-1
    quadratic    u (2 - |u|) for |u| <= 1     2            1       C1 at u = 0, +-1

    Limits: tends to mu_d N sign(v) as v_eps -> 0; the float v_eps = 0 uses sign(v), 0 at rest.
    Never sticks: under a load F_e < mu_d N it creeps, with tanh at v = v_eps atanh(F_e / (mu_d N)).
    The slope at rest is mu_d N / v_eps times that of the table.
    Source: Amontons 1699, Coulomb 1785; tanh as in Project Chrono and MORe, atan in Leine's codes,
    quadratic in the incremental potential contact and TAMSI methods.
    Checked: projectchrono/chrono ChContactSMC (tanh); rleine's stickslipsmooth.m (arctangent).
    """

    facts = Facts(
        ("D",),
        "C∞ (shape saturation C0 at |v| = v_eps, quadratic C1 at 0 and |v| = v_eps)",
        "two sources",
    )

    mu_d: Scalar = fields.MU_D(0.1)
    v_eps: Scalar = fields.V_EPS(1e-3)
    shape: str = option("tanh", choices=tuple(SHAPES), doc="smooth sign")

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 for zero widths."""
        return self.mu_d * N

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        if equals(self.v_eps, 0.0):
            return self.mu_d * N * smooth.sign(v, 0.0)
        return self.mu_d * N * SHAPES[self.shape](v / self.v_eps)


@parametric
class Viscous(StaticLaw):
    """Linear viscous friction, independent of the load.

        F = sigma_2 v

    Limits: no friction at rest.
    Source: textbook; Olsson et al., Eur. J. Control 4, 1998.
    """

    facts = Facts(("V",), "C∞", "textbook", load="independent")

    sigma_2: Scalar = fields.SIGMA_2(0.4)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0, which is zero at rest."""
        return self.sigma_2 * speed

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        return self.sigma_2 * v


@parametric
class PowerLawViscous(StaticLaw):
    """Power-law viscous friction, independent of the load.

        F = sigma_2 |v|^d sign(v)        smooth: sigma_2 v (v^2 + v_eps^2)^((d - 1)/2)

    Limits: d = 1 is `Viscous`, d = 2 drag. For d < 1 the original is infinitely steep at rest, and
    the smooth form has the slope sigma_2 v_eps^(d - 1). Relative error (d - 1)/2 (v_eps/v)^2.
    Source: textbook; the general exponent as in drive and fluid-film models.
    """

    facts = Facts(("V",), "C∞", "textbook", load="independent")

    sigma_2: Scalar = fields.SIGMA_2(0.4, unit="N (s/m)^d")
    d: Scalar = fields.SHAPE(2.0, doc="exponent", lower=0.1, upper=10.0)
    v_eps: Scalar = fields.REST_EPS(1e-4, doc="smoothing velocity", lower=1e-12)

    @property
    def velocity_scale(self) -> Scalar:
        """Smoothing velocity [m/s]; inf for the linear law."""
        return inf if equals(self.d, 1.0) else self.v_eps

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the force of the law [N], since it does not jump at rest."""
        return self.force(speed, N)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        if equals(self.d, 1.0):
            return self.sigma_2 * v
        return self.sigma_2 * smooth.signed_power(v, self.d, self.v_eps)


@parametric
class Table(StaticLaw):
    """Friction coefficients measured at several speeds, interpolated without overshoot.

        F = N mu(|v|) sign(v)

    `mu` is the monotone cubic interpolant (PCHIP of Fritsch and Carlson) of (speeds, coefficients),
    constant outside the table; sign(v) is smooth over v_eps. All intervals are evaluated, which is
    suitable for tens of points, not for thousands.
    Limits: between two equal coefficients mu is constant; a table of two points is nearly a ramp.
    Creeps under load.
    Source: Fritsch and Carlson, SIAM J. Numer. Anal. 17, 1980, in the form of Fritsch and Butland
    1984 (harmonic mean of slopes); tables as in Modelica's SupportFriction.
    Checked: Fritsch and Butland 1984, as in SciPy.
    """

    facts = Facts(("D", "S", "St", "V"), "C1 at the speeds of the table", "two sources")

    speeds: tuple[float, ...]
    coefficients: tuple[float, ...]
    v_eps: Scalar = fields.V_EPS(1e-4, lower=1e-12)

    def __post_init__(self) -> None:
        super().__post_init__()
        v = checks.array("Table: speeds", self.speeds)
        mu = checks.array("Table: coefficients", self.coefficients)
        if v.shape != mu.shape or v.size < 2:
            raise ValueError(
                "Table: expected as many coefficients as speeds, two or more, got "
                f"{v.size} speeds and {mu.size} coefficients"
            )
        if not ((np.diff(v) > 0).all() and v[0] >= 0):
            raise ValueError(f"Table: speeds: expected 0 <= rising numbers, got {self.speeds}")
        if not (mu >= 0).all():
            raise ValueError(f"Table: coefficients: expected numbers >= 0, got {self.coefficients}")

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 for zero widths."""
        return N * self.coefficient(speed)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        mu = self.coefficient(smooth.magnitude(v, 0.0))
        return N * mu * smooth.sign(v, self.v_eps)

    def coefficient(self, speed: Scalar) -> Scalar:
        """Return the coefficient mu at a speed >= 0 [m/s]."""
        mu = self.coefficients[0]
        pieces = zip(pairwise(self.speeds), pairwise(self.coefficients), self._slopes, strict=True)
        for (a, b), (low, high), (left, right) in pieces:
            t = smooth.clip((speed - a) / (b - a), 0.0, 1.0)
            rise, left, right = high - low, left * (b - a), right * (b - a)
            bend = left + right - 2 * rise
            mu = mu + t * (left + t * (rise - left - bend + t * bend))
        return mu

    @cached_property
    def _slopes(self) -> list[tuple[float, float]]:
        """Slopes at both ends of each interval: weighted harmonic means, zero at the end points."""
        from scipy.interpolate import PchipInterpolator  # noqa: PLC0415  (slow to import)

        curve = PchipInterpolator(self.speeds, self.coefficients)
        return list(pairwise([0.0, *curve.derivative()(self.speeds[1:-1]).tolist(), 0.0]))
