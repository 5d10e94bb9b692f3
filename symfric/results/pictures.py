"""Plots of simulations and of ensembles, with units."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import casadi as ca
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.foundation.panels import NARROW, panels, save
from symfric.foundation.panels import panels as empty_panels
from symfric.foundation.shown import spaced
from symfric.foundation.style import COLOURS, EDGE, colour, line
from symfric.foundation.units import clock, readable
from symfric.model.kinds import CONSTRAINTS, ENERGY, FRICTION
from symfric.results.kinds import Group, every, friction_laws, kinds, main
from symfric.results.signals import Signals

APART = 8
"""Largest number of signals for which each signal has a panel if all are shown."""
BLACK = COLOURS.index(EDGE)
FLAT = 1e-6
"""Change relative to the magnitude below which a signal is plotted as a constant."""

PANELS, POINTS = 3, 1500
"""Largest number of signals and approximate number of intervals in the small figure."""


def plot_trajectories(
    trajectories: Mapping[str, Signals],
    names: Sequence[str] = (),
    path: str | Path | None = None,
    panels: str = "main",
    log: Sequence[str] = (),
) -> Figure:
    """Plot signals of one or several simulations over time, with signals of one kind in one panel.

    Long times are in hours, days or years.

    Args:
        trajectories: trajectories by legend entry.
        names: signals or details, each in its own panel.
        path: image file.
        panels: signals to plot if `names` is empty: "main" for positions, friction and energy (or
            power, if the model has no energy balance); "all" for every signal that all trajectories
            have, grouped by kind and unit if there are many. For a model with neither positions nor
            friction, "main" also selects all signals.
        log: signals or details with a logarithmic axis; nonpositive values are omitted.
    """
    checks.choice("plot: panels", panels, ("main", "all"))
    log = (log,) if isinstance(log, str) else tuple(log)
    first = next(iter(trajectories.values()))
    for trajectory in trajectories.values():
        trajectory.check([*names, *log])
    units = {
        n: u for n, u in first.units.items() if all(n in t.units for t in trajectories.values())
    }
    if names:
        groups = [Group("", first.unit(name), {name: name}) for name in names]
    else:
        chosen = main(first.model, units) if panels == "main" else []
        groups = chosen or every(first.model, units, APART)
        if len(trajectories) > 1:
            groups = split(groups)
    tall = max((len(g.names) for g in groups), default=1) > 1
    figure, axes = empty_panels(len(groups), width=8.5 if tall else 7.0, height=2.0)
    alone = all(len(g.names) == 1 for g in groups)
    checks.check_names("plot: log", log, [name for group in groups for name in group.names])
    for name in log:
        top = max(float(run.at_looks(name).max()) for run in trajectories.values())
        if not top > 0:
            what = f"expected signals above zero somewhere, got {name}, at most {top:g}"
            raise ValueError(f"plot: log: {what}")
    by_t, unit_t = clock([end for run in trajectories.values() for end in run.span])
    for axis, group in zip(axes, groups, strict=True):
        _panel(axis, group, trajectories, alone, by_t, not set(log).isdisjoint(group.names))
    laws = {friction_laws(run.model) for run in trajectories.values()}
    law = f" with {min(laws)}" if len(laws) == 1 and min(laws) else ""
    handles: list[Artist] = []
    for r, label in enumerate(trajectories if list(trajectories) != [first.scene] else ()):
        look = line(r) if alone else line(BLACK, r)
        handles.append(Line2D([], [], label=label, linewidth=1.4, **look))
    columns = min(4, len(handles))
    return _finished(figure, axes, f"{first.scene}{law}", f"t [{unit_t}]", path, handles, columns)


def _finished(
    figure: Figure, axes: Sequence[Axes], title: str, xlabel: str, path: str | Path | None,
    handles: Sequence[Artist] = (), columns: int = 1,
) -> Figure:  # fmt: skip
    """Add a title, the label of the abscissa, and a legend below the panels; save the figure."""
    axes[0].set_title(title, loc="left", fontsize="medium")
    axes[-1].set_xlabel(xlabel)
    if handles:
        figure.legend(handles=handles, loc="outside lower center", frameon=False, fontsize="small",
                      ncols=columns)  # fmt: skip
    figure.align_ylabels(axes)
    return save(figure, path)


def split(groups: Sequence[Group]) -> list[Group]:
    """Return the groups for a comparison of simulations.

    If there are few signals, each has its own panel, and only the total energy is shown.
    """
    single = [
        Group("", group.unit, {name: name}, group.norms)
        for group in groups
        for name in (list(group.names)[-1:] if group.title == ENERGY else group.names)
    ]
    return single if len(single) <= APART else list(groups)


def _panel(
    axis: Axes,
    group: Group,
    trajectories: Mapping[str, Signals],
    alone: bool,
    by_t: float,
    log: bool,
) -> None:
    """Plot the signals of a group, with a colour per signal and a line style per simulation.

    If `alone`, every panel has only one signal, and simulations also differ in colour.
    """
    several, runs = len(group.names) > 1, len(trajectories) > 1
    values = {
        (name, label): run[name] if group.norms else run.at_looks(name)
        for name in group.names
        for label, run in trajectories.items()
    }
    factor, unit = (1.0, group.unit) if log else readable(group.unit, values.values())
    for k, (name, called) in enumerate(group.names.items()):
        for r, (label, run) in enumerate(trajectories.items()):
            entry = label if not several else called if r == 0 else None
            y = factor * values[name, label]
            if group.norms:
                axis.plot(by_t * run.t, y, ".", color=colour(k), markersize=1.5, label=entry)
                continue
            look = line(r if alone else k if several else BLACK, r) if runs else line(k)
            axis.plot(by_t * run.looks, y, linewidth=1.2, label=entry, **look)
    if group.norms or log:
        axis.set_yscale("log", nonpositive="mask")
    else:
        level(axis, [factor * v for v in values.values()])
    (only,) = group.names if not several else ("",)
    axis.set_ylabel(f"{only or group.title} [{unit}]".replace(" []", "").strip())
    if several:
        axis.legend(
            loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize="x-small",
            markerscale=4, ncols=1 + (len(group.names) - 1) // 8,
        )  # fmt: skip


def level(axis: Axes, values: Sequence[Array]) -> None:
    """Set ticks without offset; centre a constant signal, so that rounding is not magnified."""
    axis.ticklabel_format(axis="y", useOffset=False)
    low = min((float(np.nanmin(v, initial=np.inf)) for v in values), default=0.0)
    high = max((float(np.nanmax(v, initial=-np.inf)) for v in values), default=0.0)
    size = max(abs(low), abs(high))
    if np.isfinite(size) and high - low <= FLAT * size:
        middle = (low + high) / 2
        axis.set_ylim(middle - (0.2 * size or 1.0), middle + (0.2 * size or 1.0))


def plot_points(run: Signals, x: str, y: str, times: Array, path: str | Path | None) -> Figure:
    """Plot two signals at single times as points."""
    figure, (axis,) = panels(1, width=NARROW, height=3.0)
    expressions = [run.model.expression(name) for name in (x, y)]
    axis.plot(*run.of(ca.vertcat(*expressions), times), ".", markersize=4.0, color=colour(0))
    axis.set_xlabel(f"{x} [{run.unit(x)}]")
    axis.set_ylabel(f"{y} [{run.unit(y)}]")
    return save(figure, path)


def _small(
    curves: Sequence[tuple[str, Array, Array]], unit_t: str, height: float, **look: float
) -> Figure:
    """Return a small figure of curves (label, times, values), each in its own panel."""
    figure = Figure(figsize=(5.2, height), layout="constrained")
    axes = list(figure.subplots(len(curves), 1, sharex=True, squeeze=False)[:, 0])
    for axis, (label, t, values) in zip(axes, curves, strict=True):
        axis.plot(t, values, color=COLOURS[0], **look)
        axis.set_ylabel(label, fontsize=7)
        axis.tick_params(labelsize=7)
        axis.grid(alpha=0.3)
    axes[-1].set_xlabel(f"t [{unit_t}]", fontsize=7)
    figure.align_ylabels(axes)
    return figure


def thumbnail(run: Signals) -> Figure:
    """Return a small plot of the first position, its rate and the first friction force."""
    (by_t, unit_t), curves = clock(run.span), list[tuple[str, Array, Array]]()
    for name in _few(run):
        t, values = _thinned(run.t, run[name])
        curves.append((f"{name} [{run.units[name]}]", by_t * t, values))
    return _small(curves, unit_t, 0.5 + 1.05 * len(curves), linewidth=1.0)


def _few(run: Signals) -> list[str]:
    """Return the names of the signals of the small plot."""
    found, kind = list(run.units), kinds(run.model)
    states = [v.name for v in run.model.x][:2]
    rubs = [n for n in found if kind.get(n) == FRICTION or n == "friction"][:1]
    rest = [n for n in found if n not in (*states, *rubs) and kind.get(n) != CONSTRAINTS]
    return [*states, *rubs, *rest][:PANELS]


def _thinned(t: Array, values: Array) -> tuple[Array, Array]:
    """Return fewer points; they include the extremes of each interval."""
    size = -(-t.size // POINTS)
    if size < 3:
        return t, values
    count = t.size // size
    rows = values[: count * size].reshape(count, size)
    starts = size * np.arange(count)
    kept = np.unique(np.r_[starts + rows.argmin(1), starts + rows.argmax(1), t.size - 1])
    return t[kept], values[kept]


SHOWN, LINES, TIMES, SMALL = 6, 6, 500, 200
"""Largest numbers of signals by default, of individually drawn members, of times, and of members in
the small plot."""
BANDS = ((5.0, 95.0, 0.15, "90 %"), (25.0, 75.0, 0.3, "50 %"))
"""Percentiles, opacity and legend entry of each band."""
SERIES, JOINED = 6, 200
"""Largest number of values of a second parameter for which each value has a series, and largest
number of members joined by a line."""
DECADES = 100.0
"""Ratio of the largest to the smallest value from which an axis is logarithmic."""
Varied = tuple[str, str, Array]
"""Name, unit and values of a varied quantity, shape (members,)."""


def plot_many(
    scene: str,
    t: Array,
    signals: Mapping[str, Array],
    units: Mapping[str, str],
    names: Sequence[str] = (),
    path: str | Path | None = None,
) -> Figure:
    """Plot the median and the bands of 50 and 90 % of the members over time, a panel per signal.

    Up to six members are drawn individually. If there is only one time per member, histograms are
    plotted. NaN of members that have ended or failed is omitted.

    Args:
        scene: title.
        t: times [s], shape (k,); or ends of the members, shape (members, 1).
        signals: values by name, shape (members, k).
        units: units by name.
        names: signals to plot; by default the first six.
        path: image file.

    Raises:
        ValueError: a name is unknown.
    """
    checks.check_names(f"ensemble of '{scene}'", names, signals)
    shown = list(names) or list(signals)[:SHOWN]
    ends = t.ndim > 1 or t.size < 2
    pick = slice(None) if ends else np.unique(np.linspace(0, t.size - 1, TIMES).astype(int))
    figure, axes = panels(len(shown), shared=not ends, height=2.0)
    by_t, unit_t = clock(t)
    xlabel = f"t [{unit_t}]"
    for axis, name in zip(axes, shown, strict=True):
        values = np.asarray(signals[name][:, pick], dtype=float)
        factor, unit = readable(units[name], [values])
        if ends:
            finite = values[np.isfinite(values[:, -1]), -1]
            spread = finite.size > 1 and np.ptp(finite) > 0
            axis.hist(factor * finite, bins="auto" if spread else 1, color=colour(0), alpha=0.7)
            xlabel = f"{name} [{unit}] at the end"
            axis.set_xlabel(xlabel)
            axis.set_ylabel("members")
        else:
            _bands(axis, by_t * t[pick], factor * values)
            level(axis, [factor * values])
            axis.set_ylabel(f"{name} [{unit}]")
    members = next(iter(signals.values())).shape[0] if signals else 0
    handles = axes[0].get_legend_handles_labels()[0]
    return _finished(figure, axes, f"{scene}, {members} members", xlabel, path, handles, 6)


def _bands(axis: Axes, t: Array, values: Array) -> None:
    """Plot the members individually if they are few, else median and bands."""
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


def plot_over(
    scene: str,
    when: str,
    signals: Mapping[str, tuple[str, Array]],
    over: Varied,
    others: Mapping[str, tuple[str, Array]],
    path: str | Path | None = None,
) -> Figure:
    """Plot signals over a varied quantity, each in its own panel.

    If one other quantity was varied and has few values, each of these values has its own series.
    The title states the number of members without a value, which failed or ended before.

    Args:
        scene, when: title, and a description of the time of the values.
        signals: unit and values of each signal by name, shape (members,).
        over: varied quantity on the abscissa.
        others: unit and values of other varied quantities by name.
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
    if x.size and x.min() > 0 and x.max() >= DECADES * x.min():
        axes[-1].set_xscale("log")
    absent = int((~np.isfinite(next(iter(signals.values()))[1])).sum())
    without = f", {absent} without a value" if absent else ""
    title = f"{scene}, {x.size} members{without}, {when}"
    handles = axes[0].get_legend_handles_labels()[0] if len(series) > 1 else ()
    xlabel = name_x if unit in ("", "1") else f"{name_x} [{unit}]"
    return _finished(figure, axes, title, xlabel, path, handles, min(3, len(series)))


def _series(
    count: int, others: Mapping[str, tuple[str, Array]]
) -> list[tuple[str, NDArray[np.bool_]]]:
    """Return the legend entry and the members of each series; see `plot_over`."""
    every = [("", np.ones(count, dtype=bool))]
    if len(others) != 1:
        return every
    ((other, (unit, values)),) = others.items()
    known = np.unique(values)
    if not 1 < known.size <= SERIES:
        return every
    return [(f"{other} = {value:.4g}{spaced(unit)}", values == value) for value in known]


def _draw(axis: Axes, x: Array, y: Array, k: int, label: str) -> None:
    """Plot points, which a line joins if they are few and have different abscissas."""
    order = np.argsort(x, kind="stable")
    x, y = x[order], y[order]
    if x.size <= JOINED and np.unique(x).size == x.size and x.size > 1:
        size = 3.0 if x.size <= JOINED // 4 else 0.0
        axis.plot(x, y, marker="o", markersize=size, linewidth=1.2, label=label, **line(k))
    else:
        axis.plot(x, y, ".", markersize=3 if x.size < 5000 else 1, color=colour(k), label=label,
                  alpha=0.7, rasterized=x.size > 5000)  # fmt: skip


def thumbnail_of_many(t: Array, values: Array, label: str) -> Figure:
    """Return a small plot of the first members over time."""
    return _small([(label, t, np.asarray(values[:SMALL]).T)], "s", 1.9, linewidth=0.6, alpha=0.4)
