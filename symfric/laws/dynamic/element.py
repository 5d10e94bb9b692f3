"""The elastoplastic element that hysteresis laws are built of."""

from symfric.laws import smooth
from symfric.numeric import Scalar


def stretched(F: Scalar, dF: Scalar, limit: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """An element with the load F, to which dF is added evenly over a step, up to +-limit.

    Its load at the end and in the mean of the step, and whether it slips then.
    """
    ahead = smooth.sign(dF, 0.0)
    slips = smooth.choose(ahead == 0, 0.0, ahead * (F + dF) >= limit)
    end = smooth.choose(slips, ahead * limit, F + dF)
    share = smooth.clip((end - F) / smooth.choose(ahead == 0, 1.0, dF), 0.0, 1.0)
    return end, end - (end - F) * share / 2, slips


def yielding(v: Scalar, r: Scalar, n: Scalar, v_eps: Scalar, r_eps: Scalar) -> Scalar:
    """Rate at which an element under slip velocity `v` stretches.

        v [1 - |r|^n (1 + sign(v r)) / 2]

    r is its load over its limit. It stretches elastically while unloading and, for n -> inf, up
    to |r| = 1, where it slips. sign is smooth over v_eps and r_eps, |r| over r_eps; at v = 0 the
    rate is exactly zero, so that an element at rest keeps its load. At r = 1 it vanishes to
    rounding for r_eps <= 1e-8. What is spent never drives: with t = sign(v) it is
    |r|^n v t (t + sign(r)) / 2, so that an element beyond its limit, because the load has dropped,
    comes back in either direction and however slowly it is moved.
    """
    t = smooth.sign(v, v_eps)
    return v - smooth.power(r, n, r_eps) / 2 * (v * t) * (t + smooth.sign(r, r_eps))
