"""Solution with the user's law and its states, started from a motion with static friction.

The bristles of a LuGre law deflect before they slip, so a control that is exact for Coulomb
friction with stiction misses the end with the law itself. Collocation does not resolve their time
constants, from microseconds in sliding to milliseconds at rest; shooting by exponential steps does.

1. Find the control nearest to the given one with which the motion with the law itself satisfies
   all conditions (`project_control`).
2. Solve the problem from there for a few iterations. The kink of the law at reversals can make
   Newton's method cycle; the best feasible iterate is kept.
3. Find the nearest control again, on intervals that are divided where steps are inaccurate, until
   the simulation agrees. Solve the problem once more if step 2 solved it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from ocp.checking.interval_errors import cut_meshes, local_errors
from ocp.checking.resimulate import arcs_of
from ocp.checking.verify import confirmed, verified
from ocp.formulation.phase import Array
from ocp.solving.one_solve import Solved, Task
from ocp.solving.prepared import Option
from ocp.solving.solution import Solution, with_sentence
from ocp.solving.starts import start_of
from ocp.transcription.program import Iterate, Program
from ocp.transcription.transcribe import Discretisation, Transcription, discretise
from symfric.foundation.status import SolveError, Status

STEPS = 20
"""Default number of steps of an interval."""
PASSES = 8
"""Largest number of meshes."""
MOST_PARTS = 8
"""Largest number of parts into which one pass divides an interval."""
GOAL = 0.3
"""Largest local error of an interval, as a share of the tolerance."""
CLOSE: dict[str, Option] = {"tol": 1e-6, "mu_init": 1e-4, "max_iter": 100}
MOST_ITERATIONS = 60
COST: dict[str, Option] = {"tol": 1e-5, "mu_init": 1e-4, "max_iter": MOST_ITERATIONS}
FAILURES = (ArithmeticError, AttributeError, LookupError, RuntimeError, TypeError, ValueError)
"""Exceptions after which the next strategy is tried."""
KEPT = 1e-6
"""Violation of a scaled row below which an iterate is feasible."""


@final
@dataclass(frozen=True, eq=False)
class OriginalLaw:
    """Solver of a problem with laws with states.

    Attributes:
        task: the user's problem, whose laws have states, and a shooting scheme that resolves them;
            the options of its solver take precedence.
        tolerance: tolerance of the verification.
    """

    task: Task
    tolerance: float

    def continued(self, exact: Solution) -> Solution:
        """Return the verified motion near `exact`, or `exact` with the reason of a failure."""
        try:
            own = self.solved(exact)
        except FAILURES as error:  # shooting does not support all models
            return with_sentence(exact, f"With the law itself: {reason_of(error)}.")
        own = replace(own, statistics=exact.statistics.then(own.statistics))
        if confirmed(own):
            return replace(own, modes=exact.modes)
        kept = with_sentence(exact, f"By {self.task.scheme} with the law itself: {own.message}")
        kept = replace(kept, statistics=own.statistics)
        stopped = own.status.stopped
        return replace(kept, status=own.status, cause=own.cause) if stopped else kept

    def solved(self, static: Solution) -> Solution:
        """Return the verified motion with the law itself near `static`.

        Its message describes the method. Its status is ACCEPTABLE if the motion satisfies all
        conditions but not the optimality conditions.

        Raises:
            ValueError: the scheme does not support a model.
        """
        made = discretise(self.task.problem, self.task.scheme)
        near = self._near(made, static, 1)
        best = self._cheaper(made, near) if near.ok else near
        if not best.ok and best.status is not Status.ACCEPTABLE:
            return best
        near = self._near(made, best, PASSES)
        if not near.verified:
            return near
        text = f"ocp '{made.problem.name}': By {made.scheme} with the law itself,"
        if best.status is Status.SOLVED:
            best = self._cheaper(made, near)
            if best.status is Status.SOLVED or best.status.stopped:
                checked = verified(best, self.tolerance)
                if confirmed(checked):
                    end = "the optimality conditions hold" if checked.ok else "stopped"
                    return replace(checked, message=f"{text} {end}.")
            near = replace(near, statistics=best.statistics)
        return replace(
            near,
            status=Status.ACCEPTABLE,
            message=f"{text} it arrives; the optimality conditions of the cost do not hold within "
            f"{MOST_ITERATIONS} iterations, as at kinks of a law. The cost is {near.cost:.6g}, "
            f"with the static law {static.cost:.6g}.",
        )

    def _near(self, made: Discretisation, guess: Solution, passes: int) -> Solution:
        """Return the motion by the control nearest to that of `guess`; verified if passes > 1."""
        meshes: Sequence[Array] = guess.meshes
        goal, past, phases = GOAL * self.tolerance, None, len(made.problem.chain)
        for number in range(1, passes + 1):
            begin = perf_counter()
            on = made.on(meshes)
            start = start_of(on, guess)[0]
            solver = self.task.ipopt.with_defaults(**CLOSE)
            prepared = solver.prepared(project_control(on, start.w))
            stage = f"law itself {number}"
            outcome = self.task.supervisor.run(on, prepared, start, stage, begin=begin)
            past = outcome.statistics if past is None else past.then(outcome.statistics)
            cost = float(on.program.gradient(outcome.iterate.w, on.program.values)[0])
            guess = replace(Solved(on, outcome).solution, cost=cost, statistics=past)
            if not guess.ok or passes == 1:
                return guess
            arcs = arcs_of(made.problem, guess.meshes, guess.points)
            errors, finer = local_errors(arcs, min(1e-6, 1e-2 * self.tolerance)), None
            while finer is None and number < passes:
                finer = cut_meshes(guess.meshes, errors, phases, goal, order=2, most=MOST_PARTS)
                if finer is None:
                    guess = verified(guess, self.tolerance)
                    if guess.verified:
                        return guess
                    goal /= 4  # errors of many intervals add up
            meshes = finer or meshes
        return verified(guess, self.tolerance)

    def _cheaper(self, made: Discretisation, near: Solution) -> Solution:
        """Solve the problem from `near`.

        If it is neither solved nor stopped, return the best feasible iterate as ACCEPTABLE.
        """
        on = made.on(near.meshes)
        prepared = self.task.ipopt.with_defaults(**COST).prepared(on.program)
        start = Iterate.cold(near.iterate.w, on.program.g.numel())
        outcome = self.task.supervisor.run(on, prepared, start, "law itself, cost")
        statistics = near.statistics.then(outcome.statistics)
        found = Solved(on, outcome).solution
        if not found.ok and not outcome.status.stopped:
            better = outcome.violation < KEPT and outcome.cost < near.cost
            found = replace(found if better else near, status=Status.ACCEPTABLE)
        return replace(found, statistics=statistics)


def project_control(transcription: Transcription, w: ArrayLike) -> Program:
    """Return the program of `transcription` with the distance from the controls in `w` as its cost.

    Free durations and chosen parameters count as inputs. All variables are scaled.
    """
    program, layout = transcription.program, transcription.layout
    weights = np.zeros(layout.size)
    for span, mesh in zip(layout.spans, transcription.meshes, strict=True):
        weights[span.u] = np.diff(mesh)
        if span.T >= 0:
            weights[span.T] = 1.0
    weights[layout.chosen] = 1.0
    scale, goal = ca.DM(weights), ca.DM(np.asarray(w, dtype=float))
    x, p = ca.MX.sym("x", program.w.numel()), ca.MX.sym("p", program.p.numel())
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", program.g.numel())

    def cost(x: ca.MX) -> ca.MX:
        return ca.dot(scale, (x - goal) ** 2) / 2

    curved = ca.MX(program.hessian(x, p, 0.0, lam_g))
    hessian = ca.triu(curved + lam_f * ca.diag(scale))
    return replace(
        program,
        f=cost(program.w),
        gradient=ca.Function("gradient", [x, p], [cost(x), scale * (x - goal)]),
        hessian=ca.Function("hessian", [x, p, lam_f, lam_g], [hessian]),
    )


def reason_of(error: Exception) -> str:
    """Return the message of `error` as a clause, with its type if it is an internal error."""
    first = (str(error).strip().splitlines() or [""])[0].rstrip(".")
    if isinstance(error, ValueError | SolveError):
        return first
    return f"internal error, {type(error).__name__}: {first}"
