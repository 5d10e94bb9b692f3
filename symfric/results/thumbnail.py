"""A small picture of a run for notebooks: some signals over time."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from symfric.foundation.style import COLOURS
from symfric.foundation.units import clock
from symfric.model.kinds import CONSTRAINTS, FRICTION
from symfric.results.kinds import kinds

if TYPE_CHECKING:
    from symfric.results.trajectory import Trajectory

Array = NDArray[np.float64]
PANELS, POINTS = 3, 1500
"""Signals, and times of each."""


def picture(run: "Trajectory") -> Figure:
    """Some signals over time, small: the first position, its rate and the first friction force."""
    names, (by_t, unit_t) = _main(run), clock(run.span)
    figure = Figure(figsize=(5.2, 0.5 + 1.05 * len(names)), layout="constrained")
    axes = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for axis, name in zip(axes, names, strict=True):
        t, values = _thinned(run.t, run[name])
        axis.plot(by_t * t, values, linewidth=1.0, color=COLOURS[0])
        axis.set_ylabel(f"{name} [{run.units[name]}]", fontsize=7)
        axis.tick_params(labelsize=7)
        axis.grid(alpha=0.3)
    axes[-1].set_xlabel(f"t [{unit_t}]", fontsize=7)
    figure.align_ylabels(list(axes))
    return figure


def _main(run: "Trajectory") -> list[str]:
    """The signals of the small picture."""
    found, kind = list(run.units), kinds(run.model)
    states = [v.name for v in run.model.x][:2]
    rubs = [n for n in found if kind.get(n) == FRICTION or n == "friction"][:1]
    rest = [n for n in found if n not in (*states, *rubs) and kind.get(n) != CONSTRAINTS]
    return [*states, *rubs, *rest][:PANELS]


def _thinned(t: Array, values: Array) -> tuple[Array, Array]:
    """Few points that keep the least and greatest value of every stretch."""
    size = -(-t.size // POINTS)
    if size < 3:
        return t, values
    count = t.size // size
    rows = values[: count * size].reshape(count, size)
    starts = size * np.arange(count)
    kept = np.unique(np.r_[starts + rows.argmin(1), starts + rows.argmax(1), t.size - 1])
    return t[kept], values[kept]
