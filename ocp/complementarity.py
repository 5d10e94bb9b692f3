"""Solution of problems with complementary signals by a sequence of relaxed problems.

    0 <= a,   0 <= b,   a b <= eps size,    eps = 1e-1, 1e-2, ... 1e-8

The exact condition has no interior and dependent derivatives, so no solver of smooth programs
converges from a distance. eps is a parameter of the program; each solve starts at the result of the
previous one, and a step that fails is repeated with a smaller factor. The last eps is that of a
solve on refined meshes.

Source: Scholtes, SIAM Journal on Optimization 11(4), 2001, 918-936.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from math import sqrt

from ocp.checking.mesh_refinement import Goals, refined_solve
from ocp.formulation.expressions import EPS
from ocp.formulation.phase import Array
from ocp.solving.one_solve import Solved, Task
from ocp.solving.prepared import Prepared, Supervisor
from ocp.solving.solution import Solution, with_sentence
from ocp.solving.starts import Start, start_of
from ocp.solving.verification import largest_product
from ocp.transcription.program import Iterate, SolverStatistics
from ocp.transcription.transcribe import Transcription, discretise
from symfric.foundation.status import Status

FIRST, LAST = 1e-1, 1e-8
"""First and last eps; `p` of the problem may give another last one."""
FACTOR, LEAST_FACTOR = 10.0, 1.5
"""Ratio of successive eps, and the ratio below which the sequence stops."""
MOST = 1e-5
"""Largest last eps of a solution."""
PASSES = 4
"""Largest number of solves on refined meshes."""
UNREFINED = 1.0
"""Loss of cost by constant inputs, relative to J, for which meshes are refined: its estimate is not
valid where complementary signals change their roles."""
LATER = 1e-3
"""Initial barrier parameter of Ipopt after the first solve."""


def solve_relaxed(task: Task, meshes: Sequence[Array], guess: Start, goals: Goals) -> Solution:
    """Solve a problem with complementary signals; see `refined_solve` for the arguments.

    The status is not ok if eps remains above `MOST`. The problem of the solution has the last eps.
    """
    later = task.solver.with_defaults(mu_init=LATER)
    on = discretise(task.problem, task.scheme).on(meshes)
    prepared = task.solver.prepared(on.program), later.prepared(on.program)
    eps, solution = _decreased(on, prepared, start_of(on, guess)[0], task.supervisor)
    problem = replace(task.problem, p=dict(task.problem.p) | {EPS: eps})
    solution = replace(solution, problem=problem)
    if solution.ok:
        goals = replace(goals, loss=UNREFINED, passes=min(goals.passes, PASSES), patient=False)
        finer = refined_solve(replace(task, problem=problem, solver=later), meshes, solution, goals)
        statistics = solution.statistics.then(finer.statistics)
        kept = finer if finer.ok or finer.status.stopped else solution
        solution = replace(kept, statistics=statistics)
    return solution


def with_products(solution: Solution) -> Solution:
    """Return a solution with the last eps and the largest product in its message."""
    given = solution.scheme, solution.meshes, solution.points
    eps, product = solution.problem.p[EPS], largest_product(solution.problem, *given)
    text = f"Complementary signals: eps = {eps:.1g}, largest product {product:.1g}."
    return with_sentence(solution, text)


def _decreased(
    on: Transcription, prepared: tuple[Prepared, Prepared], start: Iterate, supervisor: Supervisor
) -> tuple[float, Solution]:
    """Return the last eps and its solution; the first solve uses the first prepared solver."""
    first, later = prepared
    last = float(on.problem.p.get(EPS, LAST))
    eps, factor, statistics = max(FIRST, last), FACTOR, list[SolverStatistics]()
    reached, found = eps, list[Solution]()
    while factor > LEAST_FACTOR:
        values, solver = on.values({EPS: eps}), later if found else first
        outcome = supervisor.run(on, solver, start, f"complementarity {eps:.1g}", values)
        statistics.append(outcome.statistics)
        solved = outcome.status.ok
        if solved or not found:
            reached = eps
            found.append(Solved(on, outcome).solution)
            start = Iterate.cold(outcome.iterate.w, on.program.g.numel())
        if outcome.status.stopped or not found[-1].ok:
            cause, text = outcome.cause, f"ocp '{on.problem.name}': {outcome.sentence}"
            found.append(replace(found[-1], status=outcome.status, message=text, cause=cause))
            break
        if solved and eps <= last:
            break
        factor = factor if solved else sqrt(factor)
        eps = max(reached / factor, last)
    if found[-1].ok and reached > max(MOST, last):
        text = f"ocp '{on.problem.name}': No solve with eps below {reached:.1g} succeeded; give "
        text += "another guess, more intervals, or Ipopt()."
        found.append(replace(found[-1], status=Status.NO_STEP, message=text))
    return reached, replace(found[-1], statistics=reduce(SolverStatistics.then, statistics))
