"""`symfric stress` on the command line."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from symfric.cli import main
from symfric.stress import Case, Report, Verdict, draw
from symfric.stress.judge import CLASSES


def test_a_campaign_prints_a_table_and_writes_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "stress.json"
    arguments = ["stress", "--cases", "2", "--seed", "3", "--json", str(target)]
    assert main([*arguments, "--out", str(tmp_path / "cases")]) == 0
    data = json.loads(target.read_text())
    assert list(data["classes"]) == list(CLASSES)
    assert sum(data["classes"].values()) == 2
    printed = capsys.readouterr().out
    assert all(name in printed for name in CLASSES)
    assert not (tmp_path / "cases").exists()


def test_a_failing_campaign_saves_its_cases_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    report = Report(1, 3, {0: Verdict("silent", "far off"), 1: Verdict("right")}, 1.0)
    monkeypatch.setattr("symfric.stress.campaign.campaign", lambda *_, **__: report)
    assert main(["stress", "--out", str(tmp_path)]) == 1
    assert Case.read(tmp_path / "silent_1_0.json") == draw(1, 0)
    printed = capsys.readouterr()
    assert "Interrupted: 1 of 3 cases were not run." in printed.out
    assert "silent_1_0.json" in printed.err


def test_the_files_are_written_while_a_campaign_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A machine that is switched off loses one minute of a long campaign."""

    def killed(*_: object, progress: Callable[[Report], None], **__: object) -> Report:
        progress(Report(1, 3, {0: Verdict("silent", "far off")}, 1.0))
        raise RuntimeError

    monkeypatch.setattr("symfric.stress.campaign.campaign", killed)
    monkeypatch.setattr("symfric.cli.campaigns.EVERY", -1.0)
    target = tmp_path / "stress.json"
    with pytest.raises(RuntimeError):
        main(["stress", "--json", str(target), "--out", str(tmp_path)])
    assert json.loads(target.read_text())["classes"]["silent"] == 1
    assert (tmp_path / "silent_1_0.json").exists()


def test_a_saved_case_runs_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Case(1, 1, "rabinowicz", "brown_mcphee", t_end=0.5).write(tmp_path / "case.json")
    assert main(["stress", "--case", str(tmp_path / "case.json")]) == 0
    assert "brown_mcphee in rabinowicz, rtol 1e-06, auto: right" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--cases", "0"], "expected cases > 0"),
        (["--case", "missing.json"], "missing.json"),
        (["--json", "."], "expected a file name"),
    ],
)
def test_bad_input_is_one_sentence(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["stress", *arguments]) == 2
    assert message in capsys.readouterr().err
