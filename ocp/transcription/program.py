"""The nonlinear program that a solver gets."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import final

import casadi as ca
import numpy as np

from ocp.formulation.problem import Problem
from ocp.transcription.assembly import Assembled
from ocp.transcription.blocks import Array, Indices, Piece
from ocp.transcription.unknowns import Layout


@final
@dataclass(frozen=True)
class Place:
    """What a row or an unknown of the program is about.

    Attributes:
        name: "the equation of v", "force".
        span: number of the span.
        fraction: where in the span, between 0 and 1; nan for what belongs to all of it.
        scale: SI value divided by the value in the program.
    """

    name: str
    span: int
    fraction: float
    scale: float = 1.0


@final
class Places(Sequence[Place]):
    """Places of all rows or unknowns, made only when somebody asks."""

    def __init__(
        self, count: int, make: Callable[[], tuple[Sequence[str], Indices, Indices, Array, Array]]
    ) -> None:
        """`make` returns names, and of each place number of the name, span, fraction, scale."""
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
    """Stages of the program, as structured solvers take them: x_k with u_k, rows of its gap first.

    Attributes:
        nx, nu: states and further unknowns of each stage, in the order of w; the last nu is 0.
        ng: rows of each stage besides its gap x_(k+1) = F(x_k, u_k), in the order of g.
        equality: which rows of g are equations, shape (m,).
    """

    nx: tuple[int, ...]
    nu: tuple[int, ...]
    ng: tuple[int, ...]
    equality: tuple[bool, ...]


def no_structure() -> tuple[Stages | None, str]:
    """Of a program that nobody has looked at."""
    return None, "no known structure"


@final
@dataclass(frozen=True, eq=False)
class Program:
    """A nonlinear program with exact sparse derivatives; everything scaled.

        min f(w, p)   subject to   lower_w <= w <= upper_w,   lower_g <= g(w, p) <= upper_g

    Attributes:
        w, p: MX unknowns and parameters.
        f, g: MX cost and rows.
        gradient: (x, p) -> (f, grad_f_x).
        jacobian: (x, p) -> (g, jac_g_x).
        hessian: (x, p, lam_f, lam_g) -> triu_hess_gamma_x_x.
        values: numbers of p.
        rows, unknowns: what each row and each unknown is about.
        scale: SI values of the unknowns divided by w.
        structure: looks for stages when somebody asks.
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
        """Structure for solvers that use it; None where there is none, see `unstaged`."""
        return self.structure()[0]

    @property
    def unstaged(self) -> str:
        """Why there are no stages."""
        return self.structure()[1]

    @property
    def nlp(self) -> dict[str, ca.MX]:
        """The program as `casadi.nlpsol` takes it."""
        return {"x": self.w, "p": self.p, "f": self.f, "g": self.g}

    @property
    def derivatives(self) -> dict[str, ca.Function]:
        """Options of `casadi.nlpsol` that hand the derivatives over."""
        return {"grad_f": self.gradient, "jac_g": self.jacobian, "hess_lag": self.hessian}


def stages_of(
    problem: Problem,
    layout: Layout,
    pieces: tuple[Piece, ...],
    made: Assembled,
    equality: Array,
) -> tuple[Stages | None, str]:
    """The stages, or None and what couples more than neighbours.

    Args:
        equality: which rows are equations, shape (m,).
    """
    common = _common(problem, layout)
    if common:
        return None, common
    first, nx, stage_of = _columns(layout)
    owner, gap = _rows(layout, pieces, made)
    K = nx.size - 1
    gaps = np.bincount(owner[gap], minlength=K + 1)
    if (gaps[:-1] != nx[1:]).any() or gaps[-1]:
        return None, "states that start anew behind a phase"
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
    """What all of the motion has in common, if there is such a thing."""
    if len(problem.scenarios) > 1:
        return "several scenarios"
    if problem.chosen:
        return f"the chosen parameter {problem.chosen[0].name}"
    if any(span.T >= 0 for span in layout.spans):
        return "a free duration"
    return ""


def _columns(layout: Layout) -> tuple[Indices, Indices, Indices]:
    """First column and number of states of each stage, and the stage of each column."""
    first = np.concatenate([span.nodes[0] for span in layout.spans])
    nx = np.concatenate([np.full(s.nodes.shape[1], s.nodes.shape[0]) for s in layout.spans])
    stage_of = np.searchsorted(first, np.arange(layout.size), side="right") - 1
    return first, nx, stage_of


def _rows(
    layout: Layout, pieces: tuple[Piece, ...], made: Assembled
) -> tuple[Indices, np.ndarray[tuple[int], np.dtype[np.bool_]]]:
    """Stage of each row, and whether it closes the gap to the next one."""
    begins = np.cumsum([0, *(span.intervals + 1 for span in layout.spans)])
    m = made.g.numel()
    owner, gap = np.zeros(m, np.int64), np.zeros(m, dtype=bool)
    for piece, at in zip(pieces, made.at, strict=True):
        span, interval = piece.order >> 40, (piece.order >> 6) & ((1 << 34) - 1)
        stage = begins[np.minimum(span, len(layout.spans))] + interval
        known = stage < begins[-1]  # what holds between all spans stands behind them
        owner[at] = np.where(known, stage, begins[-1] - 1)
        gap[at] = known & ((piece.order & 63) == 0)
    return owner, gap


def _named(pieces: tuple[Piece, ...], made: Assembled, row: int) -> str:
    """What a row is called."""
    for piece, at in zip(pieces, made.at, strict=True):
        for name, numbers in zip(piece.names, at, strict=True):
            if row in numbers:
                return f"{name}, which knows more than its interval"
    return "a row that knows more than its interval"
