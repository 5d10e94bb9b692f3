"""Smooth approximations of sign, abs, max and powers, which regularise all laws.

The derivatives of `fabs`, `sign`, `if_else`, `norm` and fractional powers at zero are wrong or NaN,
so laws use the functions of this file instead. A width `eps` is always a parameter of the law, in
the unit of `x`. Where documented, the float `eps = 0.0` selects the original, non-smooth function.
"""

import casadi as ca
import numpy as np

from symfric.foundation.numeric import Scalar, equals, exp, expm1, is_casadi, is_number, sqrt, tanh
from symfric.foundation.vector import ROUND, TINY, NotIsotropicError, Vector, Vectors, no_vector

BACK = 1e16
"""Yielding factor above which an element returns to its limit immediately."""

SHARE = 1e-6
"""Fraction of the Stribeck velocity over which `fall` is rounded at rest."""

CORNER = 1e-4
"""Fraction of the smoothing velocity over which a static law rounds |v| in its Stribeck weight.

Within this range the smooth sign is not larger than this fraction. Therefore the force differs from
the formula with |v| by less than this fraction of the static excess.
"""


def sign(x: Scalar, eps: Scalar) -> Scalar:
    """Return the smooth sign tanh(x / eps); within 1 % of +-1 beyond 2.65 eps.

    The float `eps = 0.0` gives the sign itself, with value and derivative 0 at x = 0.
    """
    if equals(eps, 0.0):
        if isinstance(x, Vector):
            return x / x.length(TINY)
        return ca.sign(x) if is_casadi(x) else np.sign(x)
    return tanh(x / eps)


def magnitude(x: Scalar, eps: Scalar) -> Scalar:
    """Return the smooth |x| = x tanh(x / eps), exactly 0 at x = 0.

    Since it is zero at rest, a bristle at rest does not relax. Beyond 20 eps it equals |x| to
    rounding. The float `eps = 0.0` gives |x| itself, with its kink at x = 0.
    """
    if equals(eps, 0.0):
        if isinstance(x, Vector):
            return x.length(TINY)
        return ca.fabs(x) if is_casadi(x) else np.abs(x)
    return x * tanh(x / eps)


def power(x: Scalar, exponent: Scalar, eps: Scalar) -> Scalar:
    """Return the smooth |x|^exponent = (x^2 + eps^2)^(exponent/2) - eps^exponent, 0 at x = 0.

    All its derivatives with respect to x and the exponent are finite. The float `exponent = 2.0`
    gives x^2 exactly, with one multiplication. The float `eps = 0.0` gives |x|^exponent itself,
    which has no derivative at x = 0 for exponents below 1.
    """
    if equals(exponent, 2.0):
        return x * x
    if equals(eps, 0.0):
        return magnitude(x, 0.0) ** exponent
    return (x * x + eps * eps) ** (exponent / 2) - eps**exponent


def overload(x: Scalar, exponent: Scalar, eps: Scalar) -> Scalar:
    """Return `power` of a load share that may be far above 1, without overflow in float.

        w^(n/2) [1 + n/2 (1 - w/q)] - eps^n,   q = x^2 + eps^2
        w = q well below Q = BACK^(2/n), w = Q well above it, smooth

    It equals `power` bit for bit up to q = (1 + Q)/2, and it is monotonic. Above Q an element
    returns to its limit within a path of 1/BACK of its stretch, which is the rounding error of a
    double, so the exact rate does not affect results. By contrast, |x|^50 overflows in float if the
    load falls to a sixth, and |x|^1000 overflows in double if it falls to a half.
    """
    if equals(exponent, 2.0) or equals(eps, 0.0):
        return power(x, exponent, eps)
    q, top = x * x + eps * eps, BACK ** (2 / exponent)
    beyond = tanh(40 * (q - top) / (top - 1))  # exactly -1 up to the middle between 1 and top
    within = (q * (1 - beyond) + top * (1 + beyond)) / 2
    return within ** (exponent / 2) * (1 + exponent / 2 * (1 - within / q)) - eps**exponent


def signed_power(x: Scalar, exponent: Scalar, eps: Scalar) -> Scalar:
    """Return the smooth |x|^exponent sign(x) = x (x^2 + eps^2)^((exponent - 1)/2), 0 at x = 0."""
    return x * (x * x + eps * eps) ** ((exponent - 1) / 2)


def positive(x: Scalar, eps: Scalar) -> Scalar:
    """Return the smooth max(x, 0) = (x + sqrt(x^2 + eps^2)) / 2, with the value eps/2 at x = 0.

    The float `eps = 0.0` gives max(x, 0) itself, with its kink at x = 0.
    """
    no_vector("cuts", x)
    if equals(eps, 0.0):
        return ca.fmax(x, 0.0) if is_casadi(x) else np.maximum(x, 0.0)
    return (x + sqrt(x * x + eps * eps)) / 2


def clip(x: Scalar, low: Scalar, high: Scalar) -> Scalar:
    """Return `x` limited to [low, high], with kinks; `hold` limits the length of a vector."""
    if isinstance(x, Vector):
        if is_number(low) and equals(high, -low):
            return hold(x, high, 0.0)
        raise NotIsotropicError("clips a vector")
    if is_casadi(x, low, high):
        return ca.fmin(ca.fmax(x, low), high)
    return np.minimum(np.maximum(x, low), high)


def hold(x: Scalar, top: Scalar, eps: Scalar) -> Scalar:
    """Return `x` limited to +-`top`: exactly x up to top - eps, exactly +-top from top + eps, C2.

    Unlike with tanh, a contact that carries hold(F_e) does not creep under a load below top - eps.
    The float `eps = 0.0` gives the limit with kinks. A vector keeps its direction.
    """
    if isinstance(x, Vector):
        return x.odd(lambda size: hold(size, top, eps), ROUND * top)
    if equals(eps, 0.0):
        return clip(x, -top, top)

    def corner(y: Scalar) -> Scalar:
        t = positive((y - top) / (2 * eps) + 0.5, 0.0)
        return t * t * t * (2 - t) * eps

    # a single clip, since several could round to different sides of a knot
    within = clip(x, -top - eps, top + eps)
    return within - corner(within) + corner(-within)


def step3(x: Scalar) -> Scalar:
    """Return the cubic step 3x^2 - 2x^3 from 0 at x <= 0 to 1 at x >= 1, C1."""
    t = clip(x, 0.0, 1.0)
    return t * t * (3 - 2 * t)


def step5(x: Scalar) -> Scalar:
    """Return the quintic step 10x^3 - 15x^4 + 6x^5 from 0 at x <= 0 to 1 at x >= 1, C2."""
    t = clip(x, 0.0, 1.0)
    return t * t * t * (10 - t * (15 - 6 * t))


def bumps(x: Scalar, centres: range) -> list[Scalar]:
    """Return the cubic B-splines of x with their centres at consecutive integers, C2.

        max(left, right) / 6,   left = (x - c + 2)+^3 - 4 (x - c + 1)+^3,   right = left(-x)

    Each is 2/3 at its centre c, positive for |x - c| < 2 and exactly 0 beyond; y+ = max(y, 0).
    Where terms of the maxima are equal, they agree to second order, so that derivatives up to the
    second are exact there, unlike with |x|.
    """

    def cubes(sign: int, knots: range) -> dict[int, Scalar]:
        rises = {k: positive(sign * (x - k), 0.0) for k in knots}
        return {k: rise * rise * rise for k, rise in rises.items()}

    first, last = centres[0], centres[-1]
    left, right = cubes(1, range(first - 2, last)), cubes(-1, range(first + 1, last + 3))
    largest = ca.fmax if is_casadi(x) else np.maximum
    sides = ((left[c - 2] - 4 * left[c - 1], right[c + 2] - 4 * right[c + 1]) for c in centres)
    return [largest(*pair) / 6 for pair in sides]


def fraction(x: Scalar) -> Scalar:
    """Return `x` modulo 1, in [0, 1)."""
    no_vector("counts", x)
    return x - (ca.floor(x) if is_casadi(x) else np.floor(x))


def choose(condition: Scalar, yes: Scalar, no: Scalar) -> Scalar:
    """Return `yes` where the condition holds, else `no`; for modes and for non-smooth originals."""
    if isinstance(yes, Vector) or isinstance(no, Vector):
        return _chosen(condition, yes, no)
    if is_casadi(condition, yes, no):
        return ca.if_else(condition, yes, no)
    return np.where(condition, yes, no)[()]


def _chosen(condition: Scalar, yes: Vectors, no: Vectors) -> Vector:
    if not (isinstance(yes, Vector) and isinstance(no, Vector)):
        raise NotIsotropicError("chooses between a number and a vector")
    pairs = zip(yes.parts, no.parts, strict=True)
    return Vector([choose(condition, a, b) for a, b in pairs], yes.turn)


def stribeck(v: Scalar, v_s: Scalar, delta: Scalar, eps: Scalar) -> Scalar:
    """Return the Stribeck weight exp(-|v / v_s|^delta): 1 at rest, 0 far above v_s.

    The weight is rounded at rest over `eps`. Beyond 1e3 eps the rounding changes it by at most 4e-6
    for every delta from 0 to 10. The float `delta = 2.0` needs no rounding. The float `eps = 0.0`
    gives the original weight, which has a kink at rest for delta < 2.
    """
    u = v / v_s
    if equals(delta, 2.0) or equals(eps, 0.0):
        return exp(-power(u, delta, 0.0))
    return exp(-_rounded_power(u, delta, eps / v_s))


def _rounded_power(u: Scalar, exponent: Scalar, width: Scalar) -> Scalar:
    """Return |u|^exponent = u^2 (u^2 + width^2)^(exponent/2 - 1), exactly 0 at u = 0.

    The relative error decreases as (width/u)^2. The error of `power`, which has the offset
    width^exponent, decreases more slowly for exponents below 2: it is 3e-3 at u = 1 for the
    exponent 0.5 and the width 1e-5.
    """
    return u * u * (u * u + width * width) ** (exponent / 2 - 1)


def onward(x: Scalar) -> Scalar:
    """Return `x` for x >= 0 and tanh(2 x) / 2 for x < 0, C2, to extend formulas for speeds >= 0.

    Iterates of a solver may have negative speeds. A Stribeck weight that grows exponentially there
    would make the solver diverge.
    """
    return choose(x < 0, tanh(2 * x) / 2, x)


def fall(speed: Scalar, v_s: Scalar, delta: Scalar) -> Scalar:
    """Return the Stribeck weight exp(-(speed / v_s)^delta) on one side of rest, for speeds >= 0.

    If `delta` is a float with an integer value, all derivatives exist at rest. Otherwise the power
    is rounded over `SHARE` of v_s, since for delta < 2 it has no second derivative at rest. The
    weight is bounded for negative speeds, see `onward`.
    """
    if equals(delta, 2.0):
        return exp(-((speed / v_s) ** 2))
    u = onward(speed / v_s)
    if is_number(delta) and float(delta).is_integer():
        return exp(-(u ** int(delta)))
    return exp(-_rounded_power(u, delta, SHARE))


def phi1(x: Scalar) -> Scalar:
    """Return (exp(x) - 1) / x, with the value 1 and correct derivatives at x = 0.

    For |x| < 1e-2 a Taylor polynomial replaces the quotient (next term x^5/720, 1.4e-13). A
    quotient that is only guarded against x = 0 has the derivative 0 there instead of 1/2.
    """
    series = 1 + x / 2 * (1 + x / 3 * (1 + x / 4 * (1 + x / 5)))
    if not is_casadi(x):
        near = np.abs(x) < 1e-2
        return np.where(near, series, expm1(x) / np.where(near, 1.0, x))[()]
    near = ca.fabs(x) < 1e-2
    return ca.if_else(near, series, expm1(x) / ca.if_else(near, 1.0, x))
