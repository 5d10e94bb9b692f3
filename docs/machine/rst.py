"""Pieces of reStructuredText, and docstrings as such: equations as formulas, sections as lists.

The docstrings of this project are plain text: paragraphs, indented blocks, `names` between single
backticks, and sections such as `Args:` whose entries are `name: text`.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from inspect import cleandoc

from docs.machine.formula import GREEK, latex
from docs.machine.formula import name as symbol_of

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


SECTIONS = ("Args", "Attributes", "Raises", "Returns", "Warns", "Yields", "Example")
SECTION = re.compile(rf"^({'|'.join(SECTIONS)}):\s*(.*)$")
ENTRY = re.compile(r"^((?:`[^`]+`|[\"'\w*]+)(?:(?:, | \| )(?:`[^`]+`|[\"'\w*]+))*):\s+(.*)$", re.S)
TITLES = {"Args": "Arguments", "Returns": "Returns", "Raises": "Raises", "Warns": "Warns"}
NAMED = re.compile(rf"(?<![\w.])(?:(?:{'|'.join(GREEK)}|[A-Za-z])_\w+|{'|'.join(GREEK)})(?![\w(])")
WIDE = re.compile(r"\S {3,}\S")

Linked = Callable[[str], str]
"""How a name between backticks is written: as code, or as a link to where it is documented."""


def to_rst(
    docstring: str, linked: Linked = code, formulas: bool = True, symbols: bool = False
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

    def __call__(self, sentence: str) -> str:
        """The name as before."""
        return self.linked(sentence)


def sentence(words: str, linked: Linked = code) -> str:
    """A paragraph: markup nowhere but in names between backticks."""
    parts = re.split(r"`([^`]+)`", " ".join(words.split()))
    found = ""
    for k, part in enumerate(parts):
        if k % 2 == 0:
            found += with_symbols(part) if isinstance(linked, Symbols) else plain(part)
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
        found += plain(before) + (r"\ " if match.start() else "")
        found += f":math:`{symbol_of(match[0])}`" + (r"\ " if after else "")
        end = match.end()
    return found + plain(words[end:])


SENTENCES = re.compile(r"(Limits|Source|Checked|Defaults): (.*)")
"""Sections of one paragraph that follow others without an empty line."""


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
                if SECTION.match(lines[end]) or SENTENCES.match(lines[end]):
                    break
                end += 1
            yield _paragraph(lines[place:end], linked)
        place = end


def _paragraph(lines: list[str], linked: Linked) -> str:
    if sum(WIDE.search(line) is not None for line in lines) > 1:  # a table
        return literal("\n".join(lines))
    words = " ".join(lines)
    head = re.match(r"(Sign|Stability): (.*)", words) or SENTENCES.match(words)
    if head:
        return f"**{head[1]}.** {sentence(head[2], linked)}\n\n"
    return sentence(words, linked) + "\n\n"


def shown(block: str, formulas: bool = True) -> str:
    """An indented block: formulas where every line is an equation, else unchanged."""
    first, *rest = block.rstrip().splitlines()
    margin = len(first) - len(first.lstrip())
    lines = [line[margin:] if line[:margin].isspace() else line.lstrip() for line in [first, *rest]]
    if formulas:
        try:
            return directive("math", "", latex("\n".join(lines)) + "\n")
        except (ValueError, KeyError, IndexError):
            pass
    return literal("\n".join(lines))


def _section(title: str, behind: str, lines: list[str], linked: Linked) -> str:
    head = f"**{TITLES.get(title, title)}**\n\n"
    body = cleandoc("\n".join(["", *lines]))
    if title == "Example":
        return head + (sentence(behind, linked) + "\n\n" if behind else "") + literal(body)
    if title in ("Returns", "Yields") and not behind:
        return head + "".join(_blocks(body.splitlines(), linked, formulas=False))
    if behind:
        return head + sentence(f"{behind} {body}", linked) + "\n\n"
    found = head
    for entry in entries(body):
        match = ENTRY.match(entry)
        words = match[2] if match else entry
        said = "\n\n".join(b.strip() for b in _entry(words.splitlines(), linked))
        if match:
            names = ", ".join(code(n.strip("`")) for n in match[1].split(", "))
            found += f"{names}\n{indented(said or '-')}\n"
        else:
            found += f"{said}\n\n"
    return found


def _entry(lines: Iterable[str], linked: Linked) -> Iterator[str]:
    """Paragraphs of one entry: choices such as `"auto": ...` become a list."""
    words: list[str] = []
    for line in lines:
        bare = line.strip()
        if re.match(r'^"[\w-]+"(, "[\w-]+")*:? ', bare) and words:
            yield sentence(" ".join(words), linked)
            words = []
        if bare:
            words.append(bare)
    if words:
        yield sentence(" ".join(words), linked)


def entries(body: str) -> list[str]:
    """The entries of a section: each begins at the left margin."""
    found: list[str] = []
    for line in body.splitlines():
        if line.strip() and not line.startswith(" "):
            found.append(line)
        elif found:
            found[-1] += "\n" + line
    return found
