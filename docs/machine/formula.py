"""Equations of docstrings as LaTeX: `F = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)] sign(v)`.

A line is one equation, with what it holds for: products are juxtaposed, a tight slash divides its
two neighbours, a slash between blanks the whole product before it; wide gaps part conditions. Words
that are neither letters, functions nor defined by the block itself are words of English.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import final

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
RELATIONS = {"=": "=", "<": "<", ">": ">", "<=": r"\le", ">=": r"\ge", "->": r"\to"}
CLOSING = {"(": ")", "[": "]", "{": "}", "|": "|"}
TOKEN = re.compile(
    r"""(?P<gap>\ {2,})|(?P<blank>\ )
    |(?P<rate>d(?=[A-Za-z]\w*/dt\b)(?P<of>\w+)/dt)
    |(?P<number>\d+(?:\.\d+)?(?:e[-+]?\d+)?)
    |(?P<name>[A-Za-z][A-Za-z0-9]*(?:_[A-Za-z0-9]+)*'*)
    |(?P<quoted>"[^"]*")|(?P<dots>\.\.\.)
    |(?P<relation><=|>=|->|=|<|>)
    |(?P<sign>\+-|[-+*])|(?P<other>[/^|(){}\[\],:;.])""",
    re.X,
)


@final
@dataclass(frozen=True)
class Token:
    """A piece of an equation; `tight` where no blank stands before it."""

    kind: str
    text: str
    tight: bool


def latex(block: str) -> str:
    """A block of equations as one `aligned` of LaTeX, aligned at the first sign of equality.

    Raises:
        ValueError: a line that is no equation, with the place where it stops being one.
    """
    lines = [line for line in block.splitlines() if line.strip()]
    defined = frozenset(re.findall(r"([A-Za-z]\w*)(?:\([A-Za-z]\))?\s+=(?!=)", block))
    found = [_Row(line, defined).latex() for line in joined(lines)]
    return "\\begin{aligned}\n" + " \\\\\n".join(found) + "\n\\end{aligned}"


def joined(lines: Iterable[str]) -> list[str]:
    """Lines that go on with the one before are put behind it; others stand on their own."""
    rows: list[str] = []
    base: int | None = None
    for line in lines:
        indent = len(line) - len(line.lstrip())
        base = indent if base is None else base
        goes_on = indent > base and (line.lstrip()[0] in "+-" or not re.search(r"\w\s+=", line))
        if goes_on and rows:
            rows[-1] += " " + line.strip()
        else:
            rows.append(line.strip())
    return rows


def tokens(line: str) -> Iterator[Token]:
    """The pieces of a line, blanks kept only where they are wide."""
    place, tight = 0, False
    while place < len(line):
        match = TOKEN.match(line, place)
        if match is None:
            raise ValueError(f"{line!r}: expected an equation, got {line[place:]!r}")
        kind = str(match.lastgroup if match.lastgroup != "of" else "rate")
        place = match.end()
        if kind == "blank":
            tight = False
            continue
        yield Token(kind, match["of"] if kind == "rate" else match[0], tight)
        tight = kind != "gap"


def name(text: str, defined: Iterable[str] = ()) -> str:
    """A name with its subscripts and primes: `mu_s`, `F_1`, `v_eps`, `x'`."""
    bare = text.rstrip("'")
    primes = r"^{\prime}" * (len(text) > len(bare))
    base, *under = bare.split("_")
    if not under and (parts := re.fullmatch(r"([A-Za-z])(\d+)", base)):
        base, under = parts[1], [parts[2]]
    if base not in GREEK and len(base) > 1 and base not in defined and not under:
        raise KeyError(text)
    first = GREEK.get(base) or (base if len(base) == 1 else rf"\mathrm{{{base}}}")
    if not under:
        return first + primes
    below = ",".join(_below(part) for part in under)
    return f"{first}_{{{below}}}{primes}"


def _below(text: str) -> str:
    """A subscript: an index slanted, Greek as such, all else upright."""
    if text in ("i", "j", "k", "n") or text.isdigit():
        return text
    return GREEK.get(text) or rf"\mathrm{{{text}}}"


class _Row:
    """One line, read from left to right."""

    def __init__(self, line: str, defined: frozenset[str]) -> None:
        self.line, self.defined = line, defined
        self.rest = list(tokens(line))
        self.place = 0

    def latex(self) -> str:
        label = re.match(r"([a-z]+)\s*:\s+", self.line)
        head = ""
        if label:
            said = name(label[1]) if label[1] in GREEK else rf"\text{{{label[1]}}}"
            head = rf"{said}\text{{:}}\quad "
            self.rest = list(tokens(self.line[label.end() :]))
        found = self.items(None, align=True)
        if self.place < len(self.rest):
            raise ValueError(f"{self.line!r}: expected an equation, got {self.seen()!r}")
        return head + (found if "&" in found else "&" + found)

    def seen(self, ahead: int = 0) -> str:
        """The text of the next piece, "" at the end."""
        place = self.place + ahead
        return self.rest[place].text if place < len(self.rest) else ""

    def next(self) -> Token | None:
        return self.rest[self.place] if self.place < len(self.rest) else None

    def take(self) -> Token:
        self.place += 1
        return self.rest[self.place - 1]

    def items(self, until: str | None, align: bool = False) -> str:
        """Terms, signs, relations, words and commas up to a closing bracket."""
        found: list[str] = []
        aligned = not align
        while (token := self.next()) and token.text != until:
            if token.kind == "gap":
                self.take()
                if found and self.seen() not in RELATIONS:
                    found.append(self.gap(align and aligned))
            elif token.kind == "relation":
                mark = "&" if not aligned else ""
                aligned = True
                found.append(f"{mark}{RELATIONS[self.take().text]} ")
            elif token.kind == "sign":
                found.append(
                    {"+-": r"\pm ", "*": r"\cdot "}.get(self.take().text, f"{token.text} ")
                )
            elif token.text in (",", ":", ";", "."):
                found.append(f"{self.take().text}\\;")
            elif token.kind == "dots":
                self.take()
                found.append(r"\ldots ")
            elif token.kind == "quoted":
                found.append(rf"\text{{{self.take().text}}}")
            elif self.is_word():
                before = r"\;" if found else ""
                found.append(rf"{before}\text{{{self.words()}}}{self.blank_behind()}")
            else:
                found.append(self.product())
        return "".join(found)

    def blank_behind(self) -> str:
        """A blank behind words, unless a comma or nothing follows."""
        return "" if self.seen() in ("", ",", ";", ":", ".", ")", "]", "}") else r"\;"

    def gap(self, may_align: bool) -> str:
        """The LaTeX of a wide gap: conditions of several lines stand below each other."""
        if self.rest[self.place - 2].text == ",":
            return r"\quad "
        condition = self.is_word() or self.seen(1) in RELATIONS or self.seen() == "("
        return "&\\quad " if may_align and condition else r"\quad "

    def is_word(self, ahead: int = 0) -> bool:
        """True if the piece ahead is a word of English."""
        place = self.place + ahead
        if place >= len(self.rest) or self.rest[place].kind != "name":
            return False
        text, following = self.rest[place].text, self.rest[place + 1 : place + 2]
        if text == "a" and place and self.rest[place - 1].text.isalpha():
            return bool(following) and following[0].text.isalpha() and len(following[0].text) > 1
        called = bool(following) and following[0].text == "(" and following[0].tight
        if text in FUNCTIONS:
            applied = bool(following) and following[0].kind == "name" and text in ("sin", "cos")
            return not (called or applied)
        if called:
            return False
        return len(text) > 1 and text.isalpha() and text not in (*GREEK, *self.defined)

    def words(self) -> str:
        """Words of English up to the next symbol."""
        found = [self.take().text]
        while self.is_word():
            found.append(self.take().text)
        return " ".join(found)

    def product(self) -> str:
        """Factors side by side, with fractions."""
        factors: list[str] = []
        bare: list[str] = []
        while self.starts_factor():
            drawn, inner = self.factor()
            factors.append(drawn)
            bare.append(inner)
            while self.seen() == "/":
                whole = not self.take().tight
                if not self.starts_factor():
                    raise ValueError(f"{self.line!r}: expected a divisor, got {self.seen()!r}")
                above = bare[-1] if not whole or len(bare) == 1 else r"\,".join(factors)
                fraction = rf"\frac{{{above}}}{{{self.factor()[1]}}}"
                kept = [] if whole else factors[:-1]
                factors, bare = [*kept, fraction], [*(bare[:-1] if kept else []), fraction]
        if not factors:
            raise ValueError(f"{self.line!r}: expected an equation, got {self.seen()!r}")
        return r"\,".join(factors) + " "

    def starts_factor(self) -> bool:
        token = self.next()
        if token is None or self.is_word():
            return False
        if token.text == "|":
            return not self.inside_bars
        return token.kind in ("rate", "number", "name") or token.text in ("(", "[", "{")

    inside_bars = False

    def factor(self) -> tuple[str, str]:
        """One factor with its power: unchanged, and without its brackets where it has any."""
        drawn, inner = self.primary()
        if self.seen() != "^":
            return drawn, inner
        self.take()
        sign = self.take().text if self.seen() == "-" else ""
        power = f"{{{drawn}}}^{{{sign}{self.power()}}}"
        return power, power

    def power(self) -> str:
        """An exponent: in brackets it needs none, and a fraction of letters is one line."""
        if self.seen() != "(":
            return self.primary()[0]
        start = self.place
        depth = 0
        while True:
            depth += {"(": 1, ")": -1}.get(self.take().text, 0)
            if depth == 0:
                break
        inside = self.rest[start + 1 : self.place - 1]
        row = _Row("", self.defined)
        row.rest = inside
        return re.sub(r"\\frac\{([\w ]*)\}\{([\w ]*)\}", r"\1/\2", row.items(None)).strip()

    def primary(self) -> tuple[str, str]:
        """A number, a name, a rate, a call or something in brackets."""
        token = self.take()
        if token.kind == "number":
            drawn = _number(token.text)
            return drawn, drawn
        if token.kind == "rate":
            base, under, below = token.text.partition("_")
            drawn = name(f"d{under}{below}", ["d"]).replace("d", rf"\dot{{{name(base)}}}", 1)
            return drawn, drawn
        if token.text in CLOSING:
            inner = self.within(token.text)
            left, right = (rf"\{b}" if b in "{}" else b for b in (token.text, CLOSING[token.text]))
            drawn = rf"\left{left}{inner}\right{right}"
            return drawn, drawn if token.text == "|" else inner
        drawn = self.named(token.text)
        return drawn, drawn

    def within(self, bracket: str) -> str:
        """The terms up to the closing bracket."""
        outer, self.inside_bars = self.inside_bars, bracket == "|"
        inner = self.items(CLOSING[bracket]).strip()
        if self.seen() != CLOSING[bracket]:
            raise ValueError(f"{self.line!r}: expected {CLOSING[bracket]!r}, got the end")
        self.take()
        self.inside_bars = outer
        return inner

    def named(self, text: str) -> str:
        """A name, or a function with its arguments."""
        token = self.next()
        called = token is not None and token.text == "(" and token.tight
        if text == "sqrt" and called:
            self.take()
            return rf"\sqrt{{{self.within('(')}}}"
        if text == "e" and not called:
            return r"\mathrm{e}"
        if text in FUNCTIONS:
            first = FUNCTIONS[text]
            return f"{first}{self.arguments()}" if called else f"{first} "
        if called and len(text) > 1 and text.isalpha() and text not in GREEK:
            return rf"\operatorname{{{text}}}{self.arguments()}"
        drawn = name(text, self.defined)
        return f"{drawn}{self.arguments()}" if called else drawn

    def arguments(self) -> str:
        self.take()
        return rf"\left({self.within('(')}\right)"


def _number(text: str) -> str:
    mantissa, _, power = text.partition("e")
    return rf"{mantissa}\cdot 10^{{{int(power)}}}" if power else mantissa
