"""Pages, docstrings and messages use the words of CONTRIBUTING.md."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

from docs.machine.pages import ROOT, written_pages

KINDS = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
PACKAGES = ("symfric", "ocp", "identification")
OPENINGS = {
    "What", "Whether", "Where", "How", "Why", "Which", "Who", "Whoever", "That", "Those", "It",
    "Nothing", "None", "No",
}  # fmt: skip
"""First words that turn a docstring into a clause instead of a description."""


def avoided() -> re.Pattern[str]:
    """Return a pattern of the words in the left column of the table in CONTRIBUTING.md."""
    section = (
        (ROOT / "CONTRIBUTING.md").read_text("utf-8").split("\n## Words\n")[1].split("\n## ")[0]
    )
    rows = [line.split("|")[1] for line in section.splitlines() if line.startswith("| ")]
    words = [word.strip() for row in rows[1:] for word in row.split(",")]
    assert len(words) > 10
    return re.compile(rf"\b({'|'.join(map(re.escape, words))})\b")


def pages() -> list[Path]:
    """Return the pages that people write."""
    pages = [*written_pages(), ROOT / "docs/README.md", ROOT / "CHANGELOG.md"]
    return [*pages, ROOT / "symfric/CONVENTIONS.md"]


@cache
def texts() -> tuple[tuple[str, str, bool], ...]:
    """Return place and text of every string of the packages, and whether it is a docstring."""
    found = list[tuple[str, str, bool]]()
    for path in sorted(p for name in PACKAGES for p in (ROOT / name).rglob("*.py")):
        docstrings = set[int]()
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            first = node.body[0] if isinstance(node, KINDS) and node.body else None
            if isinstance(first, ast.Expr):
                docstrings.add(id(first.value))
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                where = f"{path.relative_to(ROOT)}:{node.lineno}: {node.value[:60]}"
                found.append((where, node.value, id(node) in docstrings))
    return tuple(found)


def test_pages_use_standard_terms() -> None:
    pattern = avoided()
    lines = [
        f"{path.relative_to(ROOT)}:{number}: {line}"
        for path in pages()
        for number, line in enumerate(path.read_text("utf-8").splitlines(), 1)
        if pattern.search(line)
    ]
    assert not lines


def test_docstrings_and_messages_use_standard_terms() -> None:
    pattern = avoided()
    assert not [where for where, text, _ in texts() if " " in text and pattern.search(text)]


def test_docstrings_begin_with_a_description() -> None:
    docstrings = [(where, text) for where, text, is_docstring in texts() if is_docstring]
    assert len(docstrings) > 3000
    begins = [(where, re.split(r"\W", text.strip(), maxsplit=1)[0]) for where, text in docstrings]
    assert not [where for where, word in begins if word in OPENINGS]


@pytest.mark.parametrize("line", ["mu_s is not told.", "The run is for the drawer."])
def test_a_word_to_avoid_is_found(line: str) -> None:
    assert avoided().search(line)
