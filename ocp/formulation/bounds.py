"""Values to meet, ranges to stay in, durations to choose."""

from dataclasses import dataclass
from math import inf, isfinite, isnan, sqrt
from typing import Any, final

from symfric.foundation import checks
from symfric.foundation.numeric import is_number

Range = float | tuple[float | None, float | None]
"""A value to meet, or (lower, upper) to stay between; None is no bound."""

Box = tuple[float, float]

FREE: Box = (-inf, inf)
"""No condition: `start={"x": FREE}` lets the optimiser choose the start inside the bounds."""

RANGE = "a finite number or (lower, upper) with lower <= upper and None for no bound"


@final
@dataclass(frozen=True)
class Free:
    """A duration [s] that the optimiser chooses between `lower` > 0 and `upper`.

    `guess` is where it starts, the geometric mean of the bounds if none is given.

    Raises:
        ValueError: not 0 < lower <= guess <= upper < inf, or lower = upper.
    """

    lower: float
    upper: float
    guess: float | None = None

    def __post_init__(self) -> None:
        for name in ("lower", "upper", "guess"):
            value = getattr(self, name)
            if name != "guess" or value is not None:
                number = checks.number(f"Free: {name}", value, unit="s", above=0.0)
                object.__setattr__(self, name, number)
        guess = self.lower if self.guess is None else self.guess
        if not (0 < self.lower <= guess <= self.upper < inf and self.lower < self.upper):
            raise ValueError(
                f"Free: expected 0 < lower <= guess <= upper [s] and lower < upper, got "
                f"{self.lower!r}, {self.guess!r}, {self.upper!r}"
            )

    @property
    def start(self) -> float:
        """The duration the solver starts with [s]."""
        return sqrt(self.lower * self.upper) if self.guess is None else self.guess


def as_box(value: Range) -> Box:
    """(lower, upper) of a number or a pair with None for no bound."""
    if isinstance(value, tuple):
        low, high = value
        return (-inf if low is None else float(low), inf if high is None else float(high))
    return (float(value), float(value))


def meet(a: Box, b: Box) -> Box:
    """What lies in both ranges; empty (lower > upper) if nothing does."""
    return (max(a[0], b[0]), min(a[1], b[1]))


def fixed(box: Box) -> bool:
    """Whether the range is one number."""
    return box[0] == box[1]


def is_range(value: Any) -> bool:
    """Whether `value` is a finite number or an ordered pair that leaves some room."""
    if not isinstance(value, tuple):
        return is_number(value) and isfinite(value)
    if len(value) != 2 or not all(v is None or is_number(v) for v in value):
        return False
    low, high = as_box(value)
    return not isnan(low) and not isnan(high) and low <= high and low < inf and high > -inf
