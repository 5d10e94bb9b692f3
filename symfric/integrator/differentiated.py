"""A run with the derivatives of its signals, computed when somebody asks for them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.derivatives.adjoint import gradient
from symfric.integrator.derivatives.path import Path
from symfric.integrator.derivatives.seeds import Seeds
from symfric.integrator.derivatives.sensitivity import Slopes, forward, of_signals

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Differentiated:
    """Derivatives along the steps of a run.

    Attributes:
        make: what was run; made when it is first needed.
        which: by what it is differentiated.
        names: of the signals.
        t: times of the result [s].
    """

    make: Callable[[], Path]
    which: Seeds
    names: tuple[str, ...]
    t: Array

    @cached_property
    def path(self) -> Path:
        """What was run."""
        return self.make()

    @cached_property
    def solution(self) -> Slopes:
        """Derivatives of the unknowns."""
        return forward(self.path, self.which)

    def at(self, times: Array) -> dict[str, dict[str, Array]]:
        """Derivatives of all signals: name -> signal -> values, shape (times,)."""
        values = of_signals(self.path, self.which, self.solution.dense, times)
        return {
            seed: dict(zip(self.names, rows, strict=True))
            for seed, rows in zip(self.which.names, values, strict=True)
        }

    def pull_back(self, weights: Mapping[str, Array]) -> dict[str, float]:
        """Derivatives of a weighted sum of signals at `t`."""
        used = {self.names.index(name): w for name, w in weights.items() if w.any()}
        return gradient(self.path, self.which, self.t, used)

    def delays(self) -> dict[str, Array]:
        """Derivatives of the times of events."""
        jumps = [len(jump.which) for jump in self.path.jumps]
        times = np.repeat(self.solution.times, jumps, axis=0)
        return dict(zip(self.which.names, times.T, strict=True))
