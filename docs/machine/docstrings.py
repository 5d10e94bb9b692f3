"""Docstrings as reStructuredText: equations as formulas, sections as lists, all else as it stands.

The docstrings of this project are plain text: paragraphs, indented blocks, `names` between single
backticks, and sections such as `Args:` whose entries are `name: text`.
"""

import re
from collections.abc import Callable, Iterable, Iterator
from inspect import cleandoc

from docs.machine import rst
from docs.machine.formula import GREEK, latex, name

SECTIONS = ("Args", "Attributes", "Raises", "Returns", "Warns", "Yields", "Example")
SECTION = re.compile(rf"^({'|'.join(SECTIONS)}):\s*(.*)$")
ENTRY = re.compile(r"^((?:`[^`]+`|[\"'\w*]+)(?:(?:, | \| )(?:`[^`]+`|[\"'\w*]+))*):\s+(.*)$", re.S)
TITLES = {"Args": "Arguments", "Returns": "Returns", "Raises": "Raises", "Warns": "Warns"}
NAMED = re.compile(rf"(?<![\w.])(?:(?:{'|'.join(GREEK)}|[A-Za-z])_\w+|{'|'.join(GREEK)})(?![\w(])")
WIDE = re.compile(r"\S {3,}\S")

Linked = Callable[[str], str]
"""How a name between backticks is written: as code, or as a link to where it is documented."""


def to_rst(
    docstring: str, linked: Linked = rst.code, formulas: bool = True, symbols: bool = False
) -> str:
    """A docstring, cleaned by `inspect`, as reStructuredText.

    Args:
        docstring: what `inspect.getdoc` returns.
        linked: how a name between backticks is written.
        formulas: whether indented equations become formulas.
        symbols: whether names such as mu_s in sentences become symbols.
    """
    if symbols:
        linked = Symbols(linked)
    return "".join(_blocks(docstring.splitlines(), linked, formulas))


def first_line(docstring: str | None) -> str:
    """The first paragraph in one line."""
    return " ".join(cleandoc(docstring or "").split("\n\n")[0].split())


class Symbols:
    """Writes names between backticks as `linked` does, and asks for symbols elsewhere."""

    def __init__(self, linked: Linked) -> None:
        self.linked = linked

    def __call__(self, text: str) -> str:
        """The name as before."""
        return self.linked(text)


def text(words: str, linked: Linked = rst.code) -> str:
    """A paragraph: markup nowhere but in names between backticks."""
    parts = re.split(r"`([^`]+)`", " ".join(words.split()))
    found = ""
    for k, part in enumerate(parts):
        if k % 2 == 0:
            found += with_symbols(part) if isinstance(linked, Symbols) else rst.plain(part)
        else:
            before = "" if not found or found[-1] in " (" else r"\ "
            after = "" if parts[k + 1][:1] in ("", " ", ".", ",", ";", ":", ")", "'") else r"\ "
            found += before + linked(part) + after
    return found


def with_symbols(words: str) -> str:
    """Words in which names such as mu_s, v_eps or alpha are symbols."""
    found, end = "", 0
    for match in NAMED.finditer(words):
        before, after = words[end : match.start()], words[match.end() : match.end() + 1]
        found += rst.plain(before) + (r"\ " if match.start() else "")
        found += f":math:`{name(match[0])}`" + (r"\ " if after else "")
        end = match.end()
    return found + rst.plain(words[end:])


def _blocks(lines: list[str], linked: Linked, formulas: bool) -> Iterator[str]:
    """Paragraphs, indented blocks and sections, one after the other."""
    place = 0
    while place < len(lines):
        section = SECTION.match(lines[place])
        end = place + 1
        if not lines[place].strip():
            pass
        elif section:
            while end < len(lines) and (not lines[end].strip() or lines[end].startswith(" ")):
                end += 1
            yield _section(section[1], section[2], lines[place + 1 : end], linked)
        elif lines[place].startswith(" "):
            while end < len(lines) and (not lines[end].strip() or lines[end].startswith(" ")):
                end += 1
            yield shown("\n".join(lines[place:end]), formulas)
        else:
            while end < len(lines) and lines[end].strip() and not lines[end].startswith(" "):
                if SECTION.match(lines[end]) or re.match(r"(Limits|Source|Defaults): ", lines[end]):
                    break
                end += 1
            yield _paragraph(lines[place:end], linked)
        place = end


def _paragraph(lines: list[str], linked: Linked) -> str:
    if sum(WIDE.search(line) is not None for line in lines) > 1:  # a table
        return rst.literal("\n".join(lines))
    words = " ".join(lines)
    head = re.match(r"(Limits|Source|Defaults|Sign|Stability): (.*)", words)
    if head:
        return f"**{head[1]}.** {text(head[2], linked)}\n\n"
    return text(words, linked) + "\n\n"


def shown(block: str, formulas: bool = True) -> str:
    """An indented block: formulas where every line is an equation, else as it stands."""
    first, *rest = block.rstrip().splitlines()
    margin = len(first) - len(first.lstrip())
    lines = [line[margin:] if line[:margin].isspace() else line.lstrip() for line in [first, *rest]]
    if formulas:
        try:
            return rst.directive("math", "", latex("\n".join(lines)) + "\n")
        except (ValueError, KeyError, IndexError):
            pass
    return rst.literal("\n".join(lines))


def _section(title: str, behind: str, lines: list[str], linked: Linked) -> str:
    head = f"**{TITLES.get(title, title)}**\n\n"
    body = cleandoc("\n".join(["", *lines]))
    if title == "Example":
        return head + (text(behind, linked) + "\n\n" if behind else "") + rst.literal(body)
    if title in ("Returns", "Yields") and not behind:
        return head + "".join(_blocks(body.splitlines(), linked, formulas=False))
    if behind:
        return head + text(f"{behind} {body}", linked) + "\n\n"
    found = head
    for entry in entries(body):
        match = ENTRY.match(entry)
        words = match[2] if match else entry
        said = "\n\n".join(b.strip() for b in _entry(words.splitlines(), linked))
        if match:
            names = ", ".join(rst.code(n.strip("`")) for n in match[1].split(", "))
            found += f"{names}\n{rst.indented(said or '-')}\n"
        else:
            found += f"{said}\n\n"
    return found


def _entry(lines: Iterable[str], linked: Linked) -> Iterator[str]:
    """What is said of one entry: choices such as `"auto": ...` become a list."""
    words: list[str] = []
    for line in lines:
        bare = line.strip()
        if re.match(r'^"[\w-]+"(, "[\w-]+")*:? ', bare) and words:
            yield text(" ".join(words), linked)
            words = []
        if bare:
            words.append(bare)
    if words:
        yield text(" ".join(words), linked)


def entries(body: str) -> list[str]:
    """The entries of a section: each begins at the left margin."""
    found: list[str] = []
    for line in body.splitlines():
        if line.strip() and not line.startswith(" "):
            found.append(line)
        elif found:
            found[-1] += "\n" + line
    return found
