"""Parameters that are chosen together with the motion."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite, sqrt
from typing import final

from ocp.formulation.bounds import Box, as_box
from ocp.formulation.settings import Setting


@final
@dataclass(frozen=True)
class Choice:
    """A parameter that the optimiser chooses.

    Attributes:
        lower, upper: its bounds, those of the parameter itself included.
        guess: where the solver starts.
    """

    name: str
    unit: str
    lower: float
    upper: float
    guess: float

    @property
    def nominal(self) -> float:
        """Typical magnitude: of the guess, else of the larger bound, else 1."""
        sizes = [abs(b) for b in (self.lower, self.upper) if isfinite(b)]
        return abs(self.guess) or max(sizes, default=0.0) or 1.0


def chosen_of(
    choose: Mapping[str, tuple[float | None, ...]], settings: Sequence[Setting]
) -> tuple[Choice, ...]:
    """What is chosen, in the order of `choose`."""
    return tuple(_choice(name, given, settings) for name, given in choose.items())


def _choice(name: str, given: tuple[float | None, ...], settings: Sequence[Setting]) -> Choice:
    found = [(s, v) for s in settings for v in s.model.p if v.name == name]
    wanted = as_box((given[0], given[1]))
    low, high = wanted
    for _, v in found:
        low, high = max(low, v.lower), min(high, v.upper)
    setting, variable = found[0]
    value = float(setting.p.get(name, variable.start))
    guess = given[2] if len(given) == 3 else None
    guess = _guess(wanted, value) if guess is None else float(guess)
    return Choice(name, variable.unit, low, high, min(max(guess, low), high))


def _guess(box: Box, value: float) -> float:
    """The value of the parameter where it lies in the range, else the middle of the range."""
    low, high = box
    if low <= value <= high:
        return value
    if low > 0 and high < inf:
        return sqrt(low * high)
    if isfinite(low) and isfinite(high):
        return 0.5 * (low + high)
    return low if isfinite(low) else high
