"""Data of a behaviour figure, and the magnitudes of laws that figures are scaled by."""

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from math import inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation import checks
from symfric.foundation.parameters import check_names, parameters
from symfric.foundation.shown import Showing, Shown, Table
from symfric.foundation.style import DASHES, colour, dash
from symfric.foundation.units import readable
from symfric.laws import (
    ALL_LAWS,
    PHENOMENA,
    POPULATIONS,
    AnyLaw,
    Law,
    Population,
    law_name,
    steady_force,
)
from symfric.laws.base.law import check_law

if TYPE_CHECKING:
    from matplotlib.axes import Axes
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
        """Legend entry of the curve: its law and, where there are several, its case."""
        return f"{self.law}, {self.case}" if self.case else self.law

    def __getitem__(self, column: str) -> Array:
        check_names(f"curve '{self.label}'", [column], self.columns)
        return self.columns[column]


@final
@dataclass(frozen=True, eq=False, repr=False)
class FigureData(Showing):
    """Data of one figure.

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
        """Return the picture of `plot`, small."""
        return self.plot()

    def __getitem__(self, name: str) -> Curve:
        found = {c.label: c for c in self.curves}
        for curve in self.curves:
            for short in (curve.case, curve.law):
                found.setdefault(short, curve)
        check_names(f"figure '{self.name}'", [name], [key for key in found if key])
        return found[name]

    def named(self, law: str) -> "FigureData":
        """Return the same with another name of its law."""
        return replace(self, curves=tuple(replace(c, law=law) for c in self.curves))

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Draw it, labelled with units, a panel per pair of columns; save it to `path` if given.

        Colours and line styles tell laws or cases apart: of several laws each has its colour, and
        the cases differ by their line styles.
        """
        from symfric.foundation.panels import panels, save  # noqa: PLC0415  (matplotlib is slow to import)

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
            entries = axes[0].get_legend_handles_labels()
            figure.legend(*entries, loc="outside lower center", ncols=3, fontsize="small")
        figure.align_ylabels(axes)
        return save(figure, path)

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


def clear(curves: Sequence[Curve], *, loops: bool = False) -> tuple[list[Curve], str]:
    """Curves that differ visibly in one picture, and a word about the others.

    Where laws are compared these are no references; of three laws and more the first and the last
    case, and of `loops` within loops, which lie on each other, the first.
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
    """Return the curves of one panel, in units that are easily read.

    Args:
        laws: those that have a colour each, where several are compared; else the cases have.
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
"""Inputs that a block that is slid or pushed gives a law."""


def parts(law: AnyLaw) -> list[type[AnyLaw]]:
    """Return the kinds of law inside `law`, from the outside in, each once."""
    found: list[type[AnyLaw]] = [type(law)]
    for item in fields(law):
        value = getattr(law, item.name)
        for child in value if isinstance(value, tuple) else (value,):
            if isinstance(child, Law):
                found += parts(child)
    return list(dict.fromkeys(found))


def phenomena(law: AnyLaw) -> list[str]:
    """Return the codes of everything that `law` and the laws in it show."""
    shown = {code for part in parts(law) for code in part.facts.phenomena}
    return [code for code in PHENOMENA if code in shown]


def check_any(where: str, law: object) -> None:
    """Refuse what is neither a law nor a population of contacts."""
    if not isinstance(law, Population):
        check_law(where, law)


def finite(where: str, law: AnyLaw, F: Array) -> Array:
    """Return `F` [N] of a law, if any of it is a number.

    Raises:
        ValueError: none is, as where parameters leave the range of a root or an arcsine.
    """
    if F.size and not np.isfinite(F).any():
        raise ValueError(
            f"{where} of {law_name(law)}: expected parameters under which the force is a number, "
            "got some under which it is none anywhere; the limits of the law say which"
        )
    return F


def require(where: str, law: AnyLaw, *codes: str) -> None:
    """Refuse a law that shows none of `codes`, or needs more than motion and force of a block.

    Raises:
        ValueError: says what is missing, and names laws that have it; what else the law needs.
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


MASS = 0.8
"""Mass of the block where one is driven [kg], that of `Rabinowicz`."""

NORMAL_FORCE = MASS * 9.81
"""Normal force of the figures if none is given [N]."""


@final
@dataclass(frozen=True)
class Scales:
    """Magnitudes of a law under one normal force.

    Attributes:
        static: peak of the force in steady sliding, or mu_s N where that is more [N].
        kinetic: lowest force beyond the peak, up to 10 velocities [N].
        elastic: force up to which no drift is claimed [N]: sigma_0 z_ba of a law with a break-away
            deflection z_ba, else the kinetic level.
        stretch: static level over the stiffness at rest, the pre-sliding distance [m]; inf for a
            law without pre-sliding.
        velocity: Stribeck velocity [m/s]: the parameter v_s, else where the force has fallen half
            the way from its peak, else the `velocity_scale` of the law, else 100 stretches a
            second.
    """

    static: float
    kinetic: float
    elastic: float
    stretch: float
    velocity: float

    @property
    def mass(self) -> float:
        """Mass of a block to push [kg]: 0.8, or more for a strong contact (1.5 m/s^2 at most)."""
        return max(MASS, self.static / 1.5)


def scales(law: AnyLaw, N: float = NORMAL_FORCE) -> Scales:
    """Return the magnitudes of `law`, with numbers for parameters, under the normal force `N` [N].

    Raises:
        ValueError: no law, symbols for parameters, N that is not positive.
    """
    check_any("figure", law)
    checks.number("figure: N", N, unit="N", above=0.0)
    known = {p.name: checks.number(f"figure: {p.name}", p.value) for p in parameters(law).values()}
    stiffness = _stiffness(law, N) if "P" in phenomena(law) else 0.0
    velocity = known.get("v_s", float(law.velocity_scale))
    if not isfinite(velocity):
        top = float(steady_force(law, np.array([1e-3]), N)[0])
        velocity = 100 * top / stiffness if stiffness > 0 else 1e-3
    elif "v_s" not in known:
        velocity = _half_fall(law, velocity, N)
    F = steady_force(law, velocity * np.geomspace(1e-3, 10.0, 801), N)
    peak = _peak(F)
    kinetic = float(np.min(F[peak:]))
    static = max(float(F[peak]), known.get("mu_s", 0.0) * N)
    elastic = min(known.get("sigma_0", inf) * known.get("z_ba", inf), kinetic)
    stretch = static / stiffness if stiffness > 0 else inf
    return Scales(static, kinetic, elastic, stretch, velocity)


def _peak(F: Array) -> int:
    """Index at which `F` first falls, or ends."""
    falls = np.flatnonzero((np.diff(F) <= 0) & (F[:-1] > 0))
    return int(falls[0]) if falls.size else F.size - 1


def _half_fall(law: AnyLaw, scale: float, N: float) -> float:
    """Return the velocity at which the force has fallen half the way [m/s]; `scale` if it does
    not.
    """
    v = scale * np.geomspace(1e-2, 1e3, 1001)
    F = steady_force(law, v, N)
    beyond = F[_peak(F) :]
    top, low = beyond[0], np.min(beyond)
    if top - low < 0.01 * top:
        return scale
    half = np.argmax(beyond <= (top + low) / 2)
    return float(v[_peak(F) + half])


def _stiffness(law: AnyLaw, N: float) -> float:
    """dF/dx at rest [N/m]: how the force grows with a displacement of the unloaded contact."""
    if isinstance(law, Population):
        return law.stiffness
    v, z = ca.SX.sym("v"), ca.SX.sym("z", len(law.states))
    slope = ca.jacobian(law.force(v, N, z), z) @ ca.jacobian(law.rate(v, N, z), v)
    return float(ca.Function("stiffness", [v, z], [slope])(0.0, law.steady_state(0.0, N)))
