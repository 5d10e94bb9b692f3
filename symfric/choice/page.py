"""The choice as one page that needs nothing from elsewhere: verdict, picture, table."""

from collections.abc import Sequence
from html import escape
from math import isfinite

from symfric.choice.nature import NEEDS
from symfric.choice.pictures import plot_choice
from symfric.choice.ranking import Ranking, Row
from symfric.choice.text import GROUPS, interrupted, number, verdict
from symfric.foundation.shown import data_uri
from symfric.page import html

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
    """The whole document."""
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
    """The picture for wide and for narrow screens, at twice its size for sharp ones."""
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
    for standing, text in GROUPS.items():
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
