"""Starts around a centre: a Latin hypercube in the coordinates of the fit.

Positive values are multiplied by factors up to `REACH`, those that the user bounded go over all of
their range, values of either sign move by half of themselves; start values of records stay, which
are read from the data.

Source: M. D. McKay, R. J. Beckman, W. J. Conover, Technometrics 21, 1979.
"""

import numpy as np
from numpy.typing import NDArray

from identification.unknowns.unknown import Unknown
from identification.unknowns.unknowns import Unknowns

Array = NDArray[np.float64]

REACH = 5.0
"""Largest factor by which a positive value is changed."""
WIDE = 1e3
"""Ratio of bounds up to which all of the range is searched; others are bounds by nature."""


def scattered(at: Unknowns, centre: Array, count: int, seed: int = 0) -> list[Array]:
    """`count` coordinates, the first one the `centre`, the same for the same `seed`.

    Args:
        at: the unknowns with their box.
        centre: coordinates, shape (n,).
        count: number of starts.
        seed: of the random numbers.
    """
    rng = np.random.default_rng(seed)
    n, others = centre.size, max(count - 1, 0)
    cells = np.stack([rng.permutation(others) for _ in range(n)], axis=1).reshape(others, n)
    shares = (cells + rng.random((others, n))) / max(others, 1)
    starts = [at.inside(centre)]
    for row in shares:
        w = [
            _moved(u, float(x), float(share), *box)
            for u, x, share, *box in zip(at.unknowns, centre, row, at.lower, at.upper, strict=True)
        ]
        starts.append(at.inside(np.array(w)))
    return starts


def _moved(unknown: Unknown, w: float, share: float, lower: float, upper: float) -> float:
    """One coordinate moved, `share` in (0, 1)."""
    side = 2 * share - 1
    if unknown.nuisance and not (np.isfinite(lower) and np.isfinite(upper)):
        return w
    if unknown.logarithmic and not unknown.above:
        if upper - lower < np.log(WIDE):
            return lower + share * (upper - lower)
        return w + side * np.log(REACH)
    if np.isfinite(lower) and np.isfinite(upper) and not unknown.logarithmic:
        return lower + share * (upper - lower)
    if unknown.logarithmic:
        return (
            w + side * np.log(REACH) if not np.isfinite(upper) else lower + share * (upper - lower)
        )
    if unknown.above:
        return w + side * np.log(REACH)
    if lower >= 0 and w > 0:
        return w * REACH**side
    return w + 0.5 * side * abs(w)
