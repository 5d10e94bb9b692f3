"""Solution of a mode sequence: durations, motion, and the solution of the user's problem."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.checking.interval_errors import zoh_losses
from ocp.formulation.phase import Row, Span
from ocp.formulation.problem import Problem
from ocp.friction.arcs import MARGIN, in_arcs
from ocp.friction.mode_models import SIDES
from ocp.friction.sequence import Leg, flat, placed, shown, tracks_of
from ocp.friction.transfer import CAUGHT, FIRST, PULLED, STOPPED, Known, breaks_away, points_in
from ocp.solving.methods import Ipopt
from ocp.solving.motion import Motion, motion_of
from ocp.solving.prepared import Clock, Option
from ocp.solving.solution import Mode, Solution
from ocp.transcription.program import Iterate, Outcome, Report, SolverStatistics
from ocp.transcription.schemes import Scheme
from ocp.transcription.transcribe import Discretisation, discretise
from ocp.transcription.transcription import Transcription
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
FINER: dict[str, Option] = CLOSE | {"perturb_always_cd": "yes"}
"""The same for a finer mesh. Where stiction is at its level, the rows of short intervals are nearly
dependent. Unless Ipopt always regularises them, MUMPS delays pivots until its fronts are dense:
for an arm with 700 intervals, more than 30 s for one factorisation instead of 0.1 s."""
KINDS = {1: "slip+", 0: "stick", -1: "slip-"}


@final
@dataclass(frozen=True, eq=False)
class Solved:
    """A mode sequence with its optimised durations."""

    legs: tuple[Leg, ...]
    discretisation: Discretisation
    transcription: Transcription
    outcome: Outcome

    @cached_property
    def points(self) -> Points:
        """Motion of all arcs."""
        return self.transcription.unpack(self.outcome.iterate.w)

    @cached_property
    def known(self) -> Known:
        """Motion, as a starting point."""
        t, points = self.transcription, self.points
        spans = list(enumerate(t.problem.spans))
        scheme = t.scheme.coefficients()
        motion = motion_of("", spans, points.spans, t.meshes, scheme, points.chosen)
        p = {v.name: float(x) for s in t.problem.spans for v, x in zip(s.model.p, s.p, strict=True)}
        return Known(motion, p | dict(points.chosen), points.chosen)

    @cached_property
    def losses(self) -> tuple[Array, ...]:
        """Cost of holding the inputs in each interval."""
        iterate = self.outcome.iterate
        return zoh_losses(self.transcription, iterate.w, iterate.lam_g)

    @property
    def loss(self) -> float:
        """Cost of holding the inputs over all intervals."""
        return sum(float(loss.sum()) for loss in self.losses)

    @property
    def ideal_cost(self) -> float:
        """Cost J without the cost of holding the inputs: compares sequences on different meshes."""
        return self.outcome.cost - self.loss

    @cached_property
    def overloaded(self) -> tuple[NDArray[np.bool_], ...]:
        """Intervals at whose start, before their first point, stiction exceeds its static level."""
        found: list[NDArray[np.bool_]] = []
        spans, arcs = self.transcription.problem.spans, flat(self.legs)
        for span, arc, points in zip(spans, arcs, self.points.spans, strict=True):
            rooms = [
                span.model.outputs[f"{name}{FIRST}{side}"].expression
                for name, mode in arc.modes.items()
                for side in SIDES.values()
                if not mode
            ]
            outside = _at_starts(span, points, rooms) < 0.0
            found.append(np.any(outside, axis=0))
        return tuple(found)

    def pressed(self, margin: float) -> bool:
        """Return True if stiction, or its start or end, is as close to its level as permitted."""
        spans = self.transcription.problem.spans
        for span, points in zip(spans, self.points.spans, strict=True):
            outputs = span.model.outputs
            rooms = {name: o.expression for name, o in outputs.items() if FIRST in name}
            rooms |= {
                name: ca.SX(o.expression) + (0 if PULLED in name else margin)
                for name, o in outputs.items()
                if name.endswith((PULLED, CAUGHT, STOPPED))
            }
            values = _at_starts(span, points, [*rooms.values()])
            for name, row in zip(rooms, values, strict=True):
                if (row if FIRST in name else row[:1]).min() < NEAR * margin:
                    return True
        return False

    @property
    def ok(self) -> bool:
        """True if the solver found a solution."""
        return self.outcome.status.ok

    @property
    def intervals(self) -> int:
        """Number of intervals."""
        return sum(mesh.size - 1 for mesh in self.transcription.meshes)


@final
@dataclass(frozen=True, eq=False)
class ModeSolver:
    """Settings common to all sequences of one problem.

    Attributes:
        problem: the user's problem.
        sizes: contact -> typical static level [N].
        at_rest: contacts that stick at the start.
        solver, scheme, progress: as in `optimise_modes`.
        shortest: least duration of an arc [s].
        kick: least length of the interval in which a contact breaks away or is stopped [s].
        margin: friction margin: share of the static level that stiction keeps from it.
        clock: time limit.
    """

    problem: Problem
    sizes: Mapping[str, float]
    at_rest: Sequence[str]
    solver: Ipopt
    scheme: Scheme
    shortest: float
    kick: float
    progress: Report | None
    margin: float = MARGIN
    clock: Clock = field(default_factory=Clock)

    def solve(self, legs: Sequence[Leg], known: Known, intervals: int, barrier: float) -> Solved:
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
        return self.on(legs, self.discretised(legs), meshes, known, barrier, CLOSE)

    def discretised(self, legs: Sequence[Leg]) -> Discretisation:
        """Return the problem of a sequence, discretised except for its meshes."""
        rests = self.sizes, self.at_rest, self.shortest, self.margin
        problem = in_arcs(self.problem, legs, *rests)
        return discretise(problem, self.scheme, _sawn(problem))

    def again(self, solved: Solved) -> Solved:
        """Solve again with this margin, from a motion with another one, on its meshes."""
        made = self.discretised(solved.legs)
        return self.on(solved.legs, made, solved.transcription.meshes, solved.known, 1e-4)

    def on(
        self,
        legs: Sequence[Leg],
        discretisation: Discretisation,
        meshes: Sequence[Array],
        known: Known,
        barrier: float,
        options: Mapping[str, Option] = FINER,
    ) -> Solved:
        """Solve a sequence on given meshes."""
        spans, arcs = discretisation.problem.spans, flat(legs)
        meshes = [
            _with_kick(mesh, self.kick / arc.duration) if breaks_away(span) else mesh
            for mesh, span, arc in zip(meshes, spans, arcs, strict=True)
        ]
        transcription = discretisation.on(meshes)
        start = transcription.pack(points_in(transcription, flat(legs), known))
        prepared = self.solver.with_options(mu_init=barrier, **options).prepared(
            transcription.program
        )
        cold = Iterate.cold(start, transcription.program.g.numel())
        stage = f"modes {shown(legs)}"
        outcome = self.clock.run(transcription, prepared, cold, self.progress, stage)
        durations = [span.T for span in transcription.unpack(outcome.iterate.w).spans]
        return Solved(placed(legs, durations), discretisation, transcription, outcome)


def _at_starts(span: Span, points: SpanPoints, expressions: Sequence[ca.SX]) -> Array:
    """Return values of expressions at the starts of all intervals of a phase, (rows, N)."""
    n = points.u.shape[1]
    rows = ca.Function("rows", span.symbols, [stacked(map(ca.SX, expressions))]).map(n)
    z, p = points.z[:, :: points.z.shape[1] // n], np.tile(span.p[:, None], (1, n))
    return rows(np.zeros((1, n)), points.nodes[:, :-1], z, points.u, p).full()


def _sawn(problem: Problem) -> dict[int, list[Row]]:
    """Return the friction margins of each arc that depend on inputs, for starts of intervals.

    If the stiction force is at its level, held inputs make it a sawtooth, whose peaks are at the
    starts of intervals, between collocation points.
    """
    found: dict[int, list[Row]] = {}
    for number, span in enumerate(problem.spans):
        u = span.model.vector("u")
        found[number] = [
            row
            for row in span.rows_at[0.0]
            if FIRST in row.name and ca.depends_on(row.expression, u)
        ]
    return found


def _with_kick(mesh: Array, kick: float) -> Array:
    """Return `mesh` with a first interval of at least `kick`, if enough intervals remain.

    A control may break a contact away by a pulse and then stay below its static level. The cost
    decreases with the length of the pulse without limit: its length has to be given.
    """
    kept = mesh[(mesh == 0.0) | (mesh >= kick)]
    return kept if kept.size > LEAST else mesh


def reassemble(
    problem: Problem, solved: Solved, statistics: Sequence[SolverStatistics]
) -> Solution:
    """Reassemble the arcs of `solved` into a solution of `problem`.

    Law states that mode models do not have are set to zero.
    """
    points, meshes = _joined(problem, solved)
    t = solved.transcription
    spans = list(enumerate(problem.spans))
    motion = motion_of("", spans, points.spans, meshes, t.scheme.coefficients(), points.chosen)
    total = statistics[0]
    for later in statistics[1:]:
        total = total.then(later)
    outcome = solved.outcome
    return Solution(
        problem=problem,
        status=outcome.status,
        message=f"ocp '{problem.name}': modes {shown(solved.legs)}: {outcome.sentence}",
        cost=outcome.cost,
        motions=(_with_forces(motion, solved.known.motion),),
        chosen=dict(points.chosen),
        statistics=total,
        scheme=t.scheme,
        meshes=meshes,
        points=points,
        iterate=Iterate.cold(np.zeros(0), 0),  # its program differs from that of the problem
        modes=modes_of(solved.legs),
        cause=outcome.cause,
    )


def modes_of(legs: Sequence[Leg]) -> dict[str, tuple[Mode, ...]]:
    """Return contact -> its modes over time."""
    return {
        contact: tuple(Mode(KINDS[run.mode], run.begin, run.end) for run in runs)
        for contact, runs in tracks_of(legs).items()
    }


def _joined(problem: Problem, solved: Solved) -> tuple[Points, tuple[Array, ...]]:
    """Return points and meshes of the user's phases."""
    t, points = solved.transcription, solved.points
    arcs = list(zip(t.problem.spans, points.spans, t.meshes, strict=True))
    spans: list[SpanPoints] = []
    meshes: list[Array] = []
    for number, span in enumerate(problem.spans):
        legs = [leg for leg in solved.legs if leg.phase == number]
        count = sum(len(leg.arcs) for leg in legs)
        own, arcs = arcs[:count], arcs[count:]
        spans.append(_span_points(span, own))
        meshes.append(_mesh(problem, number, legs, [(p.T, mesh) for _, p, mesh in own]))
    return Points(tuple(spans), points.chosen), tuple(meshes)


def _span_points(span: Span, arcs: Sequence[tuple[Span, SpanPoints, Array]]) -> SpanPoints:
    """Return the points of one phase, for its own model."""
    nodes = [_rows(span.model.x, own.model.x, p.nodes)[:, int(k > 0) :]
             for k, (own, p, _) in enumerate(arcs)]  # fmt: skip
    return SpanPoints(
        sum(p.T for _, p, _ in arcs),
        np.hstack(nodes),
        np.hstack([_rows(span.model.x, own.model.x, p.inner) for own, p, _ in arcs]),
        np.hstack([_rows(span.model.z, own.model.z, p.z) for own, p, _ in arcs]),
        np.hstack([_rows(span.model.u, own.model.u, p.u) for own, p, _ in arcs]),
    )


def _rows(wanted: Sequence[Variable], there: Sequence[Variable], values: Array) -> Array:
    """Return rows of `values` by name; zero for absent ones."""
    rows = {v.name: row for v, row in zip(there, values, strict=True)}
    zero = np.zeros(values.shape[1])
    return np.array([rows.get(v.name, zero) for v in wanted]).reshape(-1, values.shape[1])


def _mesh(
    problem: Problem, number: int, legs: Sequence[Leg], arcs: Sequence[tuple[float, Array]]
) -> Array:
    """Return the mesh of a phase as fractions of its duration, with exact via points."""
    fractions = [0.0, *sorted(problem.chain[number].via), 1.0]
    found = [np.zeros(1)]
    first = 0
    for leg, low, high in zip(legs, fractions[:-1], fractions[1:], strict=True):
        own = arcs[first : first + len(leg.arcs)]
        first += len(leg.arcs)
        whole, begin = sum(T for T, _ in own), 0.0
        for T, mesh in own:
            found.append(low + (high - low) * (begin + T * mesh[1:]) / whole)
            begin += T
        found[-1][-1] = high
    return np.concatenate(found)


def _with_forces(motion: Motion, arcs: Motion) -> Motion:
    """Return `motion` with the signals of the arcs, in which stiction is a reaction."""
    if motion.t.size != arcs.t.size:
        return motion
    signals = {name: arcs.signals.get(name, row) for name, row in motion.signals.items()}
    return replace(motion, signals=signals)
