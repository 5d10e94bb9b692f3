"""Every block of code in the README and in the pages runs, and prints what the page says."""

from pathlib import Path

import pytest

from docs.machine.pages import DOCS, ROOT, agrees, blocks, commands, mark, run, written_pages


def marks(page: Path) -> list[pytest.MarkDecorator]:
    name = mark(page.read_text("utf-8"))
    return [getattr(pytest.mark, name)] if name else []


PAGES = [
    pytest.param(page, id=str(page.relative_to(ROOT)), marks=marks(page))
    for page in written_pages()
]


@pytest.mark.parametrize("page", PAGES)
def test_blocks_print_what_the_page_says(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    text = page.read_text("utf-8")
    for code, printed, expected in run(blocks(text), str(page)):
        assert agrees(printed, expected), f"{code}\nprinted\n{printed}\ninstead of\n{expected}"


def test_the_readme_and_the_first_page_show_something() -> None:
    for page in (ROOT / "README.md", DOCS / "index.md"):
        assert any(b.prints for b in blocks(page.read_text("utf-8")))


def test_blocks_of_a_page_are_found_with_what_they_print() -> None:
    text = "# T\n```python\na = 1\n```\n```text\n1\n```\n\nso\n```text\nno\n```\n```c\nx;\n```\n"
    first, second, third = blocks(text)
    assert (first.language, first.body, first.line, first.prints) == ("python", "a = 1\n", 2, "1\n")
    assert (second.language, second.prints) == ("text", None)
    assert third.language == "c"


def test_commands_are_told_from_what_they_print() -> None:
    (block,) = blocks("```console\n$ symfric a \\\n  --b\nsays\nthis\n$ symfric c\n```\n")
    assert commands(block) == [("symfric a    --b", "says\nthis\n"), ("symfric c", "")]
    (block,) = blocks("```console\nsymfric a\n```\n")
    with pytest.raises(ValueError, match="line 1: expected a command"):
        commands(block)


def test_printed_text_agrees_up_to_what_is_left_out() -> None:
    assert agrees("a 1.2345 b  \nc\n", "a 1.23... b\nc")
    assert not agrees("a 1.2345 b\n", "a 1.24... b\n")
    assert not agrees("a\nb\n", "a\n")
    assert agrees("a\nb\n", "a\n...")
    assert not agrees("anything", "")
    assert not agrees("a 1x5\n", "a 1.5\n")
    assert agrees("x [m] (a|b)\n", "x [m] (a|b)\n")


def test_code_without_output_must_print_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    ((_, printed, expected),) = run(blocks("```python\nprint('x')\n```\n"), "page")
    assert not agrees(printed, expected)


def test_a_shell_knows_this_python_and_symfric(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    text = "```console\n$ echo a b | python -c 'print(len(input().split()))'\n2\n```\n"
    ((_, printed, expected),) = run(blocks(text), "page")
    assert agrees(printed, expected)
