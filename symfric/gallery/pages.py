"""The index page of a gallery, beside its pictures."""

from collections.abc import Mapping, Sequence
from html import escape
from re import sub
from typing import Any

STYLE = """
:root { color-scheme: light; --ink: #1c1c1c; --soft: #5c5c5c; --line: #d8d8d8; }
body { margin: 0 auto; max-width: 62rem; padding: 1rem; color: var(--ink); background: #fff;
  font: 16px/1.5 system-ui, sans-serif; }
h1 { font-size: 1.5rem; } h2 { margin-top: 3rem; border-top: 2px solid var(--ink);
  padding-top: .6rem; font-size: 1.25rem; } h3 { margin: 2.2rem 0 .4rem; font-size: 1.05rem; }
img { display: block; max-width: 100%; height: auto; margin: .6rem 0; }
dl { display: grid; grid-template-columns: 6.5rem 1fr; gap: .25rem .8rem; margin: .4rem 0; }
dt { color: var(--soft); } dd { margin: 0; overflow-wrap: anywhere; }
table { border-collapse: collapse; font-size: .9rem; } td, th { padding: .15rem .7rem .15rem 0;
  border-bottom: 1px solid var(--line); text-align: left; vertical-align: top; }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
nav { overflow-x: auto; } summary { color: var(--soft); cursor: pointer; }
@media (max-width: 40rem) { dl { grid-template-columns: 1fr; } dd { margin-bottom: .4rem; } }
"""

REDUCED = (
    "Some figures are computed at reduced size: beside them stands what was checked there, without "
    "the verdicts, which rest on the full size."
)


def index_page(records: Sequence[Mapping[str, Any]]) -> str:
    """One page of HTML with the plates `records`, grouped by paper; its pictures lie beside it."""
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
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<link rel="icon" href="data:,">'
        f"<title>Gallery</title><style>{STYLE}</style></head><body>"
        "<h1>Figures of the papers, computed again</h1>"
        "<p>Beside each: what is compared, how far we are, and which observation is reproduced, "
        "which explanation refuted, and what the text leaves open."
        f"</p>{note}{body}</body></html>\n"
    )


def figure_block(record: Mapping[str, Any]) -> str:
    """One plate: heading, picture, what is said about it, its numbers."""
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
    """Text of a docstring as HTML, names between backquotes as code."""
    return sub(r"`([^`]+)`", r"<code>\1</code>", escape(text))


def anchor(record: Mapping[str, Any]) -> str:
    """Where a plate stands on the page."""
    return str(record["name"]).replace("/", "-").replace("_", "-")


def _numbers(record: Mapping[str, Any]) -> str:
    rows = "".join(
        f'<tr><td>{escape(name)}</td><td class="number">{value:.6g}</td></tr>'
        for name, value in record["numbers"].items()
    )
    seconds = f"{record['seconds']:.1f} s"
    return f"<details><summary>numbers, in {seconds}</summary><table>{rows}</table></details>"


def _overview(records: Sequence[Mapping[str, Any]]) -> str:
    rows = "".join(
        f'<tr><td><a href="#{anchor(r)}">{escape(r["figure"])}</a></td><td>{escape(r["title"])}'
        f'</td><td class="number">{escape(r["how_far"])}</td></tr>'
        for r in records
    )
    return f"<nav><table><tr><th></th><th></th><th>how far</th></tr>{rows}</table></nav>"
