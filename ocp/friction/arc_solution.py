"""Solution of a mode sequence, and its conversion to a solution of the user's problem."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.checking.interval_errors import zoh_losses
from ocp.formulation.phase import Array, Row, Span
from ocp.formulation.problem import Problem
from ocp.friction.arcs import CAUGHT, FIRST, PULLED, STOPPED, Rules, breaks_away, in_arcs
from ocp.friction.sequence import Leg, Legs, flat, modes_of, placed, shown, tracks_of
from ocp.friction.transfer import Known, points_in
from ocp.solving.motion import motions_of
from ocp.solving.one_solve import Solved, Task, along_points
from ocp.solving.prepared import Option
from ocp.solving.solution import Solution
from ocp.transcription.program import Iterate, SolverStatistics
from ocp.transcription.transcribe import Discretisation, discretise
from ocp.transcription.unknowns import SpanPoints, Values
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import stacked

LEAST = 3
"""Smallest number of intervals of an arc."""
NEAR = 1.5
"""Distance of stiction from its static level, in margins, below which it counts as close."""
CLOSE: dict[str, Option] = {"constr_mult_init_max": 1e8}
"""Options for a start near the solution, which keep large estimated multipliers. By default Ipopt
sets multipliers above 1e3 to zero and may diverge: after a refinement of the cart-pendulum to twice
as many intervals, it takes 9 iterations with these options and more than 100 without."""
FINER: dict[str, Option] = CLOSE | {
    "perturb_always_cd": "yes",
    "mumps_permuting_scaling": 0,
    "bound_mult_init_method": "mu-based",
    "watchdog_shortened_iter_trigger": 3,
}
"""Options for a finer mesh. If stiction is at its level, the rows of short intervals are nearly
dependent. Unless Ipopt always regularises them and MUMPS does not permute the matrix before it
orders it, pivots are delayed until fronts are dense: for robot arms with 700 intervals, one
factorisation takes 30 to 150 s instead of 0.1 s. Multipliers of bounds from the barrier parameter
save a quarter of the iterations. Near the level the line search shortens steps that only bend away
from the constraints; after three of them, instead of ten, the watchdog takes a full step."""


@final
@dataclass(frozen=True, eq=False)
class SolvedSequence(Solved):
    """Mode sequence with its optimised durations and motion."""

    legs: Legs
    discretisation: Discretisation

    @cached_property
    def known(self) -> Known:
        """Motion as a starting point of further solves."""
        t, points = self.transcription, self.points
        (motion,) = motions_of(t.problem, t.meshes, t.scheme.coefficients(), points)
        return Known.of(t.problem, motion, points.chosen)

    @cached_property
    def losses(self) -> tuple[Array, ...]:
        """Loss of cost by constant inputs in each interval, (N,) for each arc."""
        return zoh_losses(self.transcription, self.outcome.iterate)

    @property
    def loss(self) -> float:
        """Total loss of cost by constant inputs."""
        return sum(float(loss.sum()) for loss in self.losses)

    @property
    def ideal_cost(self) -> float:
        """Cost J minus the loss by constant inputs, for comparisons between different meshes."""
        return self.outcome.cost - self.loss

    @cached_property
    def overloaded(self) -> list[NDArray[np.bool_]]:
        """Masks of intervals at whose start stiction exceeds its static level."""
        return [np.any(_margins(span, points) < 0.0, axis=0) for span, points in self._arcs()]

    def pressed(self, margin: float) -> bool:
        """Return True if stiction, or a start or end of stick, is near the limit of the margin."""
        for span, points in self._arcs():
            kept = _margins(span, points)
            changes = [
                ca.SX(o.expression) + (0 if PULLED in name else margin)
                for name, o in span.model.outputs.items()
                if name.endswith((PULLED, CAUGHT, STOPPED))
            ]
            first = along_points(span, points, stacked(changes), starts=True)[:, :1]
            if min(kept.min(initial=np.inf), first.min(initial=np.inf)) < NEAR * margin:
                return True
        return False

    def _arcs(self) -> list[tuple[Span, SpanPoints]]:
        spans = self.transcription.problem.spans
        return list(zip(spans, self.points.spans, strict=True))

    @property
    def intervals(self) -> int:
        """Total number of intervals."""
        return sum(mesh.size - 1 for mesh in self.transcription.meshes)


def _margins(span: Span, points: SpanPoints) -> Array:
    """Return the friction margins at the starts of all intervals of an arc, (rows, N)."""
    margins = (o.expression for name, o in span.model.outputs.items() if FIRST in name)
    return along_points(span, points, stacked(margins), starts=True)


class StoppedError(Exception):
    """Exception after a solve that the user or the time limit has stopped."""


@final
@dataclass(frozen=True, eq=False)
class ModeSolver:
    """Solver of mode sequences of one problem.

    Attributes:
        rules: rules by which arcs become phases.
        task: the user's problem, with scheme, solver, time limit and progress.
        kick: smallest length of the interval in which a contact breaks away or is stopped [s].
        tried: results of all solves. A stopped solve is added before `StoppedError` is raised.
    """

    rules: Rules
    task: Task
    kick: float
    tried: list[SolvedSequence] = field(default_factory=list[SolvedSequence])

    def solve(self, legs: Legs, known: Known, intervals: int, barrier: float) -> SolvedSequence:
        """Optimise the durations and the motion of a sequence.

        Args:
            legs: the sequence, with its times in `known`.
            known: initial motion.
            intervals: approximate number of intervals, which have similar lengths.
            barrier: initial barrier parameter of the interior-point method, small near a solution.
        """
        whole = sum(leg.duration for leg in legs)
        parts = [max(LEAST, round(intervals * arc.duration / whole)) for arc in flat(legs)]
        meshes = [np.linspace(0.0, 1.0, n + 1) for n in parts]
        return self.on(legs, self._discretised(legs), meshes, known, barrier, CLOSE)

    def _discretised(self, legs: Legs) -> Discretisation:
        """Return the discretised problem of a sequence, independent of meshes.

        With constant inputs, a stiction force near its level is a sawtooth with peaks at the starts
        of intervals, where there are no collocation points. Therefore margins that depend on inputs
        are conditions at these starts.
        """
        problem = in_arcs(self.rules, legs)
        peaks: dict[int, list[Row]] = {}
        for number, span in enumerate(problem.spans):
            u = span.model.vector("u")
            rows = [row for row in span.rows_at[0.0] if FIRST in row.name]
            peaks[number] = [row for row in rows if ca.depends_on(row.expression, u)]
        return discretise(problem, self.task.scheme, peaks)

    @property
    def stopped(self) -> bool:
        """True if the user or the time limit has stopped the last solve."""
        return self.tried[-1].outcome.status.stopped

    def with_iterations(self, limit: int) -> "ModeSolver":
        """Return the solver with another limit of the iterations of one solve."""
        solver = self.task.ipopt.with_options(max_iter=limit)
        return replace(self, task=replace(self.task, solver=solver))

    def with_margin(self, margin: float) -> "ModeSolver":
        """Return the solver with another friction margin."""
        return replace(self, rules=self.rules._replace(margin=margin))

    def again(self, solved: SolvedSequence) -> SolvedSequence:
        """Solve a sequence again with the margin of `rules`, from its motion and on its meshes."""
        made, meshes = self._discretised(solved.legs), solved.transcription.meshes
        return self.on(solved.legs, made, meshes, solved.known, 1e-4)

    def on(
        self,
        legs: Legs,
        discretisation: Discretisation,
        meshes: Sequence[Array],
        known: Known,
        barrier: float,
        options: Mapping[str, Option] = FINER,
    ) -> SolvedSequence:
        """Solve a discretised sequence on given meshes from the motion `known`.

        Raises:
            StoppedError: the user or the time limit has stopped the solver.
        """
        spans, arcs = discretisation.problem.spans, flat(legs)
        meshes = [
            _with_kick(mesh, self.kick / arc.duration) if breaks_away(span) else mesh
            for mesh, span, arc in zip(meshes, spans, arcs, strict=True)
        ]
        made = discretisation.on(meshes)
        prepared = self.task.ipopt.with_options(mu_init=barrier, **options).prepared(made.program)
        start = Iterate.cold(made.pack(points_in(made, arcs, known)), made.program.g.numel())
        outcome = self.task.supervisor.run(made, prepared, start, f"modes {shown(legs)}")
        durations = [span.T for span in made.unpack(outcome.iterate.w).spans]
        solved = SolvedSequence(made, outcome, placed(legs, durations), discretisation)
        self.tried.append(solved)
        if outcome.status.stopped:
            raise StoppedError
        return solved


def _with_kick(mesh: Array, kick: float) -> Array:
    """Return `mesh` with a first interval of at least `kick`, if enough intervals remain.

    A control may break a contact away by a pulse and then remain below its static level. A shorter
    pulse always costs less, so its length has to be limited.
    """
    kept = mesh[(mesh == 0.0) | (mesh >= kick)]
    return kept if kept.size > LEAST else mesh


def reassemble(
    problem: Problem, solved: SolvedSequence, statistics: Sequence[SolverStatistics]
) -> Solution:
    """Return a solution of `problem` from the arcs of `solved`.

    Modes are those of the arcs. Other law states, which mode models do not contain, are zero.
    """
    t, outcome = solved.transcription, solved.outcome
    arcs = list(zip(t.problem.spans, solved.points.spans, t.meshes, strict=True))
    spans: list[SpanPoints] = []
    meshes: list[Array] = []
    for number, span in enumerate(problem.spans):
        legs = [leg for leg in solved.legs if leg.phase == number]
        count = sum(len(leg.arcs) for leg in legs)
        own, arcs = arcs[:count], arcs[count:]
        modes = [arc.modes for leg in legs for arc in leg.arcs]
        spans.append(_span_points(span, own, modes))
        meshes.append(_mesh(problem, number, legs, [(p.T, mesh) for _, p, mesh in own]))
    points = Values(tuple(spans), solved.points.chosen)
    (motion,) = motions_of(problem, meshes, t.scheme.coefficients(), points)
    detailed = solved.known.motion  # contains stiction as reactions
    if motion.t.size == detailed.t.size:
        signals = {n: detailed.signals.get(n, row) for n, row in motion.signals.items()}
        motion = replace(motion, signals=signals)
    return replace(
        solved.solution,
        problem=problem,
        message=f"ocp '{problem.name}': modes {shown(solved.legs)}: {outcome.sentence}",
        motions=(motion,),
        statistics=reduce(SolverStatistics.then, statistics),
        meshes=tuple(meshes),
        points=points,
        iterate=Iterate.cold(np.zeros(0), 0),  # multipliers do not apply to the user's problem
        modes={contact: modes_of(runs) for contact, runs in tracks_of(solved.legs).items()},
    )


def _span_points(
    span: Span,
    arcs: Sequence[tuple[Span, SpanPoints, Array]],
    modes: Sequence[Mapping[str, int]],
) -> SpanPoints:
    """Return the points of one phase of the user's problem.

    Variables that no arc has are zero, except `modes`, those of each arc by contact. States that
    only some arcs have, the violations of soft conditions at the ends, are constant.
    """
    held = {
        v.name: row[-1] for one, p, _ in arcs for v, row in zip(one.model.x, p.nodes, strict=True)
    }

    def joined(letter: str, name: str) -> Array:
        parts: list[Array] = []
        wanted: Sequence[Variable] = getattr(span.model, letter)
        for k, (own, points, _) in enumerate(arcs):
            values: Array = getattr(points, name)[:, int(k > 0 and name == "nodes") :]
            names = [v.name for v in getattr(own.model, letter)]
            rows, count = dict(zip(names, values, strict=True)), values.shape[1]
            known = held | {n: modes[k].get(c.name, 0) for n, c in span.model.modes.items()}
            filled = (rows.get(v.name, np.full(count, known.get(v.name, 0.0))) for v in wanted)
            parts.append(np.array([*filled], float).reshape(-1, count))
        return np.hstack(parts)

    groups = (("x", "nodes"), ("x", "inner"), ("z", "z"), ("u", "u"))
    return SpanPoints(sum(p.T for _, p, _ in arcs), *(joined(*group) for group in groups))


def _mesh(
    problem: Problem, number: int, legs: Sequence[Leg], arcs: Sequence[tuple[float, Array]]
) -> Array:
    """Return the mesh of a phase as fractions of its duration, with its via points as nodes."""
    fractions = [0.0, *problem.chain[number].stops, 1.0]
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
