"""The elastoplastic element that hysteresis laws are built of."""

from symfric.laws import smooth
from symfric.numeric import Scalar


def yielding(v: Scalar, r: Scalar, n: Scalar, v_eps: Scalar, r_eps: Scalar) -> Scalar:
    """Rate at which an element under slip velocity `v` stretches.

        v [1 - |r|^n (1 + sign(v r)) / 2]

    r is its load over its limit. It stretches elastically while unloading and, for n -> inf, up
    to |r| = 1, where it slips. sign is smooth over v_eps and r_eps, |r| over r_eps; at v = 0 the
    rate is exactly zero, so that an element at rest keeps its load. At r = 1 it vanishes to
    rounding for r_eps <= 1e-8.
    """
    spent = smooth.power(r, n, r_eps) / 2
    return v - spent * (v + smooth.magnitude(v, v_eps) * smooth.sign(r, r_eps))
