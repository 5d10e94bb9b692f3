"""One problem on finer and finer meshes, until all intervals are right."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ocp.checking.arcs import arcs_of
from ocp.checking.local_errors import local_errors
from ocp.result.solution import Solution
from ocp.solvers.outcome import Report, in_stage
from ocp.solving.clock import Clock
from ocp.solving.one_solve import Solver, solve_on
from ocp.solving.starts import Start
from ocp.text.problem import Problem
from ocp.transcription.grid import split
from ocp.transcription.schemes import Scheme
from ocp.transcription.transcribe import discretise
from ocp.transcription.transcription import Transcription

Array = NDArray[np.float64]
PASSES = 8
MOST = 2000


def refined_solve(
    problem: Problem,
    scheme: Scheme,
    solver: Solver,
    meshes: Sequence[Array],
    guess: Start,
    clock: Clock,
    progress: Report | None,
    *,
    tolerance: float,
    refine: bool,
) -> Solution:
    """Solve, and solve again on finer meshes, until local errors are a tenth of `tolerance`."""
    made = discretise(problem, scheme)

    def on(meshes: Sequence[Array], guess: Start, number: int) -> tuple[Solution, Transcription]:
        transcription = made.on(meshes)
        prepared = clock.within(solver.prepared(transcription.program))
        stage = in_stage(progress, f"mesh {number}")
        return solve_on(transcription, prepared, guess, stage), transcription

    found, transcription = on(meshes, guess, 1)
    for number in range(2, PASSES + 1):
        if not (refine and found.ok):
            break
        errors = local_errors(arcs_of(problem, transcription.meshes, found.points))
        finer = _finer(problem, transcription.meshes, errors, 0.1 * tolerance)
        if finer is None:
            break
        new, transcription = on(finer, found, number)
        total = found.statistics.then(new.statistics)
        if not new.ok:
            return replace(found, statistics=total)
        found = replace(new, statistics=total)
    return found


def _finer(
    problem: Problem, meshes: Sequence[Array], errors: Sequence[Array], allowed: float
) -> list[Array] | None:
    phases = len(problem.chain)
    if max(float(e.max()) for e in errors) <= allowed or sum(m.size for m in meshes) > MOST:
        return None
    made: list[Array] = []
    for number, mesh in enumerate(meshes):
        same = range(number % phases, len(meshes), phases)
        error = np.max([np.where(np.isfinite(errors[k]), errors[k], 1.0) for k in same], axis=0)
        parts = np.clip(np.ceil((error / allowed) ** (1 / 3)), 2, 4).astype(int)
        made.append(split(mesh, np.where(error > allowed, parts, 1).tolist()))
    return made
