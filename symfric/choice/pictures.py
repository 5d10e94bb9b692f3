"""The choice as a picture: error against work of all laws, and all of them by name."""

from collections.abc import Sequence
from pathlib import Path
from statistics import median
from textwrap import wrap

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import Bbox

from symfric.choice.nature import GROUPS, shown
from symfric.choice.ranking import Ranking, Row
from symfric.foundation.panels import blank, dressed, save
from symfric.foundation.style import MARKERS, colour

KINDS = (*GROUPS.values(), "sliding")
"""Groups of laws by the most that they show."""
SMALL = 7
OFFSETS = ((5, 3), (5, -9), (-5, 3), (-5, -9), (0, 8), (0, -13), (9, 9), (9, -15), (-9, 9))
"""Places of a label beside its point [points], the best first."""
BEHIND = {"fc": "w", "alpha": 0.75, "lw": 0.0, "pad": 0.6}
GAP = 3.0
"""Around a name [pixel], so that its ground hides nothing of the next."""
APART = 1e-2
"""Ranked laws of less than this share of the error allowed stand apart, and are named there."""
COLUMN, PLANE, ROW = 3.35, 2.1, 0.135
"""Width of a column of print, height of the plane and of a name beside it [inch]."""
LEAST = 3
"""Ticks of an axis of work."""
MOST = 80
"""Laws that are listed by name: all of the catalogue, so that no marker is without one."""


def plot_choice(choice: Ranking, path: str | Path | None = None, wide: bool = True) -> Figure:
    """Error against work, marked by what a law shows, and every law by its work.

    Args:
        wide: the panels side by side; else above each other, in the width of a column of print.
    """
    named = choice.placed[:MOST]
    tall = ROW * len(named) + (0.75 if wide else 0.55)
    if wide:
        figure = blank(2 * COLUMN + 0.6, max(3.6, tall + 0.6))
        plane, listed = figure.subplots(1, 2, width_ratios=(1.25, 1.0))
    else:
        figure = blank(COLUMN, PLANE + tall + 0.9)
        plane, listed = figure.subplots(2, 1, height_ratios=(PLANE, tall))
    if named:
        _by_name(dressed(listed), named, _milliseconds(choice.placed))
    else:
        figure.delaxes(listed)
    rows = _plane(dressed(plane), choice)
    figure.suptitle("\n".join(wrap(choice.title, 90 if wide else 48)), fontsize=SMALL + 2 * wide)
    handles = [
        Line2D([], [], ls="", marker=MARKERS[k], color=colour(k), label=kind, markersize=5)
        for k, kind in enumerate(KINDS)
        if any(shown(row.phenomena) == kind for row in choice.placed)
    ]
    hollow = Line2D(
        [], [], ls="", marker="o", mfc="none", mec="k", label="not ranked", markersize=5
    )
    figure.legend(
        handles=[*handles, hollow],
        loc="outside lower center",
        ncols=6 if wide else 3,
        fontsize=SMALL,
        frameon=False,
        handletextpad=0.2,
        columnspacing=1.2,
    )
    _label(figure, plane, _told(choice, rows), rows)  # last: it looks where everything stands
    return save(figure, path)


def _milliseconds(rows: Sequence[Row]) -> float:
    """Processor time of a million instructions [ms], in the middle of the laws."""
    return median(1e9 * row.time_s / row.work for row in rows) if rows else 0.0


def _plane(axis: Axes, choice: Ranking) -> list[Row]:
    """All laws where they are at equal error; those that stand in the picture."""
    rows = [row for row in choice.placed if 0.0 < row.error < 1e3]
    for row in rows:
        k = KINDS.index(shown(row.phenomena))
        axis.plot(
            1e-6 * row.work, row.error, MARKERS[k], ms=4.5, mew=0.9, mec=colour(k),
            mfc=colour(k) if row.ranked else "none", zorder=3 if row.ranked else 2,
        )  # fmt: skip
    axis.axhline(choice.accuracy, color="k", lw=0.8, ls=(0, (5, 2)), zorder=0)
    axis.set(xscale="log", yscale="log")
    axis.set_xlabel("work [million instructions]", fontsize=SMALL + 1)
    axis.set_ylabel("error / motion", fontsize=SMALL + 1)
    axis.tick_params(labelsize=SMALL)
    if rows:
        _round(axis, [1e-6 * row.work for row in rows])
    least = min((row.error for row in rows if row.error > 1e-9), default=1e-6)
    axis.set_ylim(bottom=max(1e-9, 0.1 * min(least, choice.accuracy)))
    return rows


def _told(choice: Ranking, rows: Sequence[Row]) -> list[Row]:
    """Which are named there: the first, those that stand apart, and all that are not ranked."""
    apart = (row for row in choice.ranked[1:] if row.error < APART * choice.accuracy)
    others = sorted((row for row in rows if not row.ranked), key=lambda row: row.work)
    return [*choice.ranked[:1], *apart, *others]


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
                row.law, (1e-6 * row.work, row.error), (dx, dy), textcoords="offset points",
                fontsize=SMALL - 1, bbox=BEHIND, ha=side,
            )  # fmt: skip
            box = text.get_window_extent().padded(GAP)
            text.set_in_layout(False)
            within = inside.contains(box.x0, box.y0) and inside.contains(box.x1, box.y1)
            if within and not any(box.overlaps(other) for other in taken):
                taken.append(box)
                break
            text.remove()


def _around(axis: Axes, row: Row, size: float) -> Bbox:
    """The square that the marker of a row covers [pixel]."""
    x, y = axis.transData.transform((1e-6 * row.work, row.error))
    return Bbox.from_extents(x - size / 2, y - size / 2, x + size / 2, y + size / 2)


def _by_name(axis: Axes, named: Sequence[Row], milliseconds: float) -> None:
    """The work of each of them, by rank."""
    for place, row in enumerate(named):
        k = KINDS.index(shown(row.phenomena))
        face = colour(k) if row.ranked else "none"
        axis.plot(1e-6 * row.work, place, MARKERS[k], mec=colour(k), mfc=face, ms=4.5)
    axis.set_yticks(range(len(named)), [f"{row.law}  {row.rank}" for row in named], fontsize=SMALL)
    axis.set(xscale="log")
    axis.set_xlabel(
        f"work [million instructions]\n{milliseconds:.2g} ms each here",
        fontsize=SMALL + 1,
    )
    axis.set_ylim(len(named) - 0.4, -0.6)
    _round(axis, [1e-6 * row.work for row in named])


def _round(axis: Axes, values: Sequence[float]) -> None:
    """A logarithmic axis with round numbers on it, three at least where it can."""
    low, high = 0.8 * min(values), 1.25 * max(values)
    ticks: list[float] = []
    for digits in ((1,), (1, 2, 5), (1, 1.5, 2, 3, 4, 5, 7)):
        if len(ticks) < LEAST:
            nice = [digit * 10.0**power for power in range(-6, 9) for digit in digits]
            ticks = [t for t in nice if low <= t <= high]
    axis.set_xlim(low, high)
    axis.set_xticks(ticks, [f"{t:g}" for t in ticks], fontsize=SMALL)
    axis.minorticks_off()
