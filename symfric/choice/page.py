"""The choice as one page that needs nothing from elsewhere: verdict, picture, table."""

from collections.abc import Sequence
from html import escape
from math import isfinite
from typing import TYPE_CHECKING

from symfric.choice.needs import NEEDS
from symfric.choice.pictures import plot_choice
from symfric.choice.row import Row
from symfric.foundation.panels import data_uri

if TYPE_CHECKING:
    from symfric.choice.result import Choice

STYLE = """
body { font: 15px/1.5 system-ui, "DejaVu Sans", Arial, sans-serif; color: #1c2530; margin: 0; }
main { max-width: 66rem; margin: 0 auto; padding: 1.5rem 1.25rem 4rem; }
h1 { font-size: 1.5rem; margin: 0 0 .3rem; } h2 { font-size: 1.1rem; margin: 2rem 0 .5rem; }
.soft { color: #5b6775; } img { max-width: 100%; height: auto; }
.verdict { background: #f4f6f8; border-left: .4rem solid #1d7a3e; padding: .5rem 1rem; }
.verdict.none { border-color: #b3261e; } .verdict p { margin: .4rem 0; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .87rem; font-variant-numeric: tabular-nums; }
th, td { padding: .2rem .7rem .2rem 0; border-bottom: 1px solid #d5dbe1; text-align: left;
  vertical-align: top; white-space: nowrap; } thead th { color: #5b6775; }
td.n { text-align: right; } td.why { white-space: normal; min-width: 20rem; }
tr.best td { font-weight: 600; }
"""

COLUMNS = (
    ("law", "name in the catalogue"),
    ("time [ms]", "processor time of the run at equal error, in CasADi's virtual machine"),
    ("work", "attempts of a step times CasADi instructions of one, in millions"),
    ("attempts", "of a step, at equal error"),
    ("rtol", "loosest relative tolerance that keeps the accuracy"),
    ("error", "largest difference from the reference, relative to the motion"),
    ("fixed [s]", "largest step of backward Euler in which the plant follows the motion"),
    ("explicit [s]", "largest step of an explicit Runge-Kutta method of order 5 in which it does"),
    ("C", "operations of the law's step in C, float"),
    ("parameters", "that describe friction; of these hard to measure"),
    ("class", "smoothness in the velocity"),
    ("shows", "codes of what it shows"),
    ("numbers", "what to give the law: parameters that it does not come with"),
)
"""Head of a column, and what it means."""


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
    stopped = "<p>Interrupted: laws without a row were not measured.</p>"
    parts = [
        f'<div class="{kind}">{said}{stopped * choice.interrupted}</div>',
        f"<p>{_image(choice, width)}</p>",
    ]
    if choice.ranked:
        parts += ["<h2>Ranked by time at equal error</h2>", _ranked(choice.ranked)]
    others = [row for row in choice.rows if not row.ranked]
    if others:
        parts += ["<h2>Not ranked, and why</h2>", _others(others)]
    return "\n".join(parts)


def _image(choice: "Choice", width: int) -> str:
    """The picture, drawn at twice its `width` [pixel] for sharp screens."""
    figure = plot_choice(choice)
    source = data_uri(figure, 2 * width / float(figure.get_size_inches()[0]))
    return f'<img src="{source}" alt="{escape(choice.title)}" width="{width}">'


def _asked(choice: "Choice") -> str:
    uncertain = f"{choice.uncertain:.0e}" if isfinite(choice.uncertain) else "an unknown amount"
    return (
        f'<p class="soft">All laws describe {escape(choice.friction)}. Errors are measured from '
        f"{escape(choice.reference)}, itself known to {uncertain}, over {choice.t_end:g} s. "
        f"Fixed steps may be {choice.control:g} off. Measured in {choice.wall_s:.0f} s.</p>"
    )


def _ranked(rows: Sequence[Row]) -> str:
    head = "".join(f'<th title="{escape(why)}">{escape(name)}</th>' for name, why in COLUMNS)
    lines = [
        f"<tr{' class=best' if k == 0 else ''}>{_cells(row)}</tr>" for k, row in enumerate(rows)
    ]
    return _table(head, lines)


def _cells(row: Row) -> str:
    form = [f"form = {row.form}"] if row.form else []
    values = ", ".join([*form, *(f"{n} = {value:.3g}" for n, value in (row.values or {}).items())])
    numbers = (
        f"{1e3 * row.time_s:.2f}",
        f"{1e-6 * row.work:.2f}",
        str(row.attempts),
        f"{row.rtol:.0e}",
        f"{row.error:.1e}",
        _step(row.fixed_step),
        _step(row.explicit_step),
        "-" if row.c_operations is None else str(row.c_operations),
        f"{row.parameters} / {len(row.hard)}",
    )
    hints = ("", "", "", "", "", row.fixed_why, row.explicit_why, row.c_why, " ".join(row.hard))
    cells = "".join(
        f'<td class="n" title="{escape(hint)}">{text}</td>'
        for text, hint in zip(numbers, hints, strict=True)
    )
    texts = (row.smoothness, " ".join(row.phenomena), values or "exact")
    return f"<td>{escape(row.law)}</td>{cells}" + "".join(f"<td>{escape(t)}</td>" for t in texts)


def _step(value: float | None) -> str:
    return "-" if value is None else f"{value:g}"


def _others(rows: Sequence[Row]) -> str:
    head = "".join(f"<th>{name}</th>" for name in ("law", "error", "time [ms]", "why"))
    lines = [
        f"<tr><td>{escape(row.called)}</td>"
        f'<td class="n">{f"{row.error:.1e}" if isfinite(row.error) else "-"}</td>'
        f'<td class="n">{f"{1e3 * row.time_s:.2f}" if isfinite(row.time_s) else "-"}</td>'
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
