"""Pictures of benchmarks."""

from collections.abc import Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from symfric.foundation.panels import grid, panels, save
from symfric.foundation.style import COLOURS, MARKERS, colour, dash

if TYPE_CHECKING:
    from symfric.bench.regularisation import RegularisationRow

ABREAST = 5
"""Panels in a row."""


def _filled(number: int) -> str | None:
    """Hollow markers where the colours come round again."""
    return "none" if number // len(COLOURS) % 2 else None


def plot_work_precision(
    lines: Mapping[str, Mapping[str, Sequence[tuple[float, float]]]],
    path: str | Path | None = None,
    error_label: str = "relative position error [1]",
) -> Figure:
    """Run time against error, a panel per case, at most five beside each other.

    Args:
        lines: case -> integrator -> points (relative error, time in s).
        path: image file.
        error_label: what the error is.
    """
    columns = min(len(lines), ABREAST)
    rows = -(-len(lines) // columns)
    figure, tiles = grid(rows, columns, 11.0, 1.6 + 3.2 * rows, sharey=True)
    axes = list(chain(*tiles))
    names = list(dict.fromkeys(name for integrators in lines.values() for name in integrators))
    for axis in axes[len(lines) :]:
        axis.set_axis_off()
    for axis, (case, integrators) in zip(axes, lines.items(), strict=False):
        for name, points in integrators.items():
            error, time = zip(*sorted(points), strict=True)
            bold = name.startswith("symfric")
            axis.loglog(
                error, [1e3 * t for t in time], markersize=4 if bold else 3,
                marker=MARKERS[names.index(name) % len(MARKERS)],
                linewidth=2.0 if bold else 1.0, linestyle="-" if bold else "--", label=name,
                color=colour(names.index(name)), markerfacecolor=_filled(names.index(name)),
            )  # fmt: skip
        axis.set_title(case)
        axis.set_xlabel(error_label)
        axis.invert_xaxis()
        axis.grid(alpha=0.3, which="both")
    for axis in axes[::columns]:
        axis.set_ylabel("time of a run [ms]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=5,
                  fontsize="small")  # fmt: skip
    return save(figure, path)


def plot_regularisation(
    rows: "Sequence[RegularisationRow]", path: str | Path | None = None
) -> Figure:
    """Error of smooth friction above, CPU time below, over its width; drier to the right.

    A column per case, a colour per tolerance; the dotted line is the error of the reference.
    """
    cases = list(dict.fromkeys(row.case for row in rows))
    rtols = sorted({row.rtol for row in rows}, reverse=True)
    figure, axes = grid(2, len(cases), 1.2 + 2.4 * len(cases), 5.6, sharex="col")
    for above, below, case in zip(*axes, cases, strict=True):
        own = [row for row in rows if row.case == case]
        for k, rtol in enumerate(rtols):
            line = [row for row in own if row.rtol == rtol]
            x = [row.value for row in line]
            label = f"rtol = {rtol:g}"
            look: dict[str, Any] = {
                "color": colour(k), "linestyle": dash(k), "linewidth": 1.2,
                "markersize": 3 + 1.5 * k,
                "marker": MARKERS[k % len(MARKERS)], "markerfacecolor": "none",
            }  # fmt: skip
            above.loglog(x, [r.error for r in line], label=label, **look)
            below.loglog(x, [1e3 * r.time_s for r in line], **look)
            cycle = [(r.value, r.cycle_error) for r in line if r.cycle_error == r.cycle_error]
            if cycle:
                above.loglog(*zip(*cycle, strict=True), "--", color=colour(k), lw=1)
        above.axhline(own[0].uncertain, color="grey", linestyle=":", linewidth=1)
        above.set_title(case.replace(" ", "\n"), fontsize="medium")
        below.set_xlabel(f"{own[0].parameter} [{own[0].unit}]")
        if own[0].value > own[-1].value:
            below.invert_xaxis()
        for axis in (above, below):
            axis.grid(alpha=0.3, which="both")
    axes[0][0].set_ylabel("error [1]; dashed: of the last cycle")
    axes[1][0].set_ylabel("CPU time of a run [ms]")
    figure.legend(*axes[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=5,
                  fontsize="small")  # fmt: skip
    return save(figure, path)


def plot_goals(
    names: Sequence[str], decades: Sequence[float], met: Sequence[bool], path: str | Path | None
) -> Figure:
    """How many decades each number lies beyond its goal, a bar each; left of zero it is met."""
    figure, (axis,) = panels(1, 8.0, 0.5 + 0.25 * len(names))
    bars = axis.barh(names, decades, color=[colour(2) if well else colour(1) for well in met])
    for bar, well in zip(bars, met, strict=True):
        bar.set_hatch("" if well else "///")
    axis.axvline(0.0, color="0.3", linewidth=0.8)
    axis.invert_yaxis()
    axis.set_xlabel("decades beyond the goal")
    axis.tick_params(axis="y", labelsize="small")
    axis.grid(axis="x", alpha=0.3)
    return save(figure, path)
