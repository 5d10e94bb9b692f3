"""What start values are read from: force against velocity, and the path where there is one."""

from dataclasses import dataclass
from itertools import pairwise
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation import checks

Array = NDArray[np.float64]

LEAST = 3
"""Samples below which nothing is estimated."""


@final
@dataclass(frozen=True, eq=False)
class Measured:
    """Samples of friction, in SI units; of an axis that turns in rad/s, N m and rad.

    Attributes:
        v: sliding velocity [m/s], shape (n,).
        F: force that moves the body, or friction itself where no mass is moved [N], shape (n,).
        x: position [m], shape (n,); from v and t where it is not given.
        t: increasing times [s], shape (n,); None for points without time.
        a: acceleration [m/s^2], shape (n,), where F moves a mass, too.
        N: normal force [N]; with 1 N the coefficients of a law read as forces.
        breaks: first samples of the records after the first one.

    Raises:
        ValueError: arrays of different shapes, numbers that are not finite, fewer than 3 samples,
            times that do not increase.
    """

    v: Array
    F: Array
    x: Array | None = None
    t: Array | None = None
    a: Array | None = None
    N: float = 1.0
    breaks: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        for name in ("v", "F", "x", "t", "a"):
            if (given := getattr(self, name)) is not None:
                object.__setattr__(self, name, _samples(name, given, np.size(self.v)))
        checks.number("Measured: N", self.N, unit="N", above=0.0)
        for record in self.records:
            if self.t is not None and not (np.diff(self.t[record]) > 0).all():
                raise checks.refused("Measured: t", "increasing times", self.t)
        if self.x is None and self.t is not None:
            object.__setattr__(self, "x", self._integrated(self.t))

    def _integrated(self, t: Array) -> Array:
        x = np.zeros(t.size)
        for record in self.records:
            steps = np.diff(t[record]) * (self.v[record][1:] + self.v[record][:-1]) / 2
            x[record] = np.concatenate([[0.0], np.cumsum(steps)])
        return x

    @property
    def records(self) -> tuple[slice, ...]:
        """Samples of each record."""
        edges = (0, *self.breaks, np.size(self.v))
        return tuple(slice(a, b) for a, b in pairwise(edges))

    @property
    def fastest(self) -> float:
        """Largest speed [m/s]."""
        return float(np.abs(self.v).max())


def _samples(name: str, given: object, size: int) -> Array:
    """`given` as finite floats, shape (size,)."""
    found = np.asarray(given, dtype=float)
    if found.ndim != 1 or found.size != size or size < LEAST:
        what = f"at least {LEAST} samples in one dimension, as many as v"
        raise checks.refused(f"Measured: {name}", what, found)
    if not np.isfinite(found).all():
        place = int(np.flatnonzero(~np.isfinite(found))[0])
        raise ValueError(
            f"Measured: {name}: expected finite numbers, got {found[place]} at sample {place}; "
            "leave such rows out"
        )
    return found
