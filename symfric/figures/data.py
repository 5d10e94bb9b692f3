"""Data and plots of figures, and the check whether a law can show a behaviour."""

import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, final

import numpy as np

from symfric.foundation.numeric import Array
from symfric.foundation.parameters import check_names
from symfric.foundation.shown import Showing, Shown, TextTable
from symfric.foundation.style import DASHES, colour, dash
from symfric.foundation.units import readable
from symfric.laws import ALL_LAWS, PHENOMENA, POPULATIONS, AnyLaw, Law, Population, law_name
from symfric.laws.base.law import require_law

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@final
@dataclass(frozen=True, eq=False, repr=False)
class Curve:
    """Curve of a figure: columns of equal length by name, of shape (n,) each.

    Attributes:
        law: name of the law.
        case: difference from other curves of the same law, such as "2 Hz"; may be empty.
        columns: values by name.
        reference: True for a dashed curve that is shown for comparison.
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
        """Legend entry, which consists of the law and the case."""
        return f"{self.law}, {self.case}" if self.case else self.law

    def __getitem__(self, column: str) -> Array:
        check_names(f"curve '{self.label}'", [column], self.columns)
        return self.columns[column]


@final
@dataclass(frozen=True, eq=False, repr=False)
class FigureData(Showing):
    """Data of one figure.

    `figure["2 Hz"]` is the curve of this case, law or label, and `figure["2 Hz"]["F"]` its column.

    Attributes:
        name: name on the command line.
        title: description.
        units: units of the columns by name.
        panels: columns (abscissa, ordinate) of each panel.
        curves: the curves.
        log: columns with a logarithmic axis.
        dots: True for points with markers.
        note: remarks, such as the swept factor or omitted laws with the reason.
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
        """Describe the curves with the range of each column."""
        rows = tuple(
            (c.label, *(_range(c.columns[u]) if u in c.columns else "" for u in self.units))
            for c in self.curves
        )
        header = ("curve", *(f"{name} [{unit}]" for name, unit in self.units.items()))
        return Shown(f"figure '{self.name}': {self.title}", (), TextTable(header, rows))

    def thumbnail(self) -> "Figure":
        """Return the figure of `plot`."""
        return self.plot()

    def __getitem__(self, name: str) -> Curve:
        found = {c.label: c for c in self.curves}
        for curve in self.curves:
            for short in (curve.case, curve.law):
                found.setdefault(short, curve)
        check_names(f"figure '{self.name}'", [name], [key for key in found if key])
        return found[name]

    def named(self, law: str) -> "FigureData":
        """Return a copy in which `law` is the name of the law of all curves."""
        return replace(self, curves=tuple(replace(c, law=law) for c in self.curves))

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Draw the figure, with one panel per pair of columns; save it to `path` if given.

        Colours distinguish laws and line styles distinguish cases; with a single law both
        distinguish its cases.
        """
        from symfric.foundation.panels import legend_below, panels, save  # noqa: PLC0415  (slow to import)

        laws = list(dict.fromkeys(c.law for c in self.curves))
        abscissae = {x for x, _ in self.panels}
        height = {1: 4.0, 2: 2.6}.get(len(self.panels), 1.7)
        figure, axes = panels(len(self.panels), 7.0, height, shared=len(abscissae) == 1)
        drawn, omitted = clear(self.curves, loops=self.name == "hysteresis")
        for axis, panel in zip(axes, self.panels, strict=True):
            draw_curves(axis, self, panel, drawn, laws if len(laws) > 1 else ())
            if axis is not axes[-1] and len(abscissae) == 1:
                axis.set_xlabel("")
        title = self.title if len(laws) > 1 else f"{laws[0]}: {self.title}"
        figure.suptitle("\n".join(textwrap.wrap(title, 88)), fontsize="medium")
        if note := "; ".join(text for text in (self.note, omitted) if text):
            axes[0].set_title("\n".join(textwrap.wrap(note, 100)), loc="left", fontsize="small")
        if len(drawn) > 1:
            legend_below(figure, axes[0], fontsize="small", frameon=True)
        figure.align_ylabels(axes)
        return save(figure, path)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: name, title, units, panels and the columns of each curve."""
        curves = [
            {"law": c.law, "case": c.case, "columns": {n: v.tolist() for n, v in c.columns.items()}}
            for c in self.curves
        ]
        return {
            "name": self.name, "title": self.title, "note": self.note, "units": dict(self.units),
            "panels": [list(panel) for panel in self.panels], "curves": curves,
        }  # fmt: skip


def _range(values: Array) -> str:
    """Return the range of a column as text."""
    finite = values[np.isfinite(values)]
    return f"{finite.min():.4g} ... {finite.max():.4g}" if finite.size else ""


def clear(curves: Sequence[Curve], *, loops: bool = False) -> tuple[list[Curve], str]:
    """Return the curves that are distinguishable in one figure, and a note on the others.

    A comparison of laws omits references. With three or more laws it contains the first and the
    last case only, and for `loops`, whose cases coincide, the first case only.
    """
    laws = {c.law for c in curves}
    shown = [c for c in curves if not (c.reference and len(laws) > 1)]
    cases = list(dict.fromkeys(c.case for c in shown))
    if loops and len(laws) > 1:
        shown = [c for c in shown if c.case == cases[0]]
    elif len(laws) > 2 and len(cases) > 2:
        shown = [c for c in shown if c.case in (cases[0], cases[-1])]
    left = list(dict.fromkeys(c.case for c in curves if c not in shown))
    return shown, f"not drawn: {', '.join(left)}" if left else ""


def draw_curves(
    axis: "Axes",
    data: FigureData,
    panel: tuple[str, str],
    curves: Sequence[Curve],
    laws: Sequence[str],
) -> None:
    """Draw the curves of one panel, in readable units.

    Args:
        axis: axis of the panel.
        data: figure with the units of the columns.
        panel: columns (abscissa, ordinate).
        curves: the curves to draw.
        laws: names of laws, each of which has its own colour; if empty, each case has its own.
    """
    x, y = panel
    cases = list(dict.fromkeys(c.case for c in curves))
    by_x, unit_x = readable(data.units[x], () if x in data.log else [c[x] for c in curves])
    by_y, unit_y = readable(data.units[y], () if y in data.log else [c[y] for c in curves])
    for c in curves:
        case = cases.index(c.case)
        if laws:
            number = laws.index(c.law)
            style = dash(case) if len(cases) > 1 else dash(number)
        else:
            number, style = case, DASHES[1] if c.reference else dash(case)
        axis.plot(
            by_x * c[x], by_y * c[y], linestyle=style, color=colour(number), linewidth=1.3,
            marker="o" if data.dots else None, markersize=4,
            label=c.label if laws else c.case or "as it is",
        )  # fmt: skip
    for on, scale in ((x, axis.set_xscale), (y, axis.set_yscale)):
        if on in data.log:
            scale("log")
    if y not in data.log:
        axis.ticklabel_format(axis="y", useOffset=False)
        if data.dots and axis.dataLim.y0 >= 0:
            axis.set_ylim(0.0, 1.1 * axis.dataLim.y1)
    axis.set_xlabel(f"{x} [{unit_x}]")
    axis.set_ylabel(f"{y} [{unit_y}]")


GIVEN = ("v", "N", "F_e", "dv")
"""Inputs of a law that a sliding or pushed block provides."""


def parts(law: AnyLaw) -> list[type[AnyLaw]]:
    """Return the classes of `law` and of the laws that it contains, without duplicates."""
    kinds: list[type[AnyLaw]] = [type(law)]
    for item in fields(law):
        value = getattr(law, item.name)
        for child in value if isinstance(value, tuple) else (value,):
            kinds += parts(child) if isinstance(child, Law) else []
    return list(dict.fromkeys(kinds))


def phenomena(law: AnyLaw) -> list[str]:
    """Return the codes of all phenomena of `law` and of the laws that it contains."""
    shown = {code for part in parts(law) for code in part.facts.phenomena}
    return [code for code in PHENOMENA if code in shown]


def check_any(where: str, law: object) -> None:
    """Raise an error if `law` is neither a law nor a population of contacts."""
    if not isinstance(law, Population):
        require_law(where, law)


def finite(where: str, law: AnyLaw, F: Array) -> Array:
    """Return `F` [N] unchanged if some of its values are finite.

    Raises:
        ValueError: no value is finite, for example because of a root of a negative parameter.
    """
    if F.size and not np.isfinite(F).any():
        raise ValueError(
            f"{where} of {law_name(law)}: expected parameters under which the force is a number, "
            "got some under which it is none anywhere; the limits of the law say which"
        )
    return F


def require(where: str, law: AnyLaw, *codes: str) -> None:
    """Raise an error if `law` shows none of `codes`, or needs inputs that a block does not provide.

    The message states the missing phenomenon and the laws that show it, or the inputs.
    """
    check_any(where, law)
    shown = phenomena(law)
    needed = [i.name for i in law.inputs if i.name not in GIVEN] if isinstance(law, Law) else []
    if set(codes) & set(shown) and not needed:
        return
    if set(codes) & set(shown):
        raise ValueError(
            f"{where} of {law_name(law)}: expected a law that needs no more than velocity, load, "
            f"acceleration and applied force, got one that needs {', '.join(needed)}; a figure of "
            "a scene that has them shows it, see `symfric scenes`"
        )
    missing = " or ".join(PHENOMENA[code] for code in codes)
    kinds = (ALL_LAWS | POPULATIONS).items()
    able = [name for name, kind in kinds if set(codes) & set(kind.facts.phenomena)]
    raise ValueError(
        f"{where} of {law_name(law)}: expected a law that shows {missing}, got one that shows "
        f"{', '.join(PHENOMENA[code] for code in shown) or 'nothing by itself'}; "
        f"such laws are {', '.join(able)}"
    )


Figures = dict[str, Callable[..., FigureData]]
FIGURES: Figures = {}
"""Figures by name, as functions (law, N, given) -> data."""
P = ParamSpec("P")
Content = tuple[str, Sequence[Curve]] | tuple[str, Sequence[Curve], str]
"""Title, curves and optional note of a figure."""


def behaviour(
    needs: tuple[str, ...], units: Mapping[str, str], *panels: tuple[str, str],
    log: tuple[str, ...] = (), dots: bool = False,
) -> Callable[[Callable[P, Content]], Callable[P, FigureData]]:  # fmt: skip
    """Return a decorator that registers a function (law, ...) -> title and curves as a figure.

    The figure has the name of the function. It rejects laws that show none of the phenomena
    `needs`, see `require`; with empty `needs` it accepts all laws. See `FigureData` for the other
    arguments.
    """

    def decorate(content: Callable[P, Content]) -> Callable[P, FigureData]:
        name = content.__name__

        @wraps(content)
        def make(*args: P.args, **options: P.kwargs) -> FigureData:
            law: Any = args[0] if args else options["law"]
            if needs:
                require(name, law, *needs)
            title, curves, *note = content(*args, **options)
            return FigureData(
                name, title, units, panels, tuple(curves), log=log, dots=dots, note="".join(note)
            )

        FIGURES[name] = make
        return make

    return decorate
