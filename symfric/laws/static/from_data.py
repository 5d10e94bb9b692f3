"""Laws from data: friction curves without a formula, whose coefficients are fitted."""

from functools import partial
from itertools import accumulate

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, log, total
from symfric.foundation.parameters import Parametric, option, param, parametric
from symfric.laws.base import fields, smooth
from symfric.laws.base.law import Facts, StaticLaw


@parametric
class Level(Parametric):
    """Coefficient c of one basis function of a friction curve."""

    c: Scalar = fields.COEFFICIENT(0.1, doc="coefficient of the curve")


LEVELS = (Level(0.15), Level(0.14), Level(0.12), Level(0.1), Level(0.1), Level(0.11))
"""Coefficients of a curve that falls and rises."""
SPEED = partial(param, unit="m/s", role="geometry", lower=1e-12)


@parametric
class Spline(StaticLaw):
    """Friction curve as a cubic spline over the logarithm of the speed, with n coefficients.

        x = (n - 1) log(1 + (v/v_first)^2) / log(1 + (v_last/v_first)^2)
        F = N mu(x) tanh(v / v_eps),   mu = c_1 [B(x) + B(x + 1)] + c_2 B(x - 1) + ... + c_n W

    B is the cubic B-spline of width 4 and W = 1 less all others. The basis functions are positive
    and their sum is 1, so that mu is between the smallest and the largest c_i near x, and the force
    opposes the motion for all c_i >= 0. The knots are evenly spaced in the logarithm of the speed
    from v_first to v_last. mu is linear in the coefficients, so that `Fit` finds their only
    minimum. It may fall and rise: Stribeck curves are not monotone. shape = "falling" replaces c_i
    by c_i + c_(i+1) + ... + c_n, so that mu falls with the speed for all c_i >= 0; its sum with
    `Viscous` has a monotone dry part and a rising viscous part.
    Limits: equal coefficients give `Coulomb`. Between v_last and v_last (v_last/v_first)^(1/(n-1))
    mu approaches c_n; beyond it is c_n at all speeds, a constant slope of zero, or sigma_2 in a sum
    with `Viscous`. mu at rest is (5 c_1 + c_2)/6. Creeps under load.
    Source: de Boor, A Practical Guide to Splines, 1978, ch. IX; constructed here as a law.
    Checked: scipy.interpolate.BSpline.
    """

    facts = Facts(("D", "S", "St", "V"), "C2 at the knots", "one source")

    levels: tuple[Level, ...] = LEVELS
    v_first: Scalar = SPEED(1e-3, doc="speed of the first bend")
    v_last: Scalar = SPEED(1.0, doc="speed of the last knot")
    v_eps: Scalar = fields.V_EPS(1e-4, lower=1e-12)
    shape: str = option("free", choices=("free", "falling"), doc="any curve, or a falling one")

    strictly_ordered = (("v_first", "v_last"),)

    def __post_init__(self) -> None:
        super().__post_init__()
        levels = checks.many("Spline: levels", self.levels, "levels, such as (Level(0.1), ...)")
        if len(levels) < 3 or not all(isinstance(item, Level) for item in levels):
            raise checks.refused("Spline: levels", "three or more, all Level", self.levels)

    @classmethod
    def over(cls, v_first: float, v_last: float, count: int, **more: Scalar | str) -> "Spline":
        """Return a curve of `count` equal coefficients for data between two speeds [m/s].

        Raises:
            ValueError: bad input, such as fewer than 3 coefficients.
        """
        checks.count("Spline.over: count", count, least=3)
        share = count if more.get("shape") == "falling" else 1
        levels = tuple(Level(0.1 / share) for _ in range(count))
        return cls(levels, v_first, v_last, **more)  # pyright: ignore[reportArgumentType]

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 for zero widths."""
        return N * self.coefficient(speed)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        return N * self.coefficient(v) * smooth.sign(v, self.v_eps)

    def coefficient(self, v: Scalar) -> Scalar:
        """Return mu at a velocity [m/s]."""
        u, top = v / self.v_first, self.v_last / self.v_first
        last = len(self.levels) - 1
        x = last / log(1 + top * top) * log(1 + u * u)
        before, first, *others = smooth.bumps(x, range(-1, last))
        parts = [before + first, *others]
        rest = smooth.positive(1 - total(parts), 0.0)  # positive also to rounding
        c = [level.c for level in self.levels]
        if self.shape == "falling":
            c = list(accumulate(reversed(c)))[::-1]
        return total(a * part for a, part in zip(c, [*parts, rest], strict=True))
