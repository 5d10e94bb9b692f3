"""Numbers to pixels: ranges with round ticks, linear and logarithmic."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import ceil, floor, isfinite, log10
from typing import final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
SMALL, LARGE = 1e-2, 1e5
"""Magnitudes between which ticks are written as they are; beyond, a power of ten is taken out."""


@final
@dataclass(frozen=True)
class Axis:
    """One direction of a chart.

    Attributes:
        name, unit: what is drawn; the label is "name [unit]".
        low, high: its range, low < high; with `logarithmic` 0 < low.
        logarithmic: by decades.
        whole: ticks at whole numbers only.
    """

    name: str
    unit: str
    low: float
    high: float
    logarithmic: bool = False
    whole: bool = False

    def at(self, values: Array) -> Array:
        """Positions of `values` between low (0) and high (1)."""
        if self.logarithmic:
            return np.log(values / self.low) / np.log(self.high / self.low)
        return (values - self.low) / (self.high - self.low)

    @property
    def power(self) -> int:
        """Power of ten, a multiple of 3, by which the tick labels are divided."""
        size = max(abs(self.low), abs(self.high))
        if self.logarithmic or SMALL <= size < LARGE:
            return 0
        return 3 * floor(log10(size) / 3)

    @property
    def label(self) -> str:
        """Name and unit, with the power of ten of the ticks."""
        factor = f"10{str(self.power).translate(SUPERSCRIPTS)}" if self.power else ""
        inside = " ".join(part for part in (factor, self.unit) if part and part != "1")
        return f"{self.name} [{inside}]" if inside else self.name

    def ticks(self, most: int = 6) -> list[tuple[float, str]]:
        """Round values inside the range and their labels."""
        if self.logarithmic:
            return self._decades(most)
        step = self._step(most)
        first, last = ceil(self.low / step - 1e-9), floor(self.high / step + 1e-9)
        digits = max(6, ceil(log10(max(abs(self.low), abs(self.high)) / step)) + 1)
        unit = 10.0**self.power
        return [(k * step, f"{k * step / unit:.{digits}g}") for k in range(first, last + 1)]

    def _step(self, most: int) -> float:
        """The coarsest round step that has about `most` ticks, and three at least."""
        rough = (self.high - self.low) / most
        decade = 10.0 ** floor(log10(rough))
        steps = [s * d for d in (decade / 10, decade) for s in STEPS[:-1]] + [10 * decade]
        coarse = next(s for s in steps if s >= 0.999 * rough)
        if self.whole:
            return max(1.0, ceil(coarse))
        finer = [s for s in steps if s <= coarse and self.high // s - -(-self.low // s) >= 2]
        return finer[-1] if finer else coarse

    def _decades(self, most: int) -> list[tuple[float, str]]:
        first, last = ceil(log10(self.low) - 1e-9), floor(log10(self.high) + 1e-9)
        if last - first < 1:  # less than a decade: round values
            plain = Axis(self.name, self.unit, self.low, self.high)
            return [(x, f"{x:.3g}") for x, _ in plain.ticks(most) if x > 0]
        stride = max(1, ceil((last - first) / most))
        return [
            (10.0**k, f"10{str(k).translate(SUPERSCRIPTS)}") for k in range(first, last + 1, stride)
        ]


def around(
    name: str, unit: str, values: Iterable[Array], margin: float = 0.05, logarithmic: bool = False
) -> Axis:
    """An axis that holds all finite numbers in `values` with a margin."""
    kept = [y[np.isfinite(y) & ((y > 0) | (not logarithmic))] for y in values]
    every = np.concatenate([*kept, np.zeros(0)])
    if not every.size:
        return Axis(name, unit, 0.1 if logarithmic else 0.0, 1.0, logarithmic)
    low, high = float(every.min()), float(every.max())
    if logarithmic:
        share = max(margin * log10(high / low), 0.05)
        return Axis(name, unit, low / 10**share, high * 10**share, True)
    width = high - low
    if not (isfinite(width) and width > 1e-12 * max(abs(low), abs(high))):
        width = abs(high) or 1.0
    return Axis(name, unit, low - margin * width, high + margin * width)
