"""The page of benchmarks, from the measurements that are stored in `docs/benchmarks`."""

import json
from typing import Any

from docs.machine import rst
from docs.machine.docstrings import text as sentence
from docs.machine.pages import DOCS

STORED = DOCS / "benchmarks"
KEYS = ("title", "about", "command", "date", "commit", "machine", "tables")


def stored() -> dict[str, dict[str, Any]]:
    """File name -> measurement."""
    files = sorted(STORED.glob("*.json"))
    return {path.stem: json.loads(path.read_text("utf-8")) for path in files}


def page() -> str:
    """All measurements, each with command, machine, date and commit."""
    text = rst.title("Benchmarks")
    text += (
        "Measured numbers, kept as files beside this page with command, machine, date and commit. "
        "Times are processor times of whole calls from Python unless a table says otherwise. "
        "``symfric bench SUBJECT`` measures on your machine; ``python -m docs.machine.measure "
        "SUBJECT`` stores what it finds for this page.\n\n"
    )
    return text + "".join(section(name, found) for name, found in stored().items())


def section(name: str, found: dict[str, Any]) -> str:
    """One measurement."""
    text = rst.title(found["title"], "-") + sentence(found["about"]) + "\n\n"
    for one in found["tables"]:
        if one["title"]:
            text += f"**{sentence(one['title'])}**\n\n"
        rows = [[sentence(cell) for cell in row] for row in one["rows"]]
        text += rst.table([sentence(c) for c in one["columns"]], rows)
    where = f"``docs/benchmarks/{name}.json``"
    made = f"``{found['command']}``, {found['date']}, commit {found['commit']}; {found['machine']}"
    return text + f"*Measured by* {made}. Stored in {where}.\n\n"
