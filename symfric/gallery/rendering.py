"""Parallel computation of figures, their pictures and numbers, and the index page of a gallery."""

import json
import os
from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from html import escape
from pathlib import Path
from re import sub
from time import perf_counter
from typing import Any, final

from symfric import __version__
from symfric.foundation.files import write_text
from symfric.foundation.panels import save
from symfric.foundation.workers import Crashed, TimedOut, outcomes
from symfric.gallery.plate import chosen, script, scripts
from symfric.page import html

LIMIT = 600.0
"""Largest processor time [s] of the figures of one process."""
Record = dict[str, Any]
"""Figure as plain data, with its name, its picture and its run time."""


@final
@dataclass(frozen=True, eq=False)
class Gallery:
    """Result of `render`.

    Attributes:
        folder: folder of pictures, numbers and `index.html`.
        asked: names of the requested figures.
        records: name -> figure as plain data, for each computed figure.
        failures: name -> reason of a failure.
        seconds: wall time [s].
    """

    folder: Path
    asked: tuple[str, ...]
    records: dict[str, Record]
    failures: dict[str, str]
    seconds: float

    @property
    def left(self) -> int:
        """Number of figures that were not computed because of an interrupt."""
        return len(self.asked) - len(self.records) - len(self.failures)


def render(
    folder: Path,
    names: Sequence[str] = (),
    *,
    quick: bool = False,
    workers: int | None = None,
    progress: Callable[[float], None] = lambda fraction: None,
) -> Gallery:
    """Compute figures; write a picture and a JSON file of each figure, and `index.html`.

    Figures of one module run in one process and share cached runs. An interrupt (Ctrl-C) returns
    the finished figures.

    Args:
        folder: output folder.
        names: names of figures, or their beginnings, such as a paper; by default all figures.
        quick: compute at reduced size.
        workers: number of processes; by default one per core.
        progress: called with the fraction done.

    Raises:
        ValueError: an unknown name.
    """
    asked, began = chosen(tuple(names)), perf_counter()
    groups = together(asked)
    for name in asked:  # results of an earlier call
        for ending in (".json", ".png"):
            (folder / f"{name}{ending}").unlink(missing_ok=True)
    tasks = ((i, (group, str(folder), quick)) for i, group in enumerate(groups))
    size = min(workers or os.cpu_count() or 1, len(groups))
    failures, done = dict[str, str](), 0
    with closing(outcomes(_rendered, tasks, size, LIMIT)) as found, suppress(KeyboardInterrupt):
        for number, outcome in found:
            failures |= _failures(groups[number], folder, outcome)
            done += len(groups[number])
            progress(done / len(asked))
    there = read(folder)
    write_text(folder / "index.html", index_page([*there.values()]))
    records = {name: there[name] for name in asked if name in there}
    return Gallery(folder, asked, records, failures, perf_counter() - began)


def read(folder: Path) -> dict[str, Record]:
    """Return the figures written to `folder`, in the order of the gallery."""
    found: dict[str, Record] = {}
    for name in scripts():
        with suppress(FileNotFoundError):
            found[name] = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
    return found


def draw(name: str, folder: Path, quick: bool = False) -> Record:
    """Compute a figure, write its picture and its JSON file, and return the content of the file."""
    began = perf_counter()
    plate = script(name)(quick=quick)
    save(plate.picture, folder / f"{name}.png")
    about = {"name": name, "picture": f"{name}.png", "quick": quick, "symfric": __version__}
    record = about | {"seconds": round(perf_counter() - began, 2)} | plate.to_dict()
    text = json.dumps(record, indent=2, allow_nan=False) + "\n"
    write_text(folder / f"{name}.json", text)
    return record


def together(names: Sequence[str]) -> list[tuple[str, ...]]:
    """Return the figures grouped by module, since figures of one module share cached runs."""
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(scripts()[name], []).append(name)
    return [tuple(group) for group in sorted(groups.values(), key=len, reverse=True)]


def _rendered(task: tuple[tuple[str, ...], str, bool]) -> dict[str, str]:
    """Draw the figures of one process; return name -> reason for each failure."""
    names, folder, quick = task
    failures: dict[str, str] = {}
    for name in names:
        try:
            draw(name, Path(folder), quick)
        except Exception as error:  # noqa: BLE001  (one failure must not stop the others)
            failures[name] = f"{type(error).__name__}: {' '.join(str(error).split())}"
    return failures


def _failures(
    group: tuple[str, ...], folder: Path, outcome: dict[str, str] | Crashed | TimedOut
) -> dict[str, str]:
    if isinstance(outcome, dict):
        return outcome
    why = "not finished within its time"
    if isinstance(outcome, Crashed):
        why = f"its process died, {outcome.how}: {outcome.last_line}"
    return {name: why for name in group if not (folder / f"{name}.json").exists()}


# ---- index page, in the folder of the pictures ----

REDUCED = (
    "Some figures are computed at reduced size: they state what was checked there, without "
    "the verdicts, which rest on the full size."
)


def index_page(records: Sequence[Record]) -> str:
    """Return an HTML page of the figures `records` by paper; pictures are in the same folder."""
    papers: dict[str, list[Record]] = {}
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


def figure_block(record: Record) -> str:
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


def anchor(record: Record) -> str:
    """Return the anchor of a plate on the page."""
    return str(record["name"]).replace("/", "-").replace("_", "-")


def _numbers(record: Record) -> str:
    rows = [(name, f"{value:.6g}") for name, value in record["numbers"].items()]
    table = html.table("", ("number", "value"), rows, numbers=(1,))
    return html.details(f"numbers, in {record['seconds']:.1f} s", table)


def _overview(records: Sequence[Record]) -> str:
    rows = "".join(
        f'<tr><td><a href="#{anchor(r)}">{escape(r["figure"])}</a></td><td>{escape(r["title"])}'
        f'</td><td class="number">{escape(r["how_far"])}</td></tr>'
        for r in records
    )
    return f"<nav><table><tr><th></th><th></th><th>how far</th></tr>{rows}</table></nav>"
