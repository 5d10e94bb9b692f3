"""Pictures of benchmarks."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from symfric.foundation.panels import save

if TYPE_CHECKING:
    from symfric.bench.regularisation import RegularisationRow

ABREAST = 5
"""Panels in a row."""


def _filled(number: int) -> str | None:
    """Hollow markers from the eleventh line on, which has the colour of the first."""
    return "none" if number >= 10 else None


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
    figure, axes = plt.subplots(
        rows, columns, squeeze=False, sharey=True, figsize=(11, 1.6 + 3.2 * rows)
    )
    figure.set_layout_engine("constrained")
    names = list(dict.fromkeys(name for integrators in lines.values() for name in integrators))
    for axis in axes.flat[len(lines) :]:
        axis.set_axis_off()
    for axis, (case, integrators) in zip(axes.flat, lines.items(), strict=False):
        for name, points in integrators.items():
            error, time = zip(*sorted(points), strict=True)
            bold = name.startswith("symfric")
            axis.loglog(
                error, [1e3 * t for t in time], marker="o", markersize=4 if bold else 3,
                linewidth=2.0 if bold else 1.0, linestyle="-" if bold else "--", label=name,
                color=f"C{names.index(name) % 10}", markerfacecolor=_filled(names.index(name)),
            )  # fmt: skip
        axis.set_title(case)
        axis.set_xlabel(error_label)
        axis.invert_xaxis()
        axis.grid(alpha=0.3, which="both")
    for axis in axes[:, 0]:
        axis.set_ylabel("time of a run [ms]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5,
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
    figure, axes = plt.subplots(
        2, len(cases), squeeze=False, sharex="col", figsize=(1.2 + 2.4 * len(cases), 5.6)
    )
    figure.set_layout_engine("constrained")
    for (above, below), case in zip(axes.T, cases, strict=True):
        own = [row for row in rows if row.case == case]
        for k, rtol in enumerate(rtols):
            line = [row for row in own if row.rtol == rtol]
            x = [row.value for row in line]
            label = f"rtol = {rtol:g}"
            above.loglog(x, [r.error for r in line], "-o", color=f"C{k}", ms=3, label=label)
            below.loglog(x, [1e3 * r.time_s for r in line], "-o", color=f"C{k}", ms=3)
            cycle = [(r.value, r.cycle_error) for r in line if r.cycle_error == r.cycle_error]
            if cycle:
                above.loglog(*zip(*cycle, strict=True), "--", color=f"C{k}", lw=1)
        above.axhline(own[0].uncertain, color="grey", linestyle=":", linewidth=1)
        above.set_title(case.replace(" ", "\n"), fontsize="medium")
        below.set_xlabel(f"{own[0].parameter} [{own[0].unit}]")
        if own[0].value > own[-1].value:
            below.invert_xaxis()
        for axis in (above, below):
            axis.grid(alpha=0.3, which="both")
    axes[0, 0].set_ylabel("error [1]; dashed: of the last cycle")
    axes[1, 0].set_ylabel("CPU time of a run [ms]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5,
                  fontsize="small")  # fmt: skip
    return save(figure, path)


def plot_goals(
    names: Sequence[str], decades: Sequence[float], met: Sequence[bool], path: str | Path | None
) -> Figure:
    """How many decades each number lies beyond its goal, a bar each; left of zero it is met."""
    figure, axis = plt.subplots(figsize=(8, 1.2 + 0.25 * len(names)), layout="constrained")
    axis.barh(names, decades, color=["C2" if well else "C3" for well in met])
    axis.axvline(0.0, color="0.3", linewidth=0.8)
    axis.invert_yaxis()
    axis.set_xlabel("decades beyond the goal")
    axis.tick_params(axis="y", labelsize="small")
    axis.grid(axis="x", alpha=0.3)
    return save(figure, path)
