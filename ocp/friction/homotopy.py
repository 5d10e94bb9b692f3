"""From friction smoothed over wide layers of velocities to sharp friction, step by step.

A sharp law has many local optima and no usable derivatives where a body reverses. A law that is
smooth over a third of the largest sliding velocity has few, and a motion that is optimal for it
leads to a good one for the sharp law. So:

1. Coarse solves with wide layers, from several starts; the best one goes on. Among local optima
   the order of the costs there is that of the costs at the end, and such a solve takes a tenth of
   a second.
2. The layers become narrower, by a factor that adapts itself, while the mesh is refined where an
   interval errs. A step is taken back, and made shorter, where it does not converge or where it
   jumps to a motion that is worse: the Lagrangian with the multipliers of the step before,

       J(widths + step) ~ L(w, lam, widths + step),

   says what the cost should be, and costs one evaluation. A jump to something better is welcome.

Widths and mesh fractions are parameters of the nonlinear program: a step builds nothing anew
unless the number of intervals changes.
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
"""Solutions on the coarse mesh that are solved on the finer one, where the best of them is seen."""
ALIKE = 1e-3
"""Share of J by which different motions differ at least."""
FIRST = 0.3
"""Width of the layers of the first solves, in multiples of the largest sliding velocity."""
LAST = 1e-2
"""Width at which the modes of a motion can be read from it."""
FACTOR = 10**0.25
"""Factor between one width and the next, while all goes well."""
LEAST_FACTOR = 1.03
"""Steps shorter than this get nowhere."""
QUICK = 15
"""Iterations below which the next step may be longer."""
ABOVE = 0.01
"""Share of J by which a step may cost more than predicted."""
COARSE = 30
"""Intervals of the whole motion in the first solves, and `FINE` afterwards."""
FINE = 60
MOST = 300
"""More intervals are not made on the way."""
MOST_PARTS = 4
"""Into which one interval is cut at once."""
TOLERANCE = 1e-3
"""Local error of an interval, relative to the size of the states, that asks for no refinement."""
PASSES = 4
"""Refinements at one width."""
SPREAD = 0.5
"""How far the further starts are from the given one; see `starts_around`."""
FURTHER = 2
"""Times that so many starts are made round straight lines when none has led to a solution."""
SAME = 3.0
"""Factor by which the speeds of the first motion may differ from those the widths were made for."""
EARLY = {"tol": 1e-4, "max_iter": 100}
LATER = {"tol": 1e-5, "max_iter": 60, "mu_init": 1e-3}
ONTO = LATER | {"max_iter": 150}
BOUNDING = {"max_iter": 80}
"""Where the largest cost counts: with a small barrier parameter the multipliers of the bounds of
the costs start wrong, and with them all curvature."""


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
        costs = [one.outcome.cost for one in found]
        new = all(abs(step.outcome.cost - cost) > ALIKE * abs(cost) for cost in costs)
        if not found or (new and step.good and len(found) < FINALISTS):
            found.append(step)
    return found


@final
@dataclass(frozen=True, eq=False)
class Sharp:
    """A solution with smooth friction, on the way to sharp friction.

    Attributes:
        solution: of the problem with smooth models, its widths among the values of `p`.
        level: width of the layers, in multiples of the largest sliding velocity of each contact.
        scales: of each contact.
        steady: whether the step to it was a plain one; False where steps were taken back.
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
    """Solutions with narrower and narrower layers, each solved when it is taken.

    The first has layers of `FIRST`, the last one of `last`, or as narrow as it got: where the
    solver fails or is stopped, the solution says so.

    Args:
        problem: the user's, with contacts.
        scheme, solver: as in `solve`; of Ipopt the user's options win.
        guess: where to start; further starts are made around it.
        intervals: of the whole motion, before refinement.
        tolerance: local error of an interval.
        starts: coarse solves from different starts, the best of which goes on.
        last: width of the layers to stop at.
        clock: when to stop.
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
    """What the steps share."""

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
        """The best of several coarse solves with wide layers, on the mesh to go on with."""
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
            else:  # layers that much narrower are too far away
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
        """Solves with the widest layers from several starts, until one is stopped."""
        found: list[Step] = []
        for number, points in enumerate(tries, 1):
            found.append(self.solve(mesh, points, FIRST, options, f"start {number}"))
            if found[-1].ended:
                break
        return found

    def settled(self, before: Step, level: float, limit: float) -> Step:
        """The step to another width, on a mesh that is fine enough for it."""
        step = self.solve(before.transcription, before.points, level, LATER, f"width {level:.2g}")
        if not step.good or step.outcome.cost > limit:
            return replace(step, accepted=False)
        return self.refined(step, limit)

    def refined(self, step: Step, limit: float | None) -> Step:
        """`step` on finer and finer meshes, until its intervals are right or enough."""
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
        """One solve with layers of `level`."""
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
        """The motion of a step on other meshes."""
        spans = stored_spans(self.problem, self.scheme, step.transcription.meshes, step.points)
        chosen, iterate = step.points.chosen, step.outcome.iterate
        return resample(into, Stored("", "", "", 0.0, "", spans, chosen, iterate))

    def judged(self, step: Step) -> Step:
        """`step` with the local errors of its intervals."""
        widths = widths_at(self.user, self.scales, step.level)
        arcs = [*arcs_of(self.problem, step.transcription.meshes, step.points)]
        for k, arc in enumerate(arcs):
            pairs = zip(arc.span.model.p, arc.p, strict=True)
            arcs[k] = replace(arc, p=np.array([widths.get(v.name, x) for v, x in pairs]))
        errors = local_errors(arcs, min(1e-6, 1e-2 * self.tolerance))
        worst = max((float(e.max()) for e in errors), default=0.0)
        return replace(step, error=worst, errors=errors)

    def finer(self, step: Step) -> list[Array] | None:
        """Meshes with the intervals that err cut into pieces; None where there are none."""
        meshes, phases = step.transcription.meshes, len(self.problem.chain)
        if sum(m.size - 1 for m in meshes) > MOST:
            return None
        return cut_meshes(meshes, step.errors, phases, self.tolerance, order=3, most=MOST_PARTS)

    def predicted(self, step: Step, level: float) -> float:
        """The largest cost at another width that belongs to the motion of `step`.

        Its Lagrangian there, with a share of J more, and of what the step is to change.
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
        """A step as a solution of the problem with these widths."""
        widths = widths_at(self.user, self.scales, step.level)
        solution = solution_of(step.transcription, step.outcome)
        problem = replace(self.problem, p=dict(self.problem.p) | widths)
        statistics = reduce(SolverStatistics.then, self.solves)
        solution = replace(solution, problem=problem, statistics=statistics)
        return Sharp(solution, step.level, self.scales, steady, step.error)


def _meshes(problem: Problem, intervals: int) -> list[Array]:
    """Even meshes, so many intervals in all phases together."""
    T = [phase.T.start if isinstance(phase.T, Free) else float(phase.T) for phase in problem.chain]
    counts = [max(4, round(intervals * one / sum(T))) for one in T]
    return make_meshes(problem, counts)
