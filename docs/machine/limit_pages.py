"""All limits that docstrings state, on one page."""

import re
from inspect import getdoc
from typing import Any

from docs.machine import rst
from docs.machine.docstrings import Symbols, text
from docs.machine.law_pages import MADE_OF_LAWS
from docs.machine.names import catalogue, linked
from symfric import ALL_LAWS, POPULATIONS
from symfric.scenes import ALL_SCENES

LIMITS = re.compile(r"^(?:Limits|Not valid): (.*?)(?=\n\n|\n[A-Z][a-z]+:|\Z)", re.M | re.S)


def limits(item: Any) -> str:
    """What a docstring says about limits, "" for nothing."""
    return " ".join(" ".join(found.split()) for found in LIMITS.findall(getdoc(item) or ""))


def page() -> str:
    """Limits of laws, scenes and public names, each with its link."""
    found = rst.title("Limits")
    found += "What a docstring says about where a thing ends; each stands beside it, too.\n\n"
    kinds: dict[str, dict[str, Any]] = {
        "Laws": ALL_LAWS | POPULATIONS | MADE_OF_LAWS,
        "Scenes": dict(ALL_SCENES),
    }
    seen: set[int] = set()
    for title, items in kinds.items():
        room = title.lower()
        rows = [
            [f":doc:`{name} </{room}/{name}>`", text(limits(kind), Symbols(linked))]
            for name, kind in items.items()
            if limits(kind)
        ]
        seen |= {id(kind) for kind in items.values()}
        found += rst.title(title, "-") + rst.table([room[:-1], "limits"], rows)
    rows = [
        [f":py:obj:`{p.full}`", text(limits(p.object), linked)]
        for names in catalogue().values()
        for p in names
        if id(p.object) not in seen and limits(p.object)
    ]
    return found + rst.title("Python", "-") + rst.table(["name", "limits"], rows)
