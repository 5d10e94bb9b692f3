"""Where a function of time, an input or a model's own, changes its pace: no pulse is leapt over.

While a machine rests, steps grow until they are longer than a pulse that is still to come, and no
stage falls on it. The function is known, however, and cheap: it is looked at on a grid, and the
span cut in halves until each piece is straight. Where pieces become much shorter or much longer
from one to the next, a step has to end. An input of one pace throughout, a sine, has no such times.
"""

from functools import lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.integrator.compiled.columns import Columns

Array = NDArray[np.float64]
DEPTH = 13
"""The grid has 2^13 intervals; what is shorter than one of them may stay unseen."""

STRAIGHT = 1e-3
"""How far a straight piece may be off, relative to the range of the function."""

LEVELS = 3
"""Halvings between neighbours that are a change of pace: error control sees to less."""


QUICKEST = 1.0
"""Percent of the span that set the pace of a function: more than what a few jumps take."""


def onsets(function: str, t_start: float, t_end: float) -> tuple[float, ...]:
    """Times [s] inside the span at which a function of time, a serialised SX, changes its pace."""
    level = _looked(function, t_start, t_end)
    if level is None:
        return ()
    grid = np.linspace(t_start, t_end, 2**DEPTH + 1)
    return tuple(grid[changes(level)].tolist())


def pace(function: str, t_start: float, t_end: float) -> float:
    """Length [s] of the straight pieces of a function of time where it is quickest.

    A fiftieth to a hundredth of the period of a sine; inf for a straight line.
    """
    level = _looked(function, t_start, t_end)
    halvings = 0.0 if level is None else float(np.percentile(level, 100 - QUICKEST, method="lower"))
    return (t_end - t_start) / 2.0**halvings if halvings else np.inf


@lru_cache(64)
def _looked(function: str, t_start: float, t_end: float) -> NDArray[np.intp] | None:
    """`levels` of a function of time on the grid; None for a constant."""
    expression = ca.SX.deserialize(function)
    time = ca.symvar(expression)
    if not time:
        return None
    grid = np.linspace(t_start, t_end, 2**DEPTH + 1)
    look = Columns(ca.Function("input", time, [ca.densify(expression)]))
    (values,) = look([grid[:, None]])
    return levels(np.nan_to_num(values[:, 0]))


def levels(values: Array) -> NDArray[np.intp]:
    """How often each interval of a grid of 2^k + 1 values is halved until its piece is straight."""
    cells = values.size - 1
    depth = cells.bit_length() - 1
    allowed = STRAIGHT * np.ptp(values)
    found = np.full(cells, depth)
    for level in range(depth - 1, -1, -1):
        width = cells >> level
        ends = values[::width]
        line = ends[:-1, None] + np.diff(ends)[:, None] * (np.arange(width) / width)
        straight = (np.abs(values[:-1].reshape(-1, width) - line) <= allowed).all(axis=1)
        found.reshape(-1, width)[straight] = level
    return found


def changes(level: NDArray[np.intp]) -> NDArray[np.intp]:
    """Grid points at which the level has changed by `LEVELS` since the last such point."""
    found: list[int] = []
    last = level[0]
    for i in np.flatnonzero(np.diff(level)) + 1:
        if abs(level[i] - last) >= LEVELS:
            found.append(int(i))
            last = level[i]
    return np.array(found, dtype=np.intp)
