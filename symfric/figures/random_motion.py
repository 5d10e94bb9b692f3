"""The same motions for a population of random contacts, which advances by steps."""

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, sqrt
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symfric.figures.data import Array
from symfric.foundation import checks
from symfric.integrator import Linear
from symfric.integrator.equations.inputs import Input
from symfric.laws import Population

REST = 1e6
"""How long the contacts have rested before a motion [s], so that all of them are old."""


def slid(
    law: Population, N: float, velocity: Callable[[ca.SX, ca.SX], ca.SX], times: Array, pace: float
) -> dict[str, Array]:
    """Columns t, x, v, F at `times` [s] of rested contacts slid with `velocity(t, pace)`."""
    t, p = ca.SX.sym("t"), ca.SX.sym("pace")
    function = ca.Function("v", [t, p], [velocity(t, p)])
    end = float(times[-1])
    coarse = np.linspace(0.0, end, 2001)
    fastest = np.abs(function(coarse, pace).full()).max()
    grid = np.linspace(0.0, end, max(2001, ceil(2 * fastest * end / law.step)))
    middle = (grid[1:] + grid[:-1]) / 2
    way = function(middle, pace).full().ravel() * np.diff(grid)
    x = np.concatenate([[0.0], np.cumsum(way)])
    return {
        "t": times,
        "x": np.interp(times, grid, x),
        "v": function(times, pace).full().ravel(),
        "F": np.interp(times, grid, law.force([-REST, *grid], [0.0, *x], N)[1:]),
    }


@final
@dataclass(frozen=True, eq=False)
class Steps:
    """The steps of a pushed block: their ends [s], and at each the signals."""

    step_times: Array
    columns: dict[str, Array]

    def at(self, t: ArrayLike) -> dict[str, Array]:
        """The signals at the times `t` [s], linear between the steps."""
        times = np.atleast_1d(np.asarray(t, float))
        return {n: np.interp(times, self.step_times, column) for n, column in self.columns.items()}


def shoved(
    law: Population,
    N: float,
    mass: float,
    force: Input,
    t_end: float,
    until: float | None,
    way: float = 0.0,
) -> Steps:
    """A block of `mass` [kg] on random contacts pushed with `force` [N], by explicit steps.

    A step is a fifth of the inverse frequency of the block on its unloaded contacts: velocity
    first, then position, which holds the energy of an elastic contact.
    """
    h = 0.2 * sqrt(mass / law.stiffness)
    t = np.arange(0.0, t_end + h, h)
    load = _signal(force, t)
    contacts, held = law.advance(law.begin(), 0.0, REST, N)
    x = v = 0.0
    rows = np.zeros((t.size, 3))
    for i in range(t.size):
        rows[i] = x, v, held
        if until is not None and v > until and x >= way:
            t, rows, load = t[: i + 1], rows[: i + 1], load[: i + 1]
            break
        v += h / mass * (load[i] - held)
        x += h * v
        contacts, held = law.advance(contacts, h * v, h, N)
    columns = {"x": rows[:, 0], "v": rows[:, 1], "friction": rows[:, 2], "force": load}
    return Steps(t, columns)


def _signal(force: Input, t: Array) -> Array:
    """The driving force [N] at the times `t` [s]."""
    if isinstance(force, Linear):
        return np.interp(t, np.asarray(force.t), np.asarray(force.values))
    if callable(force):
        symbol = ca.SX.sym("t")
        return ca.Function("F_e", [symbol], [force(symbol)])(t).full().ravel()
    return np.full(t.shape, checks.number("figure: force", force))
