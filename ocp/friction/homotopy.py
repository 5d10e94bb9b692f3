"""Homotopy in the smoothing width: from wide friction layers to sharp friction, step by step.

A sharp law has many local optima and no usable derivatives at reversals. A law that is smoothed
over a third of the largest sliding velocity has few, and an optimal motion for it leads to a good
one for the sharp law. Therefore:

1. Coarse solves with wide layers, from several starts; the best one continues. The order of the
   costs of local optima there agrees with the order at the end, and such a solve takes a tenth of
   a second.
2. The layers become narrower by an adaptive factor, while the mesh is refined where an interval has
   large errors. A step is rejected and shortened if it does not converge or if it jumps to a worse
   motion: the Lagrangian with the multipliers of the previous step,

       J(widths + step) ~ L(w, lam, widths + step),

   predicts the cost and takes one evaluation. A jump to a better motion is accepted.

Widths and mesh fractions are parameters of the nonlinear program: a step rebuilds nothing unless
the number of intervals changes.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from math import sqrt
from typing import final

import numpy as np
from numpy.typing import NDArray

from ocp.checking.interval_errors import cut_meshes, local_errors
from ocp.checking.resimulate import arcs_of
from ocp.formulation.phase import Free
from ocp.formulation.problem import Problem
from ocp.friction import smooth_models
from ocp.friction.smooth_models import Scale, Scales, same_size, scales_of, widths_at
from ocp.solving.methods import Ipopt
from ocp.solving.motion import Stored, stored_spans
from ocp.solving.one_solve import Solver, solution_of, starts_around
from ocp.solving.prepared import Clock, Prepared
from ocp.solving.solution import Solution
from ocp.solving.starts import STARTS, Start, resample, start_of
from ocp.transcription.program import Iterate, Outcome, Report, SolverStatistics
from ocp.transcription.schemes import Scheme, make_meshes
from ocp.transcription.transcribe import Discretisation, discretise
from ocp.transcription.transcription import Transcription
from ocp.transcription.unknowns import Points
from symfric.foundation.status import Status

Array = NDArray[np.float64]
ENDED = (Status.INTERRUPTED, Status.TIME_LIMIT)
FINALISTS = 3
"""Number of coarse solutions that are solved again on the finer mesh to find the best one."""
ALIKE = 1e-3
"""Smallest relative difference of J between different motions."""
FIRST = 0.3
"""Smoothing width of the first solves, in multiples of the largest sliding velocity."""
LAST = 1e-2
"""Smoothing width at which the modes of a motion can be deduced from it."""
FACTOR = 10**0.25
"""Largest factor between successive widths."""
LEAST_FACTOR = 1.03
"""Smallest factor; the homotopy stops below it."""
QUICK = 15
"""Iterations up to which the next step may be longer."""
ABOVE = 0.01
"""Relative excess of J over the prediction at which a step is rejected."""
COARSE = 30
"""Intervals of the whole motion in the first solves; `FINE` afterwards."""
FINE = 60
MOST = 300
"""Largest number of intervals during the homotopy."""
MOST_PARTS = 4
"""Largest number of parts into which one interval is divided at once."""
TOLERANCE = 1e-3
"""Local error of an interval, relative to the size of the states, that needs no refinement."""
PASSES = 4
"""Largest number of meshes at one width."""
SPREAD = 0.5
"""Spread of additional starts around the given one; see `starts_around`."""
FURTHER = 2
"""Repetitions with new starts around straight lines if none has led to a solution."""
SAME = 3.0
"""Largest ratio between the speeds of the first motion and those assumed for the widths."""
EARLY = {"tol": 1e-4, "max_iter": 100}
LATER = {"tol": 1e-5, "max_iter": 60, "mu_init": 1e-3}
ONTO = LATER | {"max_iter": 150}
BOUNDING = {"max_iter": 80}
"""Options for worst-case costs: with a small initial barrier parameter the multipliers of the
bounds on the costs start wrong, and so does the curvature."""


@final
@dataclass(frozen=True, eq=False)
class Step:
    """A solve and its result."""

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
        """True if the homotopy can continue from here."""
        return self.accepted and self.outcome.status.ok

    @property
    def ended(self) -> bool:
        """True if the user or the time limit has stopped the solver."""
        return self.outcome.status in ENDED

    def better_than(self, other: "Step") -> bool:
        """Return True if solved and the other is not, at a lower cost, or with less violation."""
        if self.outcome.status.ok != other.outcome.status.ok:
            return self.outcome.status.ok
        if self.outcome.status.ok:
            return self.outcome.cost < other.outcome.cost
        return self.outcome.violation < other.outcome.violation


def least(steps: Sequence[Step]) -> Step:
    """Return the best of several steps, or the one that was stopped."""
    best = steps[0]
    for step in steps[1:]:
        best = step if step.ended or (not best.ended and step.better_than(best)) else best
    return best


def finalists(steps: Sequence[Step]) -> list[Step]:
    """Return the best few steps with different motions; equal costs count as the same motion."""
    found: list[Step] = []
    for step in sorted(steps, key=lambda one: (not one.good, one.outcome.cost)):
        costs = [one.outcome.cost for one in found]
        new = all(abs(step.outcome.cost - cost) > ALIKE * abs(cost) for cost in costs)
        if not found or (new and step.good and len(found) < FINALISTS):
            found.append(step)
    return found


@final
@dataclass(frozen=True, eq=False)
class Sharp:
    """A solution with smooth friction, at one level of the homotopy.

    Attributes:
        solution: of the problem with smooth models, its widths among the values of `p`.
        level: smoothing width, in multiples of the largest sliding velocity of each contact.
        scales: of each contact.
        steady: True if no step before it was rejected.
        error: largest local error of an interval.
    """

    solution: Solution
    level: float
    scales: Scales
    steady: bool
    error: float


def sharpened(
    problem: Problem,
    scheme: Scheme,
    solver: Solver,
    guess: Start = None,
    *,
    intervals: int = FINE,
    tolerance: float = TOLERANCE,
    starts: int = STARTS,
    last: float = LAST,
    clock: Clock | None = None,
    progress: Report | None = None,
) -> Iterator[Sharp]:
    """Yield solutions with decreasing smoothing widths; each item triggers a solve.

    The first has the width `FIRST`, the last one `last`, or the narrowest one reached: if the
    solver fails or is stopped, the status of the solution reports it.

    Args:
        problem: the user's problem, with contacts.
        scheme, solver: as in `solve`; the user's options of Ipopt take precedence.
        guess: initial guess; additional starts are generated around it.
        intervals: of the whole motion, before refinement.
        tolerance: local error of an interval.
        starts: coarse solves from different starts, the best of which goes on.
        last: final smoothing width.
        clock: time limit.
        progress: called after each iteration.
    """
    smooth = smooth_models.smoothed(problem)
    path = _Path(problem, smooth, scheme, solver, tolerance, clock or Clock(), progress)
    step = path.first(guess, starts, intervals)
    factor, steady = FACTOR, True
    yield path.told(step, steady)
    while step.good and step.level > last * 1.001:
        level = max(step.level / factor, last)
        limit = path.predicted(step, level)
        following = path.settled(step, level, limit)
        if following.ended:
            yield path.told(following, False)
            return
        if following.good:
            if following.outcome.statistics.iterations <= QUICK:
                factor = min(1.5 * factor, FACTOR)
            step = following
            yield path.told(step, steady)
            steady = True
            continue
        factor, steady = sqrt(factor), False
        if factor < LEAST_FACTOR:
            return


@final
@dataclass
class _Path:
    """State common to all steps."""

    user: Problem
    problem: Problem
    scheme: Scheme
    solver: Solver
    tolerance: float
    clock: Clock
    progress: Report | None
    scales: Scales = field(default_factory=dict[str, Scale])
    solves: list[SolverStatistics] = field(default_factory=list[SolverStatistics])

    def __post_init__(self) -> None:
        self.discretisation: Discretisation = discretise(self.problem, self.scheme)
        self.prepared: dict[tuple[int, str], Prepared] = {}

    def first(self, guess: Start, starts: int, intervals: int) -> Step:
        """Return the best of several coarse solves with wide layers, on the finer mesh."""
        coarse = self.discretisation.on(_meshes(self.problem, COARSE))
        begin = coarse.unpack(start_of(coarse, guess)[0].w)
        straight = coarse.unpack(start_of(coarse, None)[0].w)
        tries = starts_around(coarse, begin, range(starts), SPREAD)
        if guess is not None:
            tries += starts_around(coarse, straight, range(1, starts, 2), SPREAD)
        found = [scales_of(self.user, self.problem, points) for points in tries]
        self.scales = smooth_models.guessed(self.user, found)
        found = self.each(coarse, tries)
        best = least(found)
        for more in range(1, FURTHER + 1):
            if best.ended or best.good:
                break
            seeds = range(more * starts, (more + 1) * starts)
            found += self.each(coarse, starts_around(coarse, straight, seeds, SPREAD))
            best = least(found)
        if best.ended:
            return best
        now = scales_of(self.user, self.problem, best.points, self.scales)
        before, self.scales = self.scales, now
        if not same_size(now, before, SAME):
            again = self.each(coarse, [best.points, *tries])
            if least(again).good or least(again).ended:
                found = again
            else:  # the change of the widths is too large
                self.scales = before
        fine = self.discretisation.on(_meshes(self.problem, intervals))
        step = least(self.each(fine, [self.moved(one, fine) for one in finalists(found)], ONTO))
        if not step.good and not step.ended:
            step = least(self.each(fine, [self.moved(best, fine)], LATER | {"max_iter": 300}))
        now = scales_of(self.user, self.problem, step.points, self.scales)
        self.scales = now if same_size(now, self.scales, SAME) else self.scales
        return self.refined(step, None) if step.good else step

    def each(
        self,
        mesh: Transcription,
        tries: Sequence[Points],
        options: Mapping[str, float | int] = EARLY,
    ) -> list[Step]:
        """Solve with the widest layers from several starts, until one is stopped."""
        found: list[Step] = []
        for number, points in enumerate(tries, 1):
            found.append(self.solve(mesh, points, FIRST, options, f"start {number}"))
            if found[-1].ended:
                break
        return found

    def settled(self, before: Step, level: float, limit: float) -> Step:
        """Solve with another width, on a mesh that is fine enough for it."""
        step = self.solve(before.transcription, before.points, level, LATER, f"width {level:.2g}")
        if not step.good or step.outcome.cost > limit:
            return replace(step, accepted=False)
        return self.refined(step, limit)

    def refined(self, step: Step, limit: float | None) -> Step:
        """Refine the mesh of `step` until its errors are small enough or a limit is reached."""
        step = self.judged(step)
        for _ in range(PASSES - 1):
            meshes = self.finer(step)
            if meshes is None:
                break
            finer = self.discretisation.on(meshes)
            name = f"width {step.level:.2g}"
            again = self.solve(finer, self.moved(step, finer), step.level, LATER, name)
            if again.ended:
                return again
            if not again.good or (limit is not None and again.outcome.cost > limit):
                break
            step = self.judged(again)
        return step

    def solve(
        self,
        transcription: Transcription,
        points: Points,
        level: float,
        options: Mapping[str, float | int],
        stage: str,
    ) -> Step:
        """Solve once with the smoothing width `level`."""
        widths = widths_at(self.user, self.scales, level)
        values = transcription.values(widths)
        if self.problem.kind == "worst":
            options = {name: v for name, v in options.items() if name != "mu_init"} | BOUNDING
        key = (id(transcription.skeleton), str(options))
        prepared = self.prepared.get(key)
        if prepared is None:
            solver = self.solver
            if isinstance(solver, Ipopt):
                solver = Ipopt(max_time=solver.max_time, **(dict(options) | dict(solver.options)))
            prepared = self.prepared[key] = solver.prepared(transcription.program)
        start = Iterate.cold(transcription.pack(points), transcription.program.g.numel())
        outcome = self.clock.run(transcription, prepared, start, self.progress, stage, values)
        self.solves.append(outcome.statistics)
        found = transcription.unpack(outcome.iterate.w)
        return Step(transcription, values, outcome, found, level)

    def moved(self, step: Step, into: Transcription) -> Points:
        """Interpolate the motion of a step to other meshes."""
        spans = stored_spans(self.problem, self.scheme, step.transcription.meshes, step.points)
        chosen, iterate = step.points.chosen, step.outcome.iterate
        return resample(into, Stored("", "", "", 0.0, "", spans, chosen, iterate))

    def judged(self, step: Step) -> Step:
        """Return `step` with the local errors of its intervals."""
        widths = widths_at(self.user, self.scales, step.level)
        arcs = [*arcs_of(self.problem, step.transcription.meshes, step.points)]
        for k, arc in enumerate(arcs):
            pairs = zip(arc.span.model.p, arc.p, strict=True)
            arcs[k] = replace(arc, p=np.array([widths.get(v.name, x) for v, x in pairs]))
        errors = local_errors(arcs, min(1e-6, 1e-2 * self.tolerance))
        worst = max((float(e.max()) for e in errors), default=0.0)
        return replace(step, error=worst, errors=errors)

    def finer(self, step: Step) -> list[Array] | None:
        """Return meshes with inaccurate intervals divided; None if there are none."""
        meshes, phases = step.transcription.meshes, len(self.problem.chain)
        if sum(m.size - 1 for m in meshes) > MOST:
            return None
        return cut_meshes(meshes, step.errors, phases, self.tolerance, order=3, most=MOST_PARTS)

    def predicted(self, step: Step, level: float) -> float:
        """Return the largest cost at another width that belongs to the motion of `step`.

        It is its Lagrangian there, plus a share of J and of the predicted decrease.
        """
        program, iterate = step.transcription.program, step.outcome.iterate
        values = step.transcription.values(widths_at(self.user, self.scales, level))
        rows = [
            np.asarray(program.jacobian(iterate.w, p)[0]).ravel() for p in (step.values, values)
        ]
        cost = float(program.gradient(iterate.w, values)[0])
        cost += float(iterate.lam_g @ (rows[1] - rows[0]))
        now = step.outcome.cost
        return cost + ABOVE * abs(now) + 0.3 * max(0.0, now - cost)

    def told(self, step: Step, steady: bool) -> Sharp:
        """Return a step as a solution of the problem with these widths."""
        widths = widths_at(self.user, self.scales, step.level)
        solution = solution_of(step.transcription, step.outcome)
        problem = replace(self.problem, p=dict(self.problem.p) | widths)
        statistics = reduce(SolverStatistics.then, self.solves)
        solution = replace(solution, problem=problem, statistics=statistics)
        return Sharp(solution, step.level, self.scales, steady, step.error)


def _meshes(problem: Problem, intervals: int) -> list[Array]:
    """Return uniform meshes with a total number of intervals over all phases."""
    T = [phase.T.start if isinstance(phase.T, Free) else float(phase.T) for phase in problem.chain]
    counts = [max(4, round(intervals * one / sum(T))) for one in T]
    return make_meshes(problem, counts)
