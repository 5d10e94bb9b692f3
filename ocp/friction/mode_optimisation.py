"""Optimisation of contact modes, their order and their switching times from a sharpened motion.

Smooth friction with a width of a hundredth of the speed shows which contacts slip and when. In the
mode sequence deduced from this motion, friction is a known force while a contact slips and a
reaction while it sticks. The problem of these arcs is smooth and the switching times are unknowns,
so a solver finds them with full precision on few intervals:

1. Deduce the sequence (`ocp.friction.sequence`). If it leads to no solution, insert stick at each
   reversal and at the ends.
2. Solve the problem of mode models with free durations (`ocp.friction.arcs`).
3. Remove arcs whose duration is almost zero, change the sequence where the motion is at the bounds
   of its modes (`ocp.friction.sequence`), and solve again from there.
4. Refine the intervals until the loss of cost by constant inputs is negligible.

The result holds for exact Coulomb friction with stiction, the limit of smooth laws.
Source: Betts, Practical Methods for Optimal Control, 2nd ed., 2010, 3.7 (phases); Bryson and Ho,
Applied Optimal Control, 1975, 3.7 (conditions at free times).
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import islice, product
from math import inf, sqrt
from typing import final

import numpy as np

from ocp.checking.interval_errors import estimated_errors
from ocp.checking.mesh_refinement import MeshErrors, refined
from ocp.checking.resimulate import arcs_of
from ocp.formulation.phase import Array
from ocp.formulation.problem import Problem
from ocp.formulation.statement import Soft
from ocp.friction.arc_solution import ModeSolver, SolvedSequence, StoppedError, reassemble
from ocp.friction.arcs import MARGIN, Rules
from ocp.friction.mode_models import restless
from ocp.friction.sequence import Legs, flat, inserted, neighbours, pruned, shown
from ocp.friction.smooth_models import shortfall
from ocp.friction.transfer import Known, Reader
from ocp.solving.one_solve import Task
from ocp.solving.solution import Solution

TOUCH = 1e-5
"""Share of the largest sliding velocity of a contact below which its slip touches zero. It exceeds
the distance of an interior-point method to an active bound."""
CREEP = (3.0, 1.0, 10.0)
"""Multiples of the width below which a contact counts as sticking; the first one that leads to a
solution is used. A smooth law is at its dynamic level at a few widths."""
SHORTEST = 5e-5
"""Smallest duration of an arc, relative to the total duration; necessary arcs are longer."""
AGAIN = 0.1
"""Initial barrier parameter after a change of the sequence; smaller values may diverge."""
KICK = 2e-3
"""Smallest length of an interval in which a contact breaks away, relative to the total duration."""
GONE = 4.0
"""Duration below which arcs are removed, in multiples of the smallest duration."""
ROUNDS = 4
"""Largest number of changes of the sequence."""
NEW_ARC = 5e-3
"""Initial duration of an inserted arc, relative to the total duration."""
WORTH = 1e-4
"""Relative reduction of the cost from which another sequence is preferred. It exceeds the error of
the estimated loss by constant inputs on few intervals."""
FINE = 3e-4
"""Permitted loss of cost by constant inputs, relative to the cost."""
ZERO = 1e-8
"""Smallest significant difference between costs."""
LOCAL = 1e-7
"""Largest relative local error of an interval."""
HALVED = 4.0
"""Error, in multiples of the largest local error, by which refinement halves an interval."""
MOST_ITERATIONS, PATIENT = 100, 400
"""Limits of the iterations of one solve. A sequence that takes more is usually wrong. If no
sequence leads to a solution, the second limit applies: an arm whose joints stop takes 350."""
CLOSER = 5.0
"""Divisor of the margin for a motion that is computed only to find the cost of a margin."""
SURE = 1.5
"""Factor by which a margin exceeds the share of the static level that a law does not reach."""
LEAST_INTERVALS = 40
MOST = 800
LEAST_GROWTH, GROWTH = 1.1, 5.0
"""Smallest growth of the number of intervals that reduces the loss further, and largest growth in
one pass."""


def rests_inside(solved: SolvedSequence) -> Legs | None:
    """Return the sequence with stick where slips touch zero, or None if none does."""
    arcs, legs, transcription = flat(solved.legs), solved.legs, solved.transcription
    times, slips, largest = list[Array](), list[dict[str, Array]](), dict[str, float]()
    for number, (span, arc) in enumerate(zip(transcription.problem.spans, arcs, strict=True)):
        t = arc.begin + transcription.fractions(number) * arc.duration
        columns = {n: span.model.expression(f"{n}_slip") for n in arc.modes}
        own = {n: solved.known.along(span.model, slip, t)[0] for n, slip in columns.items()}
        times.append(t)
        slips.append(own)
        largest |= {n: max(largest.get(n, 0.0), float(np.abs(v).max())) for n, v in own.items()}
    for number in reversed(range(len(arcs))):  # later arcs first, which keeps the numbers of others
        t = times[number]
        for contact, mode in arcs[number].modes.items():
            # points inside the arc at which the slip is almost zero
            size = np.abs(slips[number][contact][1:-1])
            near = np.flatnonzero(size < TOUCH * largest[contact]) + 1
            if mode and near.size:
                window = float(t[near[0] - 1]), float(t[near[-1] + 1])
                legs = inserted(legs, number, contact, 0, *window)
                break
    return pruned(legs, 0.0) if legs is not solved.legs else None


@final
@dataclass(frozen=True, eq=False)
class ModeMotions:
    """Result of a search for modes, from which motions with several margins are computed.

    Attributes:
        modes_solver: solver of sequences, with the margin of the search.
        margin: the wanted margin.
        possible: smallest margin at which the user's laws hold a contact.
        pressed: True if the margin of the search is active.
        coarse: margin -> sequence on few intervals; empty if no sequence led to a solution.
    """

    modes_solver: ModeSolver
    margin: float
    possible: float
    pressed: bool = False
    coarse: dict[float, SolvedSequence] = field(default_factory=dict[float, SolvedSequence])

    @property
    def first(self) -> float:
        """Margin of the search."""
        return self.modes_solver.rules.margin

    @property
    def least(self) -> float:
        """Smallest margin, by which the cost of margins is found."""
        least = max(self.margin, self.possible)
        return least if least < self.first else self.margin / CLOSER

    @property
    def margins(self) -> tuple[float, ...]:
        """Margins of possible motions, the smallest one first."""
        if self.margin <= self.least and self.least in self.coarse:
            return self.least, sqrt(self.least * self.first), self.first
        return (self.first,)

    def rests(self, margin: float, cost: float) -> str:
        """Return a sentence about the margin of a motion and its share of `cost`, if active."""
        if not self.pressed:
            return ""
        what = "an unknown amount"
        if self.least in self.coarse:
            more, less = (self.coarse[m].ideal_cost for m in (self.first, self.least))
            slope = max(0.0, more - less) / (self.first - self.least)
            what = f"about {slope * margin:.2g} of {cost:.6g}"
        few = "" if margin <= self.margin else "; no valid motion was found with less"
        return f"Stiction keeps {margin:.2g} of its level as a margin, which costs {what}{few}."

    def motion(self, margin: float) -> Solution:
        """Return the motion with one of the `margins` on fine intervals."""
        solver = self.modes_solver.with_margin(margin)
        found = self.coarse.get(margin, self.coarse.get(self.first))
        if found is not None and not solver.stopped:
            with suppress(StoppedError):
                found = found if margin in self.coarse else solver.again(found)
                found = _fine(solver, found) if found.ok else found
        return _solution(solver, found)


def optimise_modes(
    smooth: Sequence[tuple[Solution, Mapping[str, float]]], task: Task, margin: float = MARGIN
) -> ModeMotions:
    """Return the best motion with exact friction near one of several sharpened motions.

    The margin of the search is the larger one of `MARGIN` and `margin`. If it is active, the motion
    with the smaller `margin` follows; if `margin` is `MARGIN` or more, a still smaller margin
    serves to find its cost.

    Args:
        smooth: solutions of the problem with smooth friction, with widths of about a hundredth of
            the speeds, and contact -> sliding velocity [m/s] over which its friction is smoothed;
            they need not be verified.
        task: the user's problem, with scheme, solver, time limit and progress.
        margin: margin between stiction and its static level, as a share of this level.

    Returns:
        A search result, whose solutions have `modes` for exact Coulomb friction with stiction,
        without verification. Their status is not ok if no sequence led to a solution. They have no
        `modes` if the search was stopped before.

    Raises:
        ValueError: an unsuitable problem; see `refusal`.

    Limits: the sequence differs from those of the sharpened motions only by stick intervals,
    superfluous arcs and active bounds; a qualitatively different motion is not found. Contacts with
    dependent slips (a loop of one degree of freedom) have no unique reactions in stick and are
    refused.
    """
    problem, first, tried = task.problem, max(MARGIN, margin), list[SolvedSequence]()
    if reason := refusal(problem):
        raise ValueError(f"optimise_modes: {reason}")
    limits = [MOST_ITERATIONS] if len(smooth) > 1 else [MOST_ITERATIONS, PATIENT]
    if "max_iter" in task.ipopt.options:
        limits = [int(task.ipopt.options["max_iter"])]

    def near(motion: Solution, widths: Mapping[str, float], most: int | None) -> ModeMotions:
        known = Known.of(problem, motion.motions[0], motion.chosen)
        N, whole = max(LEAST_INTERVALS, motion.motions[0].t_control.size // 2), known.motion.T
        reader, best = Reader(problem, known), None
        at_rest = reader.starts_at_rest(widths)
        rules = Rules(problem, reader.sizes(), at_rest, SHORTEST * whole, first)
        modes_solver = ModeSolver(rules, task, KICK * whole, tried)
        quick = modes_solver.with_iterations(limits[0])
        with suppress(StoppedError):
            for limit, legs in islice(_attempts(limits, reader, widths), most):
                found = modes_solver.with_iterations(limit).solve(legs, known, N, 1e-2)
                if found.ok:
                    best = found  # kept if the following step is stopped
                    best = settled(quick, best)
                    break
        possible = SURE * max(shortfall(phase.model) for phase in problem.chain)
        return ModeMotions(quick, margin, possible, False, {first: best} if best else {})

    every: list[ModeMotions] = []
    for pair in smooth:  # the sequences of rivals are tried once
        every.append(near(*pair, 1 if any(one.coarse for one in every) else None))
        if every[-1].modes_solver.stopped:
            break
    found = min(every, key=lambda one: min([inf, *(s.ideal_cost for s in one.coarse.values())]))
    modes_solver = found.modes_solver
    if found.coarse and not modes_solver.stopped:
        best = found.coarse[first]
        with suppress(StoppedError):
            best = better(modes_solver, best, NEW_ARC * sum(leg.duration for leg in best.legs))
            found.coarse[first], found = best, replace(found, pressed=best.pressed(first))
            if found.pressed:
                closer = modes_solver.with_margin(found.least).again(best)
                found.coarse.update({found.least: closer} if closer.ok else {})
    return found


def _solution(modes_solver: ModeSolver, best: SolvedSequence | None) -> Solution:
    """Return the best or the first sequence, with total statistics and the reason for a stop."""
    problem, tried = modes_solver.rules.problem, modes_solver.tried
    found = reassemble(problem, best or tried[0], [s.outcome.statistics for s in tried])
    if not modes_solver.stopped:
        return found
    last = tried[-1].outcome
    message = f"ocp '{problem.name}': {last.sentence}"
    message += "" if best is None else " The result has the best modes so far."
    modes = {} if best is None else found.modes
    return replace(found, status=last.status, message=message, cause=last.cause, modes=modes)


def refusal(problem: Problem) -> str:
    """Return the reason why modes of a problem cannot be optimised, or "" if they can."""
    if not any(phase.model.contacts for phase in problem.chain):
        return "expected a model with contacts, got none"
    if problem.scenarios:
        return (
            "expected one motion, got scenarios, whose contacts change their modes at different "
            "times under one control"
        )
    if any(phase.cost is not None and phase.cost.peaks for phase in problem.chain):
        return "expected largest(...) in the cost of the problem, got it in the cost of a phase"
    inside = [c for phase in problem.chain for s in phase.stops for c in phase.at.get(s, ())]
    if any(isinstance(condition, Soft) for condition in inside):
        return "expected soft conditions at the ends of phases or over them, got one between"
    if any(phase.stops and not isinstance(phase.T, float | int) for phase in problem.chain):
        return "expected phases of fixed duration with via points; split them at the via points"
    if reasons := [text for phase in problem.chain if (text := restless(phase.model))]:
        return reasons[0]
    return ""


def _attempts(
    limits: Sequence[int], reader: Reader, widths: Mapping[str, float]
) -> Iterator[tuple[int, Legs]]:
    """Yield iteration limits and possible sequences, the most likely one first.

    All sequences with the first limit precede those with the second one. Those without inserted
    stick come first: it takes many iterations to shrink, and the motion shows longer stick.
    """
    sequences: dict[str, Legs] = {}
    for rests, factor in product((False, True), CREEP):
        creep = {name: factor * width for name, width in widths.items()}
        legs = reader.sequence(creep, rests)
        if shown(legs) not in sequences:
            sequences[shown(legs)] = legs
            yield limits[0], legs
    yield from product(limits[1:], sequences.values())


def settled(modes_solver: ModeSolver, solved: SolvedSequence) -> SolvedSequence:
    """Return the solution without superfluous arcs and with stick where slips touch zero."""
    seen = {shown(solved.legs)}
    for _ in range(ROUNDS):
        legs = pruned(solved.legs, GONE * modes_solver.rules.shortest)
        if shown(legs) == shown(solved.legs):
            legs = rests_inside(solved) or legs
        if shown(legs) in seen:
            break
        seen.add(shown(legs))
        changed = modes_solver.solve(legs, solved.known, solved.intervals, AGAIN)
        if not changed.ok:
            break
        solved = changed
    return solved


def better(modes_solver: ModeSolver, solved: SolvedSequence, width: float) -> SolvedSequence:
    """Return the best one of the solved sequence and its neighbours."""
    seen = {shown(solved.legs)}
    for _ in range(ROUNDS):
        for legs in neighbours(solved.legs, width):
            if shown(legs) in seen:
                continue
            seen.add(shown(legs))
            other = modes_solver.solve(legs, solved.known, solved.intervals, AGAIN)
            left = pruned(other.legs, GONE * modes_solver.rules.shortest)
            if not other.ok or shown(left) in seen - {shown(legs)}:
                continue
            other = settled(modes_solver, other)
            if other.ideal_cost < solved.ideal_cost - WORTH * abs(solved.ideal_cost):
                solved = other
                break
        else:
            break
    return solved


def _fine(modes_solver: ModeSolver, solved: SolvedSequence) -> SolvedSequence:
    """Refine the intervals until the loss by constant inputs is negligible.

    The estimate of this loss is reliable if two meshes agree on the cost without the loss. Until
    they agree, all intervals are halved. If stiction follows its level, the estimate is too large,
    and the error of J by two meshes applies.
    """
    before: SolvedSequence | None = None
    for _ in range(ROUNDS):
        t, allowed = solved.transcription, FINE * abs(solved.outcome.cost) + ZERO
        arcs = arcs_of(t.problem, t.meshes, solved.points)
        local = estimated_errors(t, solved.outcome.iterate.w, t.program.values, arcs)
        ideal, left = _remaining(before, solved)
        loss = min(solved.loss, left)
        exact = max(float(own.max()) for own in local) <= LOCAL
        outside = solved.overloaded
        agree, inside = min(ideal, left) <= allowed, not any(own.any() for own in outside)
        if agree and exact and inside and loss <= allowed:
            break
        least, trust = 0.0 if agree else HALVED * LOCAL, loss / max(solved.loss, ZERO)
        errors = [
            MeshErrors(np.maximum(own, least), trust * lost, over)
            for own, lost, over in zip(local, solved.losses, outside, strict=True)
        ]
        meshes = refined(
            t.meshes, errors, [()] * len(errors), local=LOCAL, loss=allowed / 2, most=MOST,
            growth=GROWTH,
        )  # fmt: skip
        full = sum(mesh.size - 1 for mesh in meshes) < LEAST_GROWTH * solved.intervals
        if full and exact and inside:
            break
        parts = solved.legs, solved.discretisation, meshes
        finer = modes_solver.on(*parts, solved.known, 1e-4)
        if not finer.ok:  # in a flat minimum the solution may be far from the start
            finer = modes_solver.on(*parts, finer.known, 1e-2)
        if not finer.ok:
            break
        before, solved = solved, settled(modes_solver, finer)
    return solved


def _remaining(before: SolvedSequence | None, now: SolvedSequence) -> tuple[float, float]:
    """Return bounds of the errors of the cost without loss and of J, by two meshes.

    The errors fall at least as 1/N (stiction at its level), usually as N^-2. Meshes of similar size
    differ by their errors.
    """
    if before is None:
        return inf, inf
    share = max(1.0, now.intervals / before.intervals - 1.0)
    changes = now.ideal_cost - before.ideal_cost, now.outcome.cost - before.outcome.cost
    return abs(changes[0]) / share, abs(changes[1]) / share
