"""Laws from data: friction curves without a formula, whose coefficients are fitted."""

from abc import abstractmethod
from dataclasses import replace
from functools import partial
from itertools import accumulate

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, log, tanh, total
from symfric.foundation.parameters import Parametric, option, param, parameters, parametric
from symfric.laws.base import fields, smooth
from symfric.laws.base.families import CurveLaw, Fall
from symfric.laws.base.law import Facts


class FromData(CurveLaw):
    """Law with the force N mu(v) in the direction of sliding."""

    @abstractmethod
    def coefficient(self, v: Scalar) -> Scalar:
        """Return mu at a velocity [m/s]."""

    def formula(self, v: Scalar, N: Scalar, s: Scalar, fall: Fall) -> Scalar:
        """Return the friction force [N] in the direction `s`."""
        return N * self.coefficient(v) * s


@parametric
class Level(Parametric):
    """Coefficient c of one basis function of a friction curve."""

    c: Scalar = fields.COEFFICIENT(0.1, doc="coefficient of the curve")


LEVELS = (Level(0.15), Level(0.14), Level(0.12), Level(0.1), Level(0.1), Level(0.11))
"""Coefficients of a curve that falls and rises."""
SPEED = partial(param, unit="m/s", role="geometry", lower=1e-12)


@parametric
class Spline(FromData):
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

        The width v_eps is v_first / 10 unless it is given.

        Raises:
            ValueError: bad input, such as fewer than 3 coefficients.
        """
        checks.count("Spline.over: count", count, least=3)
        share = count if more.get("shape") == "falling" else 1
        levels = tuple(Level(0.1 / share) for _ in range(count))
        law = cls(levels, v_first, v_last, **more)  # pyright: ignore[reportArgumentType]
        return law if "v_eps" in more else replace(law, v_eps=law.v_first / 10)

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


@parametric
class Neuron(Parametric):
    """Smooth step of a friction curve over the logarithm of the speed, one neuron of a network."""

    w: Scalar = fields.COEFFICIENT(0.05, doc="height of the step")
    a: Scalar = fields.SHAPE(-7.0, doc="steepness of the step", lower=-30.0, upper=30.0)
    s: Scalar = fields.SHAPE(0.4, doc="place of the step", lower=-0.2, upper=1.2)


NEURONS = (Neuron(0.05, -7.0, 0.3), Neuron(0.02, -7.0, 0.5), Neuron(0.02, 4.0, 1.0))
"""Neurons of a curve that falls and rises."""


@parametric
class Network(FromData):
    """Friction curve as a small network of tanh neurons over the logarithm of the speed.

        x = log(1 + (v/v_first)^2) / log(1 + (v_last/v_first)^2)
        F = N mu(x) tanh(v / v_eps),   mu = b + sum of w_k [1 + tanh(a_k (x - s_k))] / 2

    Each neuron is a step of the height w_k near x = s_k, falling for a_k < 0, where x is 0 at rest
    and 1 at v_last. The force opposes the velocity for all b, w_k >= 0 and all a_k, s_k. By
    default, `Fit` finds b and w_k, in which mu is linear; `free=law.weights` also fits a_k and s_k,
    from several starts. The neurons may be exchanged, so only the curve has a meaning, not a weight
    or its interval. With few neurons the law costs less than a `Spline`.
    Limits: w_k = 0 is `Coulomb`. At high speeds mu is constant. Creeps under load.
    Source: Cybenko, Math. Control Signals Systems 2, 1989; constructed here as a law.
    """

    facts = Facts(("D", "S", "St", "V"), "C∞", "constructed")

    neurons: tuple[Neuron, ...] = NEURONS
    b: Scalar = fields.COEFFICIENT(0.1, doc="lowest level of the curve")
    v_first: Scalar = SPEED(1e-3, doc="lowest speed that is resolved")
    v_last: Scalar = SPEED(1.0, doc="highest speed that is resolved")
    v_eps: Scalar = fields.V_EPS(1e-4, lower=1e-12)

    strictly_ordered = (("v_first", "v_last"),)

    def __post_init__(self) -> None:
        super().__post_init__()
        neurons = checks.many("Network: neurons", self.neurons, "neurons, such as (Neuron(), ...)")
        if not neurons or not all(isinstance(item, Neuron) for item in neurons):
            raise checks.refused("Network: neurons", "one or more, all Neuron", self.neurons)

    @classmethod
    def over(cls, v_first: float, v_last: float, count: int, **more: Scalar) -> "Network":
        """Return a network of `count` falling and `count` rising neurons between two speeds [m/s].

        The width v_eps is v_first / 10 unless it is given.

        Raises:
            ValueError: bad input, such as more than 7 neurons of each kind.
        """
        checks.count("Network.over: count", count, most=7)
        places = [(k + 0.5) / count for k in range(count)]
        neurons = (Neuron(0.01, a * count, s) for s in places for a in (-4.0, 4.0))
        law = cls(tuple(neurons), 0.1, v_first, v_last, **more)
        return law if "v_eps" in more else replace(law, v_eps=law.v_first / 10)

    @property
    def weights(self) -> tuple[str, ...]:
        """Names of all weights a_k and s_k, as the argument `free` of `Fit`."""
        return tuple(n for n, p in parameters(self).items() if p.field in ("a", "s"))

    def coefficient(self, v: Scalar) -> Scalar:
        """Return mu at a velocity [m/s]."""
        u, top = v / self.v_first, self.v_last / self.v_first
        x = log(1 + u * u) / log(1 + top * top)
        return self.b + total(k.w * (1 + tanh(k.a * (x - k.s))) for k in self.neurons) / 2
