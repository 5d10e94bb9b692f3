"""`symfric gallery`: what there is, what it refuses, what it says of what failed."""

from pathlib import Path

import pytest

from symfric.cli import gallery as command
from symfric.cli.app import main
from symfric.cli.gallery import first_sentence
from symfric.gallery.rendering import Gallery

NAME = "self_tuning/fig_07_shape_factor"


def test_it_lists_the_figures_by_paper(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["gallery", "--list"]) == 0
    told = capsys.readouterr().out
    assert "self_tuning/fig_07" in told
    assert "10.1177/14644193231169325" in told
    assert max(map(len, told.splitlines())) <= 80


def test_a_wrong_name_is_refused_before_anything_is_computed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["gallery", "self_tunig"]) == 2
    assert "did you mean self_tuning?" in capsys.readouterr().err
    assert main(["gallery", "--workers", "0"]) == 2


def test_what_failed_is_told_and_the_status_is_1(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    record = {"compared": "This with that. More.", "how_far": "2e-9 m", "seconds": 1.5}
    done = Gallery(tmp_path, ("a", NAME, "b"), {NAME: record}, {"a": "ValueError: none"})
    monkeypatch.setattr(command, "render", lambda *_, **__: done)  # pyright: ignore[reportUnknownArgumentType, reportUnknownLambdaType]
    assert main(["gallery", "--out", str(tmp_path)]) == 1
    told = capsys.readouterr()
    assert "a failed, ValueError: none" in told.err
    assert "interrupted, 1 of 3 figures" in told.err
    assert "This with that" in told.out
    assert "More" not in told.out


def test_a_sentence_ends_where_it_says() -> None:
    assert first_sentence("One. Two.") == "One"
    assert first_sentence("0.5 mm ... 2 only.") == "0.5 mm ... 2 only"
