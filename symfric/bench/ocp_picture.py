"""Picture of the optimal control benchmark: how far off against how long."""

from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from symfric.foundation.panels import panels, save
from symfric.foundation.style import colour

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from symfric.bench.ocp import OcpRow

LEAST = 1e-14
"""What is drawn for less."""


def plot_ocp(rows: "Sequence[OcpRow]", path: str | Path | None = None) -> "Figure":
    """Relative miss with exact friction against processor time, a panel for each problem.

    Crosses are motions that also cost more than 0.1 % above the best one known.
    """
    cases = list(dict.fromkeys(row.case for row in rows if row.exact == row.exact))
    figure, axes = panels(len(cases))
    for axis, case in zip(axes, cases, strict=False):
        for row in rows:
            if row.case != case or row.starts == "far" or not isfinite(row.exact):
                continue
            shade = colour(("symfric", "Opti", "rockit").index(row.solver.split()[0]))
            marker = "o" if row.best > 0.5 else "x"
            axis.loglog(row.time_s, max(row.exact, LEAST), marker, color=shade)
            axis.annotate(
                row.solver, (row.time_s, max(row.exact, LEAST)), xytext=(4, 3),
                textcoords="offset points", fontsize="x-small",
            )  # fmt: skip
        axis.margins(x=0.2, y=0.2)
        axis.axhline(1e-4, color="0.7", linewidth=0.8, zorder=0)
        axis.set_ylabel("miss [1]")
        axis.set_title(case.replace("_", " "), fontsize="small")
    axes[-1].set_xlabel("processor time of a call [s]")
    figure.align_ylabels(axes)
    return save(figure, path)
