"""Solution of a mode sequence: durations, motion, and the solution of the user's problem."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.checking.interval_errors import zoh_losses
from ocp.formulation.phase import Row, Span
from ocp.formulation.problem import Problem
from ocp.friction.arcs import CAUGHT, FIRST, PULLED, STOPPED, Rules, breaks_away, in_arcs
from ocp.friction.mode_models import KINDS
from ocp.friction.sequence import Leg, Legs, flat, placed, shown, tracks_of
from ocp.friction.transfer import Known, points_in
from ocp.solving.methods import Ipopt
from ocp.solving.motion import motions_of
from ocp.solving.one_solve import Solved
from ocp.solving.prepared import Clock, Option
from ocp.solving.solution import Mode, Solution
from ocp.transcription.program import Iterate, Report, SolverStatistics
from ocp.transcription.schemes import Scheme
from ocp.transcription.transcribe import Discretisation, discretise
from ocp.transcription.unknowns import Points, SpanPoints
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import stacked

Array = NDArray[np.float64]
LEAST = 3
"""Fewest intervals of an arc."""
NEAR = 1.5
"""Distance of a stick interval from its static level that counts as close, in margins."""
CLOSE: dict[str, Option] = {"constr_mult_init_max": 1e8}
"""Options for a start near the solution: estimated multipliers are kept even if they are large.
Ipopt sets those above 1e3 to zero, and then diverges from the solution on another mesh:
cart-pendulum, twice as many intervals, 9 iterations instead of more than 100."""
FINER: dict[str, Option] = CLOSE | {"perturb_always_cd": "yes", "mumps_permuting_scaling": 0}
"""The same for a finer mesh. Where stiction is at its level, the rows of short intervals are nearly
dependent. Unless Ipopt always regularises them, and MUMPS orders the matrix without permuting it
first, pivots are delayed until fronts are dense: for arms with 700 intervals, 30 to 150 s for one
factorisation instead of 0.1 s."""


@final
@dataclass(frozen=True, eq=False)
class SolvedSequence(Solved):
    """A mode sequence with its optimised durations."""

    legs: Legs
    discretisation: Discretisation

    @cached_property
    def known(self) -> Known:
        """Motion, as a starting point."""
        t, points = self.transcription, self.points
        (motion,) = motions_of(t.problem, t.meshes, t.scheme.coefficients(), points)
        return Known.of(t.problem, motion, points.chosen)

    @cached_property
    def losses(self) -> tuple[Array, ...]:
        """Cost of holding the inputs in each interval."""
        return zoh_losses(self.transcription, self.outcome.iterate)

    @property
    def loss(self) -> float:
        """Cost of holding the inputs over all intervals."""
        return sum(float(loss.sum()) for loss in self.losses)

    @property
    def ideal_cost(self) -> float:
        """Cost J without the cost of holding the inputs: compares sequences on different meshes."""
        return self.outcome.cost - self.loss

    @cached_property
    def overloaded(self) -> list[NDArray[np.bool_]]:
        """Intervals at whose start, before their first point, stiction exceeds its static level."""
        return [
            np.any(_at_starts(span, points, _margins(span)) < 0.0, axis=0)
            for span, points in self._arcs()
        ]

    def pressed(self, margin: float) -> bool:
        """Return True if stiction, or its start or end, is as close to its level as permitted."""
        for span, points in self._arcs():
            kept = _at_starts(span, points, _margins(span))
            changes = [
                ca.SX(o.expression) + (0 if PULLED in name else margin)
                for name, o in span.model.outputs.items()
                if name.endswith((PULLED, CAUGHT, STOPPED))
            ]
            first = _at_starts(span, points, changes)[:, :1]
            if min(kept.min(initial=np.inf), first.min(initial=np.inf)) < NEAR * margin:
                return True
        return False

    def _arcs(self) -> list[tuple[Span, SpanPoints]]:
        spans = self.transcription.problem.spans
        return list(zip(spans, self.points.spans, strict=True))

    @property
    def intervals(self) -> int:
        """Number of intervals."""
        return sum(mesh.size - 1 for mesh in self.transcription.meshes)


def _margins(span: Span) -> list[ca.SX]:
    """Return the friction margins at starts of intervals."""
    return [ca.SX(o.expression) for name, o in span.model.outputs.items() if FIRST in name]


def _at_starts(span: Span, points: SpanPoints, expressions: Sequence[ca.SX]) -> Array:
    """Return values of expressions at the starts of all intervals of a phase, (rows, N)."""
    n = points.u.shape[1]
    rows = ca.Function("rows", span.symbols, [stacked(expressions)]).map(n)
    z, p = points.z[:, :: points.z.shape[1] // n], np.tile(span.p[:, None], (1, n))
    return rows(np.zeros((1, n)), points.nodes[:, :-1], z, points.u, p).full()


@final
@dataclass(frozen=True, eq=False)
class ModeSolver:
    """Settings common to all sequences of one problem.

    Attributes:
        rules: of the arcs.
        solver, scheme, progress: as in `optimise_modes`.
        kick: least length of the interval in which a contact breaks away or is stopped [s].
        clock: time limit.
    """

    rules: Rules
    solver: Ipopt
    scheme: Scheme
    kick: float
    progress: Report | None
    clock: Clock = field(default_factory=Clock)

    def solve(self, legs: Legs, known: Known, intervals: int, barrier: float) -> SolvedSequence:
        """Optimise the durations and the motion of a sequence.

        Args:
            legs: the sequence, with the times in `known`.
            known: initial motion.
            intervals: approximate number of intervals, of equal length.
            barrier: parameter of the interior-point method at the start: small near a solution.
        """
        whole = sum(leg.duration for leg in legs)
        parts = [max(LEAST, round(intervals * arc.duration / whole)) for arc in flat(legs)]
        meshes = [np.linspace(0.0, 1.0, n + 1) for n in parts]
        return self.on(legs, self._discretised(legs), meshes, known, barrier, CLOSE)

    def _discretised(self, legs: Legs) -> Discretisation:
        """Return the problem of a sequence, discretised except for its meshes.

        If the stiction force is at its level, held inputs make it a sawtooth, whose peaks are at
        the starts of intervals, between collocation points: margins that depend on inputs are
        conditions there.
        """
        problem = in_arcs(self.rules, legs)
        peaks: dict[int, list[Row]] = {}
        for number, span in enumerate(problem.spans):
            u = span.model.vector("u")
            rows = [row for row in span.rows_at[0.0] if FIRST in row.name]
            peaks[number] = [row for row in rows if ca.depends_on(row.expression, u)]
        return discretise(problem, self.scheme, peaks)

    def again(self, solved: SolvedSequence) -> SolvedSequence:
        """Solve again with this margin, from a motion with another one, on its meshes."""
        made = self._discretised(solved.legs)
        return self.on(solved.legs, made, solved.transcription.meshes, solved.known, 1e-4)

    def on(
        self,
        legs: Legs,
        discretisation: Discretisation,
        meshes: Sequence[Array],
        known: Known,
        barrier: float,
        options: Mapping[str, Option] = FINER,
    ) -> SolvedSequence:
        """Solve a sequence on given meshes."""
        spans, arcs = discretisation.problem.spans, flat(legs)
        meshes = [
            _with_kick(mesh, self.kick / arc.duration) if breaks_away(span) else mesh
            for mesh, span, arc in zip(meshes, spans, arcs, strict=True)
        ]
        made = discretisation.on(meshes)
        prepared = self.solver.with_options(mu_init=barrier, **options).prepared(made.program)
        start = Iterate.cold(made.pack(points_in(made, arcs, known)), made.program.g.numel())
        stage = f"modes {shown(legs)}"
        outcome = self.clock.run(made, prepared, start, self.progress, stage)
        durations = [span.T for span in made.unpack(outcome.iterate.w).spans]
        return SolvedSequence(made, outcome, placed(legs, durations), discretisation)


def _with_kick(mesh: Array, kick: float) -> Array:
    """Return `mesh` with a first interval of at least `kick`, if enough intervals remain.

    A control may break a contact away by a pulse and then stay below its static level. The cost
    decreases with the length of the pulse without limit: its length has to be given.
    """
    kept = mesh[(mesh == 0.0) | (mesh >= kick)]
    return kept if kept.size > LEAST else mesh


def reassemble(
    problem: Problem, solved: SolvedSequence, statistics: Sequence[SolverStatistics]
) -> Solution:
    """Reassemble the arcs of `solved` into a solution of `problem`.

    Law states that mode models do not have are set to zero.
    """
    t, outcome = solved.transcription, solved.outcome
    arcs = list(zip(t.problem.spans, solved.points.spans, t.meshes, strict=True))
    spans: list[SpanPoints] = []
    meshes: list[Array] = []
    for number, span in enumerate(problem.spans):
        legs = [leg for leg in solved.legs if leg.phase == number]
        count = sum(len(leg.arcs) for leg in legs)
        own, arcs = arcs[:count], arcs[count:]
        spans.append(_span_points(span, own))
        meshes.append(_mesh(problem, number, legs, [(p.T, mesh) for _, p, mesh in own]))
    points = Points(tuple(spans), solved.points.chosen)
    (motion,) = motions_of(problem, meshes, t.scheme.coefficients(), points)
    detailed = solved.known.motion  # in which stiction is a reaction
    if motion.t.size == detailed.t.size:
        signals = {n: detailed.signals.get(n, row) for n, row in motion.signals.items()}
        motion = replace(motion, signals=signals)
    return Solution(
        problem=problem,
        status=outcome.status,
        message=f"ocp '{problem.name}': modes {shown(solved.legs)}: {outcome.sentence}",
        cost=outcome.cost,
        motions=(motion,),
        chosen=dict(points.chosen),
        statistics=reduce(SolverStatistics.then, statistics),
        scheme=t.scheme,
        meshes=tuple(meshes),
        points=points,
        iterate=Iterate.cold(np.zeros(0), 0),  # its program differs from that of the problem
        modes={
            contact: tuple(Mode(KINDS[run.mode], run.begin, run.end) for run in runs)
            for contact, runs in tracks_of(solved.legs).items()
        },
        cause=outcome.cause,
    )


def _span_points(span: Span, arcs: Sequence[tuple[Span, SpanPoints, Array]]) -> SpanPoints:
    """Return the points of one phase, for its own model; zero for absent variables."""

    def joined(letter: str, name: str) -> Array:
        parts: list[Array] = []
        wanted: Sequence[Variable] = getattr(span.model, letter)
        for k, (own, points, _) in enumerate(arcs):
            values: Array = getattr(points, name)[:, int(k > 0 and name == "nodes") :]
            names = [v.name for v in getattr(own.model, letter)]
            rows, zero = dict(zip(names, values, strict=True)), np.zeros(values.shape[1])
            parts.append(np.array([rows.get(v.name, zero) for v in wanted]).reshape(-1, zero.size))
        return np.hstack(parts)

    groups = (("x", "nodes"), ("x", "inner"), ("z", "z"), ("u", "u"))
    return SpanPoints(sum(p.T for _, p, _ in arcs), *(joined(*group) for group in groups))


def _mesh(
    problem: Problem, number: int, legs: Sequence[Leg], arcs: Sequence[tuple[float, Array]]
) -> Array:
    """Return the mesh of a phase as fractions of its duration, with exact via points."""
    fractions = [0.0, *sorted(problem.chain[number].via), 1.0]
    parts = [np.zeros(1)]
    first = 0
    for leg, low, high in zip(legs, fractions[:-1], fractions[1:], strict=True):
        own = arcs[first : first + len(leg.arcs)]
        first += len(leg.arcs)
        whole, begin = sum(T for T, _ in own), 0.0
        for T, mesh in own:
            parts.append(low + (high - low) * (begin + T * mesh[1:]) / whole)
            begin += T
        parts[-1][-1] = high
    return np.concatenate(parts)
