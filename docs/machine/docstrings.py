"""Docstrings as reStructuredText: equations as formulas, code as literal blocks.

The docstrings of this project are plain text: paragraphs, indented blocks, `names` between single
backticks, and sections such as `Args:`, which `sphinx.ext.napoleon` reads.

Equations, such as `F = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)] sign(v)`, become LaTeX. A line
is one equation, with its conditions behind wide gaps. Products are juxtaposed, and fractions stay
on the line, as in the docstring. Names of several letters that are neither Greek, functions nor
defined by the block itself are words of English.
"""

import re
from collections.abc import Iterator
from inspect import cleandoc

LETTERS = """alpha beta gamma delta zeta eta theta iota kappa nu xi pi rho sigma tau phi chi psi
omega mu Delta Omega Phi Psi Sigma Theta Gamma Lambda"""
GREEK = {name: f"\\{name}" for name in LETTERS.split()} | {
    "epsilon": r"\varepsilon",
    "eps": r"\varepsilon",
    "lam": r"\lambda",
    "inf": r"\infty",
}
FUNCTIONS = {
    **{name: f"\\{name}" for name in ("exp", "tanh", "sin", "cos", "tan", "ln", "min", "max")},
    "atan": r"\arctan",
    "asin": r"\arcsin",
    **{name: rf"\operatorname{{{name}}}" for name in ("sign", "clip", "sat", "hold", "step")},
    "asinh": r"\operatorname{arsinh}",
    "sqrt": r"\sqrt",
    "sum": r"\sum",
}
MARKS = {
    "<=": r"\le ", ">=": r"\ge ", "->": r"\to ", "+-": r"\pm ", "*": r"\cdot ", "...": r"\ldots ",
    ",": r",\;", ";": r";\;", "{": r"\{", "}": r"\}", "^": "^",
}  # fmt: skip
CLOSING = {"(": ")", "[": "]", "{": "}"}
TOKEN = re.compile(
    r"""(?P<gap>\ {2,})|(?P<blank>\ )|d(?P<rate>[A-Za-z]\w*)/dt\b
    |(?P<number>\d+(?:\.\d+)?(?:e[-+]?\d+)?)|(?P<name>[A-Za-z]\w*'*)|"(?P<quoted>[^"]*)"
    |(?P<relation><=|>=|->|=|<|>)|(?P<mark>\+-|\.\.\.|[-+*/^|(){}\[\],:;.])""",
    re.X,
)
END = ("end", "", True)


def latex(block: str) -> str:
    """Return a block of equations as one `aligned` of LaTeX, aligned at the first relation.

    Raises:
        ValueError: a line that is not an equation.
    """
    rows: list[str] = []
    base = len(block) - len(block.lstrip(" "))
    for line in filter(str.strip, block.splitlines()):
        indented = len(line) - len(line.lstrip()) > base
        goes_on = indented and (line.lstrip()[0] in "+-" or not re.search(r"\w\s+=", line))
        if goes_on and rows:
            rows[-1] += " " + line.strip()
        else:
            rows.append(line.strip())
    defined = frozenset(re.findall(r"([A-Za-z]\w*)(?:\([A-Za-z]\))?\s+=(?!=)", block))
    body = " \\\\\n".join(_Row(row, defined).latex() for row in rows)
    return f"\\begin{{aligned}}\n{body}\n\\end{{aligned}}"


def name(text: str, defined: frozenset[str] = frozenset()) -> str:
    """Return a name with its subscripts and primes: `mu_s`, `F_1`, `v_eps`, `x'`.

    Raises:
        ValueError: a word of several letters.
    """
    bare = text.rstrip("'")
    primes = r"^{\prime}" * (len(text) > len(bare))
    base, *under = bare.split("_")
    if not under and (parts := re.fullmatch(r"([A-Za-z])(\d+)", base)):
        base, under = parts[1], [parts[2]]
    if base not in GREEK and len(base) > 1 and base not in defined and not under:
        raise ValueError(f"formula: expected a symbol, got the word '{text}'")
    first = GREEK.get(base) or (base if len(base) == 1 else rf"\mathrm{{{base}}}")
    indices = [
        part if part in "ijkn" or part.isdigit() else GREEK.get(part, rf"\mathrm{{{part}}}")
        for part in under
    ]
    return f"{first}_{{{','.join(indices)}}}{primes}" if under else first + primes


def _tokens(line: str) -> Iterator[tuple[str, str, bool]]:
    """Yield kind and text of each token, and True if no blank precedes it."""
    place, tight = 0, False
    while place < len(line):
        match = TOKEN.match(line, place)
        if match is None:
            raise ValueError(f"{line!r}: expected an equation, got {line[place:]!r}")
        place, kind = match.end(), str(match.lastgroup)
        if kind != "blank":
            yield kind, match[kind], tight
        tight = kind not in ("blank", "gap")


class _Row:
    """One line, converted token by token."""

    def __init__(self, line: str, defined: frozenset[str]) -> None:
        label = re.match(r"([a-z]+)\s*:\s+", line)
        self.head = ""
        if label:
            text = name(label[1]) if label[1] in GREEK else rf"\text{{{label[1]}}}"
            self.head, line = rf"{text}\text{{:}}\quad ", line[label.end() :]
        self.line, self.defined = line, defined
        line = re.sub(r"\^(-?[A-Za-z0-9_.]+)", r"^(\1)", line)  # all exponents in brackets
        self.tokens = [*_tokens(line), END, END]
        self.closing: list[str] = []
        self.aligned = self.bars = False

    def latex(self) -> str:
        """Return the line, with thin spaces between factors."""
        found, factor, k = self.head, False, 0
        while k < len(self.tokens) - 2:
            end = k
            while self.is_word(end):
                end += 1
            if end > k:
                words = " ".join(text for _, text, _ in self.tokens[k:end])
                before = r"\;" if found else ""
                behind = "" if self.tokens[end][1] in ("", *",;:.)]}") else r"\;"
                piece, starts, ends, k = rf"{before}\text{{{words}}}{behind}", False, False, end
            else:
                piece, starts, ends = self.piece(k)
                k += 1
            found += r"\," * (factor and starts) + piece
            factor = ends
        if self.closing or self.bars or self.tokens[-3][1] in ("/", "^"):
            raise ValueError(f"{self.line!r}: expected an equation, got its beginning only")
        return found if "&" in found else "&" + found

    def is_word(self, k: int) -> bool:
        """Return True if token `k` is a word of English."""
        (kind, text, _), following = self.tokens[k], self.tokens[min(k + 1, len(self.tokens) - 1)]
        called = following[1] == "(" and following[2]
        if kind != "name":
            return False
        if text == "a":  # the article between two words
            before = self.tokens[k - 1][1]
            return len(before) > 1 and before.isalpha() and self.is_word(k + 1)
        if text in FUNCTIONS:
            return not called and not (following[0] == "name" and text in ("sin", "cos"))
        names = (*GREEK, *self.defined)
        return not called and len(text) > 1 and text.isalpha() and text not in names

    def piece(self, k: int) -> tuple[str, bool, bool]:
        """Return token `k` as LaTeX, and whether it begins and whether it ends a factor."""
        kind, text, tight = self.tokens[k]
        before, following = self.tokens[k - 1], self.tokens[k + 1]
        if kind == "gap":
            return self.gap(k), False, False
        if kind == "relation":
            mark = "" if self.aligned or self.closing else "&"
            self.aligned = self.aligned or bool(mark)
            return f"{mark}{MARKS.get(text, text)} ", False, False
        if kind == "quoted":
            return rf"\text{{{text}}}", False, False
        if kind == "number":
            mantissa, _, power = text.partition("e")
            return rf"{mantissa}\cdot 10^{{{int(power)}}}" if power else mantissa, True, True
        if kind == "rate":
            base, _, index = text.partition("_")
            below = name(f"d_{index}").removeprefix("d") if index else ""
            return rf"\dot{{{name(base)}}}{below}", True, True
        if kind == "name":
            return self.named(text, following[1] == "(" and following[2])
        if text == "|":
            self.bars = not self.bars
            return "|", self.bars, not self.bars
        if text in CLOSING:
            braces = text == "(" and k > 0 and before[1] in ("^", "sqrt")
            opened = "{" if braces else rf"\left{MARKS.get(text, text)}"
            closed = CLOSING[text]
            self.closing.append(closed if not braces else "")
            return opened, not braces, False
        if text in CLOSING.values():
            if not self.closing or self.closing[-1] not in ("", text):
                raise ValueError(f"{self.line!r}: expected an equation, got a single {text!r}")
            return rf"\right{MARKS.get(text, text)}" if self.closing.pop() else "}", False, True
        if text == "/" and not tight:
            return r"\,/\,", False, False
        return MARKS.get(text, f"{text} " if text in "+-" else text), False, False

    def gap(self, k: int) -> str:
        """Return a wide gap; conditions of several lines stand below each other."""
        following, after = self.tokens[k + 1], self.tokens[k + 2]
        if k == 0 or following[0] == "relation":
            return ""
        condition = self.is_word(k + 1) or after[0] == "relation" or following[1] == "("
        inside = self.closing or not self.aligned or self.tokens[k - 1][1] == ","
        return r"&\quad " if condition and not inside else r"\quad "

    def named(self, text: str, called: bool) -> tuple[str, bool, bool]:
        """Return a name, or the name of a function."""
        if text == "e" and not called:
            return r"\mathrm{e}", True, True
        if text in FUNCTIONS:
            return FUNCTIONS[text] + " " * (not called), True, False
        if called and len(text) > 1 and text.isalpha() and text not in GREEK:
            return rf"\operatorname{{{text}}}", True, False
        return name(text, self.defined), True, not called


# ---- docstrings ----

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
