"""Pieces of reStructuredText."""

import re
from collections.abc import Iterable, Sequence

MARKUP = re.compile(r"([*|_\\<>`])")
LISTED = re.compile(r"^(\w{1,3})([.)] )")
"""What begins an item of a list, such as the initial of a name."""


def plain(text: str) -> str:
    """Text in which nothing is markup."""
    return LISTED.sub(r"\1\\\2", MARKUP.sub(r"\\\1", text))


def code(text: str) -> str:
    """Text as code."""
    return f"``{text}``" if text.strip() and "``" not in text else plain(text)


def title(text: str, line: str = "=") -> str:
    """A heading."""
    return f"{plain(text)}\n{line * (2 * len(text) + 4)}\n\n"


def indented(text: str, by: int = 3) -> str:
    """A text further to the right."""
    return "".join(f"{' ' * by}{line}".rstrip() + "\n" for line in text.splitlines())


def directive(name: str, argument: str = "", body: str = "", **options: str) -> str:
    """A directive with its options and its body."""
    said = "".join(f":{k.replace('_', '-')}: {v}\n" for k, v in options.items())
    head = f".. {name}:: {argument}".rstrip() + "\n"
    return head + indented(said) + ("\n" + indented(body) if body else "") + "\n"


def literal(text: str, language: str = "text") -> str:
    """Lines as they stand."""
    return directive("code-block", language, text.rstrip() + "\n")


def table(head: Sequence[str], rows: Iterable[Sequence[str]], kind: str = "") -> str:
    """A table; the cells are markup already. It scrolls by itself where it is too wide.

    Args:
        head: its first row; () if its first column is the head instead.
        rows: the others.
        kind: its class: "numbers" breaks lines in the last column only.
    """
    lines: list[str] = []
    for row in (head, *rows) if head else rows:
        for k, cell in enumerate(row):
            first, *others = (r"\-" if cell == "-" else cell).splitlines() or [""]
            lines.append(f"{'* -' if k == 0 else '  -'} {first}".rstrip())
            lines += [f"    {line}".rstrip() for line in others]
    heads = {"header_rows": "1"} if head else {"stub_columns": "1", "class": "facts"}
    options = heads | {"widths": "auto"} | ({"class": kind} if kind else {})
    return directive("list-table", "", "\n".join(lines) + "\n", **options)


def pages(names: Iterable[str], **options: str) -> str:
    """A tree of contents."""
    return directive("toctree", "", "\n".join(names) + "\n", **options)
