"""Figures for a printed page: the width of a column, text that can be read there, fonts inside."""

from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text

from symfric.foundation import checks
from symfric.foundation.panels import save

MILLIMETRE = 1 / 25.4
DOTS = 300
"""Of a picture of pixels, an inch."""
FONTS: dict[Any, Any] = {"pdf.fonttype": 42, "ps.fonttype": 42}
"""TrueType in PDF and PS: printers of journals refuse the Type 3 that is Matplotlib's default."""


def for_print(
    figure: Figure,
    path: str | Path | None = None,
    *,
    width: float = 85.0,
    height: float | None = None,
    text: float = 8.0,
) -> Figure:
    """Any figure of symfric in the width of a column, as it is returned by `run.plot()` and others.

    Texts keep their proportions, legends beside the panels take as many columns as there is room
    for. The figure itself is changed.

    Args:
        figure: what `plot()` of a run, a fit, an optimal motion, a comparison returned.
        path: file, its format taken from the ending (.pdf, .svg, .eps, .png).
        width: [mm]; 85 is a column of most journals, 175 a page.
        height: [mm]; None keeps the proportions.
        text: size of the labels of axes [pt]; other texts keep their size beside it.

    Raises:
        ValueError: no figure, sizes that are not positive, an unknown ending.
    """
    figure = checks.kind("for_print", figure, Figure, "a figure, such as run.plot()")
    width = checks.number("for_print: width", width, unit="mm", above=0.0)
    text = checks.number("for_print: text", text, unit="pt", above=0.0)
    was_wide, was_high = figure.get_size_inches()
    if height is None:
        height = width * float(was_high / was_wide)
    height = checks.number("for_print: height", height, unit="mm", above=0.0)
    figure.set_size_inches(width * MILLIMETRE, height * MILLIMETRE)
    _write_at(figure, text)
    for legend in list(figure.legends):
        _fit(figure, legend)
    with mpl.rc_context(FONTS):
        return save(figure, path, DOTS)


def _write_at(figure: Figure, text: float) -> None:
    """Every text of the figure in the size that it has beside one of `text` points."""
    first = next(iter(figure.axes), None)
    ratio = text / (float(mpl.rcParams["font.size"]) if first is None else _size(first.yaxis.label))
    texts = {id(one): one for one in _texts(figure)}
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            kept = (axis.label, axis.offsetText)
            ticks = [one for one in _texts(axis) if one not in kept]
            for one in ticks:
                texts.pop(id(one), None)
            if ticks:  # of the axis, for ticks that come and go
                axis.set_tick_params(which="both", labelsize=_size(ticks[0]) * ratio)
    for one in texts.values():
        one.set_fontsize(_size(one) * ratio)


def _texts(artist: Artist) -> list[Text]:
    found: list[Any] = artist.findobj(Text)
    return found


def _size(text: Text) -> float:
    return float(text.get_fontsize())


def _fit(figure: Figure, legend: Legend) -> None:
    """A legend outside of the panels in as many columns as the width of the figure allows."""
    side = getattr(legend, "_outside_loc", None)  # Matplotlib tells nobody where it put it
    texts = legend.get_texts()
    if side not in ("upper", "lower") or not texts:
        return
    handles, size = legend.legend_handles, texts[0].get_fontsize()
    place: Any = f"outside {side} center"
    labels, framed = [one.get_text() for one in texts], legend.get_frame_on()
    for columns in range(len(labels), 0, -1):
        legend.remove()
        legend = figure.legend(
            handles=[one for one in handles if one is not None], labels=labels, fontsize=size,
            loc=place, frameon=framed, ncols=columns, columnspacing=1.2,
            handlelength=2.4,
        )  # fmt: skip
        figure.draw_without_rendering()
        if legend.get_window_extent().width <= figure.bbox.width:
            return
