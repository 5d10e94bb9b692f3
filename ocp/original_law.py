"""From a motion with static friction to one with the user's law and its states.

LuGre's bristles give way before they slip, so that a control that is exact for Coulomb friction
with stiction misses with them. Collocation does not follow them: their time constants run from
microseconds in sliding to milliseconds at rest. Shooting by exponential steps does.

1. The control nearest to the given one with which the law itself does what is required
   (`project_control`).
2. The problem itself from there, for a few iterations: the kink of the law at reversals makes
   Newton's method go round, and the best motion on the way that keeps all conditions is taken.
3. The nearest control again, on intervals that are cut where steps err, until the simulation
   agrees; and the problem itself once more where it was solved before.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ocp.checking.interval_errors import cut_meshes, local_errors
from ocp.checking.resimulate import arcs_of
from ocp.checking.verify import verified
from ocp.formulation.problem import Problem
from ocp.solving.methods import Ipopt
from ocp.solving.one_solve import solution_of
from ocp.solving.prepared import Clock
from ocp.solving.solution import Solution
from ocp.solving.starts import start_of
from ocp.transcription.program import Iterate, Program, Report
from ocp.transcription.schemes import Shooting
from ocp.transcription.transcribe import Discretisation, discretise
from ocp.transcription.transcription import Transcription
from symfric.foundation.status import Status

Array = NDArray[np.float64]
STEPS = 20
"""Steps of an interval where the user has not named a scheme."""
PASSES = 6
"""Meshes that are tried."""
MOST_PARTS = 8
"""Into which one interval is cut at once."""
GOAL = 0.3
"""Share of the tolerance that the local error of an interval may have."""
CLOSE: dict[str, str | float | int] = {"tol": 1e-6, "mu_init": 1e-4, "max_iter": 100}
MOST_ITERATIONS = 60
COST: dict[str, str | float | int] = {"tol": 1e-5, "mu_init": 1e-4, "max_iter": MOST_ITERATIONS}
STOPPED = (Status.INTERRUPTED, Status.TIME_LIMIT)
KEPT = 1e-6
"""Violation of a scaled row below which an iterate keeps all conditions."""


@final
@dataclass(frozen=True, eq=False)
class OriginalLaw:
    """Data shared by the solves.

    Attributes:
        problem: the user's, whose laws have states.
        scheme: shooting that follows them.
        solver: with the user's options, which win.
    """

    problem: Problem
    scheme: Shooting
    solver: Ipopt
    tolerance: float
    clock: Clock
    progress: Report | None = None

    def solved(self, static: Solution) -> Solution:
        """The motion with the law itself next to `static`, verified.

        Its message says how it was found; its status is ACCEPTABLE where it arrives and the
        optimality conditions do not hold.

        Raises:
            ValueError: a model through which `scheme` does not go.
        """
        made = discretise(self.problem, self.scheme)
        near = self.near(made, static, 1)
        best = self.cheaper(made, near) if near.ok else near
        if not best.ok and best.status is not Status.ACCEPTABLE:
            return best
        near = self.near(made, best, PASSES)
        if not near.verified:
            return near
        said = f"ocp '{self.problem.name}': By {self.scheme} with the law itself,"
        if best.status is Status.SOLVED:
            best = self.cheaper(made, near)
            if best.status is Status.SOLVED or best.status in STOPPED:
                found = verified(best, self.tolerance)
                if found.verified:
                    told = "the optimality conditions hold" if found.ok else "stopped"
                    return replace(found, message=f"{said} {told}.")
            near = replace(near, statistics=best.statistics)
        return replace(
            near,
            status=Status.ACCEPTABLE,
            message=f"{said} it arrives; the optimality conditions of the cost do not hold within "
            f"{MOST_ITERATIONS} iterations, as at kinks of a law. The cost is {near.cost:.6g}, "
            f"with the static law {static.cost:.6g}.",
        )

    def near(self, made: Discretisation, given: Solution, passes: int) -> Solution:
        """Arrives, by the control nearest to that of `given`; of several passes verified."""
        meshes: Sequence[Array] = given.meshes
        guess, past, goal = given, None, GOAL * self.tolerance
        found = given
        for number in range(1, passes + 1):
            begin = perf_counter()
            on = made.on(meshes)
            start = start_of(on, guess)[0]
            program = project_control(on, start.w)
            prepared = self.solver.with_options(**(CLOSE | dict(self.solver.options))).prepared(
                program
            )
            built = perf_counter() - begin
            outcome = self.clock.run(on, prepared, start, self.progress, f"law itself {number}")
            own = replace(outcome.statistics, build_time=outcome.statistics.build_time + built)
            past = own if past is None else past.then(own)
            cost = float(on.program.gradient(outcome.iterate.w, on.program.values)[0])
            found = replace(solution_of(on, outcome), cost=cost, statistics=past)
            if not found.ok or passes == 1:
                return found
            finer = self.finer(found, goal)
            while finer is None and number < passes:
                found = verified(found, self.tolerance)
                if found.verified:
                    return found
                goal /= 4  # errors of many intervals add up
                finer = self.finer(found, goal)
            meshes, guess = finer or meshes, found
        return verified(found, self.tolerance)

    def cheaper(self, made: Discretisation, near: Solution) -> Solution:
        """The problem itself from `near`: solved, stopped, or what there is, as ACCEPTABLE.

        That is the best motion on the way that keeps all conditions.
        """
        on = made.on(near.meshes)
        prepared = self.solver.with_options(**(COST | dict(self.solver.options))).prepared(
            on.program
        )
        start = Iterate.cold(near.iterate.w, on.program.g.numel())
        outcome = self.clock.run(on, prepared, start, self.progress, "law itself, cost")
        statistics = near.statistics.then(outcome.statistics)
        found = solution_of(on, outcome)
        if not found.ok and outcome.status not in STOPPED:
            better = outcome.violation < KEPT and outcome.cost < near.cost
            found = replace(found if better else near, status=Status.ACCEPTABLE)
        return replace(found, statistics=statistics)

    def finer(self, found: Solution, goal: float) -> list[Array] | None:
        """Meshes with the intervals cut whose steps err; None where there are none."""
        phases = len(self.problem.chain)
        arcs = arcs_of(self.problem, found.meshes, found.points)
        errors = local_errors(arcs, min(1e-6, 1e-2 * self.tolerance))
        return cut_meshes(found.meshes, errors, phases, goal, order=2, most=MOST_PARTS)


def project_control(transcription: Transcription, w: ArrayLike) -> Program:
    """The program of `transcription` with the distance from the controls in `w` as its cost.

    Free durations and chosen parameters count like inputs; everything is scaled.
    """
    program, layout = transcription.program, transcription.layout
    weights = np.zeros(layout.size)
    for span, mesh in zip(layout.spans, transcription.meshes, strict=True):
        weights[span.u] = np.diff(mesh)
        if span.T >= 0:
            weights[span.T] = 1.0
    weights[layout.chosen] = 1.0
    scale, there = ca.DM(weights), ca.DM(np.asarray(w, dtype=float))
    x, p = ca.MX.sym("x", program.w.numel()), ca.MX.sym("p", program.p.numel())
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", program.g.numel())
    curved = ca.MX(program.hessian(x, p, 0.0, lam_g))
    hessian = ca.triu(curved + lam_f * ca.diag(scale))
    return replace(
        program,
        f=_half_square(program.w, there, scale),
        gradient=ca.Function(
            "gradient", [x, p], [_half_square(x, there, scale), scale * (x - there)]
        ),
        hessian=ca.Function("hessian", [x, p, lam_f, lam_g], [hessian]),
    )


def _half_square(w: ca.MX, there: ca.DM, scale: ca.DM) -> ca.MX:
    return ca.dot(scale, (w - there) ** 2) / 2
