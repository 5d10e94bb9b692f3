"""Pictures of many runs: bands that hold most of them, or histograms where only ends are known."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from symfric.foundation import checks
from symfric.foundation.panels import panels, save
from symfric.foundation.style import colour, line
from symfric.foundation.units import clock, readable
from symfric.results.pictures import level

Array = NDArray[np.float64]
SHOWN, LINES, TIMES = 6, 6, 500
"""Signals if none is named, members that are drawn one by one, and times at most."""
BANDS = ((5.0, 95.0, 0.15, "90 %"), (25.0, 75.0, 0.3, "50 %"))
"""Percentiles, opacity and legend of each band."""


def plot_many(
    scene: str,
    t: Array,
    signals: Mapping[str, Array],
    units: Mapping[str, str],
    names: Sequence[str] = (),
    path: str | Path | None = None,
) -> Figure:
    """Median and the bands of 50 and 90 % of the members over time, a panel per signal.

    Up to six members are drawn one by one. Where only the ends are known, a histogram of them. NaN,
    of members that have ended or failed, is left out.

    Args:
        scene: title.
        t: times [s], shape (k,), or (members, 1) where each member has its own end.
        signals: name -> values, shape (members, k).
        units: name -> unit.
        names: signals to show; the first six if none is given.
        path: image file.

    Raises:
        ValueError: unknown names.
    """
    checks.check_names(f"ensemble of '{scene}'", names, signals)
    shown = list(names) or list(signals)[:SHOWN]
    ends = t.ndim > 1 or t.size < 2
    pick = slice(None) if ends else np.unique(np.linspace(0, t.size - 1, TIMES).astype(int))
    figure, axes = panels(len(shown), shared=not ends, height=2.0)
    by_t, unit_t = clock(t)
    for axis, name in zip(axes, shown, strict=True):
        values = np.asarray(signals[name][:, pick], dtype=float)
        factor, unit = readable(units[name], [values])
        if ends:
            _histogram(axis, factor * values[:, -1])
            axis.set_xlabel(f"{name} [{unit}] at the end")
            axis.set_ylabel("members")
        else:
            _bands(axis, by_t * t[pick], factor * values)
            level(axis, [factor * values])
            axis.set_ylabel(f"{name} [{unit}]")
    members = next(iter(signals.values())).shape[0] if signals else 0
    axes[0].set_title(f"{scene}, {members} members", loc="left", fontsize="medium")
    if not ends:
        axes[-1].set_xlabel(f"t [{unit_t}]")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=6, frameon=False,
                      fontsize="small")  # fmt: skip
        figure.align_ylabels(axes)
    return save(figure, path)


def _bands(axis: Axes, t: Array, values: Array) -> None:
    """Members one by one where they are few, else median and bands."""
    if values.shape[0] <= LINES:
        for k, row in enumerate(values):
            axis.plot(t, row, linewidth=1.2, label=f"member {k}", **line(k))
        return
    seen = np.isfinite(values).any(axis=0)
    t, values = t[seen], values[:, seen]
    for low, high, opacity, label in BANDS:
        edges = np.nanpercentile(values, [low, high], axis=0)
        axis.fill_between(t, *edges, color=colour(0), alpha=opacity, linewidth=0, label=label)
    middle = np.nanmedian(values, axis=0)
    axis.plot(t, middle, color=colour(0), linewidth=1.4, label="median")


def _histogram(axis: Axes, values: Array) -> None:
    """How often which end."""
    finite = values[np.isfinite(values)]
    spread = finite.size > 1 and np.ptp(finite) > 0
    axis.hist(finite, bins="auto" if spread else 1, color=colour(0), alpha=0.7)
