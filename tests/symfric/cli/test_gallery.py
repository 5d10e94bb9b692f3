"""`symfric gallery`: what there is, what it refuses, what it says of what failed."""

from pathlib import Path

import pytest

from symfric.cli import completions
from symfric.cli.app import main
from symfric.cli.campaigns import brief
from symfric.gallery import rendering
from symfric.gallery.rendering import Gallery

NAME = "self_tuning/fig_07_shape_factor"


def test_it_lists_the_figures_by_paper(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["gallery", "--list"]) == 0
    told = capsys.readouterr().out
    assert "self_tuning/fig_07" in told
    assert "10.1177/14644193231169325" in told
    assert max(map(len, told.splitlines())) <= 80


def test_the_shell_completes_papers_and_their_figures() -> None:
    assert completions.plates("self") == ["self_tuning/"]
    assert "self_tuning/fig_07" in completions.plates("self_tuning/fig_0")
    assert completions.plates("no") == []


def test_a_wrong_name_is_refused_before_anything_is_computed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["gallery", "self_tunig"]) == 2
    assert "did you mean self_tuning?" in capsys.readouterr().err
    assert main(["gallery", "--workers", "0"]) == 2


def test_what_failed_is_told_and_the_status_is_1(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    record = {
        "paper": "A and B, Title",
        "compared": "This with that. More.",
        "how_far": "2e-9 m",
        "seconds": 1.5,
    }
    done = Gallery(tmp_path, ("a", NAME), {NAME: record}, {"a": "ValueError: none"}, 2.0)
    monkeypatch.setattr(rendering, "render", lambda *_, **__: done)  # pyright: ignore[reportUnknownArgumentType, reportUnknownLambdaType]
    assert main(["gallery", "--out", str(tmp_path)]) == 1
    told = capsys.readouterr()
    assert "a failed, ValueError: none" in told.err
    part = Gallery(tmp_path, ("a", NAME, "b"), {NAME: record}, {"a": "ValueError: none"}, 2.0)
    monkeypatch.setattr(rendering, "render", lambda *_, **__: part)  # pyright: ignore[reportUnknownArgumentType, reportUnknownLambdaType]
    assert main(["gallery", "--out", str(tmp_path)]) == 130
    assert "1 of 3 figures were not computed" in capsys.readouterr().err
    assert "This with that" in told.out
    assert "More" not in told.out
    assert "self_tuning: A and B, Title" in told.out
    assert max(map(len, told.out.splitlines())) <= 80


def test_a_text_is_cut_to_what_the_table_holds() -> None:
    assert brief("word " * 30).endswith("word ...")
    assert len(brief("word " * 30)) <= 84
    assert brief("One. Two.") == "One"
    assert brief("0.5 mm ... 2 only.") == "0.5 mm ... 2 only"
