"""Index page of a gallery, in the folder of its pictures."""

from collections.abc import Mapping, Sequence
from html import escape
from re import sub
from typing import Any

from symfric.page import html

REDUCED = (
    "Some figures are computed at reduced size: they state what was checked there, without "
    "the verdicts, which rest on the full size."
)


def index_page(records: Sequence[Mapping[str, Any]]) -> str:
    """Return an HTML page of the figures `records` by paper; pictures are in the same folder."""
    papers: dict[str, list[Mapping[str, Any]]] = {}
    for record in records:
        papers.setdefault(record["paper"], []).append(record)
    reduced = any(record["quick"] for record in records)
    note = f"<p><strong>{REDUCED}</strong></p>" if reduced else ""
    body = "".join(
        f"<h2>{escape(paper)}</h2><p>{written(group[0]['note'])}</p>{_overview(group)}"
        f"{''.join(map(figure_block, group))}"
        for paper, group in papers.items()
    )
    about = (
        "Beside each: what is compared, how far we are, and which observation is reproduced, which "
        "explanation refuted, and what the text leaves open."
    )
    heading = html.title("Figures of the papers, computed again")
    return html.page("Gallery", "en", f"{heading}{html.paragraph(about)}{note}{body}")


def figure_block(record: Mapping[str, Any]) -> str:
    """Return the HTML of one plate: heading, picture, texts and numbers."""
    said = {
        "compared": record["compared"],
        "how far": f"{record['how_far']}: {record['measure']}",
        **record["verdicts"],
        "checked at reduced size" if record["quick"] else "checked": "; ".join(record["checked"]),
    }
    title = f"{record['figure']}. {record['title']}"
    text = "".join(f"<p>{written(p)}</p>" for p in record["text"].split("\n\n") if p)
    entries = "".join(f"<dt>{name}</dt><dd>{written(value)}</dd>" for name, value in said.items())
    return (
        f'<h3 id="{anchor(record)}">{escape(title)}</h3>{text}'
        f'<img src="{escape(record["picture"])}" alt="{escape(title)}" loading="lazy">'
        f"<dl>{entries}</dl>{_numbers(record)}"
    )


def written(text: str) -> str:
    """Return the text of a docstring as HTML, with names between backquotes as code."""
    return sub(r"`([^`]+)`", r"<code>\1</code>", escape(text))


def anchor(record: Mapping[str, Any]) -> str:
    """Return the anchor of a plate on the page."""
    return str(record["name"]).replace("/", "-").replace("_", "-")


def _numbers(record: Mapping[str, Any]) -> str:
    rows = [(name, f"{value:.6g}") for name, value in record["numbers"].items()]
    table = html.table("", ("number", "value"), rows, numbers=(1,))
    return html.details(f"numbers, in {record['seconds']:.1f} s", table)


def _overview(records: Sequence[Mapping[str, Any]]) -> str:
    rows = "".join(
        f'<tr><td><a href="#{anchor(r)}">{escape(r["figure"])}</a></td><td>{escape(r["title"])}'
        f'</td><td class="number">{escape(r["how_far"])}</td></tr>'
        for r in records
    )
    return f"<nav><table><tr><th></th><th></th><th>how far</th></tr>{rows}</table></nav>"
