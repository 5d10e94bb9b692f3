"""Empty panels with a light grid, and figures written whole.

Figures are made without `matplotlib.pyplot`: nothing keeps them once they are forgotten, a notebook
shows the one that a cell returns, once, and a program without a screen needs no setting. Whoever
wants a window says `figure.show()`.
"""

from pathlib import Path
from typing import Any, Literal, final

from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.backend_bases import FigureManagerBase
from matplotlib.figure import Figure

from symfric.foundation import checks
from symfric.foundation.files import written
from symfric.foundation.shown import png
from symfric.foundation.style import COLOURS

Shared = bool | Literal["none", "all", "row", "col"]
NARROW, WIDE = 5.0, 7.0
"""Widths of pictures [inch]."""


@final
class Picture(Figure):
    """A figure that no registry keeps: a notebook shows it where it is returned."""

    def _repr_png_(self) -> bytes:  # pyright: ignore[reportUnusedFunction]  (notebooks call it)
        """What a notebook shows."""
        return png(self, dpi=100)

    def show(self, warn: bool = True) -> None:
        """Open it in a window and wait until that is closed, as `matplotlib.pyplot.show` does.

        Args:
            warn: has no effect; Matplotlib's own figures have it.

        Raises:
            ValueError: Matplotlib has no windows here, as on a machine without a screen.
        """
        import matplotlib.pyplot as plt  # noqa: PLC0415  (only where there shall be a window)

        manager = self.canvas.manager
        if manager is None:
            empty = plt.figure(figsize=tuple(self.get_size_inches()))
            manager = empty.canvas.manager
            if manager is None or type(manager) is FigureManagerBase:
                plt.close(empty)
                raise ValueError(
                    "show: expected a Matplotlib backend with windows, got "
                    f"'{plt.get_backend().lower()}'; give plot() a path=, or choose one, "
                    "such as MPLBACKEND=TkAgg; in a notebook the figure shows itself as the last "
                    "line of a cell"
                )
            self.set_canvas(manager.canvas)
            manager.canvas.figure = self
        plt.show()


def blank(width: float = WIDE, height: float = 4.0, *, free: bool = False) -> Figure:
    """An empty figure of `width` and `height` [inch] that keeps its labels apart, unless `free`."""
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
    """A figure of `width` and `height` [inch] and its panels with a light grid, row by row.

    Further arguments go to `Figure.subplots`.
    """
    figure = blank(width, height)
    axes = figure.subplots(rows, columns, sharex=sharex, sharey=sharey, squeeze=False, **more)
    return figure, [[dressed(axis) for axis in row] for row in axes]


def panels(
    count: int, width: float = WIDE, height: float = 1.9, shared: bool = True
) -> tuple[Figure, list[Axes]]:
    """`count` panels under each other with a light grid, their abscissa shared by default."""
    figure, axes = grid(count, 1, width, 0.7 + height * count, sharex=shared)
    return figure, [axis for (axis,) in axes]


def dressed(axis: Axes) -> Axes:
    """The same panel with a light grid behind its curves, and colours that all can tell apart."""
    axis.set_prop_cycle(cycler(color=COLOURS))
    axis.set_axisbelow(True)
    axis.grid(alpha=0.3)
    return axis


def save(figure: Figure, path: str | Path | None, dpi: float = 150) -> Figure:
    """Write `figure` to `path`, if given; return it either way."""
    if path is not None:
        known = sorted(figure.canvas.get_supported_filetypes())
        place = checks.path("picture", path)
        ending = place.suffix.removeprefix(".").lower()
        checks.check_names(f"picture '{path}': ending", [ending], known)
        with written(place) as temporary:
            figure.savefig(temporary, dpi=dpi)
    return figure
