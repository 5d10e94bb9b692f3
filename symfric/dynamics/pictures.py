"""Pictures of the long-run behaviour of machines."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from symfric.foundation.numeric import Array
from symfric.foundation.panels import NARROW, panels, save
from symfric.foundation.style import EDGE, colour, line
from symfric.results.sections import sticks
from symfric.results.trajectory import Trajectory


def bode(
    frequencies: Array, G: NDArray[np.complex128], names: Sequence[Sequence[str]],
    path: str | Path | None, labels: tuple[str, str] = ("frequency [rad/s]", "magnitude"),
) -> Figure:  # fmt: skip
    """Plot magnitude and phase of a frequency response.

    Args:
        frequencies: w [rad/s], shape (m,).
        G: response, shape (m, outputs, inputs).
        names: legend entries, by output and input.
        path: image file.
        labels: of the horizontal axis and of the magnitude.
    """
    figure, (size, angle) = panels(2, width=6.0)
    for i, row in enumerate(names):
        for j, name in enumerate(row):
            look = line(i, j)
            size.loglog(frequencies, np.abs(G[:, i, j]), label=name, linewidth=1.4, **look)
            phase = np.degrees(np.unwrap(np.angle(G[:, i, j])))
            angle.semilogx(frequencies, phase, linewidth=1.4, **look)
    size.set_ylabel(labels[1])
    angle.set_ylabel("phase [deg]")
    angle.set_xlabel(labels[0])
    size.legend(frameon=False, fontsize="small")
    return save(figure, path)


def portrait(run: Trajectory, x: str, y: str, path: str | Path | None) -> Figure:
    """Plot a run in the plane of two signals, thick where a contact sticks.

    Args:
        run: the run.
        x, y: names of signals or details.
        path: image file.
    """
    figure, (axis,) = panels(1, width=NARROW, height=3.0)
    across, up = run.at_looks(x), run.at_looks(y)
    axis.plot(across, up, linewidth=1.2, **line(0))
    stuck = np.zeros(across.size, dtype=bool)
    for c in run.model.contacts:
        stuck |= run.of(sticks(c), run.looks) < 0
    if stuck.any():
        thick = np.where(stuck, across, np.nan), np.where(stuck, up, np.nan)
        axis.plot(  # markers show stick at one point of the plane
            *thick, "-o", linewidth=4.0, markersize=4.0, mew=0.0, zorder=1.5, label="sticks",
            color=colour(1),
        )  # fmt: skip
        axis.legend(frameon=False, fontsize="small")
    for name, label in ((x, axis.set_xlabel), (y, axis.set_ylabel)):
        label(f"{name} [{run.unit(name)}]")
    return save(figure, path)


STYLES: dict[int, tuple[Literal["-", "--", ":"], str]] = {
    1: ("-", ""),
    -1: ("--", "unstable"),
    0: (":", "on the limit of stability"),
}
"""Line styles by stability, and their legend entries."""


class Plotted(NamedTuple):
    """Branch in a bifurcation diagram.

    Attributes:
        name: legend entry.
        values: parameter, shape (n,).
        low, high: smallest and largest value of a state, shape (n,); equal for equilibria.
        stability: 1, -1 or 0 for each stable, unstable or undecided point, shape (n,).
        special: (kind, parameter, value of the state) of each special point.
    """

    name: str
    values: Array
    low: Array
    high: Array
    stability: NDArray[np.int8]
    special: Sequence[tuple[str, float, float]]


def bifurcation(
    curves: Sequence[Plotted], runs: Sequence[tuple[Array, Array, Array]], labels: tuple[str, str],
    path: str | Path | None,
) -> Figure:  # fmt: skip
    """Plot branches over a parameter: stable parts solid, unstable ones dashed, others dotted.

    Args:
        curves: the branches.
        runs: parameter, smallest and largest values of runs, shown as points.
        labels: of both axes.
        path: image file.
    """
    figure, (axis,) = panels(1, width=NARROW, height=3.6)
    for values, low, high in runs:
        for side in (low, high):
            axis.plot(values, side, "o", color=EDGE, mfc="none", markersize=4.5, mew=0.6, zorder=3)
    for k, curve in enumerate(curves):
        for side in (curve.low, curve.high):
            for stability, (style, _) in STYLES.items():
                stable, shown = stability > 0, curve.stability == stability
                shown[:-1] |= shown[1:] & (not stable)
                shown[1:] |= shown[:-1] & (not stable)
                axis.plot(
                    curve.values, np.where(shown, side, np.nan), style, color=colour(k),
                    linewidth=1.6 if stable else 1.1,
                )  # fmt: skip
    axis.margins(0.08, 0.12)
    left, right = axis.get_xlim()
    for k, curve in enumerate(curves):
        for kind, value, height in curve.special:
            axis.plot([value], [height], "o", color=colour(k), markersize=4)
            side = 1 if value < left + (right - left) / 4 else -1
            axis.annotate(
                kind, (value, height), xytext=(4 * side, 5), textcoords="offset points",
                fontsize="small", ha="left" if side > 0 else "right",
            )  # fmt: skip
    axis.set_xlabel(labels[0])
    axis.set_ylabel(labels[1])
    _legend(figure, curves, bool(runs))
    return save(figure, path)


def _legend(figure: Figure, curves: Sequence[Plotted], with_runs: bool) -> None:
    """Add a legend below a bifurcation diagram."""
    handles = [Line2D([], [], color=colour(k), label=c.name) for k, c in enumerate(curves)]
    for stability, (style, label) in STYLES.items():
        if label and any((curve.stability == stability).any() for curve in curves):
            handles.append(Line2D([], [], color=EDGE, linestyle=style, label=label))
    if with_runs:
        handles.append(
            Line2D([], [], color=EDGE, marker="o", linestyle="", mfc="none", label="runs")
        )
    figure.legend(
        handles=handles, loc="outside lower center", ncols=4, frameon=False, fontsize="small"
    )
