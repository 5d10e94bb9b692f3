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
from ocp.formulation.phase import Array
from ocp.formulation.problem import Problem
from ocp.formulation.relaxed import EPS
from ocp.solving.methods import Ipopt
from ocp.solving.one_solve import Solved, Solver
from ocp.solving.penalties import largest_product
from ocp.solving.prepared import Supervisor
from ocp.solving.solution import Solution, with_sentence
from ocp.solving.starts import Start, start_of
from ocp.transcription.program import Iterate, SolverStatistics
from ocp.transcription.schemes import Scheme
from ocp.transcription.transcribe import discretise

FIRST, LAST = 1e-1, 1e-8
"""First and last eps; `p` of the problem may give another last one."""
FACTOR, LEAST_FACTOR = 10.0, 1.5
"""Ratio of successive eps, and the ratio below which the sequence stops."""
PASSES = 4
"""Largest number of solves on refined meshes."""
UNREFINED = 1.0
"""Loss of cost by constant inputs, relative to J, for which meshes are refined: its estimate is not
valid where complementary signals change their roles."""
LATER = 1e-3
"""Initial barrier parameter of Ipopt after the first solve."""


def solve_relaxed(
    problem: Problem, meshes: Sequence[Array], scheme: Scheme, solver: Solver, guess: Start,
    goals: Goals, supervisor: Supervisor,
) -> Solution:  # fmt: skip
    """Solve a problem with complementary signals; see `refined_solve` for the arguments.

    The message gives the last eps and the largest product in the solution.
    """
    on, last = discretise(problem, scheme).on(meshes), problem.p.get(EPS, LAST)
    later = solver
    if isinstance(solver, Ipopt):
        later = solver.with_options(**({"mu_init": LATER} | dict(solver.options)))
    first, again = solver.prepared(on.program), later.prepared(on.program)
    start, found = start_of(on, guess)[0], list[tuple[float, Solution]]()
    statistics, eps, factor = list[SolverStatistics](), max(FIRST, last), FACTOR
    while factor > LEAST_FACTOR:
        values, name = on.values({EPS: eps}), f"complementarity {eps:.1g}"
        outcome = supervisor.run(on, again if found else first, start, name, values)
        statistics.append(outcome.statistics)
        solution = Solved(on, outcome).solution
        if outcome.status.ok or not found:
            found.append((eps, solution))
        if outcome.status.ok:
            start = Iterate.cold(outcome.iterate.w, on.program.g.numel())
        if outcome.status.stopped or not found[-1][1].ok or (outcome.status.ok and eps <= last):
            break
        factor = factor if outcome.status.ok else sqrt(factor)
        eps = max(found[-1][0] / factor, last)
    eps, solution = found[-1]
    relaxed = replace(problem, p=dict(problem.p) | {EPS: eps})
    solution = replace(solution, problem=relaxed)
    if solution.ok and not outcome.status.stopped:
        goals = replace(goals, loss=UNREFINED, passes=min(goals.passes, PASSES), patient=False)
        finer = refined_solve(
            relaxed, meshes, scheme, later, solution, goals=goals, supervisor=supervisor
        )
        statistics.append(finer.statistics)
        solution = finer if finer.ok or finer.status.stopped else solution
    product = largest_product(solution.problem, scheme, solution.meshes, solution.points)
    text = f"Complementary signals: eps = {eps:.1g}, largest product {product:.1g}."
    solution = replace(solution, statistics=reduce(SolverStatistics.then, statistics))
    return with_sentence(solution, text)
