"""The eleven laws, in the paper's order and with its names, and what its tables print of them."""

from collections.abc import Mapping
from math import inf
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy import float64
from numpy.typing import NDArray

from symfric import Karnopp, Law
from symfric.choice.jing_mi import PRINTED
from symfric.foundation.panels import grid
from symfric.foundation.style import colour
from symfric.gallery.drawing import REFERENCE
from symfric.gallery.signals import rms

Array = NDArray[float64]

LAWS: dict[str, Law] = {name: row.law() for name, row in PRINTED.items()}
LAWS["Karnopp"] = Karnopp(form="event")
"""With the numbers of the library; a preset gives each those of the paper."""
BEHIND: dict[str, Any] = {**REFERENCE, "linewidth": 2.4}
QUICK = ("Smooth", "Karnopp", "LuGre")
"""Who stands for all at reduced size."""
SLIDING = ("Smooth", "Threlfall", "Dahl")
"""Laws without a static level."""
BRISTLES = ("LuGre", "Elasto-plastic", "Stick-slip", "Gonthier")
"""Laws with a static level and states."""

TABLE_4 = {name: 100 * row.S4 for name, row in PRINTED.items()}
"""Printed S x 100 [m] of the block on the belt."""
TABLE_8 = {name: 100 * row.S8 for name, row in PRINTED.items()}
"""Printed S x 100 [m] of the box."""


def chosen(quick: bool) -> tuple[str, ...]:
    """The laws of a figure."""
    return QUICK if quick else tuple(LAWS)


def small_multiples(
    curves: Mapping[str, tuple[Array, Array]],
    reference: tuple[Array, Array],
    label: str,
    limits: tuple[float, float] = (-inf, inf),
) -> Figure:
    """A panel per law, exact dry friction behind each; the kinds of laws by colour.

    Beside its name is the root mean square distance from exact dry friction.
    """
    unit = label[label.index("[") + 1 : -1]
    rows = -(-(len(curves) + 1) // 3)
    figure, axes = grid(rows, 3, height=0.9 + 1.45 * rows, sharex=True, sharey=True)
    places = [axis for row in axes for axis in row]
    for axis, (name, (t, y)) in zip(places, curves.items(), strict=False):
        axis.plot(*reference, **BEHIND)
        axis.plot(t, y, color=colour(kind(name)), linewidth=1.1)
        axis.set_title(name, fontsize="medium", loc="left", pad=3)
        off = rms(y - reference[1])
        axis.set_title(
            f"rms {off:.2g} {unit}", fontsize="x-small", loc="right", pad=3, color="0.35"
        )
    if limits[0] > -inf:
        places[0].set_ylim(*limits)
    for axis in places[len(curves) :]:
        axis.axis("off")
    for axis in places[len(curves) - 3 : len(curves)]:  # nothing stands below these
        axis.tick_params(labelbottom=True)
    _legend(places[len(curves)])
    figure.supxlabel("time [s]", fontsize="medium")
    figure.supylabel(label, fontsize="medium")
    return figure


def kind(name: str) -> int:
    """0: no static level; 1: static level, no states; 2: static level and states."""
    return 0 if name in SLIDING else 2 if name in BRISTLES else 1


def _legend(axis: Axes) -> None:
    axis.plot([], [], label="exact dry friction", **BEHIND)
    for k, text in enumerate(("no static level", "static level", "static level, states")):
        axis.plot([], [], color=colour(k), label=text)
    axis.legend(loc="center", frameon=False, fontsize="small")
