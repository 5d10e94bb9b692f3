"""Pictures of benchmarks."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from symfric.foundation.panels import save

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
