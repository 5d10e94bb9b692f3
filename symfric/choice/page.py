"""Choice as pictures, and as one page that needs nothing from elsewhere."""

from collections.abc import Sequence
from html import escape
from math import isfinite
from pathlib import Path
from statistics import median
from textwrap import wrap

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import Bbox

from symfric.choice.nature import GROUPS, NEEDS, shown
from symfric.choice.ranking import Ranking, Row
from symfric.choice.text import STANDING_TEXTS, interrupted, number, verdict
from symfric.foundation.panels import blank, dressed, save
from symfric.foundation.shown import data_uri
from symfric.foundation.style import MARKERS, colour
from symfric.page import html

KINDS = (*GROUPS.values(), "sliding")
"""Groups of laws by the most that they show."""
SMALL = 7
OFFSETS = ((5, 3), (5, -9), (-5, 3), (-5, -9), (0, 8), (0, -13), (9, 9), (9, -15), (-9, 9))
"""Places of a label next to its point [points], the best first."""
BEHIND = {"fc": "w", "alpha": 0.75, "lw": 0.0, "pad": 0.6}
GAP = 3.0
"""Around a name [pixel], so that its ground hides nothing of the next."""
APART = 1e-2
"""Ranked laws of less than this share of the error allowed stand apart, and are named there."""
COLUMN, PLANE, ROW = 3.35, 2.1, 0.135
"""Width of a column of print, height of the plane and of a name next to it [inch]."""
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
    """Plot all laws at equal error, and return those in the picture."""
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
    """Return the laws to be named there: the first, those apart, and all that are not ranked."""
    apart = (row for row in choice.ranked[1:] if row.error < APART * choice.accuracy)
    others = sorted((row for row in rows if not row.ranked), key=lambda row: row.work)
    return [*choice.ranked[:1], *apart, *others]


def _label(figure: Figure, axis: Axes, named: Sequence[Row], rows: Sequence[Row]) -> None:
    """Names next to points where they hide nothing; a name without such a place is left out."""
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
    """Return the square that the marker of a row covers [pixel]."""
    x, y = axis.transData.transform((1e-6 * row.work, row.error))
    return Bbox.from_extents(x - size / 2, y - size / 2, x + size / 2, y + size / 2)


def _by_name(axis: Axes, named: Sequence[Row], milliseconds: float) -> None:
    """Return the work of each of them, by rank."""
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
    """Return a logarithmic axis with round numbers on it, three at least where it can."""
    low, high = 0.8 * min(values), 1.25 * max(values)
    ticks: list[float] = []
    for digits in ((1,), (1, 2, 5), (1, 1.5, 2, 3, 4, 5, 7)):
        if len(ticks) < LEAST:
            nice = [digit * 10.0**power for power in range(-6, 9) for digit in digits]
            ticks = [t for t in nice if low <= t <= high]
    axis.set_xlim(low, high)
    axis.set_xticks(ticks, [f"{t:g}" for t in ticks], fontsize=SMALL)
    axis.minorticks_off()


COLUMNS = (
    ("rank", "place among all that run; laws that are alike share it"),
    ("law", "name in the catalogue"),
    ("work", "attempts of a step times what one counts, in millions of instructions: it ranks"),
    ("ms", "processor time of that run in CasADi's virtual machine"),
    ("error", "largest difference from the reference, relative to the motion"),
    ("own error", "that from the finest run of the law itself: the integrator's part"),
    ("attempts", "of a step"),
    ("rtol", "loosest relative tolerance that keeps the accuracy"),
    ("fixed [s]", "largest step of backward Euler in which the plant follows the motion"),
    ("explicit [s]", "largest step of an explicit Runge-Kutta method of order 5 in which it does"),
    ("M4F", "instructions of the law's step on a Cortex-M4F, in the mean over a drive's day"),
    ("C", "operations of the law's step in C, float"),
    ("parameters", "that describe friction; of these hard to measure"),
    ("class", "smoothness in the velocity"),
    ("shows", "codes of what it shows"),
    ("numbers", "what to give the law: parameters that it does not come with"),
)
"""Head of a column, and what it means."""
NARROW = 700
"""Width of a screen [pixel] below which the narrow picture is shown."""


def page(choice: Ranking) -> str:
    """Return the whole document."""
    parts = (html.title(choice.title), _asked(choice), body(choice, 760), _meaning())
    return html.page(choice.title, "en", "\n".join(parts))


def body(choice: Ranking, width: int = 640) -> str:
    """Verdict, picture and tables, for a page or a notebook."""
    said = verdict(choice.rows, choice.needs, choice.accuracy, choice.control)
    stopped = [interrupted(choice)] if choice.interrupted else []
    parts = [
        html.verdict("good" if choice.ranked else "bad", "", [*said, *stopped]),
        f"<p>{_image(choice, width)}</p>",
    ]
    if choice.placed:
        parts += ["<h2>All laws that run here</h2>", _placed(choice)]
    if others := [row for row in choice.rows if not row.rank]:
        parts += ["<h2>Laws that do not run here, and why</h2>", _others(others)]
    return "\n".join(parts)


def _image(choice: Ranking, width: int) -> str:
    """Return the picture for wide and for narrow screens, at twice its size for sharp ones."""
    wide, narrow = (plot_choice(choice, wide=wide) for wide in (True, False))
    source = data_uri(wide, 2 * width / float(wide.get_size_inches()[0]))
    small = data_uri(narrow, 2 * SMALL_WIDTH / float(narrow.get_size_inches()[0]))
    return (
        f'<picture><source media="(max-width: {NARROW}px)" srcset="{small}">'
        f'<img src="{source}" alt="{escape(choice.title)}" width="{width}"></picture>'
    )


SMALL_WIDTH = 400
"""Of the narrow picture [pixel]."""


def _asked(choice: Ranking) -> str:
    uncertain = f"{choice.uncertain:.0e}" if isfinite(choice.uncertain) else "an unknown amount"
    return html.paragraph(
        f"All laws describe {choice.friction}. Errors are measured from {choice.reference}, itself "
        f"known to {uncertain}, over {choice.t_end:g} s. Fixed steps may be {choice.control:g} "
        f"off. Measured in {choice.wall_s:.0f} s.",
        "soft",
    )


def _placed(choice: Ranking) -> str:
    head = "".join(f'<th title="{escape(why)}">{escape(name)}</th>' for name, why in COLUMNS)
    lines = list[str]()
    for standing, text in STANDING_TEXTS.items():
        group = [row for row in choice.placed if row.standing == standing]
        if group:
            lines.append(
                f'<tr class="group"><td colspan="{len(COLUMNS)}">Laws that {text}</td></tr>'
            )
        lines += [
            f"<tr{' class=best' if row.rank == 1 else ''}>{_cells(row)}</tr>" for row in group
        ]
    return (
        f'<div class="wide"><table><thead><tr>{head}</tr></thead>\n<tbody>\n'
        f"{chr(10).join(lines)}\n</tbody></table></div>"
    )


def _cells(row: Row) -> str:
    form = [f"form = {row.form}"] if row.form else []
    values = ", ".join([*form, *(f"{n} = {value:.3g}" for n, value in (row.values or {}).items())])
    numbers = (
        (number(1e-6 * row.work), ""),
        (number(1e3 * row.time_s), ""),
        (f"{row.error:.1e}", row.reason),
        (f"{row.own_error:.1e}" if isfinite(row.own_error) else "-", ""),
        (str(row.attempts), f"by {row.method}"),
        (f"{row.rtol:.0e}", ""),
        (_step(row.fixed_step), row.fixed_why),
        (_step(row.explicit_step), row.explicit_why),
        (f"{row.core:.0f}" if isfinite(row.core) else "-", row.core_why),
        ("-" if row.c_operations is None else str(row.c_operations), row.c_why),
        (f"{row.parameters} / {len(row.hard)}", " ".join(row.hard)),
    )
    cells = "".join(
        f'<td class="number"{_title(hint)}>{escape(text)}</td>' for text, hint in numbers
    )
    why = f' <span class="soft">{escape(row.reason)}</span>' if row.reason else ""
    texts = (row.smoothness, " ".join(row.phenomena), values or "as it comes")
    last = "".join(f"<td>{escape(t)}</td>" for t in texts)
    return f'<td class="number">{row.rank}</td><td>{escape(row.law)}{why}</td>{cells}{last}'


def _title(hint: str) -> str:
    return f' title="{escape(hint)}"' if hint else ""


def _step(value: float | None) -> str:
    return "-" if value is None else f"{value:g}"


def _others(rows: Sequence[Row]) -> str:
    lines = [(row.called, f"{row.standing}: {row.reason}") for row in rows]
    return html.table("", ("law", "why"), lines, kinds=["why"] * len(lines))


def _meaning() -> str:
    """Meaning of columns and codes."""
    columns = html.bullets(f"{name}: {why}" for name, why in COLUMNS)
    codes = "; ".join(f"{code}: {word} ({why})" for word, (code, why) in NEEDS.items())
    return f"<h2>What the columns mean</h2>\n{columns}\n{html.paragraph(f'Shows: {codes}.')}"
