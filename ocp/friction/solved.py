"""A sequence of modes solved: its durations, its motion."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.checking.holding import holding_losses
from ocp.formulation.phase import Row
from ocp.formulation.problem import Problem
from ocp.friction.arc_models import CAUGHT, FIRST, PULLED, STOPPED, breaks_away
from ocp.friction.arcs import MARGIN, in_arcs
from ocp.friction.carry import Known, points_in
from ocp.friction.release import SIDES
from ocp.friction.sequence import Leg, flat, placed, shown
from ocp.result.motion import motion_of
from ocp.solvers.methods import Ipopt
from ocp.solvers.outcome import Iterate, Outcome, Report, in_stage
from ocp.solvers.prepared import Option
from ocp.solving.clock import Clock
from ocp.solving.one_solve import when
from ocp.transcription.schemes import Scheme
from ocp.transcription.transcribe import Discretisation, discretise
from ocp.transcription.transcription import Transcription
from ocp.transcription.unknowns import Points
from symfric.foundation.symbols import stacked

Array = NDArray[np.float64]

LEAST = 3
"""Intervals of the shortest arc."""

NEAR = 1.5
"""Margins from its level at which a rest is no closer than it need be."""

CLOSE: dict[str, Option] = {"constr_mult_init_max": 1e8}
"""Options of a start that is nearly a solution: estimated multipliers are kept however large they
are. Ipopt sets those above 1e3 to zero, and loses the way from the solution on another mesh:
cart-pendulum, twice as many intervals, 9 iterations instead of more than 100."""

FINER: dict[str, Option] = CLOSE | {"perturb_always_cd": "yes"}
"""The same on a finer mesh. Where a rest follows its level the rows of short intervals nearly
depend on each other. Unless Ipopt always regularises them, MUMPS delays pivots until its fronts are
dense: an arm with 700 intervals, more than 30 s for one factorisation instead of 0.1 s."""


@final
@dataclass(frozen=True, eq=False)
class Solved:
    """A sequence with the durations that were found for it."""

    legs: tuple[Leg, ...]
    discretisation: Discretisation
    transcription: Transcription
    outcome: Outcome

    @cached_property
    def points(self) -> Points:
        """The motion of all arcs."""
        return self.transcription.unpack(self.outcome.iterate.w)

    @cached_property
    def known(self) -> Known:
        """The motion, to start from."""
        t, points = self.transcription, self.points
        spans = list(enumerate(t.problem.spans))
        scheme = t.scheme.coefficients()
        motion = motion_of("", spans, points.spans, t.meshes, scheme, points.chosen)
        p = {v.name: float(x) for s in t.problem.spans for v, x in zip(s.model.p, s.p, strict=True)}
        return Known(motion, p | dict(points.chosen), points.chosen)

    @cached_property
    def losses(self) -> tuple[Array, ...]:
        """What holding the inputs costs in each interval."""
        iterate = self.outcome.iterate
        return holding_losses(self.transcription, iterate.w, iterate.lam_g)

    @property
    def loss(self) -> float:
        """The same over all intervals."""
        return sum(float(loss.sum()) for loss in self.losses)

    @property
    def ideal_cost(self) -> float:
        """J of inputs that need not be held: compares sequences on different meshes."""
        return self.outcome.cost - self.loss

    @cached_property
    def overloaded(self) -> tuple[NDArray[np.bool_], ...]:
        """Intervals at whose start, before their first point, a rest asks for too much force."""
        found: list[NDArray[np.bool_]] = []
        spans, arcs = self.transcription.problem.spans, flat(self.legs)
        for span, arc, points in zip(spans, arcs, self.points.spans, strict=True):
            model, n = span.model, points.u.shape[1]
            rooms = [
                model.outputs[f"{name}{FIRST}{side}"].expression
                for name, mode in arc.modes.items()
                for side in SIDES.values()
                if not mode
            ]
            rows = ca.Function("rooms", span.symbols, [stacked(map(ca.SX, rooms))]).map(n)
            t, z, p = np.zeros((1, n)), points.z[:, :: points.z.shape[1] // n], span.p[:, None]
            values = rows(t, points.nodes[:, :-1], z, points.u, np.tile(p, (1, n))).full()
            found.append((values < 0.0).any(axis=0))
        return tuple(found)

    def pressed(self, margin: float) -> bool:
        """Whether some rest, or what ends or begins one, is as close to its level as it may be."""
        spans = self.transcription.problem.spans
        for span, points in zip(spans, self.points.spans, strict=True):
            n, outputs = points.u.shape[1], span.model.outputs
            rooms = {name: o.expression for name, o in outputs.items() if FIRST in name}
            rooms |= {
                name: ca.SX(o.expression) + (0 if PULLED in name else margin)
                for name, o in outputs.items()
                if name.endswith((PULLED, CAUGHT, STOPPED))
            }
            column = ca.Function("rooms", span.symbols, [stacked(map(ca.SX, rooms.values()))])
            z, p = points.z[:, :: points.z.shape[1] // n], np.tile(span.p[:, None], (1, n))
            values = column.map(n)(np.zeros((1, n)), points.nodes[:, :-1], z, points.u, p).full()
            for name, row in zip(rooms, values, strict=True):
                if (row if FIRST in name else row[:1]).min() < NEAR * margin:
                    return True
        return False

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
        kick: least length of the interval in which a contact breaks away or is caught [s].
        margin: share of the static level that rests keep from it.
        clock: when to stop.
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
        """Find the durations and the motion of a sequence.

        Args:
            legs: the sequence, where to look for `known`.
            known: a motion to start from.
            intervals: about how many, all of a length.
            barrier: parameter of the interior-point method to start with: small from close by.
        """
        whole = sum(leg.duration for leg in legs)
        parts = [max(LEAST, round(intervals * arc.duration / whole)) for arc in flat(legs)]
        meshes = [np.linspace(0.0, 1.0, n + 1) for n in parts]
        return self.on(legs, self.discretised(legs), meshes, known, barrier, CLOSE)

    def discretised(self, legs: Sequence[Leg]) -> Discretisation:
        """The problem of a sequence, ready for meshes."""
        rests = self.sizes, self.at_rest, self.shortest, self.margin
        problem = in_arcs(self.problem, legs, *rests)
        return discretise(problem, self.scheme, _sawn(problem))

    def again(self, solved: Solved) -> Solved:
        """A motion that was found with another margin, on its meshes."""
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
        """The same on given meshes."""
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
        stage = in_stage(self.progress, f"modes {shown(legs)}")
        rows = transcription.program.g.numel()
        outcome = self.clock.within(prepared).run(
            Iterate.cold(start, rows), progress=stage, at=partial(when, transcription)
        )
        durations = [span.T for span in transcription.unpack(outcome.iterate.w).spans]
        return Solved(placed(legs, durations), discretisation, transcription, outcome)


def _sawn(problem: Problem) -> dict[int, list[Row]]:
    """Of each arc the rooms of rests that jump with the inputs: asked for where these begin.

    Where the force at rest follows its level, inputs that are held make a saw of it, whose teeth
    stand at the starts of intervals, between collocation points.
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
    """`mesh` whose first interval is not shorter than `kick`, where two more remain.

    A control may break a contact away by a kick and then go on with less than its static level. The
    shorter the kick the less it costs, without end: its length has to be given.
    """
    kept = mesh[(mesh == 0.0) | (mesh >= kick)]
    return kept if kept.size > LEAST else mesh
