"""Docstrings as reStructuredText: equations as formulas, code as literal blocks.

The docstrings of this project are plain text: paragraphs, indented blocks, `names` between single
backticks, and sections such as `Args:`, which `sphinx.ext.napoleon` reads.
"""

import re
from collections.abc import Iterator
from inspect import cleandoc

from docs.machine.formula import GREEK, latex, name

SECTION = re.compile(r"(Args|Attributes|Raises|Returns|Warns|Yields):$")
NOTE = re.compile(r"(Limits|Source|Defaults|Sign|Stability|Not valid): ")
WIDE = re.compile(r"\S {3,}\S")
SYMBOL = re.compile(rf"(?<![\w.])(?:(?:{'|'.join(GREEK)}|[A-Za-z])_\w+|{'|'.join(GREEK)})(?![\w(])")
Blocks = Iterator[str]


def first_line(docstring: str | None) -> str:
    """Return the first paragraph on one line."""
    return " ".join(cleandoc(docstring or "").split("\n\n")[0].split())


def to_rst(docstring: str, formulas: bool = False) -> str:
    """Convert a docstring that is cleaned by `inspect`.

    Args:
        docstring: output of `inspect.getdoc`.
        formulas: convert indented equations, and names such as mu_s, to formulas.
    """
    return "\n\n".join(_blocks(docstring.splitlines(), formulas)) + "\n"


def _blocks(lines: list[str], formulas: bool) -> Blocks:
    """Yield paragraphs, indented blocks and sections."""
    start = 0
    while start < len(lines):
        end = start + 1
        if not lines[start].strip():
            start = end
            continue
        inside = SECTION.match(lines[start]) or lines[start].startswith((" ", "Example:"))
        while end < len(lines) and (
            lines[end].startswith(" ") or not lines[end].strip()
            if inside
            else lines[end].strip() and not lines[end].startswith(" ")
            and not SECTION.match(lines[end]) and not NOTE.match(lines[end])
        ):  # fmt: skip
            end += 1
        block = lines[start:end]
        if SECTION.match(lines[start]):
            yield _section(block)
        elif lines[start].startswith("Example:"):
            yield f"**Example**\n\n{literal(cleandoc(chr(10).join(['', *block[1:]])))}"
        elif inside:
            yield shown("\n".join(block).rstrip(), formulas)
        elif sum(WIDE.search(line) is not None for line in block) > 1:  # a table
            yield literal("\n".join(block))
        else:
            yield _paragraph(" ".join(block), formulas)
        start = end


def _section(lines: list[str]) -> str:
    """Escape a section; several returned values become a list."""
    entries = re.split(r"\n(?=\S)", cleandoc("\n".join(["", *lines[1:]])))
    if lines[0] == "Returns:" and len(entries) > 1 and any("\n" in entry for entry in entries):
        lines = [lines[0], *(f"    * {' '.join(entry.split())}" for entry in entries)]
    return "\n".join([lines[0], *(escaped(line) for line in lines[1:])])


def _paragraph(text: str, formulas: bool) -> str:
    note = NOTE.match(text)
    head = f"**{note[1]}.** " if note else ""
    return head + escaped(text[note.end() if note else 0 :], formulas)


def escaped(text: str, symbols: bool = False) -> str:
    """Escape markup outside backticks; with `symbols`, names such as mu_s become formulas."""
    parts = re.split(r"(`[^`]+`)", text)
    for k in range(0, len(parts), 2):
        part, found, end = parts[k], "", 0
        for match in SYMBOL.finditer(part) if symbols else ():
            after = r"\ " if part[match.end() : match.end() + 1] else ""
            found += _plain(part[end : match.start()]) + rf"\ :math:`{name(match[0])}`{after}"
            end = match.end()
        parts[k] = found + _plain(part[end:])
    for k in range(1, len(parts), 2):
        parts[k] = ("" if parts[k - 1][-1:] in ("", " ", "(") else r"\ ") + parts[k]
        parts[k] += "" if parts[k + 1][:1] in ("", *" .,;:)'") else r"\ "
    return "".join(parts)


def _plain(text: str) -> str:
    """Escape markup, and what begins a list, such as the initial of a name."""
    text = re.sub(r"(?<! )\*|\*(?! )|[|\\]|_(?!\w)|(?<=\])_", r"\\\g<0>", text)
    return re.sub(r"^(\s*\w{1,3})([.)] )", r"\1\\\2", text)


def literal(text: str) -> str:
    """Return lines as a literal block."""
    return "::\n\n" + "".join(f"   {line}".rstrip() + "\n" for line in text.splitlines())


def shown(block: str, formulas: bool) -> str:
    """Return an indented block as a formula if every line is an equation, else as it is."""
    first = block.splitlines()[0]
    margin = len(first) - len(first.lstrip())
    lines = [line[margin:] if line[:margin].isspace() else line for line in block.splitlines()]
    if formulas:
        try:
            return ".. math::\n" + literal(latex("\n".join(lines))).removeprefix("::\n")
        except ValueError:
            pass
    return literal("\n".join(lines))
