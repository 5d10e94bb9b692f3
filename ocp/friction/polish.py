"""From a sharpened motion to one that is exact: modes, their order and their instants.

Smooth friction with a width of a hundredth of the speed shows who slips when. The sequence of modes
that is read off it turns friction into what it is: a known force while a contact slips, a reaction
while it rests. The problem of these arcs is smooth, and the instants of change are among its
unknowns, so that a solver finds them to its full precision, on few intervals:

1. read the sequence; put a rest at every reversal and at the ends (`ocp.friction.sequence`);
2. solve the problem of mode models with free durations (`ocp.friction.arcs`);
3. prune arcs that have shrunk to nothing, repair the sequence where the motion presses against the
   bounds of its modes (`ocp.friction.repair`), and solve again from there;
4. halve the intervals until controls that are constant on each are fine enough.

The result holds for exact Coulomb friction with stiction, the limit of smooth laws.
Source: Betts, Practical Methods for Optimal Control, 2nd ed., 2010, 3.7 (phases); Bryson and Ho,
Applied Optimal Control, 1975, 3.7 (conditions at instants that are free).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from ocp.friction.arcs import in_arcs
from ocp.friction.carry import Known, points_in
from ocp.friction.reading import Reading, sequence_of, sizes_of, starts_at_rest
from ocp.friction.sequence import Leg, flat, placed, pruned, shown
from ocp.friction.whole import whole_solution
from ocp.result.motion import motion_of
from ocp.result.solution import Solution
from ocp.solvers.ipopt import Ipopt
from ocp.solvers.outcome import Iterate, Outcome, Report, in_stage
from ocp.text.problem import Problem
from ocp.transcription.points import Points
from ocp.transcription.schemes import Radau, Scheme
from ocp.transcription.transcribe import discretise
from ocp.transcription.transcription import Transcription

Array = NDArray[np.float64]

CREEP = (3.0, 1.0, 10.0)
"""Multiples of the width below which a contact counts as resting: the first that leads to a
solution. A smooth law is back at its dynamic level at a few widths."""

SHORTEST = 5e-5
"""Least duration of an arc, as a share of the whole: what is needed is longer."""

GONE = 2.0
"""Arcs shorter than so many times the least duration are pruned."""

ROUNDS = 4
"""How often the sequence may be changed."""

CLOSE = {"constr_mult_init_max": 1e8}
"""Options of a start that is nearly a solution: estimated multipliers are kept however large they
are. Ipopt sets those above 1e3 to zero, and then loses the way from the solution on another mesh:
cart and pendulum, twice as many intervals, 9 iterations instead of more than 100."""

FINE = 3e-4
"""Share of the cost that halving all intervals may still gain."""

MOST = 2000
"""Intervals beyond which none is halved."""


@final
@dataclass(frozen=True, eq=False)
class Solved:
    """A sequence with the durations that were found for it."""

    legs: tuple[Leg, ...]
    transcription: Transcription
    outcome: Outcome

    @property
    def points(self) -> Points:
        """The motion of all arcs."""
        return self.transcription.unpack(self.outcome.iterate.w)

    @property
    def known(self) -> Known:
        """The motion, to start from."""
        t, points = self.transcription, self.points
        spans = list(enumerate(t.problem.spans))
        scheme = t.scheme.coefficients()
        motion = motion_of("", spans, points.spans, t.meshes, scheme, points.chosen)
        p = {v.name: float(x) for s in t.problem.spans for v, x in zip(s.model.p, s.p, strict=True)}
        return Known(motion, p | dict(points.chosen), points.chosen)

    @property
    def ok(self) -> bool:
        """Whether this is a solution."""
        return self.outcome.status.ok

    @property
    def intervals(self) -> int:
        """Their number."""
        return sum(mesh.size - 1 for mesh in self.transcription.meshes)


@final
@dataclass(frozen=True, eq=False)
class Polisher:
    """What all sequences of one problem share.

    Attributes:
        problem: the user's.
        sizes: contact -> typical static level [N].
        at_rest: contacts that are at rest at the start.
        solver, scheme, progress: as in `polish`.
        shortest: least duration of an arc [s].
    """

    problem: Problem
    sizes: Mapping[str, float]
    at_rest: Sequence[str]
    solver: Ipopt
    scheme: Scheme
    shortest: float
    progress: Report | None

    def solve(self, legs: Sequence[Leg], known: Known, intervals: int, barrier: float) -> Solved:
        """Find the durations and the motion of a sequence.

        Args:
            legs: the sequence, where to look for `known`.
            known: a motion to start from.
            intervals: about how many.
            barrier: parameter of the interior-point method to start with: small from close by.
        """
        problem = in_arcs(self.problem, legs, self.sizes, self.at_rest, self.shortest)
        whole = sum(leg.duration for leg in legs)
        parts = [max(3, round(intervals * arc.duration / whole)) for arc in flat(legs)]
        meshes = [np.linspace(0.0, 1.0, n + 1) for n in parts]
        transcription = discretise(problem, self.scheme).on(meshes)
        start = transcription.pack(points_in(transcription, flat(legs), known))
        prepared = self.solver.with_options(mu_init=barrier, **CLOSE).prepared(
            transcription.program
        )
        stage = in_stage(self.progress, f"modes {shown(legs)}")
        rows = transcription.program.g.numel()
        outcome = prepared.run(Iterate.cold(start, rows), progress=stage)
        durations = [span.T for span in transcription.unpack(outcome.iterate.w).spans]
        return Solved(placed(legs, durations), transcription, outcome)


def polish(
    smooth: Solution,
    problem: Problem,
    widths: Mapping[str, float],
    *,
    solver: Ipopt | None = None,
    scheme: Scheme | None = None,
    progress: Report | None = None,
) -> Solution:
    """The exact motion next to a sharpened one, in the terms of `problem`.

    Args:
        smooth: solution of `problem` with smooth friction, of widths of about a hundredth of the
            speeds; it need not be verified.
        problem: what the user has written.
        widths: contact -> sliding velocity [m/s] over which its friction is smoothed in `smooth`.
        solver, scheme, progress: as in `ocp.solve`.

    Returns:
        A solution with `modes`, valid for exact Coulomb friction with stiction; not verified. One
        whose status is not ok where no sequence led to a solution.

    Raises:
        ValueError: a problem that is not polished, see `refusal`.

    Limits: the sequence is that of the sharpened motion but for rests, superfluous arcs and what
    bounds tell of: a motion of another kind is not found. Contacts whose slips depend on each
    other at rest (a loop of one degree of freedom) have no unique reactions and are refused by the
    mode model.
    """
    if reason := refusal(problem):
        raise ValueError(f"polish: {reason}")
    known = Known(smooth.motions[0], parameters_of(problem, smooth.chosen), smooth.chosen)
    whole = smooth.motions[0].T
    polisher = Polisher(
        problem,
        sizes_of(problem, known),
        starts_at_rest(problem, known, widths),
        solver or Ipopt(max_iter=200),
        scheme or Radau(3),
        SHORTEST * whole,
        progress,
    )
    N = max(40, smooth.motions[0].t_control.size // 2)
    tried: list[Solved] = []
    for solved in _first(polisher, known, widths, N):
        tried.append(solved)
        if solved.ok:
            tried += _settled(polisher, solved, N)
            tried += _fine(polisher, tried[-1])
            break
    best = next((s for s in reversed(tried) if s.ok), tried[-1])
    return whole_solution(problem, best, [s.outcome.statistics for s in tried])


def refusal(problem: Problem) -> str:
    """Why a problem has no polish, in a sentence; empty where it has one."""
    if not any(phase.model.contacts for phase in problem.chain):
        return "expected a model with contacts, got none"
    if problem.scenarios:
        return (
            "expected one motion, got scenarios, whose contacts change their modes at different "
            "times under one control"
        )
    if any(phase.via and not isinstance(phase.T, float | int) for phase in problem.chain):
        return "expected phases of fixed duration where there are via points; split them there"
    return ""


def parameters_of(problem: Problem, chosen: Mapping[str, float]) -> dict[str, float]:
    """Numbers of all parameters of the models by name."""
    found: dict[str, float] = {}
    for span in problem.spans:
        found |= {v.name: float(x) for v, x in zip(span.model.p, span.p, strict=True)}
    return found | dict(chosen)


def _first(
    polisher: Polisher, known: Known, widths: Mapping[str, float], intervals: int
) -> Iterator[Solved]:
    """Solutions for readings of the sharpened motion, the most likely one first."""
    seen: set[str] = set()
    for rests in (True, False):
        for factor in CREEP:
            creep = {name: factor * width for name, width in widths.items()}
            legs = sequence_of(polisher.problem, known, Reading(creep, rests))
            if shown(legs) not in seen:
                seen.add(shown(legs))
                yield polisher.solve(legs, known, intervals, 1e-2)


def _settled(polisher: Polisher, solved: Solved, intervals: int) -> list[Solved]:
    """Solutions with superfluous arcs pruned, the best one last."""
    tried: list[Solved] = []
    for _ in range(ROUNDS):
        legs = pruned(solved.legs, GONE * polisher.shortest)
        if shown(legs) == shown(solved.legs):
            break
        better = polisher.solve(legs, solved.known, intervals, 1e-3)
        tried.append(better)
        if not better.ok:
            tried.append(solved)
            break
        solved = better
    return tried


def _fine(polisher: Polisher, solved: Solved) -> list[Solved]:
    """Solutions on halved intervals, until that gains little: controls held are of order two."""
    tried: list[Solved] = []
    while 2 * solved.intervals <= MOST:
        finer = polisher.solve(solved.legs, solved.known, 2 * solved.intervals, 1e-4)
        tried.append(finer)
        if not finer.ok:
            break
        gain = (solved.outcome.cost - finer.outcome.cost) / 3
        solved = finer
        if abs(gain) <= FINE * abs(solved.outcome.cost):
            break
    return tried
