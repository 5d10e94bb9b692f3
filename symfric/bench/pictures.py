"""Pictures of benchmarks."""

from collections.abc import Iterable, Sequence
from itertools import chain
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from symfric.figures import FigureData
from symfric.foundation.panels import grid, panels, save
from symfric.foundation.style import COLOURS, MARKERS, colour, dash

ABREAST = 5
"""Panels in a row."""


def _filled(number: int) -> str | None:
    """Hollow markers where the colours come round again."""
    return "none" if number // len(COLOURS) % 2 else None


def plot_work_precision(
    points: Iterable[tuple[str, str, float, float]],
    error_label: str = "relative position error [1]",
    path: str | Path | None = None,
) -> Figure:
    """Run time against error, a panel per case, at most five in a row.

    Args:
        points: case, integrator, relative error, time [s].
        error_label: what the error is.
        path: image file.
    """
    lines: dict[str, dict[str, list[tuple[float, float]]]] = {}
    for case, name, error, time in points:
        lines.setdefault(case, {}).setdefault(name, []).append((error, time))
    columns = min(len(lines), ABREAST)
    rows = -(-len(lines) // columns)
    figure, tiles = grid(rows, columns, 11.0, 1.6 + 3.2 * rows, sharey=True)
    axes = list(chain(*tiles))
    names = list(dict.fromkeys(name for integrators in lines.values() for name in integrators))
    for axis in axes[len(lines) :]:
        axis.set_axis_off()
    for axis, (case, integrators) in zip(axes, lines.items(), strict=False):
        for name, line in integrators.items():
            error, time = zip(*sorted(line), strict=True)
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


def plot_regularisation(rows: Sequence[Any], path: str | Path | None = None) -> Figure:
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


def plot_goals(rows: Iterable[tuple[str, Any]], path: str | Path | None) -> Figure:
    """Decades by which each number exceeds its goal, a bar each; left of zero it is met.

    Args:
        rows: names, and numbers with their goals (`symfric.bench.table.Judged`).
        path: image file.
    """
    known = [(name, goal) for name, goal in rows if goal.decades == goal.decades]
    figure, (axis,) = panels(1, 8.0, 0.5 + 0.25 * len(known))
    for name, goal in known:
        axis.barh(
            name, goal.decades, color=colour(2 if goal.met else 1), hatch="" if goal.met else "///"
        )
    axis.axvline(0.0, color="0.3", linewidth=0.8)
    axis.invert_yaxis()
    axis.set_xlabel("decades beyond the goal")
    axis.tick_params(axis="y", labelsize="small")
    axis.grid(axis="x", alpha=0.3)
    return save(figure, path)


LEAST = 1e-14
"""What is drawn for less."""


def plot_ocp(rows: Sequence[Any], path: str | Path | None = None) -> Figure:
    """Relative miss with exact friction against processor time, a panel for each problem.

    Crosses are motions that also cost more than 0.1 % above the best one known.
    """
    cases = list(dict.fromkeys(row.case for row in rows if row.exact == row.exact))
    figure, axes = panels(len(cases))
    for axis, case in zip(axes, cases, strict=False):
        for row in rows:
            if row.case != case or row.starts == "far" or not isfinite(row.exact):
                continue
            shade = colour(("symfric", "Opti", "rockit").index(row.solver.split()[0]))
            marker = "o" if row.best > 0.5 else "x"
            axis.loglog(row.time_s, max(row.exact, LEAST), marker, color=shade)
            axis.annotate(
                row.solver, (row.time_s, max(row.exact, LEAST)), xytext=(4, 3),
                textcoords="offset points", fontsize="x-small",
            )  # fmt: skip
        axis.margins(x=0.2, y=0.2)
        axis.axhline(1e-4, color="0.7", linewidth=0.8, zorder=0)
        axis.set_ylabel("miss [1]")
        axis.set_title(case.replace("_", " "), fontsize="small")
    axes[-1].set_xlabel("processor time of a call [s]")
    figure.align_ylabels(axes)
    return save(figure, path)


def plot_jitter(data: FigureData, path: str | Path | None = None) -> Figure:
    """A panel per slider, a colour per way of stepping, the laws by line and marker."""
    figure, axes = panels(len(data.panels), 7.5, 3.0)
    cases = list(dict.fromkeys(c.case for c in data.curves))
    laws = list(dict.fromkeys(c.law for c in data.curves))
    for axis, (x, y) in zip(axes, data.panels, strict=True):
        for c in data.curves:
            law = laws.index(c.law)
            axis.semilogx(
                c[x], c[y], "-o" if law == 0 else "--s", color=colour(cases.index(c.case)),
                linewidth=1.2, markersize=5 if law == 0 else 4, label=c.label,
                markerfacecolor=None if law == 0 else "none",
            )  # fmt: skip
        values = np.concatenate([c[y] for c in data.curves])
        axis.set_yscale("log" if np.nanmax(values) > 5 * np.nanmin(values) else "linear")
        axis.set_ylabel(f"{y} [m/s²]")
        axis.grid(alpha=0.3, which="both")
    axes[-1].set_xlabel("velocity of the peak of friction [m/s]")
    figure.suptitle(data.title, fontsize="medium")
    figure.legend(
        *axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize="small"
    )
    return save(figure, path)
