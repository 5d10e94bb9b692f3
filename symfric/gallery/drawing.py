"""Looks of laws, references and sweeps in all pictures of the gallery; legends below panels."""

from collections.abc import Mapping
from typing import Any

from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from symfric.foundation.parameters import check_names
from symfric.foundation.style import QUIET, Line, line

REFERENCE: Mapping[str, Any] = {"color": QUIET, "linewidth": 3.2, "solid_capstyle": "butt"}
"""Keywords of a curve that the others are compared with: wide and grey, behind them."""


def shade(part: float) -> Any:
    """Colour of a parameter, from its first value (0, violet) to its last (1, light green)."""
    return colormaps["viridis"](0.9 * part)


def legend_below(figure: Figure, axis: Axes, ncols: int = 3) -> None:
    """The legend of one panel, under all panels."""
    entries = axis.get_legend_handles_labels()
    figure.legend(*entries, loc="outside lower center", ncols=ncols, frameon=False)


LOOKS = {
    "lugre": 0, "dahl": 1, "elasto_plastic": 2, "gonthier": 3, "generic_asperity": 4,
    "exact_coulomb": 4, "leuven": 5, "maxwell_slip": 6, "bengisu_akay": 7, "karnopp": 8,
    "velocity_based": 9, "stick_slip": 10, "threlfall": 11, "brown_mcphee": 12, "awrejcewicz": 13,
    "bliman_sorine": 15, "self_tuning": 16, "gms": 24, "quarter_car_general": 0,
    "quarter_car_simple": 1, "viscous": 5, "steady_state_lugre": 0,
}  # fmt: skip
"""Name in the catalogue -> number in `style.CYCLE`; laws that never meet may share one."""


def look(law: str) -> Line:
    """Colour and line style of a law by its name, as keywords of `Axes.plot`."""
    check_names("gallery", [law], LOOKS)
    return line(LOOKS[law])
