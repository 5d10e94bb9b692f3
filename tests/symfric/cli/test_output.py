"""What the commands print."""

import json
from errno import ENOSPC
from math import inf, nan
from pathlib import Path

import pytest

from symfric.cli import output
from symfric.cli.app import sentence


def test_tables_align_numbers_and_stay_within_80_columns(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    output.show_table(["name", "value", "note"], [("a", 1.0, "long " * 40), ("b", 123456.0, "")])
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[2].index("1") + 1 == lines[-1].index("123456") + 6


def test_no_word_is_cut_and_every_row_is_a_line_where_there_is_no_terminal(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    words = " ".join(f"word{k}" for k in range(40))
    output.show_table(["name", "time per call [us]", "note"], [("a", 1.0, words), ("b", 2.0, "")])
    head, rule, *rows = capsys.readouterr().out.splitlines()
    assert "time per call [us]" in head
    assert len(rule) > 200
    assert len(rows) == 2
    assert words in rows[0]
    assert not rows[1].endswith(" ")


def test_words_are_whole_where_columns_share_a_narrow_terminal() -> None:
    rows = [["task", "time per call [us]"], ["words of several lengths", "1.5"]]
    assert output.column_widths(rows, 80) == [24, 18]
    assert output.column_widths(rows, 25) == [13, 9]
    assert output.column_widths(rows, 5) == [7, 4]


def test_brackets_of_units_are_not_taken_for_markup(capsys: pytest.CaptureFixture[str]) -> None:
    output.show_table(["v [m/s]"], [("[bold]x",)], title="t [s]")
    output.show("friction [N]")
    out = capsys.readouterr().out
    assert all(text in out for text in ("v [m/s]", "[bold]x", "t [s]", "friction [N]"))


def test_json_has_null_for_what_is_not_finite(capsys: pytest.CaptureFixture[str]) -> None:
    output.emit_json({"a": [inf, nan, 1.5], "b": {"c": -inf}}, "-")
    assert json.loads(capsys.readouterr().out) == {"a": [None, None, 1.5], "b": {"c": None}}


def test_docstrings_keep_equations_and_wrap_sentences_anew(
    capsys: pytest.CaptureFixture[str],
) -> None:
    output.show_doc("Name.\n\n    F = a\n      + b\n\nOne\nsentence.\nLimits: none.\nSource: me.")
    lines = capsys.readouterr().out.splitlines()
    assert lines[:5] == ["Name.", "", "    F = a", "      + b", ""]
    assert lines[5:8] == ["One sentence.", "Limits: none.", "Source: me."]


def test_only_files_are_named_as_written(capsys: pytest.CaptureFixture[str]) -> None:
    output.say_written("a.csv", None, "-")
    assert capsys.readouterr().err == "wrote a.csv\n"


def test_files_of_a_folder_are_named_in_lines_of_a_terminal(
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder = Path("a folder with blanks")
    files = [folder / f"friction_compensator_{i}.c" for i in range(9)]
    output.say_folder(folder, files)
    head, *lines = capsys.readouterr().err.splitlines()
    assert head == "wrote 9 files into a folder with blanks:"
    assert max(map(len, lines)) <= 80
    assert " ".join(lines).split() == [file.name for file in files]


def test_progress_is_silent_where_there_is_no_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    with output.progress("work") as tell:
        tell(0.5)
    assert capsys.readouterr().err == ""


def test_a_command_line_of_another_locale_can_be_written_down() -> None:
    kept = "bericht ä.html".encode().decode("ascii", errors="surrogateescape")
    assert output.printable(kept).encode() == "bericht ä.html".encode()
    assert output.printable("bericht ä.html") == "bericht ä.html"


def test_a_full_disk_is_told_with_the_way_out() -> None:
    for file in (("run.npz",), ()):
        told = sentence(OSError(ENOSPC, "No space left on device", *file))
        place = " for 'run.npz'" if file else ""
        assert told.startswith(f"expected free disk space, got none{place}; free some")
