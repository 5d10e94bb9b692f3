"""Pictures of ensembles over what was varied: a point for each member."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from symfric.foundation import checks
from symfric.foundation.panels import panels, save
from symfric.foundation.style import colour, line
from symfric.foundation.units import readable
from symfric.results.pictures import level

if TYPE_CHECKING:
    from symfric.results.ensemble import Ensemble

Array = NDArray[np.float64]
SHOWN, SERIES, JOINED = 6, 6, 200
"""Signals if none is named, values of a second parameter that are told apart, and members of a
series that are joined by a line."""
DECADES = 100.0
"""Greatest over least value from which on an axis is logarithmic."""
PLACES = ("end", "least", "greatest")


def plot_over(
    study: "Ensemble",
    names: Sequence[str],
    over: str,
    at: float | str = "end",
    path: str | Path | None = None,
) -> Figure:
    """Signals over what was varied, a panel each.

    Where something else was varied, too, and has few values, a series for each of them. Members
    that have no value there, since they failed or ended before, are counted in the title.

    Args:
        study: the ensemble.
        names: signals; the first six if none is given.
        over: what was varied.
        at: a time of the result [s], or one of `PLACES`.
        path: image file.

    Raises:
        ValueError: unknown names, another place, a time outside the results.
    """
    where = f"ensemble of '{study.scene}'"
    checks.check_names(f"{where}: plot: over", [over], study.varied)
    checks.check_names(where, names, study.signals)
    shown = list(names) or list(study.signals)[:SHOWN]
    said, values = _values(study, shown, at)
    across, unit = readable(study.unit(over), [study.varied[over]])
    x = across * study.varied[over]
    figure, axes = panels(len(shown), shared=True, height=2.2)
    series = _series(study, over)
    for axis, name in zip(axes, shown, strict=True):
        factor, unit_y = readable(study.units[name], [values[name]])
        for k, (label, pick) in enumerate(series):
            _draw(axis, x[pick], factor * values[name][pick], k, label)
        level(axis, [factor * values[name]])
        axis.set_ylabel(f"{name} [{unit_y}]")
    _across(axes[-1], x)
    axes[-1].set_xlabel(over if unit in ("", "1") else f"{over} [{unit}]")
    absent = int((~np.isfinite(values[shown[0]])).sum())
    without = f", {absent} without a value" if absent else ""
    title = f"{study.scene}, {len(study)} members{without}, {said}"
    axes[0].set_title(title, loc="left", fontsize="medium")
    if len(series) > 1:
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center",
                      ncols=min(3, len(series)), frameon=False, fontsize="small")  # fmt: skip
    figure.align_ylabels(axes)
    return save(figure, path)


def _values(
    study: "Ensemble", names: Sequence[str], at: float | str
) -> tuple[str, dict[str, Array]]:
    """What the place is called, and name -> values there, shape (members,)."""
    where = f"ensemble of '{study.scene}': plot: at"
    if isinstance(at, str):
        checks.choice(where, at, PLACES)
        if at == "end":
            said = "at the end" if study.t.ndim > 1 else f"at t = {study.t[-1]:.4g} s"
            return said, {name: study.signals[name][:, -1] for name in names}
        which = PLACES.index(at) - 1
        said = f"{at} of each run"
        return said, {name: study.extremes[name][which] for name in names}
    if study.t.ndim > 1:
        raise checks.refused(where, "'end', where each member has its own", at)
    first, last = float(study.t[0]), float(study.t[-1])
    time = checks.number(where, at, unit="s", lower=first, upper=last)
    k = int(np.abs(study.t - time).argmin())
    return f"at t = {study.t[k]:.4g} s", {name: study.signals[name][:, k] for name in names}


def _series(study: "Ensemble", over: str) -> list[tuple[str, NDArray[np.bool_]]]:
    """Legend and members of each series: one, or one for each value of what else was varied."""
    every = [("", np.ones(len(study), dtype=bool))]
    others = [name for name in study.varied if name != over]
    if len(others) != 1:
        return every
    (other,) = others
    values = study.varied[other]
    known = np.unique(values)
    if not 1 < known.size <= SERIES:
        return every
    unit = study.unit(other)
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
