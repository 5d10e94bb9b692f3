"""Solves with smooth friction, and the comparison of motions from several starts."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from ocp.formulation.phase import Array
from ocp.solving.one_solve import Solved

FINALISTS = 3
"""Number of coarse solutions that are continued."""
ALIKE = 1e-3
"""Relative difference of J below which motions count as equal."""


@final
@dataclass(frozen=True, eq=False)
class Step(Solved):
    """Solve with the smoothing width `level` and the `values` of all parameters.

    Attributes:
        accepted: False if the solve jumped to a worse motion.
        error: largest local error of an interval.
        errors: local errors of each interval, (N,) for each phase.
    """

    values: Array
    level: float
    accepted: bool = True
    error: float = np.inf
    errors: tuple[Array, ...] = ()

    @property
    def good(self) -> bool:
        """True if the homotopy can continue from this step."""
        return self.accepted and self.ok

    @property
    def ended(self) -> bool:
        """True if the user or the time limit has stopped the solver."""
        return self.outcome.status.stopped


def least(steps: Sequence[Step]) -> Step:
    """Return the stopped step, or the cheapest one, or the least violated if none is solved."""

    def rank(step: Step) -> tuple[bool, bool, float]:
        outcome = step.outcome
        return not step.ended, not step.ok, outcome.cost if step.ok else outcome.violation

    return min(steps, key=rank)


def same_cost(a: Step, b: Step) -> bool:
    """Return True if the costs of two steps indicate the same motion."""
    return abs(a.outcome.cost - b.outcome.cost) <= ALIKE * abs(b.outcome.cost)


def finalists(steps: Sequence[Step]) -> list[Step]:
    """Return the best steps with different costs, which indicate different motions."""
    kept: list[Step] = []
    for step in sorted(steps, key=lambda one: (not one.good, one.outcome.cost)):
        new = not any(same_cost(step, one) for one in kept)
        if not kept or (new and step.good and len(kept) < FINALISTS):
            kept.append(step)
    return kept
