"""Inputs and results of a nonlinear solver."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from ocp.transcription.program import Program
from symfric.foundation.status import Status

Array = NDArray[np.float64]


@final
@dataclass(frozen=True)
class Progress:
    """The optimisation after an iteration.

    Attributes:
        iteration: how many so far in this solve.
        cost: J at this iterate.
        violation: largest violation of an equation, a constraint or a bound, scaled.
        stage: which of several solves this is, such as "widths 0.1"; empty for a single one.
    """

    iteration: int
    cost: float
    violation: float
    stage: str = ""


Report = Callable[[Progress], object]


def in_stage(progress: Report | None, stage: str) -> Report | None:
    """`progress` with the name of one of several solves."""
    if progress is None:
        return None
    return lambda now: progress(replace(now, stage=stage))


@final
@dataclass(frozen=True, eq=False)
class Iterate:
    """Unknowns and multipliers, scaled: all it takes to start again from here."""

    w: Array
    lam_w: Array
    lam_g: Array

    @staticmethod
    def cold(w: Array, rows: int) -> "Iterate":
        """`w` with zero multipliers for it and for so many rows."""
        return Iterate(w, np.zeros(w.size), np.zeros(rows))


@final
@dataclass(frozen=True)
class SolverStatistics:
    """Effort of one optimisation, or of several in a row.

    Attributes:
        unknowns, constraints: size of the nonlinear program, the last one of several.
        jacobian_nonzeros, hessian_nonzeros: of the constraints; of the Lagrangian (one triangle).
        iterations: of the solver, all solves together.
        solves: their number.
        build_time, solve_time: wall time [s] for making the program and its derivatives, and for
            solving it.
        verify_time: wall time [s] of the re-simulation.
    """

    unknowns: int
    constraints: int
    jacobian_nonzeros: int
    hessian_nonzeros: int
    iterations: int
    build_time: float
    solve_time: float
    verify_time: float = 0.0
    solves: int = 1

    def then(self, later: "SolverStatistics") -> "SolverStatistics":
        """Both in a row: the sizes of the later one, counts and times of both."""
        return replace(
            later,
            iterations=self.iterations + later.iterations,
            solves=self.solves + later.solves,
            build_time=self.build_time + later.build_time,
            solve_time=self.solve_time + later.solve_time,
            verify_time=self.verify_time + later.verify_time,
        )


@final
@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of a solver; a failed solve is an outcome, too.

    Attributes:
        iterate: the solution, or the best point seen: among feasible ones that of least cost, else
            that of least violation.
        cost: J there.
        violations: of each row of g there, scaled.
        bound_violations: of each unknown, likewise.
        status: how it ended; `sentence` says it with the worst row and what to try; `answer` is the
            solver's own word for it.
        cycles: whether the last iterations went round without getting anywhere.
        statistics: size, iterations, times.
        cause: the exception in `progress` that stopped it, if any.
    """

    iterate: Iterate
    cost: float
    violations: Array
    bound_violations: Array
    status: Status
    sentence: str
    answer: str
    cycles: bool
    statistics: SolverStatistics
    cause: BaseException | None = None

    @property
    def violation(self) -> float:
        """The largest of all violations, scaled."""
        worst = max(self.violations.max(initial=0.0), self.bound_violations.max(initial=0.0))
        return float(worst)


def outside(values: Array, lower: Array, upper: Array) -> Array:
    """Distance of each value from its bounds; infinity for one that is not finite."""
    far = np.maximum(0.0, np.maximum(lower - values, values - upper))
    return np.where(np.isfinite(values), far, np.inf)


def worst_of(program: Program, w: Array, g: Array) -> float:
    """Largest violation of a row or of a bound of an unknown."""
    rows = outside(g, program.lower_g, program.upper_g).max(initial=0.0)
    return float(max(rows, outside(w, program.lower_w, program.upper_w).max(initial=0.0)))
