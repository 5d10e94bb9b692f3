"""The choice as one page that needs nothing from elsewhere: verdict, picture, table."""

from collections.abc import Sequence
from html import escape
from math import isfinite
from typing import TYPE_CHECKING

from symfric.choice.needs import NEEDS
from symfric.choice.pictures import plot_choice
from symfric.choice.row import Row
from symfric.choice.text import GROUPS, interrupted, number
from symfric.foundation.panels import data_uri

if TYPE_CHECKING:
    from symfric.choice.result import Choice

STYLE = """
body { font: 15px/1.5 system-ui, "DejaVu Sans", Arial, sans-serif; color: #1c2530; margin: 0; }
main { max-width: 76rem; margin: 0 auto; padding: 1.5rem 1.25rem 4rem; }
h1 { font-size: 1.5rem; margin: 0 0 .3rem; } h2 { font-size: 1.1rem; margin: 2rem 0 .5rem; }
.soft { color: #5b6775; } img { max-width: 100%; height: auto; }
.verdict { background: #f4f6f8; border-left: .4rem solid #1d7a3e; padding: .5rem 1rem; }
.verdict.none { border-color: #b3261e; } .verdict p { margin: .4rem 0; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .8rem; font-variant-numeric: tabular-nums; }
th, td { padding: .2rem .5rem .2rem 0; border-bottom: 1px solid #d5dbe1; text-align: left;
  vertical-align: top; } thead th { color: #5b6775; }
td.n { text-align: right; white-space: nowrap; } td.why { min-width: 20rem; }
tr.best td { font-weight: 600; }
tr.group td { padding-top: .8rem; color: #5b6775; font-style: italic; }
td .soft { display: block; font-weight: 400; font-size: .75rem; min-width: 12rem; }
"""

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


def page(choice: "Choice") -> str:
    """The whole document."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(choice.title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<main>\n"
        f"<h1>{escape(choice.title)}</h1>\n{_asked(choice)}\n{body(choice, 760)}\n{_meaning()}\n"
        "</main>\n</body>\n</html>\n"
    )


def body(choice: "Choice", width: int = 640) -> str:
    """Verdict, picture and tables, for a page or a notebook."""
    said = "".join(f"<p>{escape(sentence)}</p>" for sentence in choice.verdict)
    kind = "verdict" if choice.ranked else "verdict none"
    stopped = f"<p>{escape(interrupted(choice))}</p>" if choice.interrupted else ""
    parts = [f'<div class="{kind}">{said}{stopped}</div>', f"<p>{_image(choice, width)}</p>"]
    if choice.placed:
        parts += ["<h2>All laws that run here</h2>", _placed(choice)]
    others = [row for row in choice.rows if not row.rank]
    if others:
        parts += ["<h2>Laws that do not run here, and why</h2>", _others(others)]
    return "\n".join(parts)


def _image(choice: "Choice", width: int) -> str:
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


def _asked(choice: "Choice") -> str:
    uncertain = f"{choice.uncertain:.0e}" if isfinite(choice.uncertain) else "an unknown amount"
    return (
        f'<p class="soft">All laws describe {escape(choice.friction)}. Errors are measured from '
        f"{escape(choice.reference)}, itself known to {uncertain}, over {choice.t_end:g} s. "
        f"Fixed steps may be {choice.control:g} off. Measured in {choice.wall_s:.0f} s.</p>"
    )


def _placed(choice: "Choice") -> str:
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
    return _table(head, lines)


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
    cells = "".join(f'<td class="n"{_title(hint)}>{escape(text)}</td>' for text, hint in numbers)
    why = f' <span class="soft">{escape(row.reason)}</span>' if row.reason else ""
    texts = (row.smoothness, " ".join(row.phenomena), values or "as it comes")
    last = "".join(f"<td>{escape(t)}</td>" for t in texts)
    return f'<td class="n">{row.rank}</td><td>{escape(row.law)}{why}</td>{cells}{last}'


def _title(hint: str) -> str:
    return f' title="{escape(hint)}"' if hint else ""


def _step(value: float | None) -> str:
    return "-" if value is None else f"{value:g}"


def _others(rows: Sequence[Row]) -> str:
    head = "".join(f"<th>{name}</th>" for name in ("law", "why"))
    lines = [
        f"<tr><td>{escape(row.called)}</td>"
        f'<td class="why">{escape(f"{row.standing}: {row.reason}")}</td></tr>'
        for row in rows
    ]
    return _table(head, lines)


def _table(head: str, lines: Sequence[str]) -> str:
    return (
        f'<div class="wide"><table><thead><tr>{head}</tr></thead>\n<tbody>\n'
        + "\n".join(lines)
        + "\n</tbody></table></div>"
    )


def _meaning() -> str:
    """What columns and codes mean."""
    columns = "".join(f"<li><b>{escape(n)}</b>: {escape(why)}</li>" for n, why in COLUMNS)
    codes = "; ".join(
        f"{code}: {escape(word)} ({escape(why)})" for word, (code, why) in NEEDS.items()
    )
    return f"<h2>What the columns mean</h2>\n<ul>{columns}</ul>\n<p>Shows: {codes}.</p>"
