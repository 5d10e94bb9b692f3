"""What lies between the steps of a run: which derivatives the next step begins with.

Behind every step of a run with jumps, from the derivatives Z_i of its start, its end and each row
of its dense output, and T of the time of its start,

    F = sum_i share_i Z_i + fall T,      X = by_state F + by_data d'

X holds those of the start of the next step and of its time. Without a jump F is Z of the end, and X
the same; an event cuts the step, and F is the dense output there at a fixed time.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.derivatives.path import Break, Jump, Path
from symfric.integrator.derivatives.saltation import Passage, at_start
from symfric.integrator.derivatives.together import at_breaks, passages

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Links:
    """The links of a run; rows of its tables are all that occur, the first one no jump.

    Attributes:
        start: what is made of the derivatives of the start.
        of: number of the row behind each step, shape (steps,).
        share: shape (rows, 2 + rows of the dense output).
        fall: shape (rows, n).
        by_state: shape (rows, n + 1, n).
        by_data: shape (rows, n + 1, n_d).
        alone: passages of each jump of the run.
    """

    start: Passage
    of: NDArray[np.intp]
    share: Array
    fall: Array
    by_state: Array
    by_data: Array
    alone: list[Passage]


def links(path: Path) -> Links:
    """The links of a run.

    Raises:
        ValueError: a motion without derivative, as `passage`.
    """
    every, breaks = passages(path), path.breaks
    own = {id(jump): one for jump, one in zip(path.jumps, every, strict=True)}
    if breaks:
        own |= {id(mark): one for mark, one in zip(breaks, at_breaks(path, breaks), strict=True)}

    def through(opening: tuple[Jump | Break | None, ...]) -> Passage:
        first, *others = (at_start(path) if mark is None else own[id(mark)] for mark in opening)
        for other in others:
            first = first.then(other)
        return first

    start, *later = (through(piece.opening) for piece in path.pieces)
    n, behind = path.integrator.system.n, np.array([p.steps.start - 1 for p in path.pieces[1:]])
    of = np.zeros(path.dense.t0.size, dtype=np.intp)
    behind = behind.astype(np.intp)
    of[behind] = np.arange(1, behind.size + 1)
    nothing = Passage(np.eye(n + 1), np.zeros((n + 1, path.steps[2].shape[1])))
    tables = [nothing, *later]
    theta = (path.dense.t1 - path.dense.t0)[behind] / path.size[behind]
    fall = np.zeros((len(tables), n))
    fall[1:] = -(1 - theta)[:, None] * path.dense.rates(behind, np.ones(behind.size))
    return Links(
        start,
        of,
        path.shares(np.append(1.0, theta)),
        fall,
        np.array([table.by_state[:, :n] for table in tables]),
        np.array([table.by_data for table in tables]),
        every,
    )
