"""One unknown of a fit."""

from dataclasses import dataclass
from math import inf
from typing import final


@final
@dataclass(frozen=True, eq=False)
class Unknown:
    """A number that is fitted, in the unit of the user.

    Attributes:
        name: of a parameter of the model; of what belongs to a record, with its number: "x0.v[2]",
            "dead_time[0]".
        start: value from which the fit starts.
        lower, upper: bounds.
        scale: typical magnitude; a linear coordinate is value / scale.
        logarithmic: fitted by its logarithm: positive scales of which nobody knows the order.
        above: name of the value that this one does not fall below, or "".
        below: likewise, of the value that this one does not exceed.
        nuisance: a start value, a dead time: fitted, but not what is asked for.
    """

    name: str
    unit: str
    start: float
    lower: float = -inf
    upper: float = inf
    scale: float = 1.0
    logarithmic: bool = False
    above: str = ""
    below: str = ""
    nuisance: bool = False

    @property
    def partner(self) -> str:
        """The value that this one is in order with, or ""."""
        return self.above or self.below
