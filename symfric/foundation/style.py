"""Styles of curves: colours for colour-blind readers, and line styles for print in grey.

The colours differ by at least 25 CIELAB units with normal vision, protanopia, deuteranopia and
tritanopia, and have a contrast of at least 3 to white paper; a test simulates this. The line style
changes with the colour, so that curves also differ in grey.

This module does not change the settings of Matplotlib: `symfric.foundation.panels` sets the colours
of its axes, and `axis.plot(x, y, **line(k))` draws curves that must be distinguishable.
"""

from typing import Literal, TypedDict

COLOURS = (
    "#0033b0",  # blue
    "#f26400",  # orange
    "#007a45",  # green
    "#b45fab",  # orchid
    "#1f1f1f",  # black
    "#900808",  # dark red
    "#7184ff",  # periwinkle
)
"""Colours of curves, in this order."""

Dash = Literal["-"] | tuple[float, tuple[float, ...]]
DASHES: tuple[Dash, ...] = ("-", (0, (5, 1.6)), (0, (6, 1.5, 1.2, 1.5)), (0, (1.3, 1.3)))
"""Line styles: solid, dashed, dash-dotted and dotted; lengths are in line widths."""

MARKERS = "osD^vPX"
"""Markers of measured points, in this order."""

QUIET = "0.6"
"""Colour of data behind a model curve."""

EDGE = "#1f1f1f"
"""Colour of outlines and other elements that are not curves."""


class Line(TypedDict):
    """Style keywords of `Axes.plot`."""

    color: str
    linestyle: Dash


def colour(k: int) -> str:
    """Return colour number `k`, from 0, repeating cyclically."""
    return COLOURS[k % len(COLOURS)]


def dash(k: int) -> Dash:
    """Return line style number `k`, from 0, repeating cyclically."""
    return DASHES[k % len(DASHES)]


def line(k: int, style: int | None = None) -> Line:
    """Return colour and line style of curve number `k`, from 0; the first 28 are different.

    `style` is the number of the line style if it is independent of the colour.
    """
    return {"color": colour(k), "linestyle": dash(k if style is None else style)}


CYCLE = tuple(line(k) for k in range(len(COLOURS) * len(DASHES)))
"""Styles of all distinguishable curves."""
