"""Texts of a data sheet, derived from the docstring of a law and the method of its steps."""

import tomllib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields
from inspect import getdoc
from pathlib import Path
from re import match, search, split
from textwrap import dedent
from typing import NamedTuple

from symfric.foundation.parameters import Option, Parametric, options
from symfric.integrator.methods.families import BackwardEuler, Exponential, Rosenbrock
from symfric.integrator.methods.method import Method
from symfric.integrator.methods.tableaux import Radau

SHEET = tomllib.loads(Path(__file__).with_name("sheet.toml").read_text(encoding="utf-8"))
"""Fixed texts of data sheets."""

TELLING = (
    r"[Nn]ot valid|[Cc]reeps? |[Dd]rifts?\b|Needs |Keep |Never |[Oo]nly if |smooth over|rounded"
)
"""Pattern of sentences that users of the law must read."""

LEANING = r"^Without it|^Made for slip|, as there|that form|form = "
"""Pattern of sentences that depend on the previous sentence or describe another form."""


class LawText(NamedTuple):
    """Texts about a law, without Python terms.

    Attributes:
        title: name of the law, one line.
        equations: formulas, line by line.
        limits: sentences about restrictions.
        source: publication.
    """

    title: str
    equations: str
    limits: tuple[str, ...]
    source: str


def texts(law: Parametric) -> tuple[LawText, ...]:
    """Return the texts of a law and of its parts, without repetitions."""

    def every(part: Parametric) -> Iterator[LawText]:
        yield _text(part)
        for item in fields(part):
            value = getattr(part, item.name)
            for inner in value if isinstance(value, tuple) else (value,):
                if isinstance(inner, Parametric) and "\n\n    " in (getdoc(type(inner)) or ""):
                    yield from every(inner)

    return tuple(dict.fromkeys(every(law)))


def equations(obj: Parametric) -> str:
    """Return the formulas of a law or machine and its parts; several parts have titles."""
    found = texts(obj)
    if len(found) == 1:
        return found[0].equations
    return "\n\n".join(f"{text.title}\n{text.equations}".rstrip() for text in found)


def _text(law: Parametric) -> LawText:
    paragraphs = (getdoc(type(law)) or type(law).__name__).split("\n\n")
    if "Raises:" in paragraphs:
        paragraphs = paragraphs[: paragraphs.index("Raises:")]
    formulas = [dedent(p) for p in _formulas(paragraphs, options(law).values())]
    prose = "\n".join(p for p in paragraphs[1:] if not p.startswith(("    ", "Raises:")))
    about, _, source = prose.partition("\nSource: ")
    chosen = "    ".join(f"{name}: {option.value}." for name, option in options(law).items())
    return LawText(
        title=" ".join(paragraphs[0].split()),
        equations="\n".join(formulas + [chosen.capitalize()] * bool(chosen)).replace("`", ""),
        limits=tuple(_limits(about)),
        source=" ".join(source.partition("\nChecked: ")[0].split()),
    )


def _formulas(paragraphs: Sequence[str], forms: Iterable[Option]) -> Iterator[str]:
    """Yield the formulas, except those whose introduction names another value of an option."""
    others = "|".join(rf'{o.name} = "(?!{o.value}")' for o in forms) or "(?!)"
    before = ""
    for paragraph in paragraphs:
        if not paragraph.startswith("    "):
            before = " ".join(paragraph.split())
        elif not search(others, before.rpartition(". ")[2]):
            lines = paragraph.splitlines()
            yield "\n".join(line for line in lines if not search(others, line))


def _limits(prose: str) -> Iterator[str]:
    """Yield the sentences about restrictions and smoothing widths of a law."""
    for sentence in split(r"(?<=\.)(?<!al\.)\s+", " ".join(prose.split())):
        for clause in split(r";\s+", sentence.removeprefix("Limits: ").replace("`", "")):
            if search(TELLING, clause) and not search(LEANING, clause):
                text = clause.strip().rstrip(".")
                capital = match(r"[a-z]+[ ']", text)
                yield f"{text[0].upper() if capital else text[0]}{text[1:]}."


def of_law(kinds: tuple[str, ...], ends: bool) -> str:
    """Return the text about the step of the states of a law.

    Args:
        kinds: types of the step, see `Step`.
        ends: True if the block also has the force at the end of the step.
    """
    names = ("held", *kinds, "mean", *("end",) * ends)
    return "\n".join(SHEET["step"][name] for name in names)


def of_method(method: Method, algebraic: bool) -> str:
    """Return the text about the fixed step of a method for x' = f(x, u), 0 = g(x, z, u).

    Args:
        algebraic: True if there are algebraic unknowns z.
    """
    texts = SHEET["step"]
    return (
        f"Fixed steps by {method.name}, order {method.order}. {texts['held']}\n"
        f"{_formula(method)}{texts['algebraic'] * algebraic}\n{texts['outputs']}"
    )


def _formula(method: Method) -> str:
    """Return the formula of one step."""
    match method:
        case BackwardEuler():
            return f"    x+ = x + h f(x+, u)    by {method.iterations} Newton iterations from x"
        case Radau():
            return (
                f"    X_i = x + h sum a_ij f(X_j, u),   i, j = 1 ... {len(method.A)},   "
                f"x+ = X_{len(method.A)}\n"
                f"    by {method.iterations} simplified Newton iterations"
            )
        case Rosenbrock():
            return (
                "    [I / (gamma h) - df/dx] k_i = f(x + sum a_ij k_j, u) + sum c_ij k_j / h\n"
                f"    x+ = x + sum m_i k_i,   i = 1 ... {len(method.A)}, gamma = {method.gamma:.6g}"
            )
        case Exponential():
            return "    x_i+ = x_i + h phi1(h df_i/dx_i) f_i(x, u),   phi1(a) = (exp(a) - 1) / a"
        case _:
            return (
                "    X_i = x + h sum a_ij f(X_j, u),   x+ = x + h sum b_i f(X_i, u)    (explicit)"
            )
