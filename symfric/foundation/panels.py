"""Empty figures and panels with a light grid, atomic saving, and figures for print.

Figures are created without `matplotlib.pyplot`: they are garbage-collected, a notebook shows a
figure only where a cell returns it, and programs without a screen need no configuration.
`figure.show()` opens a window.
"""

from pathlib import Path
from typing import Any, Literal, final

import matplotlib as mpl
from cycler import cycler
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import FigureManagerBase
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text

from symfric.foundation import checks
from symfric.foundation.files import written
from symfric.foundation.shown import png
from symfric.foundation.style import COLOURS

Shared = bool | Literal["none", "all", "row", "col"]
NARROW, WIDE = 5.0, 7.0
"""Widths of figures [inch]."""


@final
class Picture(Figure):
    """Figure that is not registered with pyplot; a notebook shows it where a cell returns it."""

    def _repr_png_(self) -> bytes:  # pyright: ignore[reportUnusedFunction]  (notebooks call it)
        """Return the PNG for a notebook."""
        return png(self, dpi=100)

    def show(self, warn: bool = True) -> None:
        """Open a window and wait until it is closed, like `matplotlib.pyplot.show`.

        Args:
            warn: ignored; it exists for compatibility with Matplotlib.

        Raises:
            ValueError: the Matplotlib backend has no windows, as on a machine without a screen.
        """
        import matplotlib.pyplot as plt  # noqa: PLC0415  (only needed for windows)

        if not self.has_window():
            raise ValueError(
                "show: expected a Matplotlib backend with windows, got "
                f"'{plt.get_backend().lower()}'; pass path= to plot(), or choose a backend, "
                "such as MPLBACKEND=TkAgg; in a notebook the figure shows itself as the last "
                "line of a cell"
            )
        plt.show()

    def has_window(self) -> bool:
        """Create a window for the figure, and return False if the backend has no windows."""
        import matplotlib.pyplot as plt  # noqa: PLC0415  (only needed for windows)

        if self.canvas.manager is None:
            empty = plt.figure(figsize=tuple(self.get_size_inches()))
            manager = empty.canvas.manager
            if manager is None or type(manager) is FigureManagerBase:
                plt.close(empty)
                return False
            self.set_canvas(manager.canvas)
            manager.canvas.figure = self
        return True


def blank(width: float = WIDE, height: float = 4.0, *, free: bool = False) -> Figure:
    """Return an empty figure [inch], with constrained layout unless `free`."""
    return Picture(figsize=(width, height), layout=None if free else "constrained")


def grid(
    rows: int,
    columns: int,
    width: float = WIDE,
    height: float = 4.0,
    *,
    sharex: Shared = False,
    sharey: Shared = False,
    **more: Any,
) -> tuple[Figure, list[list[Axes]]]:
    """Return a figure of `width` and `height` [inch] and its panels with a light grid, by row.

    Further arguments are passed to `Figure.subplots`.
    """
    figure = blank(width, height)
    axes = figure.subplots(rows, columns, sharex=sharex, sharey=sharey, squeeze=False, **more)
    return figure, [[dressed(axis) for axis in row] for row in axes]


def panels(
    count: int, width: float = WIDE, height: float = 1.9, shared: bool = True
) -> tuple[Figure, list[Axes]]:
    """Return a figure and a column of `count` panels with a light grid; `height` is per panel.

    `shared` is True for a common abscissa.
    """
    figure, axes = grid(count, 1, width, 0.7 + height * count, sharex=shared)
    return figure, [axis for (axis,) in axes]


def dressed(axis: Axes) -> Axes:
    """Set a light grid and colours for colour-blind readers, and return the panel."""
    axis.set_prop_cycle(cycler(color=COLOURS))
    axis.set_axisbelow(True)
    axis.grid(alpha=0.3)
    return axis


def legend_below(figure: Figure, axis: Axes, ncols: int = 3, **look: Any) -> None:
    """Draw the legend of one panel below all panels; `look` are arguments of `Figure.legend`."""
    entries = axis.get_legend_handles_labels()
    figure.legend(*entries, loc="outside lower center", ncols=ncols, **{"frameon": False} | look)


def save(figure: Figure, path: str | Path | None, dpi: float = 150) -> Figure:
    """Write `figure` to `path` unless it is None, and return the figure."""
    if path is not None:
        known = sorted(figure.canvas.get_supported_filetypes())
        place = checks.path("picture", path)
        ending = place.suffix.removeprefix(".").lower() or "none"
        checks.check_names(f"picture '{path}': ending", [ending], known)
        with written(place) as temporary:
            figure.savefig(temporary, dpi=dpi)
    return figure


MILLIMETRE = 1 / 25.4
DOTS = 300
"""Resolution of pixel images [dots per inch]."""
FONTS: dict[Any, Any] = {"pdf.fonttype": 42, "ps.fonttype": 42}
"""TrueType in PDF and PS; journals reject Type 3 fonts, the default of Matplotlib."""


def for_print(
    figure: Figure,
    path: str | Path | None = None,
    *,
    width: float = 85.0,
    height: float | None = None,
    text: float = 8.0,
) -> Figure:
    """Resize a figure of symfric, such as `run.plot()`, to the width of a printed column.

    Texts keep their relative sizes, and legends outside the panels have as many columns as fit. The
    figure is changed in place and returned.

    Args:
        figure: figure returned by `plot()` of a run, a fit, an optimal motion or a comparison.
        path: output file; its suffix (.pdf, .svg, .eps, .png) selects the format.
        width: width [mm]; most journals have columns of 85 mm and pages of 175 mm.
        height: height [mm]; None keeps the proportions.
        text: font size of the axis labels [pt]; other texts are scaled by the same factor.

    Raises:
        ValueError: `figure` is not a figure, a size is not positive, or the suffix is unknown.
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
    """Scale all texts of the figure so that axis labels have the size `text` [pt]."""
    first = next(iter(figure.axes), None)
    ratio = text / (float(mpl.rcParams["font.size"]) if first is None else _size(first.yaxis.label))
    texts = {id(one): one for one in _texts(figure)}
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            kept = (axis.label, axis.offsetText)
            ticks = [one for one in _texts(axis) if one not in kept]
            for one in ticks:
                texts.pop(id(one), None)
            if ticks:  # set on the axis, because Matplotlib recreates ticks
                axis.set_tick_params(which="both", labelsize=_size(ticks[0]) * ratio)
    for one in texts.values():
        one.set_fontsize(_size(one) * ratio)


def _texts(artist: Artist) -> list[Text]:
    found: list[Any] = artist.findobj(Text)
    return found


def _size(text: Text) -> float:
    return float(text.get_fontsize())


def _fit(figure: Figure, legend: Legend) -> None:
    """Arrange a legend outside the panels in as many columns as the figure width allows."""
    side = getattr(legend, "_outside_loc", None)  # Matplotlib has no public attribute for the place
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
