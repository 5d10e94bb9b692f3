"""Solve an optimal control problem, directly or by homotopy in the width of friction; verify it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, get_args

from numpy.typing import ArrayLike

from ocp.formulation.problem import Problem, cost_size, sized
from ocp.formulation.validate import doubts
from ocp.solving.methods import Fatrop, Ipopt, Sqp
from ocp.solving.one_solve import Solver
from ocp.solving.prepared import Clock
from ocp.solving.solution import Solution
from ocp.solving.starts import STARTS, Start
from ocp.transcription.program import Report
from ocp.transcription.schemes import Legendre, Radau, Scheme, Shooting, make_meshes
from symfric.foundation import checks
from symfric.foundation.status import SolveError

if TYPE_CHECKING:
    from ocp.strategies import Friction

OVER = "obj_scaling_factor"
"""Option of Ipopt: what it multiplies the cost by."""


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
    starts: int = STARTS,
    resting_margin: float = 1e-4,
    progress: Report | None = None,
    max_time: float | None = None,
    throw: bool = True,
) -> Solution:
    """Solve `problem`, and simulate its models under the control that was found.

    "Solved" only says that a discretised problem is. What the models do under the control, at the
    ends, on the way and between the nodes, says the verification, which decides: a solution that
    misses is none.

    Where a contact holds at rest, one direct solve of the problem ends in the next of many
    local optima and misses. `friction` says what is done:

        "auto"     "modes" where the layer of the law is narrower than a hundredth of the speeds;
                   else "sharpen" down to the law itself. Without contacts that hold, "smooth".
        "modes"    layers from wide to narrow, then the modes of each contact, slip and stick, with
                   the instants between them (`ocp.friction.mode_optimisation`): for exact Coulomb
                   friction with stiction, whatever smooths it. `solution.modes` lists them. A law
                   with states (LuGre, GMS) is replaced by its steady sliding and its static level,
                   and the result verified with the law itself. If it misses, `Shooting` with
                   exponential steps goes on from there with the law itself where it can; the
                   message says so. `scheme=Shooting(...)` with "auto" always does.
        "sharpen"  layers from wide to narrow, down to those of the law, or as far as it gets.
        "smooth"   the models as they are, states of laws included.

    Where modes are not found, the motion with the narrowest layers that were reached is verified
    and returned; its message says how wide they are and what was not done.

    Args:
        problem: what to solve.
        scheme: `Radau(3)` if none; or `Legendre(d)`, `Shooting(method, steps)`.
        intervals: their number for each phase, fractions of T, or a list of these; 50 if none.
            Where layers narrow, as many even ones in all; 60 if none. Refinement changes them.
        solver: `Ipopt()` if none; or `Fatrop()`, `Sqp()`.
        guess: values by name (see `ocp.solving.starts`), a solution, or one that was saved. With
            friction, further starts are made around it.
        friction: see above.
        tolerance: of the verification, relative to the largest magnitude of each state.
        refine: make the mesh finer where intervals err or where it costs to hold the inputs over
            them; with False it stays, where no friction is sharpened.
        verify: simulate the models under the control.
        starts: with friction, number of coarse solves of which the best goes on.
        resting_margin: share of its static level that a contact at rest keeps from it, where modes
            are found: a smooth law creeps just below that level. The search begins with 0.01 and
            ends with this, if the motion is still right then; where a rest is at that margin the
            message says what it costs.
        progress: called with a `Progress` after each iteration. Ctrl-C, or an exception raised
            here, stops the solver.
        max_time: wall time [s] for all; what was found by then is returned.
        throw: raise `SolveError` on failure; with False the solution is returned as it is.

    Raises:
        ValueError: bad input.
        SolveError: not solved, stopped, or not verified; its `partial` is the best solution there
            is, with its statistics and verification.

    Limits: a local optimum. With friction it is the best of a few starts.
    """
    from ocp.checking.mesh_refinement import Goals  # noqa: PLC0415  (slow to load)
    from ocp.strategies import (  # noqa: PLC0415  (slow to load)
        Direct,
        Friction,
        ModeSearch,
        Verifier,
        solved,
    )

    checks.kind("solve", problem, Problem, "a problem, such as Problem(Phase(model, T=1.0), cost)")
    tolerance = checks.number("solve: tolerance", tolerance, above=0.0)
    for name, flag in (("refine", refine), ("verify", verify), ("throw", throw)):
        checks.flag(f"solve: {name}", flag)
    starts = checks.count("solve: starts", starts)
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
        make_meshes(problem, intervals)  # refuses what is no mesh, whatever the way
    posed = sized(problem)
    if posed is not problem and isinstance(solver, Ipopt) and OVER not in solver.options:
        solver = solver.with_options(**{OVER: 1.0 / cost_size(posed)})
    goals = Goals.of(tolerance) if refine else replace(Goals.of(tolerance), passes=1)
    direct = Direct(posed, scheme, solver, intervals, goals, Clock(max_time), progress)
    search = ModeSearch(direct, Verifier(tolerance, verify), resting_margin)
    solution = solved(search, friction, guess, starts)
    odd = "" if solution.ok else doubts(problem)
    if odd:
        solution = replace(solution, message=f"{solution.message} {odd}")
    if throw and not solution.ok:
        raise SolveError(solution.message, solution.status, solution) from solution.cause
    return solution
