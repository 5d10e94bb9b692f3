"""Runs of one law within a budget: towards dry friction, and at the loosest tolerance.

    error      largest difference from the reference, caused by law and integrator
    own error  largest difference from the finest run of the same law, caused by the integrator

A law that does not tend to dry friction, such as an undamped bristle, has no small error at any
smoothing. It is timed at the tolerance at which its own error equals the required accuracy.

The budget is measured as work: attempted steps times CasADi instructions per attempt, so that no
clock influences the result. In a machine with events an attempt counts `EVENTS` more instructions,
the average cost of the search for events. For `gms`, `haessig_friedland` and exact dry friction
this search takes 60 to 80 % of the time.
"""

from contextlib import suppress
from dataclasses import dataclass, field
from math import inf, nan
from typing import Any, final

from symfric.choice.machine import FAILURES, Candidate, Reference
from symfric.choice.smoothing import MARGIN, Smoothed, SmoothingStudy, study
from symfric.figures.regularisation import Machine, Sample, apart
from symfric.foundation.status import SolveError, Status
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import chosen
from symfric.integrator.running.integrator import built
from symfric.model import Model
from symfric.results.trajectory import Trajectory

EVENTS = 12_000
"""Number of instructions that represents the search for events after an attempt."""
RUN, RUNS = 250_000_000, 5
"""Largest work of a run, about 0.7 s, and of all runs of a law as a multiple of it."""
LEAST, LEAST_WHOLE = 5_000, 30_000
"""Number of attempts that are always allowed for a run, and for all runs."""
GROWTH = 8
"""Largest ratio of the attempts of a run to those of the previous, smoother run."""


@final
class SpentError(RuntimeError):
    """Error for an exhausted budget of the runs of a law."""


@final
@dataclass(frozen=True, eq=False)
class Budget:
    """Counted and cached runs of one law in one machine.

    Attributes:
        held: the law in the machine, for any smoothing.
        instructions: number of instructions per attempt.
        work: largest work of a run.
        attempts: number of attempts of each run.
    """

    held: Candidate
    instructions: int
    work: int = RUN
    attempts: list[int] = field(default_factory=list[int])
    _models: dict[float, Model] = field(default_factory=dict[float, Model])
    _runs: dict[tuple[float, float], Sample] = field(default_factory=dict[Any, Sample])

    @property
    def most(self) -> int:
        """Largest number of attempts of one run."""
        return max(LEAST, self.work // self.instructions)

    @property
    def whole(self) -> int:
        """Largest number of attempts of all runs together."""
        return max(LEAST_WHOLE, RUNS * self.work // self.instructions)

    def left(self, share: float = 1.0) -> bool:
        """Return True if less than `share` of the budget is used."""
        return sum(self.attempts) < share * self.whole

    def model(self, s: float) -> Model:
        """Return the machine with the law at the smoothing `s`.

        Raises:
            ValueError: a parameter is out of bounds, or the machine rejects the law.
        """
        if s not in self._models:
            self._models[s] = self.held.model(s)
        return self._models[s]

    def run(self, s: float, rtol: float, most: int | None = None) -> Sample:
        """Return a run at the smoothing `s` with at most `most` attempts.

        Raises:
            SolveError: the run failed, or would take more attempts.
        """
        if (s, rtol) in self._runs:
            return self._runs[s, rtol]
        allowed = min(most or self.most, self.most)
        try:
            sample = self.held.run(self.model(s), rtol, allowed)
        except SolveError as problem:
            run = problem.partial
            if isinstance(run, Trajectory):
                self.attempts.append(run.statistics.steps + run.statistics.rejections)
            raise
        self.attempts.append(sample.attempts)
        self._runs[s, rtol] = sample
        return sample


def counted(machine: Machine, model: Model, rtol: float) -> tuple[int, str]:
    """Return the CasADi instructions of an attempt at the tolerance `rtol`, and the method."""
    formula = chosen("simulate", "auto", rtol)
    inputs = input_data(model, machine.u, 0.0, machine.t_end)
    instructions = built(model, inputs, formula)[0].instructions
    return max(1, instructions) + (EVENTS if model.events else 0), formula.name


LOOSEST, PER_DECADE = 1e-3, 2
"""Largest relative tolerance that is tried, and the number of tolerances per decade."""
LOOSER = (1e-6, 1e-5, 1e-4)
"""Relative tolerances for runs that take too many attempts at a smaller tolerance."""
COARSE, FINEST = 1e-6, 1e-11
"""Relative tolerances of the runs towards dry friction, and of the finest runs."""
NEAR = 10.0
"""Ratio of error to accuracy above which a coarse run is sufficient."""
AS_NEAR = 2.0
"""Ratio to the smallest error of a law up to which errors count as equal."""
FINER = 3
"""Typical ratio of the attempts of a fine run to those of a coarse run."""
EFFORT = "see effort"
"""Hint that a larger budget may help."""
ON_THE_WAY = 0.6
"""Share of the budget for runs towards dry friction; runs at equal error use the remainder."""


@final
@dataclass(frozen=True)
class Wanted:
    """Required errors, and the tolerances of runs that follow from them.

    Attributes:
        accuracy: largest allowed error of law and integrator together, relative to the motion.
        softest: largest error of interest.
    """

    accuracy: float
    softest: float

    @property
    def fine(self) -> float:
        """Relative tolerance at which the error of the integrator is negligible."""
        return min(1e-7, max(FINEST, 1e-3 * self.accuracy))

    @property
    def coarse(self) -> float:
        """Relative tolerance of the first run."""
        return min(COARSE, max(self.fine, 1e-2 * self.accuracy))


@final
@dataclass(frozen=True, eq=False)
class AtEqualError:
    """Run from which the row of a law is computed.

    Attributes:
        s: smoothing of the law.
        model, run, rtol: model, run and relative tolerance of the run.
        error, own: differences from the reference and from the finest run of the law itself.
    """

    s: float
    model: Model
    run: Sample
    rtol: float
    error: float
    own: float


def continued(runs: Budget, reference: Reference, goal: Wanted) -> SmoothingStudy:
    """Return errors against smoothing, ending with two successive runs within the accuracy.

    Raises:
        one of `FAILURES`: the unscaled law does not run at any tolerance.
    """

    def run(s: float) -> Smoothed:
        if not runs.left(ON_THE_WAY):
            raise SpentError(f"drier runs take more than {sum(runs.attempts)} tries, {EFFORT}")
        before = runs.attempts[-1] if runs.attempts else runs.most
        sample, rtol = _first_that_ends(runs, s, goal.coarse, GROWTH * before + LEAST)
        error = reference.off(sample.motion)
        if rtol > goal.fine and error <= NEAR * goal.accuracy:
            with suppress(SolveError):  # then the coarse run is kept
                sample = runs.run(s, goal.fine, GROWTH * sample.attempts + LEAST)
                error, rtol = reference.off(sample.motion), goal.fine
        return Smoothed(s, error, sample.attempts, rtol, sample.motion / reference.size[:, None])

    softest = max(goal.accuracy, goal.softest)
    return study(run, MARGIN * goal.accuracy, softest, runs.held.power, FAILURES, short)


def _first_that_ends(runs: Budget, s: float, rtol: float, most: int) -> tuple[Sample, float]:
    """Return the run at `rtol`, or at the next of `LOOSER` that takes at most `most` attempts.

    For s < 1 only one other tolerance is tried, since a failed run costs as much as a complete one.

    Raises:
        SolveError: no run takes at most `most` attempts, or a run fails for another reason.
    """
    looser = [x for x in LOOSER if x > 1.1 * rtol]
    for next_rtol in looser if s >= 1.0 else looser[-1:]:
        try:
            return runs.run(s, rtol, most), rtol
        except SolveError as problem:
            if problem.status is not Status.MAX_STEPS:
                raise
            rtol = next_rtol
    return runs.run(s, rtol, most), rtol


def nearest(levels: SmoothingStudy) -> Smoothed:
    """Return the smoothest level whose error is approximately the smallest error."""
    least = min(level.error for level in levels.levels)
    return next(level for level in levels.levels if not level.error > AS_NEAR * least)


def at_equal_error(
    runs: Budget, s: float, reference: Reference, goal: Wanted, near: Smoothed, whole: bool
) -> AtEqualError:
    """Return the run at the loosest tolerance at which an error is at most the accuracy.

    The next tighter tolerance must satisfy the accuracy as well. If there is no such tolerance, the
    finest run within the budget is returned.

    Args:
        near: run at a similar smoothing, which indicates the cost of a fine run.
        whole: True for the error from the reference, False for the own error of the law.

    Raises:
        SolveError: no run reaches the end of the motion.
    """
    able = near.rtol <= goal.fine or FINER * near.attempts <= runs.most
    first = goal.fine if able else max(near.rtol, goal.fine)
    try:
        best, finest = _first_that_ends(runs, s, first, GROWTH * near.attempts + LEAST)
    except SolveError:
        if s != near.s:
            raise
        best, finest = runs.run(s, near.rtol), near.rtol  # this run is known to succeed

    def own(sample: Sample) -> float:
        return apart(sample.motion, best.motion, best.size)

    taken, own_error = (finest, best), nan
    rtol, before = LOOSEST, None
    while rtol > 1.1 * finest and runs.left():
        sample, error, own_error = None, inf, inf
        with suppress(SolveError):
            sample = runs.run(s, rtol)
            own_error = own(sample)
            error = reference.off(sample.motion) if whole else own_error
        good = sample is not None and error <= goal.accuracy
        if good and before is not None:
            break
        before = (rtol, sample) if sample is not None and good else None
        rtol *= 10 ** (-1 / PER_DECADE)
    if before is not None:
        taken, own_error = before, own(before[1])
    rtol, sample = taken
    return AtEqualError(s, runs.model(s), sample, rtol, reference.off(sample.motion), own_error)


def short(problem: object) -> str:
    """Return the first sentence of an error, or a description of the status of a failed run."""
    if isinstance(problem, SolveError) and isinstance(problem.partial, Trajectory):
        run = problem.partial
        words = {
            Status.MAX_STEPS: f"more than {run.statistics.steps + run.statistics.rejections} tries",
            Status.JAMMED: "friction jams",
            Status.STEP_TOO_SMALL: "the step becomes too small",
            Status.EVENT_STORM: "events pile up",
        }
        if problem.status in words:
            return f"{words[problem.status]} by t = {run.t[-1]:.3g} s"
    return " ".join(str(problem).split()).partition("; ")[0]
