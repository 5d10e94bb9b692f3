"""Blocks of pages run and print the text of the page; `make docs` runs those of all pages."""

import ast
import shlex
from pathlib import Path

import pytest

from docs.machine.pages import ROOT, agrees, blocks, commands, differences, main, written_pages
from symfric.cli.app import COMMANDS


def test_the_readme_prints_its_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = ROOT / "README.md"
    monkeypatch.chdir(tmp_path)
    assert not [*differences(page)]
    text = page.read_text("utf-8")
    assert any(block.prints for block in blocks(text))


def test_every_page_has_valid_blocks() -> None:
    for page in written_pages():
        for block in blocks(page.read_text("utf-8")):
            if block.language == "python":
                ast.parse(block.body, f"{page}:{block.line}")
            for command, _ in commands(block) if block.language == "console" else ():
                words = shlex.split(command)
                assert words[0] != "symfric" or words[1] in (*COMMANDS, "--help"), (page, command)


def test_the_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_text("utf-8").splitlines()) <= 130


def test_blocks_are_found_with_their_output() -> None:
    text = "# T\n```python\na = 1\n```\n```text\n1\n```\n\nso\n```text\nno\n```\n```c\nx;\n```\n"
    first, second, third = blocks(text)
    assert (first.language, first.body, first.line, first.prints) == ("python", "a = 1\n", 2, "1\n")
    assert (second.language, second.prints, third.language) == ("text", None, "c")
    (block,) = blocks("```console\n$ symfric a \\\n  --b\nsays\nthis\n$ symfric c\n```\n")
    assert commands(block) == [("symfric a    --b", "says\nthis\n"), ("symfric c", "")]
    (block,) = blocks("```console\nsymfric a\n```\n")
    with pytest.raises(ValueError, match="line 1: expected a command"):
        commands(block)


@pytest.mark.parametrize(
    ("printed", "expected", "agree"),
    [
        ("a 1.2345 b  \nc\n", "a 1.23... b\nc", True), ("a 1.2345 b\n", "a 1.24... b\n", False),
        ("a\nb\n", "a\n", False), ("a\nb\n", "a\n...", True), ("anything", "", False),
        ("a 1x5\n", "a 1.5\n", False), ("x [m] (a|b)\n", "x [m] (a|b)\n", True),
    ],
)  # fmt: skip
def test_dots_stand_for_any_text(printed: str, expected: str, agree: bool) -> None:
    assert agrees(printed, expected) is agree


def test_differences_and_errors_are_printed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    page = tmp_path / "page.md"
    shell = "```console\n$ echo a b | python -c 'print(len(input().split()))'\n2\n```\n"
    page.write_text(f"```python\nx = 1\n```\n{shell}", "utf-8")
    assert main(page, tmp_path) == 0
    page.write_text(
        "```python\nprint('x')\n```\n```python\nprint(2)\n```\n```text\n3\n```\n", "utf-8"
    )
    assert main(page, tmp_path) == 1
    printed = capsys.readouterr().err
    assert "print('x')" in printed and "prints\n2\n\ninstead of\n3" in printed
    page.write_text("```python\nimport warnings\nwarnings.warn('w')\n```\n", "utf-8")
    assert main(page, tmp_path) == 1
    assert "UserWarning: w" in capsys.readouterr().err
