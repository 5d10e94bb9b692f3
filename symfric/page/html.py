"""Parts of a self-contained page and its style sheet; plain texts are escaped here."""

from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

from symfric.foundation.style import COLOURS, dash


def page(title: str, language: str, body: str) -> str:
    """Return a self-contained document."""
    return (
        f'<!DOCTYPE html>\n<html lang="{language}">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n"
        f"<body>\n<main>\n{body}\n</main>\n</body>\n</html>\n"
    )


def section(anchor: str, heading: str, *parts: str) -> str:
    """Return a section with a heading and an anchor for links; "" if all parts are empty."""
    inside = "\n".join(part for part in parts if part)
    if not inside:
        return ""
    return f'<section id="{anchor}">\n<h2>{escape(heading)}</h2>\n{inside}\n</section>'


def paragraph(text: str, kind: str = "") -> str:
    """Return a paragraph; "" for an empty text."""
    mark = f' class="{kind}"' if kind else ""
    return f"<p{mark}>{escape(text)}</p>" if text else ""


def bullets(sentences: Iterable[str]) -> str:
    """Return a list; "" without sentences."""
    items = "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences)
    return f"<ul>{items}</ul>" if items else ""


def title(text: str) -> str:
    """Return the heading of the page."""
    return f"<h1>{escape(text)}</h1>"


def code(text: str) -> str:
    """Return a preformatted program text; "" for an empty text."""
    return f"<pre><code>{escape(text)}</code></pre>" if text else ""


def details(summary: str, *parts: str) -> str:
    """Return a collapsed part with a summary; "" if all parts are empty."""
    inside = "".join(parts)
    return f"<details><summary>{escape(summary)}</summary>{inside}</details>" if inside else ""


def heading(text: str) -> str:
    """Return a heading inside a section."""
    return f"<h3>{escape(text)}</h3>"


def figure(drawing: str, caption: str = "") -> str:
    """Return a chart with a caption below."""
    below = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    return f"<figure>{drawing}{below}</figure>"


def verdict(kind: str, word: str, sentences: Iterable[str]) -> str:
    """Return a box of the kind "good", "doubtful" or "bad" with a word and sentences."""
    text = "".join(f"<p>{escape(sentence)}</p>" for sentence in sentences)
    first = f"<strong>{escape(word)}</strong>" if word else ""
    return f'<div class="verdict {kind}" role="status">{first}{text}</div>'


def contents(links: Sequence[tuple[str, str]]) -> str:
    """Return links to sections, given as pairs (anchor, text)."""
    text = "".join(f'<a href="#{anchor}">{escape(name)}</a>' for anchor, name in links)
    return f'<nav aria-label="Sections">{text}</nav>'


def table(
    caption: str,
    header: Sequence[str],
    rows: Iterable[Sequence[str]],
    numbers: Sequence[int] = (),
    kinds: Sequence[str] = (),
) -> str:
    """Return a table whose first column contains the row headers; "" without rows.

    Args:
        caption: text above the table.
        header: names of the columns.
        rows: texts of each row.
        numbers: indices of right-aligned columns.
        kinds: class of the last cell of each row: "good", "bad", "note", "why" or "".
    """
    lines = list(rows)
    if not lines:
        return ""
    every = (*kinds, *[""] * (len(lines) - len(kinds)))
    body = "".join(
        f"<tr>{_cells(row, numbers, last)}</tr>" for row, last in zip(lines, every, strict=False)
    )
    top = "".join(
        f'<th scope="col"{_class(j in numbers)}>{escape(name)}</th>'
        for j, name in enumerate(header)
    )
    return (
        f'<div class="wide"><table>{f"<caption>{escape(caption)}</caption>" if caption else ""}'
        f"<thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>"
    )


def _cells(row: Sequence[str], numbers: Sequence[int], last: str) -> str:
    cells = [f'<th scope="row">{escape(row[0])}</th>']
    for j, text in enumerate(row[1:], start=1):
        kind = last if j == len(row) - 1 else ""
        cells.append(f"<td{_class(j in numbers, kind)}>{escape(text)}</td>")
    return "".join(cells)


def _class(number: bool, kind: str = "") -> str:
    both = " ".join(part for part in ("number" * number, kind) if part)
    return f' class="{both}"' if both else ""


def triangle(caption: str, names: Sequence[str], values: Sequence[Sequence[float | None]]) -> str:
    """Return a table of correlations below the diagonal; cells near -1 or 1 are darker."""
    if len(names) < 2:
        return ""
    rows: list[str] = []
    for i, name in enumerate(names[1:], start=1):
        cells = "".join(_shade(values[i][j]) for j in range(i))
        rows.append(f'<tr><th scope="row">{escape(name)}</th>{cells}</tr>')
    top = "".join(f'<th scope="col">{escape(name)}</th>' for name in names[:-1])
    return (
        f'<div class="wide"><table class="square"><caption>{escape(caption)}</caption>'
        f"<thead><tr><td></td>{top}</tr></thead><tbody>{''.join(rows)}</tbody></table></div>"
    )


def _shade(value: float | None) -> str:
    if value is None:
        return "<td>–</td>"
    colour = "predicted" if value > 0 else "residual"
    share = round(60 * abs(value))
    mixed = f"color-mix(in srgb, var(--{colour}) {share}%, transparent)"
    return f'<td style="background:{mixed}">{value:+.2f}</td>'


def _lighter(colour: str) -> str:
    """Return the mean of a colour and white, for a dark background."""
    return "#" + "".join(f"{(int(colour[k : k + 2], 16) + 255) // 2:02x}" for k in (1, 3, 5))


def _dashes(k: int) -> str:
    pattern = dash(k)
    return "none" if isinstance(pattern, str) else " ".join(f"{1.2 * x:.3g}" for x in pattern[1])


def _runs(colours: Sequence[str]) -> str:
    """Return CSS classes run0, run1, ... with the colours and dashes of runs in figures."""
    return "\n".join(
        f"svg .run{k} {{ stroke: {colour}; stroke-dasharray: {_dashes(k)}; }}"
        for k, colour in enumerate(colours)
    )


STYLE = f"""{Path(__file__).with_name("page.css").read_text("utf-8")}{_runs(COLOURS)}
@media screen and (prefers-color-scheme: dark) {{ {_runs([_lighter(c) for c in COLOURS])} }}
"""
