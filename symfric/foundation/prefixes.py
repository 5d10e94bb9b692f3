"""Units that make numbers readable: 2.4 mm/s for 0.0024 m/s."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

PREFIXED = (
    "m", "m/s", "m/s^2", "N", "N m", "N/s", "rad", "rad/s", "rad/s^2", "s", "J", "W", "Pa",
)  # fmt: skip
"""Units that may have a prefix."""

PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
LEAST, MOST = 0.08, 2e4
"""Largest magnitudes that are written without a prefix."""

CLOCKS = ((365.25 * 86400.0, "years"), (86400.0, "days"), (3600.0, "h"))
"""What a long time is told in [s]; from three of them on, for hours from six."""


def clock(times: ArrayLike) -> tuple[float, str]:
    """A factor and the unit in which `times` [s], times the factor, are easily read on an axis."""
    t = np.asarray(times, dtype=float)
    span = float(np.ptp(t[np.isfinite(t)])) if np.isfinite(t).any() else 0.0
    for size, unit in CLOCKS:
        if span >= (6 if unit == "h" else 3) * size:
            return 1 / size, unit
    return 1.0, "s"


def readable(unit: str, values: Iterable[ArrayLike]) -> tuple[float, str]:
    """A factor and the unit in which `values` in `unit`, times the factor, are easily read.

    As they are between 0.08 and 20000, where they all vanish, or where the unit takes no prefix;
    beyond, their largest magnitude comes to lie between 0.08 and 80.
    """
    sizes = [np.abs(np.asarray(v, dtype=float)) for v in values]
    top = max((float(np.max(s[np.isfinite(s)], initial=0.0)) for s in sizes), default=0.0)
    if unit not in PREFIXED or top == 0.0 or LEAST <= top < MOST:
        return 1.0, unit
    for size, letter in PREFIXES:
        if top >= LEAST * size:
            return 1 / size, letter + unit
    size, letter = PREFIXES[-1]
    return 1 / size, letter + unit
