"""Public entry point of optimal control: `solve` checks its arguments and selects the strategy."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import replace
from typing import TYPE_CHECKING, get_args

import casadi as ca
from numpy.typing import ArrayLike

from ocp.formulation.expressions import kinks
from ocp.formulation.problem import FAR, Problem, cost_size, sized
from ocp.formulation.validate import doubts
from ocp.solving.methods import Fatrop, Ipopt, Sqp
from ocp.solving.one_solve import Solver, Task
from ocp.solving.prepared import Supervisor
from ocp.solving.solution import Solution
from ocp.solving.starts import Start
from ocp.solving.watch import Report
from ocp.transcription.schemes import Legendre, Radau, Scheme, Shooting, make_meshes
from symfric.foundation import checks
from symfric.foundation.status import SolveError

if TYPE_CHECKING:
    from ocp.strategies import Friction


def solve(
    problem: Problem,
    *,
    scheme: Scheme | None = None,
    intervals: int | ArrayLike | Sequence[ArrayLike] | None = None,
    solver: Solver | None = None,
    guess: Start = None,
    friction: Friction = "auto",
    tolerance: float = 1e-3,
    refine: bool = True,
    verify: bool = True,
    starts: int | None = None,
    executor: Executor | None = None,
    resting_margin: float = 1e-4,
    progress: Report | None = None,
    max_time: float | None = None,
    throw: bool = True,
) -> Solution:
    """Solve `problem` and verify the solution by a simulation of its models.

    The solver satisfies a discretised problem. The verification simulates the models under the
    control that was found and checks the conditions at the ends, at the nodes and between them. A
    solution that violates them counts as a failure.

    If a contact sticks during the motion, one direct solve usually ends in a nearby local optimum
    that the simulation does not confirm. `friction` selects the treatment:

        "auto"     "modes" if the layer of the law is narrower than a hundredth of the speeds,
                   otherwise "sharpen" down to the law itself; "smooth" without contacts that stick.
        "modes"    decrease the widths of the layers, then optimise the modes (slip and stick) of
                   each contact and the times between them (`ocp.friction.mode_optimisation`). The
                   result holds for exact Coulomb friction with stiction. `solution.modes` lists
                   the modes. A law with states (LuGre, GMS) is replaced by its steady sliding and
                   its static level, and the result is verified with the law itself. If it misses,
                   `Shooting` with exponential steps continues with the law itself if it supports
                   the model, and the message says so; `scheme=Shooting(...)` with "auto" always
                   takes this step.
        "sharpen"  decrease the widths of the layers to those of the law, or as far as possible.
        "smooth"   solve with the models unchanged, including the states of laws.

    If no modes are found, the motion with the narrowest layers reached is verified and returned.
    Its message gives the widths and the steps that failed.

    Args:
        problem: the problem to solve.
        scheme: `Radau(3)` by default; `Legendre(d)` or `Shooting(method, steps)`.
        intervals: number of intervals of each phase, fractions of T, or a list of these; 50 by
            default. While layers narrow, total number of equal intervals, 60 by default.
        solver: `Ipopt()` by default; `Fatrop()` or `Sqp()`.
        guess: values by name (numbers, samples over the duration, or functions of time), a
            solution of this session or from a file, a run of `simulate` or of a closed loop, each
            of any duration, mesh and law. With friction, further starts are generated around it,
            unless `starts` is None and modes near those of a solution lead to a valid motion.
        friction: see above.
        tolerance: tolerance of the verification, relative to the largest magnitude of each state.
        refine: refine the mesh where local errors are large or where constant inputs increase the
            cost. False keeps the mesh, unless friction is sharpened.
        verify: simulate the models under the control.
        starts: number of solves from starts around the guess, of which the best is continued: with
            friction, coarse ones, 6 by default; otherwise on the first mesh, 1 by default.
        executor: executor of `concurrent.futures` for these solves, such as
            `ProcessPoolExecutor()`; the result is bit-identical. It is not shut down.
        resting_margin: margin between the friction of a contact at rest and its static level, as a
            share of this level, for motions by modes: a smooth law creeps just below the level. The
            search starts at 0.01 and ends at this value, or at a larger one if the law does not
            reach the level or verification requires it. If the margin is active, the message gives
            its cost.
        progress: function called with a `Progress` (cost, violation, motion) after each iteration,
            such as `LivePlot()`; with an executor, also after each start. Ctrl-C, or an exception
            raised in the function, stops the solver.
        max_time: wall time [s] of all solves; the best solution found by then is returned.
        throw: raise `SolveError` on failure; False returns the solution with its status.

    Raises:
        ValueError: bad input.
        SolveError: not solved, stopped, or not verified; `partial` is the best solution found,
            with its statistics and verification.

    Limits: the solution is a local optimum; with friction, the best of a few starts.
    """
    from ocp.checking.mesh_refinement import Goals  # noqa: PLC0415  (slow to load)
    from ocp.strategies import Friction, Search, solved  # noqa: PLC0415  (slow to load)

    checks.kind("solve", problem, Problem, "a problem, such as Problem(Phase(model, T=1.0), cost)")
    tolerance = checks.number("solve: tolerance", tolerance, above=0.0)
    for name, flag in (("refine", refine), ("verify", verify), ("throw", throw)):
        checks.flag(f"solve: {name}", flag)
    starts = None if starts is None else checks.count("solve: starts", starts)
    resting_margin = checks.number("solve: resting_margin", resting_margin, above=0.0, upper=0.1)
    if progress is not None:
        checks.function("solve: progress", progress, "a function of the progress")
    checks.choice("solve: friction", friction, get_args(Friction))
    if max_time is not None:
        max_time = checks.number("solve: max_time", max_time, unit="s", above=0.0)
    scheme = Radau() if scheme is None else scheme
    if not isinstance(scheme, Radau | Legendre | Shooting):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise checks.refused("solve: scheme", "a scheme, such as Radau(3)", scheme)
    solver = Ipopt() if solver is None else solver
    if not isinstance(solver, Ipopt | Fatrop | Sqp):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise checks.refused("solve: solver", "a solver, such as Ipopt()", solver)
    if intervals is not None:
        make_meshes(problem, intervals)  # raises ValueError for invalid meshes of any strategy
    posed = sized(problem)
    size = cost_size(posed)
    if posed is not problem or size < 1.0 / FAR:  # Ipopt itself scales large costs
        solver = solver.with_defaults(obj_scaling_factor=1.0 / size)
    goals = Goals.of(tolerance) if refine else replace(Goals.of(tolerance), passes=1)
    if not isinstance(executor, Executor | None):  # pyright: ignore[reportUnnecessaryIsInstance]
        what = "an executor of concurrent.futures, or None"
        raise checks.refused("solve: executor", what, executor)
    task = Task(posed, scheme, solver, Supervisor(max_time, progress, executor))
    search = Search(task, intervals, goals, tolerance, verify, resting_margin)
    solution = solved(search, friction, guess, starts)
    if not solution.ok:
        costs = dict.fromkeys(kinks(ca.vertcat(span.running, span.end)) for span in posed.spans)
        causes = filter(None, [solution.message, doubts(problem), *costs])
        solution = replace(solution, message=" ".join(causes))
    if throw and not solution.ok:
        raise SolveError(solution.message, solution.status, solution) from solution.cause
    return solution
