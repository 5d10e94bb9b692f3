"""A panel for each law, the generic model behind the others."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from symfric.foundation.panels import WIDE, grid
from symfric.foundation.style import DASHES, EDGE, QUIET
from symfric.gallery.looks import look
from symfric.laws import AnyLaw, law_name

Array = NDArray[np.float64]
Loops = Mapping[str, tuple[Array, Array]]
"""Case -> abscissa and ordinate."""

CASES = (DASHES[0], DASHES[1], DASHES[3])
"""Full, dashed and dotted, as in the paper."""
FIRST = "generic model"


def law_grid(
    laws: Mapping[str, AnyLaw],
    loops: Mapping[str, Loops],
    labels: tuple[str, str],
    behind: Sequence[int] = (0, 1),
) -> Figure:
    """Two rows of four panels: a colour a law, a line style a case.

    The panels of a row share their ordinate; the one that is left has the key. In the rows `behind`
    the first case of the generic model is grey behind the others.
    """
    figure, axes = grid(2, 4, WIDE, 4.6, sharex=True, sharey="row")
    panels = [*axes[0], *axes[1]]
    for axis, (name, law) in zip(panels, laws.items(), strict=False):
        row = 0 if axis in axes[0] else 1
        if name != FIRST and row in behind:
            axis.plot(*next(iter(loops[FIRST].values())), color=QUIET, linewidth=1.0)
        for dash, (x, y) in zip(CASES, loops[name].values(), strict=False):
            axis.plot(x, y, color=look(law_name(law))["color"], linestyle=dash, linewidth=1.2)
        axis.set_title(name, fontsize="medium")
        axis.locator_params(axis="x", nbins=4)
        if axis not in axes[0] or axis is axes[0][-1]:  # nothing stands below these
            axis.tick_params(labelbottom=True)
            axis.set_xlabel(labels[0])
    for row in axes:
        row[0].set_ylabel(labels[1])
    key(panels[-1], [*loops[FIRST]])
    return figure


def key(axis: Axes, cases: Sequence[str]) -> None:
    """What the line styles mean, in a panel of its own."""
    axis.set_axis_off()
    handles = [
        Line2D([], [], color=EDGE, ls=dash, linewidth=1.2, label=case)
        for dash, case in zip(CASES, cases, strict=False)
    ]
    grey = f"{FIRST}, {cases[0]}"
    handles.append(Line2D([], [], color=QUIET, linewidth=1.0, label=grey))
    axis.legend(handles=handles, loc="center", fontsize="small", frameon=False)
