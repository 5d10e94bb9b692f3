"""Pages, docstrings and messages use the words of CONTRIBUTING.md."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

from docs.machine.pages import ROOT, written_pages

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
def sources() -> dict[str, str]:
    """Return file -> source of every module of the packages."""
    files = sorted(p for name in PACKAGES for p in (ROOT / name).rglob("*.py"))
    return {str(path.relative_to(ROOT)): path.read_text("utf-8") for path in files}


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
    wrong = [
        f"{path}:{node.lineno}: {node.value[:60]}"
        for path, source in sources().items()
        for node in (ast.walk(ast.parse(source)) if pattern.search(source) else ())
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
        if " " in node.value and pattern.search(node.value)
    ]
    assert not wrong


def test_docstrings_begin_with_a_description() -> None:
    """A docstring begins a line."""
    pattern = re.compile(r'^[ \t]*r?"""(\w+)', re.M)
    begins = [(path, word) for path, text in sources().items() for word in pattern.findall(text)]
    assert len(begins) > 3000
    assert not [(path, word) for path, word in begins if word in OPENINGS]


@pytest.mark.parametrize("line", ["mu_s is not told.", "The run is for the drawer."])
def test_a_word_to_avoid_is_found(line: str) -> None:
    assert avoided().search(line)
