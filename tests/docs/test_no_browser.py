"""Without Chromium, or where it does not start, the check of pages says so and ends."""

from pathlib import Path

import pytest

from docs.machine import browser


def test_without_a_browser_it_says_that_no_page_was_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(browser, "NAMES", ("no-such-browser",))
    assert browser.main(tmp_path) == 0
    assert "no-such-browser is installed, NO page was opened" in capsys.readouterr().out


def test_a_browser_that_does_not_start_is_a_failure_that_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.html").write_text("<!DOCTYPE html>", "utf-8")
    monkeypatch.setattr(browser, "NAMES", ("true",))
    assert browser.main(tmp_path) == 1
    assert "does not start here, NO page was opened" in capsys.readouterr().out
