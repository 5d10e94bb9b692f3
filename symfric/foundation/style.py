"""How curves look: colours that the colour-blind tell apart, and line styles for print in grey.

The colours keep at least 25 CIELAB units between any two of them, as seen by normal eyes and with
protanopia, deuteranopia and tritanopia, and a contrast of at least 3 against white paper; a test
simulates it. The line style changes with the colour, so that curves differ in grey, too.

Nothing here changes the settings of Matplotlib: `symfric.foundation.panels` hands the colours to
the axes it makes, and whoever draws curves to be told apart says `axis.plot(x, y, **line(k))`.
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
"""Solid, dashed, dash-dotted, dotted; lengths in line widths."""

MARKERS = "osD^vPX"
"""Markers of measured points, in this order."""

QUIET = "0.6"
"""Colour of data that stand behind a model."""

EDGE = "#1f1f1f"
"""Colour of outlines, and of what is no curve."""


class Line(TypedDict):
    """Keywords of `Axes.plot`."""

    color: str
    linestyle: Dash


def colour(k: int) -> str:
    """Colour number `k`, from 0; they come round again."""
    return COLOURS[k % len(COLOURS)]


def dash(k: int) -> Dash:
    """Line style number `k`, from 0; they come round again."""
    return DASHES[k % len(DASHES)]


def line(k: int, style: int | None = None) -> Line:
    """Colour and line style of curve number `k`, from 0; the first 28 are all different.

    With `style`, the line style has a number of its own, as where runs differ by it.
    """
    return {"color": colour(k), "linestyle": dash(k if style is None else style)}


CYCLE = tuple(line(k) for k in range(len(COLOURS) * len(DASHES)))
"""As many curves as differ, in colour or in line style."""
