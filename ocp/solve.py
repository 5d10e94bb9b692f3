"""Solve a problem and check the result by simulation."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from time import perf_counter

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ocp.collocation import radau
from ocp.guess import Guess, initial_points, resample
from ocp.ipopt import WARM, Iterate, Option, Outcome, Progress, optimise
from ocp.problem import Problem
from ocp.solution import Solution
from ocp.transcribe import Transcription, make_mesh, transcribe
from ocp.verify import verified
from symfric.foundation import checks
from symfric.foundation.status import SolveError, Status

Array = NDArray[np.float64]


def solve(
    problem: Problem,
    *,
    intervals: int | ArrayLike = 50,
    degree: int = 3,
    guess: Mapping[str, Guess] | Solution | None = None,
    options: Mapping[str, Option] | None = None,
    verify: bool = True,
    tolerance: float = 0.01,
    progress: Callable[[Progress], object] | None = None,
    throw: bool = True,
) -> Solution:
    """Solve `problem` by Radau collocation and Ipopt, then simulate the model under the control.

    "Solved" only says that the discretised problem is. Where a body sticks or reverses between
    the nodes of the mesh, the model under that control ends somewhere else, and this is what the
    re-simulation shows.

    Args:
        problem: what to solve.
        intervals: number of equal intervals, or fractions of T from 0 to 1. The inputs are
            constant on each.
        degree: Radau points of an interval; order 2 degree - 1.
        guess: values by name to start from (see `ocp.guess`), or a solution: its multipliers are
            used as well where mesh, degree and model are the same.
        options: of Ipopt, by their own names: {"max_iter": 500, "print_level": 5}.
        verify: re-simulate the control with rtol 1e-9.
        tolerance: largest terminal miss of a state, in multiples of the largest magnitude it
            has on the way (at least its nominal value).
        progress: called with a `Progress` after each iteration. Ctrl-C, or an exception raised
            here, stops the solver.
        throw: raise `SolveError` on failure; with False the solution is returned as it is.

    Raises:
        ValueError: bad input.
        SolveError: not solved, interrupted, or missed the target; its `partial` is the solution
            with the last iterate.

    Limits: a local minimum. Where friction makes the body stick or reverse on the way, one solve
    on an even mesh needs many intervals (1 m out and back in 2 s: 800 for a miss of 1 mm) and may
    settle for a motion that is a third too expensive.
    """
    checks.kind("solve", problem, Problem, "a problem, such as rest_to_rest(...)")
    tolerance = checks.number("solve: tolerance", tolerance, above=0.0)
    for name, value in (("verify", verify), ("throw", throw)):
        checks.flag(f"solve: {name}", value)
    if progress is not None:
        checks.function("solve: progress", progress, "a function of the progress")
    options = checks.named("solve: options", options)
    if odd := [name for name, value in options.items() if not isinstance(value, str | float | int)]:
        raise checks.refused(f"solve: option {odd[0]}", "a number or a text", options[odd[0]])
    begin = perf_counter()
    program = transcribe(problem, make_mesh(problem, intervals), radau(degree))
    start, warm = _start(program, guess)
    written = perf_counter() - begin
    outcome = optimise(
        program,
        start,
        problem.model.values("p", problem.p),
        (WARM if warm else {}) | options,
        progress,
    )
    statistics = replace(outcome.statistics, build_time=written + outcome.statistics.build_time)
    solution = _solution(program, replace(outcome, statistics=statistics))
    if verify and outcome.status.ok:
        solution = verified(solution, tolerance)
    if throw and not solution.ok:
        raise SolveError(solution.message, solution.status, solution)
    return solution


def _start(
    program: Transcription, guess: Mapping[str, Guess] | Solution | None
) -> tuple[Iterate, bool]:
    """The first iterate, and whether it has multipliers."""
    n, m = program.w.numel(), program.g.numel()
    cold = Iterate(np.zeros(n), np.zeros(n), np.zeros(m))
    if not isinstance(guess, Solution):
        return replace(cold, w=program.pack(initial_points(program, guess))), False
    old = guess.iterate
    if np.array_equal(guess.mesh, program.mesh) and (old.w.size, old.lam_g.size) == (n, m):
        return replace(old, w=program.pack(guess.points)), True
    return replace(cold, w=program.pack(resample(program, guess))), False


def _solution(program: Transcription, outcome: Outcome) -> Solution:
    """The last iterate by name."""
    problem, model = program.problem, program.problem.model
    points = program.unpack(outcome.iterate.w)
    T = program.duration(points)
    t = program.fractions * T
    interval = np.arange(t.size) // program.scheme.degree
    held = points.u[:, np.minimum(interval, program.layout.intervals - 1)]
    z = np.column_stack([points.z[:, :1], points.z])
    p = np.tile(model.values("p", problem.p)[:, None], (1, t.size))
    values = model.function("signals").map(t.size)(t[None, :], points.x, z, held, p).full()
    return Solution(
        problem=problem,
        status=outcome.status,
        message=_message(program, outcome, T),
        T=T,
        cost=outcome.cost,
        t=t,
        signals=dict(zip(model.signals, values, strict=True)),
        units=dict(model.signals),
        t_control=program.mesh[:-1] * T,
        controls={v.name: row for v, row in zip(model.u, points.u, strict=True)},
        trajectory=None,
        terminal_miss={},
        statistics=outcome.statistics,
        mesh=program.mesh,
        points=points,
        iterate=outcome.iterate,
    )


def _message(program: Transcription, outcome: Outcome, T: float) -> str:
    said, count = f"ocp '{program.problem.model.name}': ", outcome.statistics.iterations
    if outcome.status is Status.INTERRUPTED:
        said += f"Stopped by the user after {count} iterations; the result is the last iterate."
    else:
        said += outcome.status.value
    if outcome.status.ok or not outcome.violations.any():
        return said
    worst = int(np.argmax(outcome.violations))
    name, fraction = program.constraint_names()[worst]
    return (
        f"{said} (Ipopt after {count} iterations: {outcome.answer}.) Most violated is {name} at "
        f"t = {fraction * T:.4g} s, by {outcome.violations[worst]:.3g} in scaled units."
    )
