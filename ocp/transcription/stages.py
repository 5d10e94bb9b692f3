"""Stages of a program: unknowns that only know their own interval and the next node.

    x_(k+1) = F_k(x_k, u_k),   rows_k(x_k, u_k)   in stage k = 0 ... K

A stage is a node with all unknowns of the interval behind it; phases follow each other. Rows stand
in this order already, the gap first.
"""

import numpy as np

from ocp.formulation.problem import Problem
from ocp.transcription.assembly import Assembled
from ocp.transcription.blocks import Array, Indices, Piece
from ocp.transcription.points import Layout
from ocp.transcription.program import Stages


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
