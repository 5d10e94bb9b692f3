"""Pictures of benchmarks."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from symfric.foundation.panels import save


def _filled(number: int) -> str | None:
    """Hollow markers from the eleventh line on, which has the colour of the first."""
    return "none" if number >= 10 else None


def plot_work_precision(
    lines: Mapping[str, Mapping[str, Sequence[tuple[float, float]]]],
    path: str | Path | None = None,
) -> Figure:
    """Run time against error, a panel per case.

    Args:
        lines: case -> integrator -> points (relative error, time in s).
        path: image file.
    """
    figure, axes = plt.subplots(1, len(lines), squeeze=False, sharey=True, figsize=(11, 4.8))
    figure.set_layout_engine("constrained")
    names = list(dict.fromkeys(name for integrators in lines.values() for name in integrators))
    for axis, (case, integrators) in zip(axes[0], lines.items(), strict=True):
        for name, points in integrators.items():
            error, time = zip(*sorted(points), strict=True)
            bold = name.startswith("symfric")
            axis.loglog(
                error, [1e3 * t for t in time], marker="o", markersize=4 if bold else 3,
                linewidth=2.0 if bold else 1.0, linestyle="-" if bold else "--", label=name,
                color=f"C{names.index(name) % 10}", markerfacecolor=_filled(names.index(name)),
            )  # fmt: skip
        axis.set_title(case)
        axis.set_xlabel("relative position error [1]")
        axis.invert_xaxis()
        axis.grid(alpha=0.3, which="both")
    axes[0, 0].set_ylabel("time of a run [ms]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5,
                  fontsize="small")  # fmt: skip
    return save(figure, path)
