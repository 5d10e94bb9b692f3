"""Pages, docstrings and messages use the words of CONTRIBUTING.md."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
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
    written = [
        *ROOT.glob("*.md"),
        *(ROOT / "docs").glob("**/*.md"),
        ROOT / "symfric/CONVENTIONS.md",
    ]
    return [path for path in written if "made" not in path.parts and path.name != "CONTRIBUTING.md"]


def sources() -> Iterator[tuple[Path, ast.Module]]:
    """Yield the files of the packages with their syntax trees."""
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            yield path, ast.parse(path.read_text("utf-8"))


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
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}: {match.group()}"
        for path, tree in sources()
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value
        for match in pattern.finditer(node.value)
    ]
    assert not found


def test_docstrings_begin_with_a_description() -> None:
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    found = [
        f"{path.relative_to(ROOT)}:{getattr(node, 'lineno', 1)}: {text.splitlines()[0]}"
        for path, tree in sources()
        for node in ast.walk(tree)
        if isinstance(node, kinds) and (text := ast.get_docstring(node))
        if re.split(r"\W", text, maxsplit=1)[0] in OPENINGS
    ]
    assert not found


@pytest.mark.parametrize("line", ["mu_s is not told.", "The run is for the drawer."])
def test_a_word_to_avoid_is_found(line: str) -> None:
    assert avoided().search(line)
