"""Time that several solves in a row may take together."""

from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import final

from ocp.solvers.prepared import Prepared

LEAST = 1e-3
"""A solver is given some time at least [s], and stops at once."""


@final
@dataclass(frozen=True)
class Clock:
    """Runs from when it is made.

    Attributes:
        allowed: wall time [s] for all, or None for any.
    """

    allowed: float | None = None
    started: float = field(default_factory=perf_counter)

    @property
    def left(self) -> float | None:
        """What is left [s]; None for any."""
        if self.allowed is None:
            return None
        return max(LEAST, self.allowed - (perf_counter() - self.started))

    @property
    def over(self) -> bool:
        """Whether nothing is left."""
        return self.left == LEAST

    def within(self, prepared: Prepared) -> Prepared:
        """`prepared` with what is left as its limit, if that is less than its own."""
        left = self.left
        if left is None or (prepared.max_time is not None and prepared.max_time <= left):
            return prepared
        return replace(prepared, max_time=left, told_time=self.allowed)
