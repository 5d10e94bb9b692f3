"""Steps from wide layers to narrow ones, and which of several is the best."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from ocp.solvers.outcome import Outcome
from ocp.transcription.transcription import Transcription
from ocp.transcription.unknowns import Points
from symfric.foundation.status import Status

Array = NDArray[np.float64]

ENDED = (Status.INTERRUPTED, Status.TIME_LIMIT)
FINALISTS = 3
"""Solutions on the coarse mesh that are solved on the finer one, where the best of them is seen."""
ALIKE = 1e-3
"""Share of J by which different motions differ at least."""


@final
@dataclass(frozen=True, eq=False)
class Step:
    """One solve: what was solved, and what came out."""

    transcription: Transcription
    values: Array
    outcome: Outcome
    points: Points
    level: float
    accepted: bool = True
    error: float = np.inf
    errors: tuple[Array, ...] = ()

    @property
    def good(self) -> bool:
        """Whether the path may go on from here."""
        return self.accepted and self.outcome.status.ok

    @property
    def ended(self) -> bool:
        """Whether the user or the clock has stopped the solver."""
        return self.outcome.status in ENDED

    @property
    def iterations(self) -> int:
        """Of the solver."""
        return self.outcome.statistics.iterations

    def better_than(self, other: "Step") -> bool:
        """Solved before not solved, then the lower cost, or the smaller violation."""
        if self.outcome.status.ok != other.outcome.status.ok:
            return self.outcome.status.ok
        if self.outcome.status.ok:
            return self.outcome.cost < other.outcome.cost
        return self.outcome.violation < other.outcome.violation


def least(steps: Sequence[Step]) -> Step:
    """The best of several steps, or the one that was stopped."""
    best = steps[0]
    for step in steps[1:]:
        best = step if step.ended or (not best.ended and step.better_than(best)) else best
    return best


def finalists(steps: Sequence[Step]) -> list[Step]:
    """The best few of several steps that are not the same motion: what costs the same is."""
    found: list[Step] = []
    for step in sorted(steps, key=lambda one: (not one.good, one.outcome.cost)):
        new = all(abs(step.outcome.cost - one.outcome.cost) > ALIKE * abs(one.outcome.cost)
                  for one in found)  # fmt: skip
        if not found or (new and step.good and len(found) < FINALISTS):
            found.append(step)
    return found
