"""Passages of events and breaks between the steps of a run, and the links made from them.

After every step of a run with jumps, from the derivatives Z_i of its start, its end and each row of
its dense output, and T of the time of its start,

    F = sum_i share_i Z_i + fall T,      X = by_state F + by_data d'

where X holds those of the start of the next step and of its time. Without a jump F is Z of the end,
and X is the same; an event cuts the step, and F is the dense output there at a fixed time.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.derivatives.functions import derivatives
from symfric.integrator.derivatives.path import Break, Jump, Path
from symfric.integrator.derivatives.saltation import GRAZING, Passage, at_start, passage

Array = NDArray[np.float64]


def passages(path: Path) -> list[Passage]:
    """Return the passage of every event of a run.

    Raises:
        ValueError: as `passage`.
    """
    usual = [jump for jump in path.jumps if _is_usual(path, jump)]
    found = dict(zip(map(id, usual), _crossed(path, usual), strict=True)) if usual else {}
    return [found.get(id(jump)) or passage(path, jump) for jump in path.jumps]


def at_breaks(path: Path, breaks: Sequence[Break]) -> list[Passage]:
    """Return the passages of new input data; states stay, algebraic unknowns follow."""
    n, m, k = path.integrator.system.n, len(breaks), np.array([mark.step for mark in breaks])
    y, d = path.dense.y0[k], path.steps[2][k]
    moved = np.zeros((m, n + 1, n + d.shape[1]))
    moved[:, range(n), range(n)] = 1.0
    _follow(path, moved, y, d)
    by_state = np.concatenate([moved[:, :, :n], np.zeros((m, n + 1, 1))], axis=2)
    return [Passage(by_state[i], moved[i, :, n:]) for i in range(m)]


def _is_usual(path: Path, jump: Jump) -> bool:
    """Return True if a single event cut a step, away from breaks and without constraints."""
    if len(jump.which) > 1 or not jump.size or path.integrator.system.manifold is not None:
        return False
    breaks, k = path.inputs.breaks, path.place(jump)
    return min(jump.t - breaks[k], breaks[k + 1] - jump.t) > path.tolerance or breaks.size == 2


def _crossed(path: Path, jumps: Sequence[Jump]) -> list[Passage | None]:
    """Return passages of events that cut a step; None for one that seems to only touch zero."""
    made, dense = derivatives(path.integrator), path.dense
    n, m, place = made.system.n, len(jumps), np.arange(len(jumps))
    t, k = np.array([jump.t for jump in jumps]), np.array([jump.step - 1 for jump in jumps])
    before, after = (np.array(y) for y in zip(*((j.before, j.after) for j in jumps), strict=True))
    which, d = np.array([jump.which[0] for jump in jumps]), path.steps[2][k]
    back = 2 * np.maximum(path.tolerance, np.spacing(np.abs(t)))
    theta = np.maximum(1 - back / (dense.t1[k] - dense.t0[k]), 0.0)
    matrix, right = made.many(made.rates, [dense.piece(k, theta), d], path.backend)
    # CasADi stores column by column
    matrix = matrix.reshape(m, n, n).transpose(0, 2, 1)
    rate = right if made.system.is_ode else np.linalg.solve(matrix, right[:, :, None])[:, :, 0]

    slopes = made.many(made.of_events, [t, before, d], path.backend)
    by_t, by_y, by_d = (a.reshape(m, -1, len(path.integrator.model.events)) for a in slopes)
    by_t, by_y, by_d = by_t[place, 0, which], by_y[place, :, which], by_d[place, :, which]
    speed = (by_y * rate).sum(axis=1) + by_t
    terms = (np.abs(by_y) * np.abs(rate)).sum(axis=1) + np.abs(by_t)
    (began,) = made.many(made.events, [dense.t0[k], dense.y0[k], d], path.backend)
    mean = np.abs(began[place, which]) / (t - dense.t0[k])
    crosses = np.abs(speed) > np.maximum(GRAZING**2 * terms, GRAZING * mean)

    delay = -np.hstack([by_y, by_d]) / np.where(crosses, speed, 1.0)[:, None]
    moved = np.hstack([rate, np.ones((m, 1))])[:, :, None] * delay[:, None, :]
    moved[:, range(n), range(n)] += 1.0
    reset, more = _resets(path, [t, before, d], which)
    moved = reset @ moved
    moved[:, :, n:] += more
    _follow(path, moved, after, d)
    by_state = np.concatenate([moved[:, :, :n], np.zeros((m, n + 1, 1))], axis=2)
    return [Passage(by_state[i], moved[i, :, n:]) if crosses[i] else None for i in range(m)]


def _resets(path: Path, at: list[Array], which: NDArray[np.intp]) -> tuple[Array, Array]:
    """Return derivatives of y after the resets of one event each, by y and time there, and by d."""
    made, m, n = derivatives(path.integrator), which.size, path.integrator.system.n
    by_state, by_data = np.tile(np.eye(n + 1), (m, 1, 1)), np.zeros((m, n + 1, at[2].shape[1]))
    crossings = path.integrator.crossings
    resets = () if crossings is None else crossings.resets
    if not resets:
        return by_state, by_data
    slopes = made.many(made.of_resets, at, path.backend)
    by_t, by_y, by_d = (a.reshape(m, -1, len(resets)) for a in slopes)
    for i, (event, state) in enumerate(resets):
        here = which == event
        by_state[here, state, :n], by_state[here, state, n] = by_y[here, :, i], by_t[here, 0, i]
        by_data[here, state] = by_d[here, :, i]
    return by_state, by_data


def _follow(path: Path, moved: Array, found: Array, d: Array) -> None:
    """Update algebraic unknowns in place, at `found`; `moved` is by the state and by d."""
    made = derivatives(path.integrator)
    n, m, free = made.system.n, d.shape[0], made.system.free
    if not free.size:
        return
    slope, more = made.many(made.algebraic, [found, d], path.backend)
    rows = slope.shape[1] // n
    slope = slope.reshape(m, n, rows).transpose(0, 2, 1)
    left = slope @ moved[:, :n]
    left[:, :, n:] += more.reshape(m, -1, rows).transpose(0, 2, 1)
    moved[:, :n] -= free @ np.linalg.solve(slope @ free, left)


@final
@dataclass(frozen=True, eq=False)
class Links:
    """Links of a run; its tables have one row per distinct jump, the first one for no jump.

    Attributes:
        start: passage of the start.
        of: number of the row after each step, shape (steps,).
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
    """Return the links of a run.

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
