"""Random numbers that are the same on every machine and with every version of Python."""

from collections.abc import Sequence
from random import Random
from typing import TypeVar, final

T = TypeVar("T")


@final
class Dice:
    """Draws of one case; all come from `Random.random`, whose sequence Python promises to keep."""

    def __init__(self, seed: int, number: int) -> None:
        self._random = Random(f"{seed}/{number}")

    def unit(self) -> float:
        """A number in [0, 1)."""
        return self._random.random()

    def chance(self, probability: float) -> bool:
        """True with this probability."""
        return self.unit() < probability

    def pick(self, items: Sequence[T]) -> T:
        """One of `items`; one that stands twice comes twice as often."""
        return items[int(self.unit() * len(items))]

    def between(self, low: float, high: float) -> float:
        """A number in [low, high), to three digits."""
        return rounded(low + (high - low) * self.unit())

    def decade(self, low: float, high: float) -> float:
        """10^e with e in [low, high), to three digits."""
        return rounded(10.0 ** (low + (high - low) * self.unit()))

    def signed(self, low: float, high: float) -> float:
        """A decade of either sign."""
        return self.decade(low, high) * self.pick((1.0, -1.0))


def rounded(value: float) -> float:
    """Three significant digits: readable, and equal where powers differ in their last bit."""
    return float(f"{value:.3g}")
