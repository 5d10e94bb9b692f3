"""Publications that laws, scenes, methods and figures come from, as they say; how to cite."""

import ast
import re
from collections.abc import Iterator
from itertools import pairwise

from docs.machine import rst
from docs.machine.pages import ROOT
from docs.machine.stamp import PACKAGES
from symfric import ALL_LAWS, POPULATIONS, __version__
from symfric.gallery import scripts

SOURCES = re.compile(
    r"^\s*Sources?(?: of [\w' ]+)?: (.*?)(?=\n\s*\n|\n\s*[A-Z]\w+:|\Z)", re.M | re.S
)
YEAR = re.compile(r"\b1[6-9]\d\d\b|\b20\d\d\b")
ASIDE = ("laws", "gallery", "bench", "stress", "cli")
"""Rooms of symfric whose sources stand elsewhere, or are those of tables."""


def page() -> str:
    """How to cite, then laws, figures and methods with their sources."""
    text = rst.title("Literature, and how to cite")
    text += cite()
    text += rst.title("Laws", "-")
    text += "What each formula was taken from; how sure we are of it stands on its page.\n\n"
    rows = [
        [rst.plain(source), ", ".join(f":doc:`{name} </laws/{name}>`" for name in names)]
        for source, names in laws().items()
    ]
    text += rst.table(["source", "laws"], rows)
    text += rst.title("Figures", "-")
    text += "Papers whose figures are computed again in the :doc:`gallery </gallery/index>`.\n\n"
    text += "".join(f"* {rst.plain(paper)}\n" for paper in papers()) + "\n"
    text += rst.title("Scenes and methods", "-")
    rows = [[rst.plain(said), rst.code(where)] for said, where in methods()]
    return text + rst.table(["source", "used in"], rows)


def cite() -> str:
    """What to put into a paper."""
    words = "Name the version, and the paper of the law that you took.\n\n"
    entry = f"""@software{{symfric,
  title   = {{symfric: friction laws as {{CasADi}} expressions}},
  author  = {{{{The symfric authors}}}},
  version = {{{__version__}}},
  license = {{MIT}}
}}"""
    return rst.title("How to cite", "-") + words + rst.literal(entry, "bibtex")


def laws() -> dict[str, list[str]]:
    """Source -> names of the laws that it is given for, by the alphabet."""
    found: dict[str, list[str]] = {}
    for name, kind in (ALL_LAWS | POPULATIONS).items():
        found.setdefault(kind.facts.source, []).append(name)
    return dict(sorted(found.items(), key=lambda item: item[0].removeprefix("after ").lower()))


def papers() -> list[str]:
    """The first paragraph of each paper's folder in the gallery."""
    folders = dict.fromkeys(module.rpartition(".")[0] for module in scripts().values())
    found: list[str] = []
    for folder in folders:
        source = ROOT.joinpath(*folder.split("."), "__init__.py").read_text("utf-8")
        said = ast.get_docstring(ast.parse(source)) or ""
        found.append(" ".join(said.split("\n\n")[0].split()))
    return found


def methods() -> list[tuple[str, str]]:
    """Publication and the module that stands on it, of all code but the laws, by the alphabet."""
    found: dict[tuple[str, str], None] = {}
    for path in sorted(p for name in PACKAGES for p in (ROOT / name).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        if len(parts) > 1 and parts[1] in ASIDE:
            continue
        module = ".".join(part for part in parts if part != "__init__")
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            holds = isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
            for said in sources(ast.get_docstring(node) or "") if holds else ():
                found[said, module] = None
    return sorted(found, key=lambda item: item[0].lower())


def sources(docstring: str) -> Iterator[str]:
    """The publications that a docstring names: parts between semicolons, each with its year.

    A part without a year belongs to the one before it.
    """
    for match in SOURCES.findall(docstring):
        parts = " ".join(match.split()).rstrip(".").split("; ")
        begins = [k for k, part in enumerate(parts) if k == 0 or YEAR.search(part)]
        for begin, end in pairwise([*begins, len(parts)]):
            yield "; ".join(parts[begin:end])
