"""What the docstring of a law says to somebody who has only its C: formulas, limits, source."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from inspect import getdoc
from re import match, search, split
from textwrap import dedent
from typing import final

from symfric.foundation.parameters import Option, Parametric, options

TELLING = (
    r"[Nn]ot valid|[Cc]reeps? |[Dd]rifts?\b|Needs |Keep |Never |[Oo]nly if |smooth over|rounded"
)
"""What a sentence holds that a user of the numbers must know."""

LEANING = r"^Without it|^Made for slip|, as there|that form|form = "
"""What leans on the sentence before it, or speaks of another form."""


@final
@dataclass(frozen=True)
class LawText:
    """Texts about a law, without the words of Python.

    Attributes:
        title: its name, one line.
        equations: formulas, line by line.
        limits: what it cannot do, a sentence each.
        source: where it is published.
    """

    title: str
    equations: str
    limits: tuple[str, ...]
    source: str


def texts(law: Parametric) -> tuple[LawText, ...]:
    """The texts of a law and of those that it holds, each once."""
    return tuple(dict.fromkeys(_all(law)))


def equations(obj: Parametric) -> str:
    """The formulas of a law or a machine and of what it holds, under their titles if several."""
    found = texts(obj)
    if len(found) == 1:
        return found[0].equations
    return "\n\n".join(f"{text.title}\n{text.equations}".rstrip() for text in found)


def _all(law: Parametric) -> Iterator[LawText]:
    yield _text(law)
    for item in fields(law):
        value = getattr(law, item.name)
        for inner in value if isinstance(value, tuple) else (value,):
            if isinstance(inner, Parametric) and "\n\n    " in (getdoc(type(inner)) or ""):
                yield from _all(inner)


def _text(law: Parametric) -> LawText:
    paragraphs = (getdoc(type(law)) or type(law).__name__).split("\n\n")
    paragraphs = (
        paragraphs[: paragraphs.index("Raises:")] if "Raises:" in paragraphs else paragraphs
    )
    formulas = list(_formulas(paragraphs, options(law).values()))
    prose = "\n".join(p for p in paragraphs[1:] if not p.startswith(("    ", "Raises:")))
    about, _, source = prose.partition("\nSource: ")
    chosen = [f"{name}: {option.value}." for name, option in options(law).items()]
    lines = [dedent(p) for p in formulas] + ["    ".join(chosen).capitalize()] * bool(chosen)
    return LawText(
        title=" ".join(paragraphs[0].split()),
        equations="\n".join(lines).replace("`", ""),
        limits=tuple(_limits(about)),
        source=" ".join(source.split()),
    )


def _formulas(paragraphs: Sequence[str], forms: Iterable[Option]) -> Iterator[str]:
    """The formulas but for those of another form, whose name stands before them."""
    others = "|".join(rf'{o.name} = "(?!{o.value}")' for o in forms) or "(?!)"
    before = ""
    for paragraph in paragraphs:
        if not paragraph.startswith("    "):
            before = " ".join(paragraph.split())
        elif not search(others, before.rpartition(". ")[2]):
            lines = paragraph.splitlines()
            yield "\n".join(line for line in lines if not search(others, line))


def _limits(prose: str) -> Iterator[str]:
    """The sentences that tell what a law cannot do, and over which widths it is smooth."""
    for sentence in split(r"(?<=\.)(?<!al\.)\s+", " ".join(prose.split())):
        for clause in split(r";\s+", sentence.removeprefix("Limits: ").replace("`", "")):
            if search(TELLING, clause) and not search(LEANING, clause):
                text = clause.strip().rstrip(".")
                capital = match(r"[a-z]+[ ']", text)
                yield f"{text[0].upper() if capital else text[0]}{text[1:]}."
