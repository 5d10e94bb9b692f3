"""From a sharpened motion to one that is exact: modes, their order and their instants.

Smooth friction with a width of a hundredth of the speed shows who slips when. The sequence of modes
that is read off it turns friction into what it is: a known force while a contact slips, a reaction
while it rests. The problem of these arcs is smooth, and the instants of change are among its
unknowns, so that a solver finds them to its full precision, on few intervals:

1. read the sequence; put a rest at every reversal and at the ends (`ocp.friction.sequence`);
2. solve the problem of mode models with free durations (`ocp.friction.arcs`);
3. prune arcs that have shrunk to nothing, repair the sequence where the motion presses against the
   bounds of its modes (`ocp.friction.sequence`), and solve again from there;
4. refine the intervals until holding the controls on each of them costs next to nothing.

The result holds for exact Coulomb friction with stiction, the limit of smooth laws.
Source: Betts, Practical Methods for Optimal Control, 2nd ed., 2010, 3.7 (phases); Bryson and Ho,
Applied Optimal Control, 1975, 3.7 (conditions at instants that are free).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import product
from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from ocp.checking.interval_errors import local_errors
from ocp.checking.mesh_refinement import MeshErrors, refined
from ocp.checking.resimulate import arcs_of
from ocp.formulation.problem import Problem
from ocp.friction.arc_solution import ModeSolver, Solved, reassemble
from ocp.friction.arcs import MARGIN
from ocp.friction.mode_models import restless
from ocp.friction.sequence import Leg, flat, inserted, neighbours, pruned, shown
from ocp.friction.transfer import Known, Reading, sequence_of, sizes_of, starts_at_rest
from ocp.solving.methods import Ipopt
from ocp.solving.prepared import Clock
from ocp.solving.solution import Solution
from ocp.transcription.program import Report
from ocp.transcription.schemes import Radau, Scheme
from symfric.foundation.status import Status

Array = NDArray[np.float64]
TOUCH = 1e-5
"""Share of the largest sliding velocity of a contact below which it touches zero: what an interior
point leaves of a bound that presses."""
CREEP = (3.0, 1.0, 10.0)
"""Multiples of the width below which a contact counts as resting: the first that leads to a
solution. A smooth law is back at its dynamic level at a few widths."""
SHORTEST = 5e-5
"""Least duration of an arc, as a share of the whole: what is needed is longer."""
AGAIN = 0.1
"""Barrier parameter where the sequence is another one: smaller ones lose the way at times."""
KICK = 2e-3
"""Share of the whole duration that an interval has at least in which a contact breaks away."""
GONE = 4.0
"""Arcs shorter than so many times the least duration are pruned."""
ROUNDS = 4
"""How often the sequence may be changed."""
NEW_ARC = 5e-3
"""Share of the whole duration that an arc has where it is tried."""
WORTH = 1e-4
"""Share of the cost by which another sequence must be better: more than the estimate of what
holding the inputs costs on few intervals is wrong by."""
FINE = 3e-4
"""Share of the cost that holding the inputs over the intervals may cost."""
ZERO = 1e-8
"""Costs that differ less are the same to a solver."""
LOCAL = 1e-7
"""Largest local error of an interval, relative."""
HALVED = 4.0
"""Multiple of the largest local error that has an interval halved, of order 5."""
MOST_ITERATIONS, PATIENT = 100, 400
"""Of one solve: a sequence that needs more is a wrong one as a rule. Where no sequence leads to a
solution the first solves are repeated with more: an arm whose joints stop needs 350."""
CLOSER = 5.0
"""Factor to the margin of a motion that only shows what a margin costs."""
LEAST_INTERVALS = 40
MOST = 800
Keep = Callable[[Solved], Solved]
STOPPED = (Status.INTERRUPTED, Status.TIME_LIMIT)


def rests_inside(solved: Solved) -> tuple[Leg, ...] | None:
    """The sequence with rests where contacts touch zero as they slip; None where none does."""
    legs, shift = solved.legs, 0
    found = False
    slips = [_slips(solved, k) for k in range(len(flat(legs)))]
    largest: dict[str, float] = {}
    for _, own in slips:
        for contact, values in own.items():
            largest[contact] = max(largest.get(contact, 0.0), float(np.abs(values).max()))
    for number, arc in enumerate(flat(solved.legs)):
        t, own = slips[number]
        for contact, mode in arc.modes.items():
            window = _touching(t, own[contact], TOUCH * largest[contact]) if mode else None
            if window is not None:
                before = len(flat(legs))
                legs = inserted(legs, number + shift, contact, 0, *window)
                shift += len(flat(legs)) - before
                found = True
                break
    return pruned(legs, 0.0) if found else None


def _slips(solved: Solved, number: int) -> tuple[Array, dict[str, Array]]:
    """Times of all points of an arc, and sliding velocities there by contact."""
    span = solved.transcription.problem.spans[number]
    arc = flat(solved.legs)[number]
    fractions = solved.transcription.fractions(number)
    t = arc.begin + fractions * arc.duration
    names = list(arc.modes)
    values = [
        solved.known.along(span.model, span.model.expression(f"{name}_slip"), t)[0]
        for name in names
    ]
    return t, dict(zip(names, values, strict=True))


def _touching(t: Array, slip: Array, touch: float) -> tuple[float, float] | None:
    """From when to when the slip is next to nothing, away from the ends of the arc."""
    near = np.flatnonzero(np.abs(slip[1:-1]) < touch) + 1
    if not near.size:
        return None
    return float(t[near[0] - 1]), float(t[near[-1] + 1])


class _StoppedError(Exception):
    """The user or the clock has stopped a solve: no further one is begun."""


def optimise_modes(
    smooth: Solution,
    problem: Problem,
    widths: Mapping[str, float],
    *,
    solver: Ipopt | None = None,
    scheme: Scheme | None = None,
    progress: Report | None = None,
    margin: float = MARGIN,
    clock: Clock | None = None,
) -> Iterator[tuple[Solution, float]]:
    """Exact motions next to a sharpened one, in the terms of `problem`, with their margins.

    The rests of the first keep `MARGIN` of their static levels, or `margin` if that is more. Where
    that costs anything others follow that start there: with `margin`, and between both, for who
    finds that too close; where it is `MARGIN` or more, with less, to see what it costs.

    Args:
        smooth: solution of `problem` with smooth friction, of widths of about a hundredth of the
            speeds; it need not be verified.
        problem: what the user has written.
        widths: contact -> sliding velocity [m/s] over which its friction is smoothed in `smooth`.
        solver, scheme, progress: as in `ocp.solve`.
        margin: share of the static level that rests keep from it.
        clock: when to stop.

    Yields:
        A solution with `modes`, valid for exact Coulomb friction with stiction; not verified. One
        whose status is not ok where no sequence led to a solution; where that was stopped before
        any did, without `modes`.

    Raises:
        ValueError: a problem without modes, see `refusal`.

    Limits: the sequence is that of the sharpened motion but for rests, superfluous arcs and what
    bounds tell of: a motion of another kind is not found. Contacts whose slips depend on each
    other at rest (a loop of one degree of freedom) have no unique reactions and are refused by the
    mode model.
    """
    if reason := refusal(problem):
        raise ValueError(f"optimise_modes: {reason}")
    solver = solver or Ipopt()
    limits = [MOST_ITERATIONS, PATIENT]
    if "max_iter" in solver.options:
        limits = [int(solver.options["max_iter"])]
    known = Known(smooth.motions[0], parameters_of(problem, smooth.chosen), smooth.chosen)
    N = max(LEAST_INTERVALS, smooth.motions[0].t_control.size // 2)
    whole, first = known.motion.T, max(MARGIN, margin)
    modes_solver = ModeSolver(
        problem=problem,
        sizes=sizes_of(problem, known),
        at_rest=starts_at_rest(problem, known, widths),
        solver=solver.with_options(max_iter=limits[0]),
        scheme=scheme or Radau(3),
        shortest=SHORTEST * whole,
        kick=KICK * whole,
        progress=progress,
        margin=first,
        clock=clock or Clock(),
    )
    tried: list[Solved] = []

    def keep(solved: Solved) -> Solved:
        tried.append(solved)
        if solved.outcome.status in STOPPED:
            raise _StoppedError
        return solved

    best: Solved | None = None
    with suppress(_StoppedError):
        for limit, legs in _attempts(limits, problem, known, widths):
            patient = replace(modes_solver, solver=solver.with_options(max_iter=limit))
            found = keep(patient.solve(legs, known, N, 1e-2))
            if found.ok:
                best = found
                best = settled(modes_solver, best, keep)
                best = better(modes_solver, best, NEW_ARC * whole, keep)
                best = _fine(modes_solver, best, keep)
                break
    yield _solution(problem, best, tried), first
    if best is None or tried[-1].outcome.status in STOPPED or not best.pressed(first):
        return
    least = margin if margin < first else margin / CLOSER
    for closer in (least, sqrt(least * first)):
        near, found = replace(modes_solver, margin=closer), None
        with suppress(_StoppedError):
            found = keep(near.again(best))
            found = _fine(near, found, keep) if found.ok else found
        yield _solution(problem, found, tried), closer


def _solution(problem: Problem, best: Solved | None, tried: Sequence[Solved]) -> Solution:
    """The best of several sequences, or the first, with what all have cost; why it ended early."""
    found = reassemble(problem, best or tried[0], [s.outcome.statistics for s in tried])
    last = tried[-1].outcome
    if last.status not in STOPPED:
        return found
    message = f"ocp '{problem.name}': {last.sentence}"
    if best is None:
        return replace(found, status=last.status, message=message, cause=last.cause, modes={})
    message += " What there is are the best modes so far."
    return replace(found, status=last.status, message=message, cause=last.cause)


def refusal(problem: Problem) -> str:
    """Why a problem has no optimise_modes, in a sentence; empty where it has one."""
    if not any(phase.model.contacts for phase in problem.chain):
        return "expected a model with contacts, got none"
    if problem.scenarios:
        return (
            "expected one motion, got scenarios, whose contacts change their modes at different "
            "times under one control"
        )
    if any(phase.via and not isinstance(phase.T, float | int) for phase in problem.chain):
        return "expected phases of fixed duration where there are via points; split them there"
    if reasons := [text for phase in problem.chain if (text := restless(phase.model))]:
        return reasons[0]
    return ""


def parameters_of(problem: Problem, chosen: Mapping[str, float]) -> dict[str, float]:
    """Numbers of all parameters of the models by name."""
    found: dict[str, float] = {}
    for span in problem.spans:
        found |= {v.name: float(x) for v, x in zip(span.model.p, span.p, strict=True)}
    return found | dict(chosen)


def _readings(
    problem: Problem, known: Known, widths: Mapping[str, float]
) -> Iterator[tuple[Leg, ...]]:
    """Sequences that the motion may be read as, the most likely one first."""
    seen: set[str] = set()
    for rests in (True, False):
        for factor in CREEP:
            creep = {name: factor * width for name, width in widths.items()}
            legs = sequence_of(problem, known, Reading(creep, rests))
            if shown(legs) not in seen:
                seen.add(shown(legs))
                yield legs


def _attempts(
    limits: Sequence[int], problem: Problem, known: Known, widths: Mapping[str, float]
) -> Iterator[tuple[int, tuple[Leg, ...]]]:
    """Limits of iterations and sequences: all of these with the first limit, then with the next."""
    sequences: list[tuple[Leg, ...]] = []
    for legs in _readings(problem, known, widths):
        sequences.append(legs)
        yield limits[0], legs
    yield from product(limits[1:], sequences)


def settled(modes_solver: ModeSolver, solved: Solved, keep: Keep) -> Solved:
    """Without superfluous arcs, and with rests where contacts touch zero as they slip."""
    seen = {shown(solved.legs)}
    for _ in range(ROUNDS):
        legs = pruned(solved.legs, GONE * modes_solver.shortest)
        if shown(legs) == shown(solved.legs):
            legs = rests_inside(solved) or legs
        if shown(legs) in seen:
            break
        seen.add(shown(legs))
        changed = keep(modes_solver.solve(legs, solved.known, solved.intervals, AGAIN))
        if not changed.ok:
            break
        solved = changed
    return solved


def better(modes_solver: ModeSolver, solved: Solved, width: float, keep: Keep) -> Solved:
    """The best of the sequence and of those next to it."""
    seen = {shown(solved.legs)}
    for _ in range(ROUNDS):
        for legs in neighbours(solved.legs, width):
            if shown(legs) in seen:
                continue
            seen.add(shown(legs))
            other = keep(modes_solver.solve(legs, solved.known, solved.intervals, AGAIN))
            left = pruned(other.legs, GONE * modes_solver.shortest)
            if not other.ok or shown(left) in seen - {shown(legs)}:
                continue
            other = settled(modes_solver, other, keep)
            if other.ideal_cost < solved.ideal_cost - WORTH * abs(solved.ideal_cost):
                solved = other
                break
        else:
            break
    return solved


def _fine(modes_solver: ModeSolver, solved: Solved, keep: Keep) -> Solved:
    """On intervals so short that holding the inputs costs next to nothing.

    What that costs is estimated, well enough where two meshes agree on the cost without it. As long
    as they do not, all intervals are halved. Where a rest follows its level the estimate is too
    large, and what the last mesh has gained decides.
    """
    before = inf, inf
    for _ in range(ROUNDS):
        t, allowed = solved.transcription, FINE * abs(solved.outcome.cost) + ZERO
        local = local_errors(arcs_of(t.problem, t.meshes, solved.points))
        agree = abs(solved.ideal_cost - before[0]) <= allowed
        enough = solved.loss <= allowed or 0.0 <= before[1] - solved.outcome.cost <= allowed
        exact = max(float(own.max()) for own in local) <= LOCAL
        outside = solved.overloaded
        held = not any(own.any() for own in outside)
        if agree and exact and held and enough:
            break
        least = 0.0 if agree else HALVED * LOCAL
        errors = [
            MeshErrors(np.maximum(own, least), loss, over)
            for own, loss, over in zip(local, solved.losses, outside, strict=True)
        ]
        meshes = refined(
            t.meshes, errors, [()] * len(errors), local=LOCAL, loss=allowed / 2, most=MOST
        )
        parts = solved.legs, solved.discretisation, meshes
        finer = keep(modes_solver.on(*parts, solved.known, 1e-4))
        if not finer.ok:  # a long way along a flat valley
            finer = keep(modes_solver.on(*parts, finer.known, 1e-2))
        if not finer.ok:
            break
        before = solved.ideal_cost, solved.outcome.cost
        solved = settled(modes_solver, finer, keep)
    return solved
