"""Nonlinear program for a solver, its bounds and stages, and the result of the solver."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, final

import casadi as ca
import numpy as np

from ocp.formulation.phase import Box, limits
from ocp.formulation.problem import Problem
from ocp.transcription.blocks import Array, Indices, Piece
from ocp.transcription.unknowns import Grid, Layout, scale_of
from symfric.foundation.parameters import Variable
from symfric.foundation.status import Status


class Place(NamedTuple):
    """Name and place of a row or an unknown of the program.

    Attributes:
        name: name such as "the equation of v" or "force".
        span: index of the phase.
        fraction: position in the phase, between 0 and 1; NaN for the whole phase.
        scale: SI value divided by the value in the program.
    """

    name: str
    span: int
    fraction: float
    scale: float = 1.0


class Stages(NamedTuple):
    """Stages of the program for structured solvers: x_k and u_k, with the rows of the gap first.

    Attributes:
        nx, nu: numbers of states and of other unknowns of each stage, in the order of w; the last
            nu is 0.
        ng: numbers of rows of each stage without its gap x_(k+1) = F(x_k, u_k), in the order of g.
    """

    nx: tuple[int, ...]
    nu: tuple[int, ...]
    ng: tuple[int, ...]


@final
@dataclass(frozen=True, eq=False)
class Program:
    """Nonlinear program with exact sparse derivatives; all values are scaled.

        min f(w, p)   subject to   lower_w <= w <= upper_w,   lower_g <= g(w, p) <= upper_g

    Attributes:
        w, p: unknowns and parameters, MX.
        f, g: cost and rows, MX.
        gradient: (x, p) -> (f, grad_f_x).
        jacobian: (x, p) -> (g, jac_g_x).
        hessian: (x, p, lam_f, lam_g) -> triu_hess_gamma_x_x.
        values: values of p.
        scale: SI values of the unknowns divided by w.
        places: function that returns name and place of each row, and of each unknown.
        structure: function that returns the stages, or None and the reason why there are none.
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
    scale: Array
    places: Callable[[], tuple[Sequence[Place], Sequence[Place]]] = lambda: ((), ())
    structure: Callable[[], tuple[Stages | None, str]] = lambda: (None, "no known structure")

    @property
    def rows(self) -> Sequence[Place]:
        """Name and place of each row."""
        return self.places()[0]

    @property
    def unknowns(self) -> Sequence[Place]:
        """Name and place of each unknown."""
        return self.places()[1]

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of all unknowns, followed by those of all rows."""
        lower, upper = (self.lower_w, self.lower_g), (self.upper_w, self.upper_g)
        return np.concatenate(lower), np.concatenate(upper)

    @property
    def nlp(self) -> dict[str, ca.MX]:
        """Arguments of the program for `casadi.nlpsol`."""
        return {"x": self.w, "p": self.p, "f": self.f, "g": self.g}

    @property
    def derivatives(self) -> dict[str, ca.Function]:
        """Options of `casadi.nlpsol` with the derivatives."""
        return {"grad_f": self.gradient, "jac_g": self.jacobian, "hess_lag": self.hessian}


def bounds_of(problem: Problem, grid: Grid) -> tuple[Array, Array]:
    """Return the scaled lower and upper bounds of w.

    If the last collocation point is the end of its interval, only the copy at the node is bounded,
    because bounds on both would be dependent.
    """
    layout, scale = grid.layout, scale_of(problem, grid.layout)
    d = grid.scheme.degree
    sides: list[Array] = []
    for side, meet in enumerate((np.maximum, np.minimum)):
        bound = np.full(layout.size, (-np.inf, np.inf)[side])
        pairs = zip(problem.spans, layout.spans, grid.nodes, grid.released, strict=True)
        for span, own, nodes, released in pairs:
            model, N = span.model, own.intervals

            def of(group: Sequence[Variable], boxes: Mapping[str, Box], side: int = side) -> Array:
                return np.array([boxes[v.name][side] for v in group], dtype=float)

            x, u = of(model.x, span.boxes), np.tile(of(model.u, span.boxes)[:, None], (1, N))
            inner = own.inner.reshape(x.size, N, d)
            bound[own.nodes] = x[:, None]
            bound[inner[:, :, : d - 1 if grid.scheme.meets_end else d]] = x[:, None, None]
            bound[own.z] = of(model.z, span.boxes)[:, None]
            bound[own.slacks(len(span.sides) * (d > 0))] = (0.0, np.inf)[side]
            for fraction, column in ((0.0, 0), (1.0, -1)):
                u[:, column] = meet(u[:, column], of(model.u, span.inputs_at[fraction]))
            bound[own.u] = meet(u, bound[own.u])  # shared inputs may be bounded in each scenario
            for fraction, node in nodes.items():
                bound[own.nodes[:, node]] = of(model.x, span.nodes[fraction])
                for i, box in released.get(fraction, {}).items():
                    bound[own.nodes[i, node]] = box[side]
            if own.T >= 0:
                bound[own.T] = limits(span.T)[side]
        bound[layout.chosen] = [(c.lower, c.upper)[side] for c in problem.chosen]
        sides.append(bound / scale)
    return sides[0], sides[1]


def stages_of(
    problem: Problem, layout: Layout, pieces: Sequence[Piece], jacobian: ca.Function
) -> tuple[Stages | None, str]:
    """Return the stages and "", or None and the coupling that prevents them.

    `jacobian` is that of the program.
    """
    if len(problem.scenario_names) > 1:
        return None, "several scenarios"
    if problem.chosen:
        return None, f"the chosen parameter {problem.chosen[0].name}"
    if any(span.T >= 0 for span in layout.spans):
        return None, "a free duration"
    first = np.concatenate([span.nodes[0] for span in layout.spans])
    nx = np.concatenate([np.full(s.nodes.shape[1], s.nodes.shape[0]) for s in layout.spans])
    stage_of = np.searchsorted(first, np.arange(layout.size), side="right") - 1
    owner, gap = _owners(layout, pieces)
    K = nx.size - 1
    gaps = np.bincount(owner[gap], minlength=K + 1)
    if (gaps[:-1] != nx[1:]).any() or gaps[-1]:
        return None, "states that restart after a phase"
    triplet = jacobian.sparsity_out(1).get_triplet()
    rows, columns = (np.array(part, np.int64) for part in triplet)
    place = columns - first[np.minimum(owner[rows] + 1, K)]
    number = np.arange(owner.size) - np.searchsorted(owner, owner)
    own = stage_of[columns] == owner[rows]
    identity = gap[rows] & (stage_of[columns] == owner[rows] + 1) & (place == number[rows])
    wrong = rows[~own & ~identity]
    if wrong.size:
        names = (
            name
            for piece in pieces
            for name, numbers in zip(piece.names, piece.at, strict=True)
            if wrong[0] in numbers
        )
        return None, f"{next(names)}, which depends on more than its interval"
    sizes = np.diff(np.append(first, layout.size))
    ng = np.bincount(owner[~gap], minlength=K + 1)
    return Stages(*(tuple(part.tolist()) for part in (nx, sizes - nx, ng))), ""


def _owners(
    layout: Layout, pieces: Sequence[Piece]
) -> tuple[Indices, np.ndarray[tuple[int], np.dtype[np.bool_]]]:
    """Return the stage of each row, and a mask of rows of the gap to the next stage."""
    begins = np.cumsum([0, *(span.intervals + 1 for span in layout.spans)])
    m = sum(piece.at.size for piece in pieces)
    owner, gap = np.zeros(m, np.int64), np.zeros(m, dtype=bool)
    for piece in pieces:
        span, interval = piece.order >> 40, (piece.order >> 6) & ((1 << 34) - 1)
        stage = begins[np.minimum(span, len(layout.spans))] + interval
        known = stage < begins[-1]  # rows between all phases come after them
        owner[piece.at] = np.where(known, stage, begins[-1] - 1)
        gap[piece.at] = known & ((piece.order & 63) == 0)
    return owner, gap


@final
@dataclass(frozen=True, eq=False)
class Iterate:
    """Scaled unknowns and multipliers, from which a solver can restart."""

    w: Array
    lam_w: Array
    lam_g: Array

    @property
    def multipliers(self) -> Array:
        """Multipliers of all unknowns, followed by those of all rows."""
        return np.concatenate([self.lam_w, self.lam_g])

    @staticmethod
    def cold(w: Array, rows: int) -> "Iterate":
        """Return an iterate with zero multipliers for `w` and for a number of rows."""
        return Iterate(w, np.zeros(w.size), np.zeros(rows))


@final
@dataclass(frozen=True)
class SolverStatistics:
    """Size and effort of one solve, or total effort of several solves.

    Attributes:
        unknowns, constraints: size of the nonlinear program of the last solve.
        jacobian_nonzeros, hessian_nonzeros: numbers of nonzeros of the Jacobian of the constraints
            and of one triangle of the Hessian of the Lagrangian.
        iterations: number of iterations of the solver in all solves.
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
        """Return the sizes of `later`, with the sums of counts and times of both."""
        summed = ("iterations", "solves", "build_time", "solve_time", "verify_time")
        return replace(
            later, **{name: getattr(self, name) + getattr(later, name) for name in summed}
        )


class Outcome(NamedTuple):
    """Result of a solver, which may have failed.

    Attributes:
        iterate: the solution, or the best iterate: the feasible one of least cost, or the one of
            least violation if none is feasible.
        cost: J of the iterate.
        violation: largest violation of a row or a bound, scaled.
        status: status of the solve; `sentence` describes it with the worst row and a remedy.
        cycles: True if the last iterations were cyclic.
        statistics: size, iterations and times.
        cause: exception in `progress` that stopped the solver, if any.
    """

    iterate: Iterate
    cost: float
    violation: float
    status: Status
    sentence: str
    cycles: bool
    statistics: SolverStatistics
    cause: BaseException | None = None


def outside(values: Array, lower: Array, upper: Array) -> Array:
    """Return the distance of each value from its bounds; infinity if it is not finite."""
    far = np.maximum(0.0, np.maximum(lower - values, values - upper))
    return np.where(np.isfinite(values), far, np.inf)


def worst_of(program: Program, w: Array, g: Array) -> float:
    """Return the largest violation of a row or of a bound of an unknown."""
    return float(outside(np.concatenate([w, g]), *program.bounds).max(initial=0.0))


def cost_weight(problem: Problem, largest: Sequence[int], lam_g: Array, number: int) -> float:
    """Return the weight of the cost of a phase in J; for "worst", the multiplier of its bound.

    Args:
        problem: the problem.
        largest: indices of the rows that bound the costs of scenarios.
        lam_g: multipliers of all rows.
        number: index of the phase.
    """
    phases = len(problem.chain)
    if problem.kind == "worst":
        return float(lam_g[largest[number // phases]])
    return phases / len(problem.spans) if problem.kind == "mean" else 1.0
