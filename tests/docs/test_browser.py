"""The browser refuses pages with errors, lost pictures, wide lines and requests."""

import shutil
from pathlib import Path

import pytest

from docs.machine.browser import NAMES, main

pytestmark = [
    pytest.mark.heavy,
    pytest.mark.skipif(
        not any(shutil.which(name) for name in NAMES), reason=f"needs one of {', '.join(NAMES)}"
    ),
]
WORDS = "words " * 20


def test_what_is_wrong_with_a_page_is_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wrong = {
        "console error: bad": "<script>console.error('bad')</script>",
        "exception: Error: worse": "<script>throw new Error('worse')</script>",
        "picture does not show": "<img src='gone.png'>",
        "wider than the screen": "<div style='width:3000px'>x</div>",
        "asks the network for http://127.0.0.1:9/": "<img src='http://127.0.0.1:9/x.png'>",
        "formulas without extent": "<math style='display:block;height:0'></math>",
    }
    for k, body in enumerate(wrong.values()):
        text = f"<!DOCTYPE html><meta charset=utf-8><article>{WORDS}{body}</article>"
        (tmp_path / f"{k}.html").write_text(text, "utf-8")
    (tmp_path / "empty.html").write_text("<!DOCTYPE html><article></article>", "utf-8")
    assert main(tmp_path) == 1
    told = capsys.readouterr().out.splitlines()
    for k, sentence in enumerate([*wrong, ""]):
        name = f"{k}.html" if sentence else "empty.html"
        for kind in ("narrow", "wide"):
            own = [line for line in told if f"{name} ({kind})" in line]
            assert any((sentence or "hardly a word") in line for line in own), (name, kind, told)


def test_a_good_page_is_let_through(tmp_path: Path) -> None:
    text = f"<!DOCTYPE html><meta charset=utf-8><article>{WORDS}<math><mi>x</mi></math></article>"
    (tmp_path / "good.html").write_text(text, "utf-8")
    shots = tmp_path / "shots"
    assert main(tmp_path, shots) == 0
    assert (shots / "narrow" / "good.png").read_bytes().startswith(b"\x89PNG")
