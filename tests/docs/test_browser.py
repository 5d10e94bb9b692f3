"""The browser refuses pages with errors, lost pictures, wide lines and requests."""

import shutil
from base64 import b64decode
from pathlib import Path

import pytest

from docs.machine.browser import KINDS, NAMES, Browser, main, searched

pytestmark = [
    pytest.mark.heavy,
    pytest.mark.skipif(
        not any(shutil.which(name) for name in NAMES), reason=f"needs one of {', '.join(NAMES)}"
    ),
]
PNG = b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
WORDS = "words " * 20


HEAD = (
    "<!DOCTYPE html><html lang=en><meta charset=utf-8><title>t</title>"
    "<meta name=viewport content='width=device-width,initial-scale=1'><main><article><h1>T</h1>"
)


def write(folder: Path, name: str, body: str, head: str = HEAD) -> None:
    (folder / f"{name}.html").write_text(f"{head}{WORDS}{body}", "utf-8")


def test_what_is_wrong_with_a_page_is_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    grey = "<p style='color:#999;background:#fff'>pale</p>"
    dark = (
        "<style>@media (prefers-color-scheme:dark) {article {background:#111;color:#eee}}</style>"
        "<img src='x.png' alt='a' width=9>"
    )
    (tmp_path / "x.png").write_bytes(PNG)
    wrong = {
        "console error: bad": "<script>console.error('bad')</script>",
        "exception: Error: worse": "<script>throw new Error('worse')</script>",
        "(wide): picture does not show": "<img src='gone.png' alt='a'>",
        "(narrow): 2": "<div style='width:3000px'>x</div>",
        "asks the network for http://127.0.0.1:9/": "<img src='http://127.0.0.1:9/x.png' alt='a'>",
        "(wide): formula without extent": "<math style='display:block;height:0'><mi>x</mi></math>",
        "(wide): contrast of 2.8 only": grey,
        "(wide dark): picture drawn for white stands on dark": dark,
        "(wide): picture without a text in its place": "<img src='x.png'>",
        "(wide): heading 'low' skips a level": "<h3>low</h3>",
        "(wide): 2 headings of the first level": "<h1>again</h1>",
        "(wide): two places of the name 'a'": "<p id=a>x<p id=a>y",
        "(wide): link or button without a name": "<button style='width:9px;height:9px'></button>",
        "(print): cut at the right": f"<pre style='overflow:auto'>{'long' * 99}</pre>",
        "(narrow): cut at the right": f"<pre style='overflow:hidden'>{'long' * 30}</pre>",
    }
    for k, body in enumerate(wrong.values()):
        write(tmp_path, str(k), body)
    bare = "<!DOCTYPE html><meta charset=utf-8><article></article>"
    (tmp_path / "bare.html").write_text(bare, "utf-8")
    assert main(tmp_path) == 1
    told = capsys.readouterr().out.splitlines()
    for k, sentence in enumerate(wrong):
        own = [line for line in told if f" {k}.html" in line]
        assert any(sentence in line for line in own), (k, sentence, own)
    for sentence in ("hardly a word", "which language", "no title", "no main part", "0 headings"):
        assert any("bare.html" in line and sentence in line for line in told), sentence


def test_a_good_page_is_let_through(tmp_path: Path) -> None:
    write(tmp_path, "good", "<math><mi>x</mi></math>")
    shots = tmp_path / "shots"
    assert main(tmp_path, shots) == 0
    assert {p.parent.name for p in shots.rglob("good.png")} == {k.replace(" ", "_") for k in KINDS}
    assert (shots / "narrow" / "good.png").read_bytes().startswith(b"\x89PNG")


def test_the_search_must_find_something_by_itself(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(tmp_path, "search", "<ul id=search-results></ul>")
    program = next(found for name in NAMES if (found := shutil.which(name)))
    browser = Browser(program)
    try:
        told = [*searched(browser, tmp_path, patience=0.3)]
        write(tmp_path, "search", "<ul id=search-results><li>one</ul>")
        assert [*searched(browser, tmp_path)] == []
    finally:
        browser.close()
    assert told == ["search.html: nothing found for 'stribeck'"]


def test_only_pages_that_are_named_are_opened(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(tmp_path, "good", "")
    write(tmp_path, "bad", "<h1>again</h1>")
    assert main(tmp_path, only=["goo"]) == 0
    assert main(tmp_path, only=["nothing"]) == 1
    assert "no pages" in capsys.readouterr().out
