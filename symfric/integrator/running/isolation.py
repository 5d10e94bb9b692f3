"""The first root of several functions in a step: pieces that may hide some are cut until none does.

It is written a second time in C (`symfric.integrator.running.search`), operation by operation.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.running.crossings import FINER, LOOKS, SHARPER

Array = NDArray[np.float64]
LEAST = 1e-15
"""Shortest part of a step that rounding leaves."""


@final
@dataclass(eq=False)
class Isolation:
    """The search in one step.

    Attributes:
        values: theta -> value of each event.
        doubts: (values at five places) -> of the pieces between them and each event, whether it
            may have more roots there than the signs say.
        directions: of the events.
        tolerance: of event times, as a part of the step.
        roots: the first one of each event that was found, inf elsewhere.
        left: pieces that may still be cut.
    """

    values: Callable[[float], Array]
    doubts: Callable[[Array], Array]
    directions: NDArray[np.intp]
    tolerance: float
    roots: Array = field(init=False)
    left: int = FINER

    def __post_init__(self) -> None:
        self.roots = np.full(self.directions.size, np.inf)

    def first(self, at: Sequence[float], g: Array, doubts: Array) -> float:
        """The first of all roots between the places `at` with values g, or one behind them.

        What is in doubt is looked at again before the first sure root, since what jumps with that
        event does not do so before it, or piece by piece where there is none, or it is its own.
        """
        hits = passed(g[:-1], g[1:], self.directions) & (self.roots > at[0])
        suspects, sure = doubts != 0, float(self.roots.min())
        doubtful = bool(suspects.any())
        if doubtful:
            long = np.diff(at)[:, None] > max(self.tolerance, LEAST)
            suspects &= long & (self.left > 0)
        for k in np.flatnonzero((hits & ~suspects).any(axis=1)).tolist() if hits.any() else ():
            if at[k] < sure:
                sure = self._sure((at[k], at[k + 1]), g[k : k + 2], hits[k] & ~suspects[k])
        if not doubtful:
            return sure
        if sure <= at[-1]:
            others = suspects & (self.roots > 1) & (np.array(at[:-1]) < sure)[:, None]
            if others.any():
                suspects &= ~others
                sure = self._again(at[0], sure - self._share, g[0], np.any(others, axis=0))
        for k in np.flatnonzero(suspects.any(axis=1)).tolist():
            if at[k] >= sure:
                break
            found = self._again(at[k], at[k + 1], g[k], suspects[k])
            if found <= at[k + 1]:
                return found
        return float(self.roots.min())

    @property
    def _share(self) -> float:
        """Tolerance of roots."""
        return max(SHARPER * self.tolerance, LEAST)

    def _sure(self, ends: tuple[float, float], g: Array, hits: NDArray[np.bool_]) -> float:
        """The first of all roots once those of some events in a piece are located."""
        for i in np.flatnonzero(hits).tolist():

            def value(theta: float, i: int = i) -> float:
                return float(self.values(theta)[i])

            values = float(g[0, i]), float(g[1, i])
            self.roots[i] = locate(value, *ends, values, self._share)
        return float(self.roots.min())

    def _again(self, a: float, b: float, before: Array, suspects: NDArray[np.bool_]) -> float:
        """As `first`, from a with the values there to b, where these events are in doubt."""
        self.left -= 1
        b = max(a, b)
        at = [a, *(a + s * (b - a) for s in LOOKS[1:])]
        g = np.stack([before, *map(self.values, at[1:])])
        return self.first(at, g, self.doubts(g) * suspects)


def passed(before: Any, after: Any, directions: Any) -> Any:
    """Whether events go through zero in their directions."""
    rising = (before < 0) & (after >= 0) & (directions >= 0)
    return rising | ((before > 0) & (after <= 0) & (directions <= 0))


def locate(
    value: Callable[[float], float], a: float, b: float, ends: tuple[float, float], tolerance: float
) -> float:
    """Root in [a, b] of a function with values of two signs at the `ends`; the side after it.

    By the Illinois method.
    """
    fa, fb = ends
    if fb == 0.0:
        return b
    side = 0
    for _ in range(100):
        if not b - a > tolerance:
            break
        c = (fa * b - fb * a) / (fa - fb)
        c = min(max(c, a + 1e-3 * (b - a)), b - 1e-3 * (b - a)) if side else c
        fc = value(c)
        if fc == 0.0:
            return c
        if (fc > 0) == (fb > 0):
            b, fb = c, fc
            fa = fa / 2 if side == 1 else fa
            side = 1
        else:
            a, fa = c, fc
            fb = fb / 2 if side == -1 else fb
            side = -1
    return b
