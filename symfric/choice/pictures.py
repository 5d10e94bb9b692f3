"""The choice as a picture: error against time of all laws, and the ranked ones by name."""

from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import Bbox

from symfric.choice.nature import GROUPS, shown
from symfric.choice.row import Row
from symfric.foundation.panels import blank, dressed, save
from symfric.foundation.style import MARKERS, QUIET, colour

if TYPE_CHECKING:
    from symfric.choice.result import Choice

KINDS = (*GROUPS.values(), "sliding")
"""Groups of laws by the most that they show."""
SMALL = 7
OFFSETS = ((5, 3), (5, -9), (-5, 3), (-5, -9), (0, 8), (0, -13), (9, 9), (9, -15), (-9, 9))
"""Places of a label beside its point [points], the best first."""
BEHIND = {"fc": "w", "alpha": 0.75, "lw": 0.0, "pad": 0.6}
APART = 1e-2
"""Ranked laws of less than this share of the error allowed stand apart, and are named there."""
LEAST = 3
"""Ticks of an axis of times."""
MOST = 30
"""Ranked laws that are drawn by name."""


def plot_choice(choice: "Choice", path: str | Path | None = None) -> Figure:
    """Error against time, marked by what a law shows; beside it the ranked laws by their time."""
    ranked = choice.ranked[:MOST]
    figure = blank(7.6, max(3.6, 1.3 + 0.155 * len(ranked)))
    if ranked:
        left, right = figure.subplots(1, 2, width_ratios=(1.25, 1.0))
        _by_name(dressed(right), ranked)
    else:
        left = figure.subplots()
    _plane(figure, dressed(left), choice)
    figure.suptitle(choice.title, fontsize=10)
    handles = [
        Line2D([], [], ls="", marker=MARKERS[k], color=colour(k), label=kind, markersize=5)
        for k, kind in enumerate(KINDS)
        if any(shown(row.phenomena) == kind for row in choice.rows)
    ]
    hollow = Line2D(
        [], [], ls="", marker="o", mfc="none", mec="k", label="not ranked", markersize=5
    )
    figure.legend(
        handles=[*handles, hollow],
        loc="outside lower center",
        ncols=6,
        fontsize=SMALL,
        frameon=False,
    )
    return save(figure, path)


def _plane(figure: Figure, axis: Axes, choice: "Choice") -> None:
    """All laws: where they are at equal error, and how they came there."""
    rows = [row for row in choice.rows if isfinite(row.time_s) and 0.0 < row.error < 1e3]
    for row in rows:
        if row.ranked:
            errors, times = zip(*row.curve, strict=True) if row.curve else ((), ())
            axis.plot([1e3 * t for t in times], errors, color=QUIET, lw=0.5, alpha=0.6, zorder=1)
    for row in rows:
        k = KINDS.index(shown(row.phenomena))
        face = colour(k) if row.ranked else "none"
        axis.plot(
            1e3 * row.time_s, row.error, MARKERS[k], ms=4.5, mfc=face, mec=colour(k), mew=0.9,
            zorder=3 if row.ranked else 2,
        )  # fmt: skip
    axis.axhline(choice.accuracy, color="k", lw=0.8, ls=(0, (5, 2)), zorder=0)
    axis.set(xscale="log", yscale="log", xlabel="processor time [ms]", ylabel="error / motion")
    axis.tick_params(labelsize=SMALL + 1)
    if rows:
        curves = [t for row in rows if row.ranked for _, t in row.curve or ()]
        _times(axis, [1e3 * t for t in (*(row.time_s for row in rows), *curves)])
    least = min((row.error for row in rows if row.error > 1e-9), default=1e-6)
    axis.set_ylim(bottom=max(1e-9, 0.1 * min(least, choice.accuracy)))
    apart = (row for row in choice.ranked[1:] if row.error < APART * choice.accuracy)
    named = [*choice.ranked[:1], *apart, *(row for row in rows if not row.ranked)]
    _label(figure, axis, named, rows)


def _label(figure: Figure, axis: Axes, named: Sequence[Row], rows: Sequence[Row]) -> None:
    """Names beside points where they hide nothing; a name without such a place is left out."""
    figure.draw_without_rendering()
    size = 5.0 * figure.dpi / 72
    taken = [_around(axis, row, size) for row in rows]
    inside = axis.get_window_extent()
    for row in named:
        for dx, dy in OFFSETS:
            side = "left" if dx > 0 else "right" if dx < 0 else "center"
            text = axis.annotate(
                row.law, (1e3 * row.time_s, row.error), (dx, dy), textcoords="offset points",
                fontsize=SMALL - 1, bbox=BEHIND, ha=side,
            )  # fmt: skip
            box = text.get_window_extent()
            text.set_in_layout(False)
            within = inside.contains(box.x0, box.y0) and inside.contains(box.x1, box.y1)
            if within and not any(box.overlaps(other) for other in taken):
                taken.append(box)
                break
            text.remove()


def _around(axis: Axes, row: Row, size: float) -> Bbox:
    """The square that the marker of a row covers [pixel]."""
    x, y = axis.transData.transform((1e3 * row.time_s, row.error))
    return Bbox.from_extents(x - size / 2, y - size / 2, x + size / 2, y + size / 2)


def _by_name(axis: Axes, ranked: Sequence[Row]) -> None:
    """The time of each ranked law, the fastest on top."""
    for place, row in enumerate(ranked):
        k = KINDS.index(shown(row.phenomena))
        axis.plot(1e3 * row.time_s, place, MARKERS[k], color=colour(k), ms=4.5)
    axis.set_yticks(range(len(ranked)), [row.law for row in ranked], fontsize=SMALL)
    axis.set(xscale="log", xlabel="processor time at equal error [ms]")
    axis.set_ylim(len(ranked) - 0.4, -0.6)
    times = [1e3 * row.time_s for row in ranked]
    _times(axis, times)


def _times(axis: Axes, times: Sequence[float]) -> None:
    """A logarithmic axis of times [ms] with round numbers on it, three at least where it can."""
    low, high = 0.8 * min(times), 1.25 * max(times)
    ticks: list[float] = []
    for digits in ((1,), (1, 2, 5), (1, 1.5, 2, 3, 4, 5, 7)):
        if len(ticks) < LEAST:
            nice = [digit * 10.0**power for power in range(-3, 6) for digit in digits]
            ticks = [t for t in nice if low <= t <= high]
    axis.set_xlim(low, high)
    axis.set_xticks(ticks, [f"{t:g}" for t in ticks], fontsize=SMALL + 1)
    axis.minorticks_off()
