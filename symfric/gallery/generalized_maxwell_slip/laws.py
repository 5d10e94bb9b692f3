"""The laws of the paper with the numbers of its table 1, under a load of 1 N.

The generic model is `GenericAsperity`, a reconstruction from words. One number, the speed at which
contacts live as long as they take to age, is fitted to the Stribeck curve of table 1; the period of
the counterface makes a lag of the size of C in table 1 (figure 2); its stiffness is free and chosen
so that the paths of figures 4 and 5 reach break-away. `ELEMENTS` were found from its hysteresis by
`identification.fit_elements`, which figure 5 repeats. The model of Bliman and Sorine, which is
named in section 5.1 alone, has no numbers at all.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from symfric import (
    GMS,
    Dahl,
    ElastoPlastic,
    Element,
    GenericAsperity,
    Leuven,
    LuGre,
    MaxwellSlip,
    Slider,
)
from symfric.figures import Scales
from symfric.foundation.panels import WIDE, grid
from symfric.foundation.style import DASHES, EDGE, QUIET
from symfric.gallery.drawing import look
from symfric.laws import AnyLaw, law_name
from symfric.scenes import Prescribed

F_S, F_C, V_S, DELTA = 1.05, 0.2, 98e-6, 0.78  # N, N, m/s, 1
SIGMA_0, SIGMA_1, Z_BA = 0.16e6, 0.08, 0.61e-6  # N/m, N s/m, m
DELTA_L, C = 7.0, 24.0  # 1, N/s
ELEMENTS = ((0.52e6, 0.09), (0.73e6, 0.27), (0.66e6, 0.33), (0.41e6, 0.31))
"""Stiffness [N/m] and share of each element; not in the paper."""
LIFE = 75.7e-6
"""Way in contact over the time in which a contact ages [m/s]; not in the paper."""
PERIOD, DUTY = 1e-5, 0.6
"""Period of the counterface [m] and the share of it in contact; not in the paper."""

PATH = tuple(1e-6 * x for x in (0.0, 1.5, 0.2, 1.1, 0.6, 1.1, 0.2, 1.5, 0.0))
"""Turning points of the path of figure 4 [m]: a loop in a loop, up to 1.5 um; our reading."""
SIGNALS = Scales(static=F_S, kinetic=F_C, elastic=F_C, stretch=1.5e-6, velocity=1e-4)
"""Magnitudes from which the figures of `symfric.figures` take their amplitudes."""

_SLIDERS = tuple(Slider(k, alpha * F_S) for k, alpha in ELEMENTS)
_TABLE_1 = Prescribed.presets["lampaert_table_1"].friction["law"]
"""Numbers by law; given elements stay as they are, at F_S already."""


def generic(count: int = 2000) -> GenericAsperity:
    """The generic model of `count` asperities."""
    ages = DUTY * PERIOD / LIFE
    return GenericAsperity(
        k=2.5e6, mu_0=F_C, mu_inf=F_S, tau_c=ages, lam=PERIOD, duty=DUTY, count=count
    )


def laws(count: int = 2000) -> dict[str, AnyLaw]:
    """All laws by the names of the paper, the generic model of `count` asperities in front."""
    table, elements = _TABLE_1.given, tuple(Element(k, alpha) for k, alpha in ELEMENTS)
    return {
        "generic model": generic(count),
        "GMS": table(GMS(elements=elements, form="event")),
        "Leuven": table(Leuven(elements=_SLIDERS, mu_s=F_S, mu_d=F_C, sigma_1=SIGMA_1, n=200.0)),
        "LuGre": table(LuGre()),
        "elasto-plastic": table(ElastoPlastic()),
        "Maxwell slip": MaxwellSlip(elements=_SLIDERS, form="event"),
        "Dahl": Dahl(sigma_0=SIGMA_0, mu_d=F_C),
    }


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
    """Legend of the line styles, in a panel of its own."""
    axis.set_axis_off()
    handles = [
        Line2D([], [], color=EDGE, ls=dash, linewidth=1.2, label=case)
        for dash, case in zip(CASES, cases, strict=False)
    ]
    grey = f"{FIRST}, {cases[0]}"
    handles.append(Line2D([], [], color=QUIET, linewidth=1.0, label=grey))
    axis.legend(handles=handles, loc="center", fontsize="small", frameon=False)
