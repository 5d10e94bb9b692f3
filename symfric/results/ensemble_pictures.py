"""Pictures of many runs: bands that hold most of them, histograms, points over what was varied."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from symfric.foundation import checks
from symfric.foundation.panels import panels, save
from symfric.foundation.style import COLOURS, colour, line
from symfric.foundation.units import (
    clock,
    readable,
)
from symfric.results.pictures import level

Array = NDArray[np.float64]
SHOWN, LINES, TIMES, SMALL = 6, 6, 500, 200
"""Signals if none is named, members that are drawn one by one, times at most, and members of the
small picture."""
BANDS = ((5.0, 95.0, 0.15, "90 %"), (25.0, 75.0, 0.3, "50 %"))
"""Percentiles, opacity and legend of each band."""
SERIES, JOINED = 6, 200
"""Values of a second parameter that are told apart, and members of a series joined by a line."""
DECADES = 100.0
"""Greatest over least value from which on an axis is logarithmic."""
Varied = tuple[str, str, Array]
"""Name, unit and values of the members, shape (members,)."""


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


def plot_over(
    scene: str,
    said: str,
    signals: Mapping[str, tuple[str, Array]],
    over: Varied,
    others: Mapping[str, tuple[str, Array]],
    path: str | Path | None = None,
) -> Figure:
    """Signals over what was varied, a panel each.

    Where something else was varied, too, and has few values, a series for each of them. Members
    that have no value there, since they failed or ended before, are counted in the title.

    Args:
        scene, said: title, and at what place the values are.
        signals: name -> unit and values of the members, shape (members,).
        over: what was varied.
        others: name -> unit and values of what else was varied.
        path: image file.
    """
    name_x, unit, x = over
    across, unit = readable(unit, [x])
    series, x = _series(x.size, others), across * x
    figure, axes = panels(len(signals), shared=True, height=2.2)
    for axis, (name, (unit_y, values)) in zip(axes, signals.items(), strict=True):
        factor, unit_y = readable(unit_y, [values])
        for k, (label, pick) in enumerate(series):
            _draw(axis, x[pick], factor * values[pick], k, label)
        level(axis, [factor * values])
        axis.set_ylabel(f"{name} [{unit_y}]")
    _across(axes[-1], x)
    axes[-1].set_xlabel(name_x if unit in ("", "1") else f"{name_x} [{unit}]")
    first = next(iter(signals.values()))[1]
    absent = int((~np.isfinite(first)).sum())
    without = f", {absent} without a value" if absent else ""
    title = f"{scene}, {x.size} members{without}, {said}"
    axes[0].set_title(title, loc="left", fontsize="medium")
    if len(series) > 1:
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center",
                      ncols=min(3, len(series)), frameon=False, fontsize="small")  # fmt: skip
    figure.align_ylabels(axes)
    return save(figure, path)


def _series(
    count: int, others: Mapping[str, tuple[str, Array]]
) -> list[tuple[str, NDArray[np.bool_]]]:
    """Legend and members of each series: one, or one for each value of what else was varied."""
    every = [("", np.ones(count, dtype=bool))]
    if len(others) != 1:
        return every
    ((other, (unit, values)),) = others.items()
    known = np.unique(values)
    if not 1 < known.size <= SERIES:
        return every
    said = "" if unit in ("", "1") else f" {unit}"
    return [(f"{other} = {value:.4g}{said}", values == value) for value in known]


def _draw(axis: Axes, x: Array, y: Array, k: int, label: str) -> None:
    """Points; joined where there is one for each value and they are not too many."""
    order = np.argsort(x, kind="stable")
    x, y = x[order], y[order]
    if x.size <= JOINED and np.unique(x).size == x.size and x.size > 1:
        size = 3.0 if x.size <= JOINED // 4 else 0.0
        axis.plot(x, y, marker="o", markersize=size, linewidth=1.2, label=label, **line(k))
    else:
        axis.plot(x, y, ".", markersize=3 if x.size < 5000 else 1, color=colour(k), label=label,
                  alpha=0.7, rasterized=x.size > 5000)  # fmt: skip


def _across(axis: Axes, x: Array) -> None:
    """Logarithmic where the values go over decades."""
    if x.size and x.min() > 0 and x.max() >= DECADES * x.min():
        axis.set_xscale("log")


def thumbnail(t: Array, values: Array, label: str) -> Figure:
    """The first members over time, small."""
    figure = Figure(figsize=(5.2, 1.9), layout="constrained")
    axis = figure.subplots()
    axis.plot(t, np.asarray(values[:SMALL]).T, linewidth=0.6, color=COLOURS[0], alpha=0.4)
    axis.set_xlabel("t [s]", fontsize=7)
    axis.set_ylabel(label, fontsize=7)
    axis.tick_params(labelsize=7)
    axis.grid(alpha=0.3)
    return figure
