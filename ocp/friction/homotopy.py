"""Homotopy in the smoothing width, from wide friction layers to sharp friction.

With a sharp law there are many local optima and no usable derivatives at reversals. With a law that
is smoothed over a third of the largest sliding velocity there are few local optima, and an optimal
motion leads to a good one for the sharp law.

1. Coarse solves with wide layers start from several points, and the best one continues. The order
   of the costs of local optima is the same as for sharp friction. A coarse solve takes 0.1 s.
2. The widths decrease by an adaptive factor, and the mesh is refined where intervals have large
   errors. A step is rejected and shortened if it does not converge or if it jumps to a worse
   motion. The Lagrangian with the multipliers of the previous step,

       J(widths + step) ~ L(w, lam, widths + step),

   predicts the cost by one evaluation. A jump to a better motion is accepted.

Widths and mesh fractions are parameters of the nonlinear program, so the program is rebuilt only if
the number of intervals changes.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from math import sqrt
from typing import NamedTuple, final

import numpy as np

from ocp.checking.interval_errors import cut_meshes, estimated_errors
from ocp.checking.resimulate import arcs_of
from ocp.formulation.phase import Array, initial
from ocp.formulation.problem import Problem
from ocp.friction import smooth_models
from ocp.friction.smooth_models import Scales, same_size, scales_of, widths_at
from ocp.solving.motion import span_motions
from ocp.solving.one_solve import (
    STARTS,
    HomotopyStep,
    Solver,
    Starts,
    Task,
    finalists,
    least,
    starts_around,
)
from ocp.solving.optimum import Optimum
from ocp.solving.prepared import Option, Prepared
from ocp.solving.solution import Solution
from ocp.solving.starts import Start, resample, start_of
from ocp.transcription.program import SolverStatistics
from ocp.transcription.schemes import make_meshes
from ocp.transcription.transcribe import Transcription, discretise
from ocp.transcription.unknowns import Values

FIRST = 0.3
"""Smoothing width of the first solves, in multiples of the largest sliding velocity."""
LAST = 1e-2
"""Smoothing width, in multiples of the speeds, at which modes can be deduced from a motion."""
FACTOR = 10**0.25
"""Largest ratio of successive widths."""
LEAST_FACTOR = 1.03
"""Ratio of successive widths below which the homotopy stops."""
QUICK = 15
"""Number of iterations up to which the next step may be longer."""
ABOVE = 0.01
"""Relative excess of J over the prediction at which a step is rejected."""
COARSE = 30
"""Total number of intervals in the first solves; `FINE` in later ones."""
FINE = 60
MOST = 300
"""Largest number of intervals during the homotopy."""
MOST_PARTS = 4
"""Largest number of parts into which one pass divides an interval."""
TOLERANCE = 1e-3
"""Permitted local error of an interval, relative to the magnitude of the states."""
PASSES = 4
"""Largest number of meshes at one width."""
FURTHER, THINNER = 2, 0.1
"""Number of repetitions with new starts around straight lines if no start leads to a solution, and
factor of the widths in the last one."""
DEARER = 0.5
"""Relative excess of the cost at which layers are too wide, as where only friction stops a body."""
SAME = 3.0
"""Largest ratio between the speeds of the first motion and those assumed for the widths."""
EARLY: dict[str, Option] = {"tol": 1e-4, "max_iter": 100}
LATER: dict[str, Option] = {"tol": 1e-5, "max_iter": 60, "mu_init": 1e-3}
ONTO = LATER | {"max_iter": 150}
RIVAL, NEAR, CLOSE = 0.02, 0.1, 5e-3
"""Width, in multiples of the speeds, to which coarse motions are continued on their mesh, the
largest width from which their modes are read if a step fails, and the relative difference of their
costs below which they are equal."""
BOUNDING: dict[str, Option] = {"max_iter": 80}
"""Options for worst-case costs. With a small initial barrier parameter the initial multipliers of
the bounds on the costs would be wrong, and with them the curvature."""


class Sharp(NamedTuple):
    """Solution with smooth friction at one level of the homotopy.

    Attributes:
        solution: solution of the problem with smooth models, whose `p` contains the widths.
        level: smoothing width, in multiples of the largest sliding velocity of each contact.
        scales: scales of the widths of each contact.
        steady: True if the step to this solution was not rejected before.
        error: largest local error of an interval.
        rivals: different motions from all starts if this is the first of them; otherwise empty.
    """

    solution: Solution
    level: float
    scales: Scales
    steady: bool
    error: float
    rivals: "tuple[Sharp, ...]" = ()


def sharpened(
    task: Task,
    guess: Start = None,
    *,
    intervals: int = FINE,
    starts: int = STARTS,
    last: float = LAST,
    rivals: bool = False,
) -> Iterator[Sharp]:
    """Yield solutions with decreasing smoothing widths, one solve at a time.

    The first solution has the width `FIRST`, and the last one has the width `last` or the smallest
    width reached. If the solver fails or is stopped, the status of the last solution reports it.
    With `rivals`, motions on the coarse mesh at a width of about `RIVAL` precede them.

    Args:
        task: the user's problem, with contacts; the options of its solver take precedence.
        guess: initial guess; additional starts are generated around it.
        intervals: total number of intervals before refinement.
        starts: number of coarse solves from different starts; the best one is continued.
        last: final smoothing width, in multiples of the speeds.
        rivals: True to yield motions on the coarse mesh first.
    """
    path = _Path(task)
    coarse = path.coarse(guess, starts)
    if rivals and (found := path.rivals(coarse)):
        yield found[0]._replace(rivals=found)
        if found[0].solution.status.stopped:
            return
    step = path.first(coarse, intervals)
    factor, steady = FACTOR, True
    yield path.sharp(step, steady)
    while step.good and step.level > last * 1.001:
        level, solves = max(step.level / factor, last), len(path.spent)
        following = path.narrower(step, level)
        if following.ended:
            yield path.sharp(following, False)
            return
        if following.good:
            if path.spent[solves].iterations <= QUICK:  # not those on refined meshes
                factor = min(1.5 * factor, FACTOR)
            step = following
            yield path.sharp(step, steady)
            steady = True
            continue
        factor, steady = sqrt(factor), False
        if factor < LEAST_FACTOR:
            return


def resumed(task: Task, guess: Solution) -> Sharp:
    """Return the motion with the width `LAST` near a solution by modes.

    Raises:
        ValueError: its meshes do not suit the problem.
    """
    path = _Path(task)
    same = len(guess.meshes) == len(path.user.spans)
    on = path.discretisation.on(guess.meshes if same else _meshes(path.user, FINE))
    points = on.unpack(start_of(on, guess)[0].w)
    path.scales = scales_of(path.user, path.problem, points, {})
    return path.sharp(path.solve(on, points, LAST, ONTO, "guess"), steady=True)


@final
class _Path:
    """Problem with smooth models, scales and prepared solvers, shared by all steps."""

    def __init__(self, task: Task) -> None:
        self.task, self.user = task, task.problem
        self.problem = smooth_models.smoothed(self.user)
        self.discretisation = discretise(self.problem, task.scheme)
        self.scales: Scales = {}
        self.spent: list[SolverStatistics] = []
        self.prepared: dict[tuple[int, str], tuple[Solver, Prepared]] = {}

    def coarse(self, guess: Start, starts: int) -> list[HomotopyStep]:
        """Return coarse solves with wide layers that lead to different motions, the best first."""
        coarse = self.discretisation.on(_meshes(self.problem, COARSE))
        begin = coarse.unpack(start_of(coarse, guess)[0].w)
        straight = coarse.unpack(start_of(coarse, None)[0].w)
        tries = starts_around(coarse, begin, range(starts))
        if guess is not None:
            tries += starts_around(coarse, straight, range(1, starts, 2))
        found = [scales_of(self.user, self.problem, points, {}) for points in tries]
        self.scales = smooth_models.guessed(self.user, found)
        steps = self.each(coarse, tries, until=self.faster)
        best = least(steps)
        for more in range(1, FURTHER + 1):
            if best.ended or best.good:
                break
            seeds = range(more * starts, (more + 1) * starts)
            if more == FURTHER:  # where only friction stops a body, wide layers have no motion
                self.scales = {
                    n: s._replace(speed=THINNER * s.speed) for n, s in self.scales.items()
                }
            steps += self.each(coarse, starts_around(coarse, straight, seeds))
            best = least(steps)
        if best.ended:
            return [best]
        before, self.scales = self.scales, self.scales_at(best)
        if not same_size(self.scales, before, SAME):
            again = self.each(coarse, [best.points, *tries])
            wide, limit = least(again), best.outcome.cost + DEARER * abs(best.outcome.cost)
            if wide.ended or (wide.good and wide.outcome.cost <= limit):
                steps = again
            else:  # the change of the widths is too large
                self.scales = before
                steps += self.each(coarse, tries[len(steps) :])
        return finalists(steps)

    def faster(self, steps: Sequence[HomotopyStep]) -> bool:
        """Return True if the best motion so far is much faster than the scales.

        Layers are then too narrow for all starts, and lead to many iterations and poor motions.
        """
        best = least(steps)
        found = scales_of(self.user, self.problem, best.points, {})
        faster = (scale.speed > SAME * self.scales[name].speed for name, scale in found.items())
        return best.good and any(faster)

    def rivals(self, coarse: Sequence[HomotopyStep]) -> tuple[Sharp, ...]:
        """Return the motions of coarse solves with narrower layers on the same mesh.

        There are none if the layers of the laws are wide, or with several contacts, whose sequences
        require a finer mesh.
        """
        contacts = {
            c.name for phase in self.user.chain for c in smooth_models.sticking(phase.model)
        }
        if smooth_models.own_level(self.user, self.scales) > LAST or len(contacts) > 1:
            return ()
        found: list[Sharp] = []
        for step in coarse:
            last = False
            while step.good and not last:
                level = max(step.level / FACTOR, RIVAL)
                name, last = f"width {level:.2g}", level == RIVAL
                narrower = self.solve(step.transcription, step.points, level, LATER, name)
                if narrower.ended:
                    return (self.sharp(narrower, steady=False),)
                step, last = (narrower, last) if narrower.good else (step, True)
            known = any(abs(one.solution.cost - step.outcome.cost) < CLOSE * abs(step.outcome.cost)
                        for one in found)  # fmt: skip
            if step.level <= NEAR and not known:
                found.append(self.sharp(step, steady=False))
        return tuple(found)

    def first(self, coarse: Sequence[HomotopyStep], intervals: int) -> HomotopyStep:
        """Return the best of several coarse solves, solved again on the finer mesh if possible."""
        if coarse[0].ended:
            return coarse[0]
        fine = self.discretisation.on(_meshes(self.problem, intervals))
        step = least(self.each(fine, [self.moved(one, fine) for one in coarse], ONTO))
        if not step.good and not step.ended:
            step = least(self.each(fine, [self.moved(coarse[0], fine)], LATER | {"max_iter": 300}))
        if not step.good and not step.ended and coarse[0].good:
            return self.with_errors(coarse[0])
        now = self.scales_at(step)
        self.scales = now if same_size(now, self.scales, SAME) else self.scales
        return self.refined(step, np.inf) if step.good else step

    def scales_at(self, step: HomotopyStep) -> Scales:
        """Return the scales of the motion of a step."""
        return scales_of(self.user, self.problem, step.points, self.scales)

    def each(
        self, mesh: Transcription, tries: Sequence[Values],
        options: Mapping[str, Option] = EARLY,
        until: Callable[[Sequence[HomotopyStep]], bool] | None = None,
    ) -> list[HomotopyStep]:  # fmt: skip
        """Solve with the widest layers from each start, until a solve is stopped or `until` holds.

        Equal motions of several starts do not end the search, as they may be a poor local optimum:
        three starts of the cart-pole of nosnoc stay at the lower equilibrium.
        """
        stages = [f"start {number}" for number in range(1, len(tries) + 1)]
        return self.solves(mesh, tries, FIRST, options, stages, until)

    def narrower(self, before: HomotopyStep, level: float) -> HomotopyStep:
        """Solve with the smaller width `level`, and refine the mesh for it.

        A step is not accepted if its cost exceeds the Lagrangian of the previous motion at this
        width plus a share of J and of the predicted decrease.
        """
        program, iterate = before.transcription.program, before.outcome.iterate
        values = before.transcription.values(widths_at(self.user, self.scales, level))
        rows = [
            np.asarray(program.jacobian(iterate.w, p)[0]).ravel() for p in (before.values, values)
        ]
        cost = float(program.gradient(iterate.w, values)[0])
        cost += float(iterate.lam_g @ (rows[1] - rows[0]))
        now = before.outcome.cost
        limit = cost + ABOVE * abs(now) + 0.3 * max(0.0, now - cost)
        step = self.solve(before.transcription, before.points, level, LATER, f"width {level:.2g}")
        if not step.good or step.outcome.cost > limit:
            return replace(step, accepted=False)
        return self.refined(step, limit)

    def refined(self, step: HomotopyStep, limit: float) -> HomotopyStep:
        """Return `step` on a mesh refined until errors are permitted or a limit is reached."""
        step = self.with_errors(step)
        for _ in range(PASSES - 1):
            meshes, phases = step.transcription.meshes, len(self.problem.chain)
            if sum(mesh.size - 1 for mesh in meshes) > MOST:
                break
            cut = cut_meshes(meshes, step.errors, phases, TOLERANCE, order=3, most=MOST_PARTS)
            if cut is None:
                break
            finer = self.discretisation.on(cut)
            name = f"width {step.level:.2g}"
            again = self.solve(finer, self.moved(step, finer), step.level, LATER, name)
            if again.ended:
                return again
            if not again.good or again.outcome.cost > limit:
                break
            step = self.with_errors(again)
        return step

    def solve(
        self,
        transcription: Transcription,
        points: Values,
        level: float,
        options: Mapping[str, Option],
        stage: str,
    ) -> HomotopyStep:
        """Solve once with the smoothing width `level`."""
        return self.solves(transcription, [points], level, options, [stage])[0]

    def solves(
        self, transcription: Transcription, tries: Sequence[Values], level: float,
        options: Mapping[str, Option], stages: Sequence[str],
        until: Callable[[Sequence[HomotopyStep]], bool] | None = None,
    ) -> list[HomotopyStep]:  # fmt: skip
        """Solve from several starts with the smoothing width `level`; see `each`."""
        values = transcription.values(widths_at(self.user, self.scales, level))
        if self.problem.kind == "worst":
            options = {name: v for name, v in options.items() if name != "mu_init"} | BOUNDING
        key = (id(transcription.skeleton), str(options))
        if key not in self.prepared:
            solver = self.task.solver.with_defaults(**options)
            self.prepared[key] = solver, solver.prepared(transcription.program)
        starts = Starts(transcription, *self.prepared[key], values)
        steps: list[HomotopyStep] = []
        for outcome in starts.outcomes(tries, self.task.supervisor, stages):
            self.spent.append(outcome.statistics)
            steps.append(HomotopyStep(transcription, outcome, values, level))
            if until is not None and until(steps):
                break
        return steps

    def moved(self, step: HomotopyStep, into: Transcription) -> Values:
        """Return the motion of a step interpolated to the meshes of `into`."""
        meshes, points = step.transcription.meshes, step.points
        spans = span_motions(self.problem, self.task.scheme, meshes, points)
        return resample(into, spans, points.chosen)

    def with_errors(self, step: HomotopyStep) -> HomotopyStep:
        """Return `step` with the local errors of its intervals."""
        widths = widths_at(self.user, self.scales, step.level)
        arcs = [*arcs_of(self.problem, step.transcription.meshes, step.points)]
        for k, arc in enumerate(arcs):
            pairs = zip(arc.span.model.p, arc.p, strict=True)
            arcs[k] = replace(arc, p=np.array([widths.get(v.name, x) for v, x in pairs]))
        errors = estimated_errors(step.transcription, step.outcome.iterate.w, step.values, arcs)
        worst = max((float(e.max()) for e in errors), default=0.0)
        return replace(step, error=worst, errors=errors)

    def sharp(self, step: HomotopyStep, steady: bool) -> Sharp:
        """Return a step as a solution of the problem with its widths."""
        widths = widths_at(self.user, self.scales, step.level)
        problem = replace(self.problem, p=dict(self.problem.p) | widths)
        statistics = reduce(SolverStatistics.then, self.spent)
        optimum = Optimum(step.transcription, step.outcome.iterate, step.values)
        solution = replace(step.solution, problem=problem, statistics=statistics, optimum=optimum)
        return Sharp(solution, step.level, self.scales, steady, step.error)


def _meshes(problem: Problem, intervals: int) -> list[Array]:
    """Return uniform meshes with a total number of intervals over all phases."""
    T = [initial(phase.T) for phase in problem.chain]
    return make_meshes(problem, [max(4, round(intervals * one / sum(T))) for one in T])
