"""One solve: a problem on meshes, a solver and a start make a solution, as it is.

Nothing is refined, sharpened or verified here; `ocp.solve` does these by calling this.
"""

from dataclasses import replace
from time import perf_counter

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ocp.formulation.problem import Problem
from ocp.result.motion import Motion, motion_of
from ocp.result.solution import Solution
from ocp.solvers.methods import Fatrop, Ipopt, Sqp
from ocp.solvers.outcome import Outcome, Report
from ocp.solvers.prepared import Prepared
from ocp.solving.kinks import narrow_widths
from ocp.solving.starts import Start, start_of
from ocp.transcription.grid import make_meshes
from ocp.transcription.program import Place
from ocp.transcription.schemes import Radau, Scheme
from ocp.transcription.transcribe import discretise
from ocp.transcription.transcription import Transcription
from ocp.transcription.unknowns import Points
from symfric.foundation.status import Status

Array = NDArray[np.float64]

Solver = Ipopt | Fatrop | Sqp


def solve_once(
    problem: Problem,
    intervals: int | ArrayLike = 50,
    scheme: Scheme | None = None,
    solver: Solver | None = None,
    guess: Start = None,
    progress: Report | None = None,
) -> Solution:
    """Solve `problem` on one mesh; a solve that fails is a solution whose status says so.

    Args:
        problem: what to solve.
        intervals: number of equal intervals of each phase, fractions of T, or one of these for
            each phase.
        scheme: `Radau(3)` if none.
        solver: `Ipopt()` if none.
        guess: see `ocp.solving.starts`.
        progress: called with a `Progress` after each iteration.

    Raises:
        ValueError: bad input.
    """
    begin = perf_counter()
    scheme = Radau() if scheme is None else scheme
    transcription = discretise(problem, scheme).on(make_meshes(problem, intervals))
    prepared = (Ipopt() if solver is None else solver).prepared(transcription.program)
    written = perf_counter() - begin
    solution = solve_on(transcription, prepared, guess, progress)
    statistics = solution.statistics
    return replace(
        solution, statistics=replace(statistics, build_time=statistics.build_time + written)
    )


def solve_on(
    transcription: Transcription,
    prepared: Prepared,
    guess: Start = None,
    progress: Report | None = None,
    values: ArrayLike | None = None,
    warm: bool | None = None,
) -> Solution:
    """Solve a program that is there already, which may be done many times.

    Args:
        transcription: the problem on meshes.
        prepared: a solver that holds `transcription.program`, or that of another transcription by
            the same `Discretisation` on as many intervals.
        guess, progress: as in `solve_once`.
        values: numbers of the parameters, `transcription.values(...)`; its own if none.
        warm: use the multipliers of the guess; None does where it has some that fit.
    """
    start, fits = start_of(transcription, guess)
    numbers = transcription.program.values if values is None else values
    outcome = prepared.run(
        start,
        numbers,
        progress,
        fits if warm is None else warm and fits,
        lambda w, place: when(transcription, w, place),
    )
    return solution_of(transcription, outcome)


def solution_of(transcription: Transcription, outcome: Outcome) -> Solution:
    """The outcome of a solver by name."""
    problem = transcription.problem
    points = transcription.unpack(outcome.iterate.w)
    return Solution(
        problem=problem,
        status=outcome.status,
        message=_message(transcription, outcome, points),
        cost=outcome.cost,
        motions=motions_of(transcription, points),
        chosen=dict(points.chosen),
        statistics=outcome.statistics,
        scheme=transcription.scheme,
        meshes=transcription.meshes,
        points=points,
        iterate=outcome.iterate,
        cause=outcome.cause,
    )


def _message(transcription: Transcription, outcome: Outcome, points: Points) -> str:
    """The sentence of the solver, and the friction that may have stopped it."""
    said = f"ocp '{transcription.problem.name}': {outcome.sentence}"
    stuck = outcome.status in (Status.MAX_ITERATIONS, Status.NO_STEP) or outcome.cycles
    kinks = narrow_widths(transcription, points) if stuck and not outcome.status.ok else ""
    return f"{said} {kinks}".rstrip()


def motions_of(transcription: Transcription, points: Points) -> tuple[Motion, ...]:
    """What moves, for each scenario."""
    problem, phases = transcription.problem, len(transcription.problem.chain)
    names = problem.scenario_names or ("",)
    scheme = transcription.scheme.coefficients()
    found: list[Motion] = []
    for k, name in enumerate(names):
        part = slice(k * phases, (k + 1) * phases)
        spans = [(number, problem.spans[number]) for number in range(part.start, part.stop)]
        meshes = transcription.meshes[part]
        found.append(motion_of(name, spans, points.spans[part], meshes, scheme, points.chosen))
    return tuple(found)


def when(transcription: Transcription, w: Array, place: Place) -> str:
    """The time of a place, in words; its phase and scenario where there are several."""
    problem = transcription.problem
    span, phases = problem.spans[place.span], len(problem.chain)
    words: list[str] = []
    if np.isfinite(place.fraction):
        durations = [part.T for part in transcription.unpack(w).spans]
        begin = sum(durations[place.span - span.phase : place.span])
        words.append(f"at t = {begin + place.fraction * durations[place.span]:.4g} s")
    if phases > 1:
        words.append(f"in {span.name}")
    if problem.scenario_names:
        words.append(f"of scenario {problem.scenario_names[span.scenario]}")
    return " ".join(words)
