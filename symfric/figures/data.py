"""What a behaviour figure holds: curves of named columns with units."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.parameters import check_names
from symfric.foundation.shown import Showing, Shown, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False, repr=False)
class Curve:
    """One curve: columns of equal length by name, shape (n,) each.

    Attributes:
        law: whose behaviour it is.
        case: what sets it apart from the other curves of that law, such as "2 Hz"; may be empty.
        columns: name -> values.
        reference: drawn dashed, for comparison.
    """

    law: str
    case: str
    columns: Mapping[str, Array]
    reference: bool = False

    def __repr__(self) -> str:
        size = len(next(iter(self.columns.values()), ()))
        return f"<curve '{self.label}': {', '.join(self.columns)}, {size} points>"

    @property
    def label(self) -> str:
        """How a legend names the curve: its law and, where there are several, its case."""
        return f"{self.law}, {self.case}" if self.case else self.law

    def __getitem__(self, column: str) -> Array:
        check_names(f"curve '{self.label}'", [column], self.columns)
        return self.columns[column]


@final
@dataclass(frozen=True, eq=False, repr=False)
class FigureData(Showing):
    """The data of one figure.

    `figure["2 Hz"]` is the curve of that case, law or label; its columns come by name.

    Attributes:
        name: what the command line calls it.
        title: what it shows.
        units: column -> unit.
        panels: (abscissa, ordinate) of each panel.
        curves: what is drawn.
        log: columns on a logarithmic axis.
        dots: whether single points are measured and shall be seen.
        note: what else must be said: what is swept, or which law is left out and why.
    """

    name: str
    title: str
    units: Mapping[str, str]
    panels: tuple[tuple[str, str], ...]
    curves: tuple[Curve, ...]
    log: tuple[str, ...] = ()
    dots: bool = False
    note: str = ""

    def shown(self) -> Shown:
        """Its curves, with the range of each column."""
        rows = tuple(
            (c.label, *(_range(c.columns[u]) if u in c.columns else "" for u in self.units))
            for c in self.curves
        )
        header = ("curve", *(f"{name} [{unit}]" for name, unit in self.units.items()))
        return Shown(f"figure '{self.name}': {self.title}", (), Table(header, rows))

    def thumbnail(self) -> "Figure":
        """What `plot` draws, small."""
        return self.plot()

    def __getitem__(self, name: str) -> Curve:
        found = {c.label: c for c in self.curves}
        for curve in self.curves:
            for short in (curve.case, curve.law):
                found.setdefault(short, curve)
        check_names(f"figure '{self.name}'", [name], [key for key in found if key])
        return found[name]

    def named(self, law: str) -> "FigureData":
        """The same with another name of its law."""
        return replace(self, curves=tuple(replace(c, law=law) for c in self.curves))

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Draw it, labelled with units; save it to `path` if given."""
        from symfric.figures.pictures import plot_figure  # noqa: PLC0415  (matplotlib is slow to import)

        return plot_figure(self, path)

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain data: name, title, units, panels and the columns of each curve."""
        return {
            "name": self.name,
            "title": self.title,
            "note": self.note,
            "units": dict(self.units),
            "panels": [list(panel) for panel in self.panels],
            "curves": [
                {
                    "law": c.law,
                    "case": c.case,
                    "columns": {name: values.tolist() for name, values in c.columns.items()},
                }
                for c in self.curves
            ],
        }


def _range(values: Array) -> str:
    """From where to where a column goes."""
    finite = values[np.isfinite(values)]
    return f"{finite.min():.4g} ... {finite.max():.4g}" if finite.size else ""
