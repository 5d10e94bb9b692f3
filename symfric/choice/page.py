"""Figures of a ranking of laws, and a self-contained HTML page."""

from collections.abc import Sequence
from html import escape
from math import isfinite
from pathlib import Path
from statistics import median
from textwrap import wrap
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import Bbox

from symfric.choice.nature import NEEDS
from symfric.choice.ranking import STANDING_TEXTS, RankedLaw, Ranking, interruption, number
from symfric.foundation.panels import blank, dressed, save
from symfric.foundation.shown import data_uri
from symfric.foundation.style import MARKERS, colour
from symfric.page import html

GROUPS = {"M": "memory", "P": "presliding", "St": "Stribeck", "S": "stiction"}
"""Groups of laws in figures by code of phenomenon, with the most demanding first."""
KINDS = (*GROUPS.values(), "sliding")
SMALL = 7
OFFSETS = ((5, 3), (5, -9), (-5, 3), (-5, -9), (0, 8), (0, -13), (9, 9), (9, -15), (-9, 9))
"""Positions of a label relative to its data point [typographic points], in order of preference."""
BEHIND = {"fc": "w", "alpha": 0.75, "lw": 0.0, "pad": 0.6}
GAP = 3.0
"""Margin of a label [pixel], so that its background does not hide the next label."""
APART = 1e-2
"""Share of the accuracy below which a ranked law is labelled."""
COLUMN, PLANE, ROW = 3.35, 2.1, 0.135
"""Width of a printed column, height of the plane, and height of a row of the list [inch]."""
LEAST = 3
"""Smallest number of ticks on an axis of work."""
MOST = 80
"""Largest number of listed laws, which exceeds the size of the catalogue."""


def plot_choice(choice: Ranking, path: str | Path | None = None, wide: bool = True) -> Figure:
    """Draw error against work, with markers for phenomena, and a list of all laws with their work.

    Args:
        choice: the ranking.
        path: image file.
        wide: True for panels side by side, False for one panel above the other in the width of a
            printed column.
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
        _list(dressed(listed), named, median(1e9 * r.time_s / r.work for r in choice.placed))
    else:
        figure.delaxes(listed)
    rows = _plane(dressed(plane), choice)
    figure.suptitle("\n".join(wrap(choice.title, 90 if wide else 48)), fontsize=SMALL + 2 * wide)
    kinds = {_kind(row) for row in choice.placed}
    handles = [
        Line2D([], [], ls="", marker=MARKERS[k], color=colour(k), label=KINDS[k], markersize=5)
        for k in sorted(kinds)
    ]
    hollow: dict[str, Any] = {"ls": "", "marker": "o", "mfc": "none", "mec": "k", "markersize": 5}
    figure.legend(
        handles=[*handles, Line2D([], [], label="not ranked", **hollow)],
        loc="outside lower center", ncols=6 if wide else 3, fontsize=SMALL, frameon=False,
        handletextpad=0.2, columnspacing=1.2,
    )  # fmt: skip
    apart = (row for row in choice.ranked[1:] if row.error < APART * choice.accuracy)
    others = sorted((row for row in rows if not row.ranked), key=lambda row: row.work)
    _label(figure, plane, [*choice.ranked[:1], *apart, *others], rows)  # needs the final layout
    return save(figure, path)


def _kind(row: RankedLaw) -> int:
    """Return the index in `KINDS` of the most demanding phenomenon of a law."""
    codes = [*GROUPS]
    return next((k for k, code in enumerate(codes) if code in row.phenomena), len(codes))


def _point(axis: Axes, row: RankedLaw, y: float, size: float) -> None:
    """Draw the marker of a law at its work; filled if it is ranked, otherwise hollow."""
    k = _kind(row)
    axis.plot(
        1e-6 * row.work, y, MARKERS[k], ms=size, mew=0.9, mec=colour(k),
        mfc=colour(k) if row.ranked else "none", zorder=3 if row.ranked else 2,
    )  # fmt: skip


def _plane(axis: Axes, choice: Ranking) -> list[RankedLaw]:
    """Draw error against work, and return the rows of the laws within the plotted range."""
    rows = [row for row in choice.placed if 0.0 < row.error < 1e3]
    for row in rows:
        _point(axis, row, row.error, 4.5)
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


def _label(
    figure: Figure, axis: Axes, named: Sequence[RankedLaw], rows: Sequence[RankedLaw]
) -> None:
    """Write names next to their points; omit names that would overlap in every position."""
    figure.draw_without_rendering()
    half = 2.5 * figure.dpi / 72  # half width of a marker [pixel]
    points = (axis.transData.transform((1e-6 * row.work, row.error)) for row in rows)
    taken = [Bbox.from_extents(*(point - half), *(point + half)) for point in points]
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


def _list(axis: Axes, named: Sequence[RankedLaw], milliseconds: float) -> None:
    """Draw the work of each law by rank; the label states that a million takes `milliseconds`."""
    for y, row in enumerate(named):
        _point(axis, row, y, 4.5)
    axis.set_yticks(range(len(named)), [f"{row.law}  {row.rank}" for row in named], fontsize=SMALL)
    axis.set(xscale="log")
    label = f"work [million instructions]\n{milliseconds:.2g} ms each here"
    axis.set_xlabel(label, fontsize=SMALL + 1)
    axis.set_ylim(len(named) - 0.4, -0.6)
    _round(axis, [1e-6 * row.work for row in named])


def _round(axis: Axes, values: Sequence[float]) -> None:
    """Set ticks at round numbers of a logarithmic axis, at least three if possible."""
    low, high = 0.8 * min(values), 1.25 * max(values)
    ticks: list[float] = []
    for digits in ((1,), (1, 2, 5), (1, 1.5, 2, 3, 4, 5, 7)):
        if len(ticks) < LEAST:
            nice = [digit * 10.0**power for power in range(-6, 9) for digit in digits]
            ticks = [t for t in nice if low <= t <= high]
    axis.set_xlim(low, high)
    axis.set_xticks(ticks, [f"{t:g}" for t in ticks], fontsize=SMALL)
    axis.minorticks_off()


COLUMNS = {
    "rank": "rank among all laws that run; similar laws share it",
    "law": "name in the catalogue",
    "work": "attempted steps times instructions per step, in millions; it determines the rank",
    "ms": "processor time of this run in CasADi's virtual machine",
    "error": "largest difference from the reference, relative to the motion",
    "own error": "largest difference from the finest run of the same law: error of the integrator",
    "attempts": "attempted steps",
    "rtol": "loosest relative tolerance that keeps the accuracy",
    "fixed [s]": "largest step of backward Euler in which the plant follows the motion",
    "explicit [s]": "largest step of an explicit Runge-Kutta method of order 5 in which it does",
    "M4F": "instructions of the law's step on a Cortex-M4F, averaged over a typical drive",
    "C": "operations of the law's step in C with float",
    "parameters": "number of parameters that describe friction; how many are hard to measure",
    "class": "smoothness in the velocity",
    "shows": "codes of its phenomena",
    "numbers": "parameters that differ from the defaults of the law",
}
"""Headings of the columns of the table, and their meanings."""
NARROW = 700
"""Width of a screen [pixel] below which the narrow figure is shown."""
SMALL_WIDTH = 400
"""Width of the narrow figure [pixel]."""


def page(choice: Ranking) -> str:
    """Return the HTML page of a ranking."""
    uncertain = f"{choice.uncertain:.0e}" if isfinite(choice.uncertain) else "an unknown amount"
    about = html.paragraph(
        f"All laws describe {choice.friction}. Errors are measured from {choice.reference}, itself "
        f"known to {uncertain}, over {choice.t_end:g} s. Fixed steps may be {choice.control:g} "
        f"off. Measured in {choice.wall_s:.0f} s.",
        "soft",
    )
    codes = "; ".join(f"{code}: {word} ({why})" for word, (code, why) in NEEDS.items())
    meaning = [
        "<h2>What the columns mean</h2>",
        html.bullets(f"{name}: {why}" for name, why in COLUMNS.items()),
        html.paragraph(f"Shows: {codes}."),
    ]
    parts = (html.title(choice.title), about, body(choice, 760), *meaning)
    return html.page(choice.title, "en", "\n".join(parts))


def body(choice: Ranking, width: int = 640) -> str:
    """Return the verdict, the figure and the tables as HTML, for a page or a notebook."""
    sentences = [*choice.verdict, *interruption(choice)]
    parts = [
        html.verdict("good" if choice.ranked else "bad", "", sentences),
        f"<p>{_image(choice, width)}</p>",
    ]
    if choice.placed:
        parts += ["<h2>All laws that run here</h2>", _placed(choice)]
    if others := [row for row in choice.rows if not row.rank]:
        cells = [(row.called, f"{row.standing}: {row.reason}") for row in others]
        table = html.table("", ("law", "why"), cells, kinds=["why"] * len(cells))
        parts += ["<h2>Laws that do not run here, and why</h2>", table]
    return "\n".join(parts)


def _image(choice: Ranking, width: int) -> str:
    """Return the HTML of the figure for wide and narrow screens, at twice the resolution."""
    wide, narrow = (plot_choice(choice, wide=wide) for wide in (True, False))
    source = data_uri(wide, 2 * width / float(wide.get_size_inches()[0]))
    small = data_uri(narrow, 2 * SMALL_WIDTH / float(narrow.get_size_inches()[0]))
    return (
        f'<picture><source media="(max-width: {NARROW}px)" srcset="{small}">'
        f'<img src="{source}" alt="{escape(choice.title)}" width="{width}"></picture>'
    )


def _placed(choice: Ranking) -> str:
    """Return the HTML table of all laws that run, grouped by standing."""
    head = "".join(
        f'<th title="{escape(why)}">{escape(name)}</th>' for name, why in COLUMNS.items()
    )
    lines = list[str]()
    for standing, text in STANDING_TEXTS.items():
        group = [row for row in choice.placed if row.standing == standing]
        heading = f'<td colspan="{len(COLUMNS)}">Laws that {text}</td>'
        lines += [f'<tr class="group">{heading}</tr>'] * bool(group)
        lines += [f"<tr{' class=best' * (row.rank == 1)}>{_cells(row)}</tr>" for row in group]
    return (
        f'<div class="wide"><table><thead><tr>{head}</tr></thead>\n<tbody>\n'
        f"{chr(10).join(lines)}\n</tbody></table></div>"
    )


def _cells(row: RankedLaw) -> str:
    """Return the HTML cells of a law in the order of `COLUMNS`."""

    def known(value: float | None, form: str) -> str:
        return "-" if value is None or not isfinite(value) else format(value, form)

    numbers = (
        (number(1e-6 * row.work), ""),
        (number(1e3 * row.time_s), ""),
        (f"{row.error:.1e}", row.reason),
        (known(row.own_error, ".1e"), ""),
        (str(row.attempts), f"by {row.method}"),
        (f"{row.rtol:.0e}", ""),
        (known(row.fixed_step, "g"), row.fixed_why),
        (known(row.explicit_step, "g"), row.explicit_why),
        (known(row.core, ".0f"), row.core_why),
        (known(row.c_operations, "d"), row.c_why),
        (f"{row.parameters} / {len(row.hard)}", " ".join(row.hard)),
    )
    cells = [f'<td class="number">{row.rank}</td>']
    why = f' <span class="soft">{escape(row.reason)}</span>' * bool(row.reason)
    cells.append(f"<td>{escape(row.law)}{why}</td>")
    for text, hint in numbers:
        title = f' title="{escape(hint)}"' * bool(hint)
        cells.append(f'<td class="number"{title}>{escape(text)}</td>')
    form = [f"form = {row.form}"] * bool(row.form)
    values = ", ".join([*form, *(f"{n} = {value:.3g}" for n, value in (row.values or {}).items())])
    texts = (row.smoothness, " ".join(row.phenomena), values or "defaults")
    return "".join([*cells, *(f"<td>{escape(text)}</td>" for text in texts)])
