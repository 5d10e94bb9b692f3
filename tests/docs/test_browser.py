"""The browser rejects pages with errors, lost pictures, wide lines and requests."""

import shutil
from base64 import b64decode
from importlib.util import find_spec
from pathlib import Path

import pytest

from docs.machine import browser
from docs.machine.browser import KINDS, NAMES, main, searched

PNG = b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
HEAD = (
    "<!DOCTYPE html><html lang=en><meta charset=utf-8><title>t</title>"
    "<meta name=viewport content='width=device-width,initial-scale=1'><main><article><h1>T</h1>"
)
DARK = (
    "<style>@media (prefers-color-scheme:dark) {article {background:#111;color:#eee}}</style>"
    "<img src='x.png' alt='a' width=9>"
)
MANY = {
    "console error: bad": "<script>console.error('bad')</script>",
    "exception: worse": "<script>throw new Error('worse')</script>",
    "(wide): picture does not show": "<img src='gone.png' alt='a'>",
    "requests http://127.0.0.1:9/": "<img src='http://127.0.0.1:9/x.png' alt='a'>",
    "(wide): formula without extent": "<math style='display:block;height:0'><mi>x</mi></math>",
    "(wide): contrast of 2.8 only": "<p style='color:#999;background:#fff'>pale</p>",
    "(wide): picture without a text in its place": "<img src='x.png'>",
    "(wide): heading 'low' skips a level": "<h3>low</h3>",
    "(wide): 2 headings of the first level": "<h1>again</h1>",
    "(wide): two places of the name 'a'": "<p id=a>x<p id=a>y",
    "(wide): link or button without a name": "<button style='width:9px;height:9px'></button>",
}
"""Independent problems, all on one page."""
WRONG = {
    "".join(MANY.values()): tuple(MANY),
    "<div style='width:3000px'>x</div>": ("(narrow): 2",),
    DARK: ("(wide dark): picture drawn for white stands on dark",),
    f"<pre style='overflow:auto'>{'long' * 99}</pre>": ("(print): cut at the right",),
    f"<pre style='overflow:hidden'>{'long' * 30}</pre>": ("(narrow): cut at the right",),
}
"""Body of a page -> problems."""
needs_browser = pytest.mark.skipif(
    find_spec("playwright") is None or not any(map(shutil.which, NAMES)),
    reason=f"needs Playwright (extra docs) and one of {', '.join(NAMES)}",
)


def write(folder: Path, name: str, body: str) -> None:
    (folder / f"{name}.html").write_text(f"{HEAD}{'words ' * 20}{body}", "utf-8")


@needs_browser
@pytest.mark.heavy
def test_problems_of_pages_are_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "x.png").write_bytes(PNG)
    for k, body in enumerate(WRONG):
        write(tmp_path, str(k), body)
    bare = "<!DOCTYPE html><meta charset=utf-8><article></article>"
    (tmp_path / "bare.html").write_text(bare, "utf-8")
    assert main(tmp_path) == 1
    found = capsys.readouterr().out.splitlines()
    for k, sentences in enumerate(WRONG.values()):
        for sentence in sentences:
            assert any(f" {k}.html" in line and sentence in line for line in found), sentence
    for sentence in ("hardly a word", "which language", "no title", "no main part", "0 headings"):
        assert any("bare.html" in line and sentence in line for line in found), sentence


@needs_browser
@pytest.mark.slow
def test_good_pages_pass(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path, "good", "<math><mi>x</mi></math>")
    write(tmp_path, "other", "")
    shots = tmp_path / "shots"
    assert main(tmp_path, shots, ["goo"]) == 0
    assert {p.parent.name for p in shots.rglob("good.png")} == {k.replace(" ", "_") for k in KINDS}
    assert main(tmp_path, only=["nothing"]) == 1
    assert "no pages" in capsys.readouterr().out


@needs_browser
@pytest.mark.slow
def test_the_search_must_find_something(tmp_path: Path) -> None:
    from playwright.sync_api import sync_playwright  # noqa: PLC0415

    program = next(found for name in NAMES if (found := shutil.which(name)))
    write(tmp_path, "search", "<ul id=search-results></ul>")
    with sync_playwright() as playwright:
        page = playwright.chromium.launch(executable_path=program).new_page()
        found = [*searched(page, tmp_path, patience=0.3)]
        write(tmp_path, "search", "<ul id=search-results><li>one</ul>")
        assert [*searched(page, tmp_path)] == []
    assert found == ["search.html: nothing found for 'stribeck'"]


def test_without_a_browser_it_reports_that_no_page_was_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(browser, "NAMES", ("no-such-browser",))
    assert browser.main(tmp_path) == 0
    assert "no-such-browser is installed, NO page was opened" in capsys.readouterr().out
