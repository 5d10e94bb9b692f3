"""Figures of a fit and of a ranking of laws."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from identification.result.outcome import FitFields
from identification.result.parts import FrictionCurve, Series, limits
from symfric.foundation import checks
from symfric.foundation.panels import grid, panels, save
from symfric.foundation.style import colour

SHOWN = 4
"""Number of signals that are drawn by default, each in three panels."""


def picture(fit: FitFields, names: Sequence[str] = (), path: str | Path | None = None) -> Figure:
    """Plot friction over velocity, and data, fit, residuals and autocorrelation of each signal.

    Args:
        fit: the fit.
        names: signals to show, of all records; none: the first signals.
        path: image file to write.
    """
    known = list(dict.fromkeys(s.signal for s in fit.series))
    wanted = checks.names("plot", names, known) or known
    shown = [s for s in fit.series if s.signal in wanted]
    if not names:
        shown = shown[:SHOWN]
    ordered = [s for s in shown if s.correlation.size]
    dots = [s for s in shown if not s.ordered and fit.curve is not None]
    drawn = [s for s in shown if s not in dots]
    count = (fit.curve is not None) + 2 * len(drawn) + len(ordered) + len(dots)
    figure, axes = panels(count, width=7.5, height=2.1, shared=False)
    left = iter(axes)
    if fit.curve is not None:
        _curve(next(left), fit.curve, fit.name)
    for one in shown:
        if one in drawn:
            _data(next(left), one)
        _left(next(left), one)
        if one in ordered:
            _lags(next(left), one)
    word = "" if fit.status.name == "SOLVED" else f": {fit.status.name.lower()}"
    figure.suptitle(f"{fit.name}{word}", x=0.01, ha="left", fontsize="large")
    figure.align_ylabels(axes)
    return save(figure, path)


def _legend(axis: Axes, columns: int = 3) -> None:
    axis.legend(
        loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize="small",
        ncols=columns, markerscale=2,
    )  # fmt: skip


def _curve(axis: Axes, curve: FrictionCurve, name: str) -> None:
    for line in curve.measured.values():
        axis.plot(line.t, line.y, ".", color="0.6", ms=8.0, mew=0, alpha=0.6, rasterized=True)
    axis.plot([], [], ".", color="0.6", label=curve.says)
    axis.plot(curve.law.t, curve.law.y, color=colour(1), lw=1.2, label=name)
    if curve.half.size:
        ends = curve.law.y - curve.half, curve.law.y + curve.half
        axis.fill_between(curve.law.t, *ends, color=colour(1), alpha=0.25, lw=0, label="95 %")
    low, high = limits(curve)
    axis.set_ylim(low, high)
    axis.set_xlabel(f"v [{curve.v_unit}]")
    axis.set_ylabel(f"friction [{curve.F_unit}]")
    _legend(axis)


def _data(axis: Axes, one: Series) -> None:
    style = "-" if one.ordered else "."
    axis.plot(one.measured.t, one.measured.y, style, color="0.6", lw=2.2, label="measured")
    axis.plot(one.predicted.t, one.predicted.y, style, color=colour(1), lw=0.9, label="fitted")
    axis.set_ylabel(f"{one.signal} [{one.unit}]")
    axis.set_xlabel(one.abscissa)
    axis.text(0.005, 1.02, one.record, transform=axis.transAxes, fontsize="small")
    _legend(axis)


def _left(axis: Axes, one: Series) -> None:
    axis.plot(one.residual.t, one.residual.y, "-" if one.ordered else ".", color=colour(0), lw=0.7)
    axis.axhline(0.0, color="0.4", lw=0.6)
    axis.set_ylabel(f"fitted - measured [{one.unit}]")
    axis.set_xlabel(one.abscissa)


def _lags(axis: Axes, one: Series) -> None:
    axis.fill_between(
        one.lags, one.low, one.high, color=colour(0), alpha=0.15, lw=0, label="white: 95 %"
    )
    axis.vlines(one.lags, 0.0, one.correlation, color=colour(0), lw=1.2)
    axis.axhline(0.0, color="0.4", lw=0.6)
    axis.set_ylim(min(-0.3, 1.1 * one.correlation.min()), 1.0)
    axis.set_ylabel("autocorrelation")
    axis.set_xlabel(f"lag [samples], residuals of {one.signal}")
    _legend(axis)


def plot_ranking(found: Mapping[str, Any], path: str | Path | None = None) -> Figure:
    """Plot errors and BIC of several laws as bars, with the best law on top."""
    rows = [row for row in found["rows"] if row["status"]]
    figure, ((errors, criterion),) = grid(1, 2, 8.5, 1.2 + 0.42 * max(1, len(rows)), sharey=True)
    places = np.arange(len(rows))[::-1]
    for shift, key, label, shade in (
        (0.2, "validation [%]", "not fitted to", colour(0)), (-0.2, "fit [%]", "fitted to", "0.7"),
    ):  # fmt: skip
        values = [row[key] or 0.0 for row in rows]
        errors.barh(places + shift, values, height=0.38, color=shade, label=label)
    costs = ["no law" if (n := row["operations"]) is None else f"{n} op." for row in rows]
    names = [f"{r['law']}\n{r['parameters']} par., {c}" for r, c in zip(rows, costs, strict=True)]
    errors.set_yticks(places, labels=names)
    errors.set_xlabel("rms error over the spread [%]")
    errors.legend(fontsize="small")
    colours = [colour(2) if row["status"] == "SOLVED" else colour(1) for row in rows]
    criterion.barh(places, [row["BIC"] or 0.0 for row in rows], height=0.5, color=colours)
    for place, row in zip(places, rows, strict=True):
        criterion.annotate(
            row["status"], (0.0, place), (4, 0),
            textcoords="offset points", va="center", fontsize="small",
        )  # fmt: skip
    criterion.set_xlabel("BIC over that of the best")
    for axis in (errors, criterion):
        axis.grid(visible=False, axis="y")
    figure.suptitle(f"{found['data']}: {found['how']}", fontsize="medium")
    return save(figure, path)
