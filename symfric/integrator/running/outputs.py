"""Values at the times of the result, found while the run is under way."""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.running.dense import Dense

Array = NDArray[np.float64]


@final
@dataclass(eq=False)
class Outputs:
    """Unknowns at increasing times; mutable, filled from the start on.

    The compiled loop does what `fill` does, operation by operation (`loop.OUTPUTS`).

    Attributes:
        times: of the result [s], shape (m,).
        values: unknowns there, shape (n, m), known for the first `found` times.
        found: how many times were reached.
    """

    times: Array
    values: Array
    found: int = 0

    @classmethod
    def at(cls, times: Array, n: int) -> "Outputs":
        """Nothing yet of `n` unknowns at `times`."""
        times = np.ascontiguousarray(times)
        return cls(times, np.empty((n, times.size)))

    def fill(self, piece: Dense, last: bool = False) -> None:
        """Values at the times within `piece`.

        A time at its very end belongs to what follows, which an event or a break may have changed;
        unless the run ends there, with this `last` piece.
        """
        end = int(np.searchsorted(self.times, piece.t1[-1], side="right" if last else "left"))
        if end > self.found:
            self.values[:, self.found : end] = piece(self.times[self.found : end])
            self.found = end

    def back_to(self, t: float) -> None:
        """Forget what lies behind `t` [s]: steps that were interrupted before they were kept."""
        self.found = min(self.found, int(np.searchsorted(self.times, t, side="right")))

    @property
    def reached(self) -> Array:
        """Unknowns at the times that were reached, shape (n, found)."""
        return self.values[:, : self.found]
