"""Pictures of laws and of what they do, with units."""

from collections.abc import Mapping
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from symfric.foundation.panels import grid, panels, save
from symfric.foundation.parameters import parameters
from symfric.foundation.style import DASHES, colour, line
from symfric.laws import steady_force

if TYPE_CHECKING:
    from symfric.figures.data import FigureData
    from symfric.laws import AnyLaw


def plot_laws(
    laws: "Mapping[str, AnyLaw]", N: float = 1.0, path: str | Path | None = None
) -> Figure:
    """Friction force in steady sliding against velocity: near rest, and over many decades.

    Args:
        laws: legend entry -> law, with numbers for parameters.
        N: normal force [N].
        path: image file.
    """
    figure, ((near, far),) = grid(1, 2, 7.5, 3.2, sharey=True)
    scales = [scale for law in laws.values() for scale in _velocity_scales(law)]
    scale = max(scales, default=0.1)
    decades = np.geomspace(1e-3 * scale, max(1.0, 10 * scale), 1201)
    around = np.linspace(-10 * scale, 10 * scale, 2001)
    for k, (label, law) in enumerate(laws.items()):
        for axis, v in ((near, around), (far, decades)):
            axis.plot(v, steady_force(law, v, N), label=label, linewidth=1.3, **line(k))
    near.ticklabel_format(axis="x", style="sci", scilimits=(-2, 3), useMathText=True)
    far.set_xscale("log")
    for axis in (near, far):
        axis.set_xlabel("v [m/s]")
    near.set_ylabel("F in steady sliding [N]")
    near.set_title(f"near rest, N = {N:g} N", fontsize="medium")
    far.set_title("over decades", fontsize="medium")
    near.legend(fontsize="small")
    return save(figure, path)


def plot_catalogue(
    laws: "Mapping[str, AnyLaw]", N: float = 1.0, path: str | Path | None = None
) -> Figure:
    """Friction force in steady sliding against velocity, a small panel with its own axes per law.

    Args:
        laws: title -> law, with numbers for parameters.
        N: normal force [N].
        path: image file.
    """
    columns = 6
    rows = -(-len(laws) // columns)
    figure, tiles = grid(rows, columns, 11.0, 0.6 + 1.3 * rows)
    axes = list(chain(*tiles))
    for axis in axes[len(laws) :]:
        axis.set_visible(False)
    for axis, (label, law) in zip(axes, laws.items(), strict=False):
        edge = 5 * max(_velocity_scales(law), default=0.1)
        v = np.linspace(-edge, edge, 1001)
        axis.plot(v, steady_force(law, v, N), linewidth=1.1)
        axis.set_title(label, fontsize="x-small")
        axis.set_xticks([-edge, 0.0, edge], labels=[f"{-edge:.3g}", "0", f"{edge:.3g}"])
        axis.locator_params(axis="y", nbins=4)
        axis.tick_params(labelsize="xx-small")
        axis.yaxis.get_offset_text().set_fontsize("xx-small")
    figure.supxlabel("v [m/s or rad/s]", fontsize="small")
    figure.supylabel(f"F in steady sliding [N or N m], N = {N:g}", fontsize="small")
    return save(figure, path)


def _velocity_scales(law: "AnyLaw") -> list[float]:
    """The velocities [m/s] among the parameters, on which the force changes."""
    known = [(float(p.value), p.unit) for p in parameters(law).values()]
    scales = [value for value, unit in known if unit in ("m/s", "rad/s")]
    return scales + [1 / value for value, unit in known if unit == "s/m" and value > 0]


def plot_figure(data: "FigureData", path: str | Path | None = None) -> Figure:
    """A behaviour figure: a panel per pair of columns, a colour per law or, for one law, per case.

    With several laws the cases differ by their dashes.

    Args:
        data: its curves, panels and units.
        path: image file.
    """
    laws = list(dict.fromkeys(c.law for c in data.curves))
    cases = list(dict.fromkeys(c.case for c in data.curves))
    abscissae = {x for x, _ in data.panels}
    height = {1: 4.0, 2: 2.6}.get(len(data.panels), 1.7)
    figure, axes = panels(len(data.panels), 7.0, height, shared=len(abscissae) == 1)
    for axis in axes:  # before any of those that share their abscissa is logarithmic
        axis.ticklabel_format(axis="both", style="sci", scilimits=(-2, 4), useMathText=True)
    for axis, (x, y) in zip(axes, data.panels, strict=True):
        for c in data.curves:
            case = cases.index(c.case)
            dash = DASHES[case % len(DASHES)] if len(laws) > 1 else DASHES[c.reference]
            number = laws.index(c.law) if len(laws) > 1 else case
            label = c.label if len(laws) > 1 else c.case or "as it is"
            axis.plot(
                c[x], c[y], linestyle=dash, color=colour(number), linewidth=1.2,
                marker="o" if data.dots else None, markersize=4, label=label,
            )  # fmt: skip
        if x in data.log:
            axis.set_xscale("log")
        if y in data.log:
            axis.set_yscale("log")
        axis.set_ylabel(f"{y} [{data.units[y]}]")
        if axis is axes[-1] or len(abscissae) > 1:
            axis.set_xlabel(f"{x} [{data.units[x]}]")
    title = data.title if len(laws) > 1 else f"{laws[0]}: {data.title}"
    figure.suptitle(title, fontsize="medium")
    if len(data.curves) > 1:
        entries = axes[0].get_legend_handles_labels()
        figure.legend(*entries, loc="outside lower center", ncols=3, fontsize="small")
    figure.align_ylabels(axes)
    return save(figure, path)
