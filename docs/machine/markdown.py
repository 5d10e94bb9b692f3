"""Pieces of MyST Markdown, and texts of generated pages."""

import re
import tomllib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

TEXTS: dict[str, dict[str, str]] = tomllib.loads(
    Path(__file__).with_name("texts.toml").read_text("utf-8")
)


def opening(page: str, **values: Any) -> str:
    """Return the first section of a page."""
    return TEXTS["pages"][page].format(**values)


def table(head: Sequence[str], rows: Iterable[Sequence[object]], kind: str = "") -> str:
    """Return a table; its cells are Markdown.

    Args:
        head: titles of the columns; () if the first column is the head.
        rows: cells.
        kind: class of the table: "numbers" breaks lines in the last column only.
    """
    cells = [
        f"{'* -' if k == 0 else '  -'} {cell(item)}".rstrip()
        for row in ([head, *rows] if head else rows)
        for k, item in enumerate(row)
    ]
    if not cells:
        return ""
    option = "header-rows" if head else "stub-columns"
    kind = kind or "" * bool(head) or "facts" * (not head)
    return directive("list-table", "", "\n".join(cells), **{option: 1, "widths": "auto"} |
                     ({"class": kind} if kind else {}))  # fmt: skip


def cell(item: object) -> str:
    """Return one line of Markdown that begins no list; a dash for an empty text."""
    text = " ".join(str(item).split()) or "-"
    return re.sub(r"^(\d*)([-.)])(?=\s|$)", r"\1\\\2", text)


def code(text: str) -> str:
    """Return a text as inline code."""
    return f"`{text}`"


def plain(text: str) -> str:
    """Escape what is markup in Markdown outside inline code."""
    parts = text.split("`")
    return "`".join(re.sub(r"[*<\[$\\]", r"\\\g<0>", p) if k % 2 == 0 else p
                    for k, p in enumerate(parts))  # fmt: skip


def directive(name: str, argument: str = "", body: str = "", **options: object) -> str:
    """Return a directive with its options and its body."""
    fence = "`" * (3 + max([len(m) - 2 for m in re.findall(r"^`{3,}", body, re.M)], default=0))
    lines = [f":{key}: {value}".rstrip() for key, value in options.items()]
    head = f"{fence}{{{name}}} {argument}".rstrip()
    return (
        "\n".join([head, *lines, *([""] if lines and body else []), body.rstrip(), fence]) + "\n\n"
    )


def block(text: str, language: str = "text") -> str:
    """Return a block of code that is displayed only."""
    return f"```{language}\n{text.rstrip()}\n```\n\n"


def contents(names: Iterable[str]) -> str:
    """Return a hidden table of contents."""
    return directive("toctree", "", "\n".join(names), hidden="")
