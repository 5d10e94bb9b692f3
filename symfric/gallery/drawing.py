"""What the pictures of the gallery share: how references and sweeps look, where legends stand."""

from collections.abc import Mapping
from typing import Any

from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from symfric.foundation.style import QUIET

REFERENCE: Mapping[str, Any] = {"color": QUIET, "linewidth": 3.2, "solid_capstyle": "butt"}
"""Keywords of a curve that the others are compared with: wide and grey, behind them."""


def shade(part: float) -> Any:
    """Colour of a parameter, from its first value (0, violet) to its last (1, light green)."""
    return colormaps["viridis"](0.9 * part)


def legend_below(figure: Figure, axis: Axes, ncols: int = 3) -> None:
    """The legend of one panel, under all panels."""
    entries = axis.get_legend_handles_labels()
    figure.legend(*entries, loc="outside lower center", ncols=ncols, frameon=False)
