"""One law towards dry friction, and at the loosest tolerance at equal error, within its budget.

    error      largest difference from the reference: of law and integrator
    own error  largest difference from the finest run of the same law: of the integrator alone

A law that models something else than dry friction, such as a bristle that rings, keeps no small
error however dry it is made. It is timed where its own error is the wanted accuracy.

Runs of one law may cost counted work: no clock decides what is found. Work is attempts of a step
times the CasADi instructions of one. An attempt of a machine with events counts `EVENTS`
instructions more, which is what looking for them takes on average: 60 to 80 of a hundred
microseconds of `gms`, `haessig_friedland` and exact dry friction.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf, nan
from typing import Any, final

from symfric.choice.machine import FAILURES, Candidate, Reference
from symfric.choice.smoothing import MARGIN, Smoothed, SmoothingStudy, ladder
from symfric.figures.regularisation import Machine, Sample, apart
from symfric.foundation.status import SolveError, Status
from symfric.integrator.arguments import chosen
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.running.integrator import built
from symfric.model import Model
from symfric.results.trajectory import Trajectory

EVENTS = 12_000
"""Instructions that the search for events after an attempt counts as."""
RUN, RUNS = 250_000_000, 5
"""Work that a run may take, about 0.7 s, and to how many such runs all of a law may come."""
LEAST, LEAST_WHOLE = 5_000, 30_000
"""Attempts that they may take of a machine however large."""
GROWTH = 8
"""Run may take so many times the attempts of the run before, which was a bit softer."""


@final
class SpentError(RuntimeError):
    """The budget of the runs of a law is used up."""


@final
@dataclass(frozen=True, eq=False)
class Budget:
    """Runs of one law in one machine, counted; none is made twice.

    Attributes:
        held: the law in the machine, at any smoothing.
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
        """Test for less than this share of the budget used up."""
        return sum(self.attempts) < share * self.whole

    def model(self, s: float) -> Model:
        """Return the machine with the law at the smoothing `s`.

        Raises:
            ValueError: beyond a bound of the law, or the machine refuses it.
        """
        if s not in self._models:
            self._models[s] = self.held.model(s)
        return self._models[s]

    def run(self, s: float, rtol: float, most: int | None = None) -> Sample:
        """Return a run at the smoothing `s`; `most` attempts at most.

        Raises:
            SolveError: it failed, or would take more.
        """
        if (s, rtol) in self._runs:
            return self._runs[s, rtol]
        allowed = min(most or self.most, self.most)
        try:
            found = self.held.run(self.model(s), rtol, allowed)
        except SolveError as problem:
            run = problem.partial
            if isinstance(run, Trajectory):
                self.attempts.append(run.statistics.steps + run.statistics.rejections)
            raise
        self.attempts.append(found.attempts)
        self._runs[s, rtol] = found
        return found


def counted(machine: Machine, model: Model, rtol: float) -> tuple[int, str]:
    """CasADi instructions of an attempt at this tolerance, and the method."""
    formula = chosen("simulate", "auto", rtol)
    inputs = input_data(model, machine.u, 0.0, machine.t_end)
    instructions = built(model, inputs, formula)[0].instructions
    return max(1, instructions) + (EVENTS if model.events else 0), formula.name


LOOSEST, PER_DECADE = 1e-3, 2
"""Relative tolerances that are tried: half decades from here on."""
LOOSER = (1e-6, 1e-5, 1e-4)
"""Relative tolerances for runs that take too many attempts at another."""
COARSE, FINEST = 1e-6, 1e-11
"""Relative tolerances of the runs on the way to dry friction, and the finest of all."""
NEAR = 10.0
"""Beyond so many times the accuracy a coarse run says enough."""
AS_NEAR = 2.0
"""Errors of a law that never keeps the accuracy are alike within this ratio of its smallest."""
FINER = 3
"""Times the attempts of a coarse run that a fine one takes, about."""
EFFORT = "see effort"
"""Hint where a larger budget may help."""
ON_THE_WAY = 0.6
"""Share of the budget for the way to dry friction; the rest is for the run at equal error."""


@final
@dataclass(frozen=True)
class Asked:
    """Wanted errors, and tolerances for them.

    Attributes:
        accuracy: largest error relative to the motion, of law and integrator together.
        softest: largest error of a law that is of interest.
    """

    accuracy: float
    softest: float

    @property
    def fine(self) -> float:
        """Relative tolerance at which the integrator's error is negligible."""
        return min(1e-7, max(FINEST, 1e-3 * self.accuracy))

    @property
    def coarse(self) -> float:
        """Return the tolerance of the first run."""
        return min(COARSE, max(self.fine, 1e-2 * self.accuracy))


@final
@dataclass(frozen=True, eq=False)
class AtEqualError:
    """Run that a law is judged by.

    Attributes:
        s: its smoothing.
        model, run, rtol: what ran.
        error, own: from the reference, and from the finest run of the law itself.
    """

    s: float
    model: Model
    run: Sample
    rtol: float
    error: float
    own: float


def continued(runs: Budget, reference: Reference, asked: Asked) -> SmoothingStudy:
    """Error against smoothing, to where two runs in a row keep the accuracy, or no more helps.

    Raises:
        one of `FAILURES`: the law as it comes does not run at any tolerance.
    """

    def run(s: float) -> Smoothed:
        if not runs.left(ON_THE_WAY):
            raise SpentError(f"drier runs take more than {sum(runs.attempts)} tries, {EFFORT}")
        before = runs.attempts[-1] if runs.attempts else runs.most
        found, rtol = _first_that_ends(runs, s, asked.coarse, GROWTH * before + LEAST)
        error = reference.off(found.motion)
        if rtol > asked.fine and error <= NEAR * asked.accuracy:
            try:
                found = runs.run(s, asked.fine, GROWTH * found.attempts + LEAST)
                error, rtol = reference.off(found.motion), asked.fine
            except SolveError:
                pass  # the coarse run is what there is
        return Smoothed(s, error, found.attempts, rtol, found.motion / reference.size[:, None])

    wanted = MARGIN * asked.accuracy
    softest = max(asked.accuracy, asked.softest)
    return ladder(run, wanted, softest, runs.held.power, FAILURES, short)


def _first_that_ends(runs: Budget, s: float, rtol: float, most: int) -> tuple[Sample, float]:
    """Return the run at `rtol`, or at the next looser of `LOOSER` that takes no more than `most`
    attempts.

    Drier than it comes a law has one further chance, since what fails at one takes about as much.

    Raises:
        SolveError: none does, or a run fails otherwise.
    """
    looser = [x for x in LOOSER if x > 1.1 * rtol]
    for other in looser if s >= 1.0 else looser[-1:]:
        try:
            return runs.run(s, rtol, most), rtol
        except SolveError as problem:
            if problem.status is not Status.MAX_STEPS:
                raise
            rtol = other
    return runs.run(s, rtol, most), rtol


def nearest(levels: SmoothingStudy) -> Smoothed:
    """Return the softest level whose error is about the smallest that the law reaches."""
    least = min(level.error for level in levels.levels)
    return next(level for level in levels.levels if not level.error > AS_NEAR * least)


def at_equal_error(
    runs: Budget, s: float, reference: Reference, asked: Asked,
    near: Smoothed, whole: bool,
) -> AtEqualError:  # fmt: skip
    """Return the loosest tolerance at which an error is at most the accuracy.

    A tolerance counts if the next tighter one keeps the accuracy, too; where none does the finest
    that ends within the budget.

    Args:
        near: a run of about this smoothing, which says what a fine one costs.
        whole: whether that is the error from the reference, or the law's own.

    Raises:
        SolveError: no run ends.
    """
    able = near.rtol <= asked.fine or FINER * near.attempts <= runs.most
    first = asked.fine if able else max(near.rtol, asked.fine)
    try:
        best, finest = _first_that_ends(runs, s, first, GROWTH * near.attempts + LEAST)
    except SolveError:
        if s != near.s:
            raise
        best, finest = runs.run(s, near.rtol), near.rtol  # which has ended

    def own(motion: Sample) -> float:
        return apart(motion.motion, best.motion, best.size)

    def error(run: Sample) -> float:
        return reference.off(run.motion) if whole else own(run)

    rtol, found, gap = _loosest(runs, s, error, asked, finest)
    if found is None:
        rtol, found = finest, best
    said = own(found) if rtol > finest else gap
    return AtEqualError(s, runs.model(s), found, rtol, reference.off(found.motion), said)


def _loosest(
    runs: Budget, s: float, error: Callable[[Sample], float], asked: Asked, finest: float
) -> tuple[float, Sample | None, float]:
    """Return the tolerance and its run, if any above `finest`, and the error of the last one."""
    rtol, last = LOOSEST, nan
    before: tuple[float, Sample] | None = None
    while rtol > 1.1 * finest and runs.left():
        try:
            run = runs.run(s, rtol)
            last = error(run)
        except SolveError:
            run, last = None, inf
        good = run is not None and last <= asked.accuracy
        if good and before is not None:
            return *before, last
        before = (rtol, run) if run is not None and good else None
        rtol *= 10 ** (-1 / PER_DECADE)
    return (*before, last) if before is not None else (finest, None, last)


def short(problem: object) -> str:
    """Return the first sentence of an error; of a run that failed what its status says."""
    if isinstance(problem, SolveError) and isinstance(problem.partial, Trajectory):
        run = problem.partial
        said = {
            Status.MAX_STEPS: f"more than {run.statistics.steps + run.statistics.rejections} tries",
            Status.JAMMED: "friction jams",
            Status.STEP_TOO_SMALL: "the step becomes too small",
            Status.EVENT_STORM: "events pile up",
        }
        if problem.status in said:
            return f"{said[problem.status]} by t = {run.t[-1]:.3g} s"
    return " ".join(str(problem).split()).partition("; ")[0]
