"""The nonlinear program for a solver, and the result of the solver."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.problem import Problem
from ocp.transcription.assembly import Assembled
from ocp.transcription.blocks import Array, Indices, Piece
from ocp.transcription.unknowns import Layout
from symfric.foundation.status import Status


@final
@dataclass(frozen=True)
class Place:
    """Name and place of a row or an unknown of the program.

    Attributes:
        name: "the equation of v", "force".
        span: index of the phase.
        fraction: position in the phase, between 0 and 1; nan for the whole phase.
        scale: SI value divided by the value in the program.
    """

    name: str
    span: int
    fraction: float
    scale: float = 1.0


@final
class Places(Sequence[Place]):
    """Places of all rows or unknowns, computed on demand."""

    def __init__(
        self, count: int, make: Callable[[], tuple[Sequence[str], Indices, Indices, Array, Array]]
    ) -> None:
        """Store `make`, which returns names, and index, phase, fraction, scale of each place."""
        self._count, self._make = count, make

    @cached_property
    def _columns(self) -> tuple[Sequence[str], Indices, Indices, Array, Array]:
        return self._make()

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, index: int) -> Place:  # pyright: ignore[reportIncompatibleMethodOverride]
        names, name, span, fraction, scale = self._columns
        return Place(
            names[int(name[index])], int(span[index]), float(fraction[index]), float(scale[index])
        )

    def __iter__(self) -> Iterator[Place]:
        return (self[i] for i in range(self._count))


@final
@dataclass(frozen=True, eq=False)
class Stages:
    """Stages of the program for structured solvers: x_k with u_k, rows of its gap first.

    Attributes:
        nx, nu: states and other unknowns of each stage, in the order of w; the last nu is 0.
        ng: rows of each stage except its gap x_(k+1) = F(x_k, u_k), in the order of g.
        equality: mask of the rows of g that are equations, shape (m,).
    """

    nx: tuple[int, ...]
    nu: tuple[int, ...]
    ng: tuple[int, ...]
    equality: tuple[bool, ...]


def no_structure() -> tuple[Stages | None, str]:
    """Return the structure of a program that was not analysed."""
    return None, "no known structure"


@final
@dataclass(frozen=True, eq=False)
class Program:
    """A nonlinear program with exact sparse derivatives; all values are scaled.

        min f(w, p)   subject to   lower_w <= w <= upper_w,   lower_g <= g(w, p) <= upper_g

    Attributes:
        w, p: MX unknowns and parameters.
        f, g: MX cost and rows.
        gradient: (x, p) -> (f, grad_f_x).
        jacobian: (x, p) -> (g, jac_g_x).
        hessian: (x, p, lam_f, lam_g) -> triu_hess_gamma_x_x.
        values: values of p.
        rows, unknowns: name and place of each row and unknown.
        scale: SI values of the unknowns divided by w.
        structure: function that returns the stages.
    """

    w: ca.MX
    p: ca.MX
    f: ca.MX
    g: ca.MX
    gradient: ca.Function
    jacobian: ca.Function
    hessian: ca.Function
    lower_w: Array
    upper_w: Array
    lower_g: Array
    upper_g: Array
    values: Array
    rows: Sequence[Place]
    unknowns: Sequence[Place]
    scale: Array
    structure: Callable[[], tuple[Stages | None, str]] = no_structure

    @property
    def stages(self) -> Stages | None:
        """Structure for solvers that use it; None if there is none, see `unstaged`."""
        return self.structure()[0]

    @property
    def unstaged(self) -> str:
        """Reason why there are no stages."""
        return self.structure()[1]

    @property
    def nlp(self) -> dict[str, ca.MX]:
        """Arguments of the program for `casadi.nlpsol`."""
        return {"x": self.w, "p": self.p, "f": self.f, "g": self.g}

    @property
    def derivatives(self) -> dict[str, ca.Function]:
        """Options of `casadi.nlpsol` with the derivatives."""
        return {"grad_f": self.gradient, "jac_g": self.jacobian, "hess_lag": self.hessian}


def stages_of(
    problem: Problem,
    layout: Layout,
    pieces: tuple[Piece, ...],
    made: Assembled,
    equality: Array,
) -> tuple[Stages | None, str]:
    """Return the stages, or None and the coupling that prevents them.

    Args:
        equality: mask of the rows that are equations, shape (m,).
    """
    common = _common(problem, layout)
    if common:
        return None, common
    first, nx, stage_of = _columns(layout)
    owner, gap = _rows(layout, pieces, made)
    K = nx.size - 1
    gaps = np.bincount(owner[gap], minlength=K + 1)
    if (gaps[:-1] != nx[1:]).any() or gaps[-1]:
        return None, "states that restart after a phase"
    rows, columns = (
        np.array(part, np.int64) for part in made.jacobian.sparsity_out(1).get_triplet()
    )
    place = columns - first[np.minimum(owner[rows] + 1, K)]
    number = np.arange(owner.size) - np.searchsorted(owner, owner)
    own = stage_of[columns] == owner[rows]
    identity = gap[rows] & (stage_of[columns] == owner[rows] + 1) & (place == number[rows])
    wrong = ~own & ~identity
    if wrong.any():
        return None, _named(pieces, made, int(rows[wrong][0]))
    sizes = np.diff(np.append(first, layout.size))
    ng = np.bincount(owner[~gap], minlength=K + 1)
    return Stages(
        tuple(nx.tolist()),
        tuple((sizes - nx).tolist()),
        tuple(ng.tolist()),
        tuple(np.asarray(equality, dtype=bool).tolist()),
    ), ""


def _common(problem: Problem, layout: Layout) -> str:
    """Return the name of an unknown common to the whole motion, if there is one."""
    if len(problem.scenarios) > 1:
        return "several scenarios"
    if problem.chosen:
        return f"the chosen parameter {problem.chosen[0].name}"
    if any(span.T >= 0 for span in layout.spans):
        return "a free duration"
    return ""


def _columns(layout: Layout) -> tuple[Indices, Indices, Indices]:
    """Return first column and number of states of each stage, and the stage of each column."""
    first = np.concatenate([span.nodes[0] for span in layout.spans])
    nx = np.concatenate([np.full(s.nodes.shape[1], s.nodes.shape[0]) for s in layout.spans])
    stage_of = np.searchsorted(first, np.arange(layout.size), side="right") - 1
    return first, nx, stage_of


def _rows(
    layout: Layout, pieces: tuple[Piece, ...], made: Assembled
) -> tuple[Indices, np.ndarray[tuple[int], np.dtype[np.bool_]]]:
    """Return the stage of each row, and whether it closes the gap to the next one."""
    begins = np.cumsum([0, *(span.intervals + 1 for span in layout.spans)])
    m = made.g.numel()
    owner, gap = np.zeros(m, np.int64), np.zeros(m, dtype=bool)
    for piece, at in zip(pieces, made.at, strict=True):
        span, interval = piece.order >> 40, (piece.order >> 6) & ((1 << 34) - 1)
        stage = begins[np.minimum(span, len(layout.spans))] + interval
        known = stage < begins[-1]  # rows between all phases come after them
        owner[at] = np.where(known, stage, begins[-1] - 1)
        gap[at] = known & ((piece.order & 63) == 0)
    return owner, gap


def _named(pieces: tuple[Piece, ...], made: Assembled, row: int) -> str:
    """Return the name of a row."""
    for piece, at in zip(pieces, made.at, strict=True):
        for name, numbers in zip(piece.names, at, strict=True):
            if row in numbers:
                return f"{name}, which depends on more than its interval"
    return "a row that depends on more than its interval"


Array = NDArray[np.float64]


@final
@dataclass(frozen=True)
class Progress:
    """State of the optimisation after an iteration.

    Attributes:
        iteration: number of iterations in this solve.
        cost: J at this iterate.
        violation: largest violation of an equation, a constraint or a bound, scaled.
        stage: name of one of several solves, such as "widths 0.1"; empty for a single one.
    """

    iteration: int
    cost: float
    violation: float
    stage: str = ""


Report = Callable[[Progress], object]


def in_stage(progress: Report | None, stage: str) -> Report | None:
    """Return `progress` with the name of one of several solves."""
    if progress is None:
        return None
    return lambda now: progress(replace(now, stage=stage))


@final
@dataclass(frozen=True, eq=False)
class Iterate:
    """Unknowns and multipliers, scaled: the data for a restart."""

    w: Array
    lam_w: Array
    lam_g: Array

    @staticmethod
    def cold(w: Array, rows: int) -> "Iterate":
        """Return `w` with zero multipliers for it and for a number of rows."""
        return Iterate(w, np.zeros(w.size), np.zeros(rows))


@final
@dataclass(frozen=True)
class SolverStatistics:
    """Effort of one optimisation, or of several in a row.

    Attributes:
        unknowns, constraints: size of the nonlinear program, the last one of several.
        jacobian_nonzeros, hessian_nonzeros: of the constraints; of the Lagrangian (one triangle).
        iterations: of the solver, all solves together.
        solves: number of solves.
        build_time, solve_time: wall time [s] for building the program and its derivatives, and for
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
        """Return the total: the sizes of the later one, counts and times of both."""
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
    """Result of a solver, also of a failed solve.

    Attributes:
        iterate: the solution, or the best iterate: among feasible ones the one of least cost, else
            of least violation.
        cost: J there.
        violations: of each row of g, scaled.
        bound_violations: of each unknown, scaled.
        status: of the end; `sentence` describes it with the worst row and a remedy; `answer` is the
            solver's return code.
        cycles: whether the last iterations were cyclic.
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
        """Largest of all violations, scaled."""
        worst = max(self.violations.max(initial=0.0), self.bound_violations.max(initial=0.0))
        return float(worst)


def outside(values: Array, lower: Array, upper: Array) -> Array:
    """Return the distance of each value from its bounds; infinity for a non-finite one."""
    far = np.maximum(0.0, np.maximum(lower - values, values - upper))
    return np.where(np.isfinite(values), far, np.inf)


def worst_of(program: Program, w: Array, g: Array) -> float:
    """Return the largest violation of a row or of a bound of an unknown."""
    rows = outside(g, program.lower_g, program.upper_g).max(initial=0.0)
    return float(max(rows, outside(w, program.lower_w, program.upper_w).max(initial=0.0)))
