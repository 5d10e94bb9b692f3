"""What runs of one law may cost, in counted work: no clock decides what is found.

Work is attempts of a step times the CasADi instructions of one. An attempt of a machine with events
counts `EVENTS` instructions more, which is what looking for them takes on average: 60 to 80 of
a hundred microseconds of `gms`, `haessig_friedland` and exact dry friction.
"""

from dataclasses import dataclass, field
from typing import Any, final

from symfric.choice.machine import Candidate, Machine
from symfric.figures.regularisation import Sample
from symfric.foundation.status import SolveError
from symfric.model import Model
from symfric.results.trajectory import Trajectory

EVENTS = 12_000
"""Instructions that the search for events after an attempt counts as."""
RUN, RUNS = 250_000_000, 5
"""Work that a run may take, about 0.7 s, and to how many such runs all of a law may come."""
LEAST, LEAST_WHOLE = 5_000, 30_000
"""Attempts that they may take of a machine however large."""
GROWTH = 8
"""A run may take so many times the attempts of the run before, which was a bit softer."""


@final
class SpentError(RuntimeError):
    """All that the runs of a law may cost is used up."""


@final
@dataclass(frozen=True, eq=False)
class Budget:
    """Runs of one law in one machine, counted; none is made twice.

    Attributes:
        held: the law in the machine, at any softness.
        instructions: that an attempt counts.
        work: that a run may take.
        attempts: of every run.
    """

    held: Candidate
    instructions: int
    work: int = RUN
    attempts: list[int] = field(default_factory=list[int])
    _models: dict[float, Model] = field(default_factory=dict[float, Model])
    _runs: dict[tuple[float, float], Sample] = field(default_factory=dict[Any, Sample])

    @property
    def most(self) -> int:
        """Attempts that a run may take."""
        return max(LEAST, self.work // self.instructions)

    @property
    def whole(self) -> int:
        """Attempts that all runs may take."""
        return max(LEAST_WHOLE, RUNS * self.work // self.instructions)

    def left(self, share: float = 1.0) -> bool:
        """Whether less than this share of everything is used up."""
        return sum(self.attempts) < share * self.whole

    def model(self, s: float) -> Model:
        """The machine with the law at the softness `s`.

        Raises:
            ValueError: beyond a bound of the law, or the machine refuses it.
        """
        if s not in self._models:
            self._models[s] = self.held.model(s)
        return self._models[s]

    def run(self, s: float, rtol: float, most: int | None = None) -> Sample:
        """A run at the softness `s`; `most` attempts at most.

        Raises:
            SolveError: it failed, or would take more.
        """
        if (s, rtol) in self._runs:
            return self._runs[s, rtol]
        allowed = min(most or self.most, self.most)
        try:
            found = self.held.machine.run(self.model(s), self.held.law, rtol, allowed)
        except SolveError as problem:
            run = problem.partial
            if isinstance(run, Trajectory):
                self.attempts.append(run.statistics.steps + run.statistics.rejections)
            raise
        self.attempts.append(found.attempts)
        self._runs[s, rtol] = found
        return found


def counted(machine: Machine, model: Model, rtol: float) -> tuple[int, str]:
    """What an attempt counts at this tolerance, and the method."""
    instructions, method = machine.instructions(model, rtol)
    return max(1, instructions) + (EVENTS if model.events else 0), method
