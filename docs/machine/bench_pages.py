"""The page of benchmarks, from the measurements that are stored in `docs/benchmarks`."""

import json
from collections.abc import Iterable, Mapping
from typing import Any

from docs.machine import rst
from docs.machine.docstrings import text as sentence
from docs.machine.pages import DOCS

STORED = DOCS / "benchmarks"
KEYS = ("title", "about", "command", "date", "commit", "machine", "load", "seconds", "tables")
"""What `docs.machine.measure` writes; "short", what people condensed, may stand beside."""
SHORT = ("command", "date", "commit", "machine", "tables")
"""What stands under "short": tables that people made of a longer measurement."""


def stored() -> dict[str, dict[str, Any]]:
    """File name -> measurement."""
    files = sorted(STORED.glob("*.json"))
    return {path.stem: json.loads(path.read_text("utf-8")) for path in files}


def page() -> str:
    """All measurements, each with command, machine, load, date and commit."""
    text = rst.title("Benchmarks")
    text += (
        "Measured numbers, kept as files beside this page with command, machine, load, date and "
        "commit. Times are processor times of whole calls from Python unless a table says "
        "otherwise. ``symfric bench SUBJECT`` measures on your machine; ``python -m "
        "docs.machine.measure SUBJECT`` stores what it finds for this page.\n\n"
        "*Load* is the mean number of processes that wanted a processor before and after, of which "
        "the machine has two. Above two, times are too long, and their ratios are off, too; counts "
        "and errors are not touched by it.\n\n"
    )
    return text + "".join(section(name, found) for name, found in stored().items())


def section(name: str, found: Mapping[str, Any]) -> str:
    """One measurement: what people condensed of a long one, then the tables as measured."""
    text = rst.title(found["title"], "-")
    if found["about"]:
        text += sentence(found["about"]) + "\n\n"
    short = found.get("short")
    if short:
        text += "".join(shown(short["tables"]))
        text += f"*Condensed by hand from* {made_by(short)}.\n\n"
    if "tables" in found:
        text += "".join(shown(found["tables"]))
        text += f"*Measured by* {made_by(found)}. Stored in ``docs/benchmarks/{name}.json``.\n\n"
    return text


def shown(tables: Iterable[Mapping[str, Any]]) -> Iterable[str]:
    """Tables with their titles."""
    for one in tables:
        if one["title"]:
            yield f"**{rst.plain(one['title'].replace('`', ''))}**\n\n"
        rows = [[sentence(cell) for cell in row] for row in one["rows"]]
        yield rst.table([sentence(c) for c in one["columns"]], rows)


def made_by(found: Mapping[str, Any]) -> str:
    """Command, date, commit, machine and load."""
    load = f"; load {found['load']}, {found['seconds']} s" if "load" in found else ""
    parts = f"{found['date']}, commit {found['commit']}; {found['machine']}{load}"
    return f"``{found['command']}``, {rst.plain(parts)}"
