"""Friction levels that no force in the data came near: they are read off a curve far beyond it.

A record that only slides tells how friction falls with speed, not from which level: a law fits it
with a static level of many times what was ever measured, and a formal interval around it.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import final

FAR = 3.0
"""Force of a level over the largest friction force in the data from which on it is not told."""


@final
@dataclass(frozen=True)
class Levels:
    """Which of the values are friction levels, and what forces there were.

    Attributes:
        loads: name of a level -> its force over its value: 1, or of a coefficient the normal force.
        largest: largest friction force in the data [N or N m].
        unit: of the forces.
    """

    loads: Mapping[str, float]
    largest: float
    unit: str = "N"

    def beyond(self, values: Mapping[str, float]) -> Iterator[tuple[str, str]]:
        """Names of the levels far above all forces, with a sentence each."""
        for name, load in self.loads.items():
            force = abs(values.get(name, 0.0)) * load
            if force > FAR * self.largest > 0:
                yield (
                    name,
                    f"{name} is not told: no friction force in the data comes near "
                    f"{force:.3g} {self.unit}, the largest is {self.largest:.2g} {self.unit}.",
                )
