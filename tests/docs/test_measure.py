"""A measurement is stored with all that makes it judgeable, and keeps what people wrote."""

import json
from pathlib import Path

import pytest

from docs.machine import measure
from symfric.bench.interop import MOVES, RUNS
from symfric.bench.report import Report


def test_a_measurement_is_stored_with_machine_load_and_commit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    move = {"tool": "opti", "route": "flow", "law": "lugre", "cost J [N^2 s]": 1.11449}
    result = Report(tables={MOVES: [move], RUNS: [{"integrator": "cvodes", "law": "lugre"}]})
    monkeypatch.setattr(measure, "STORED", tmp_path)
    monkeypatch.setattr("symfric.bench.measure", lambda subject, quick: result)
    monkeypatch.setattr(measure, "commit", lambda: "abc")
    path = tmp_path / "interop.json"
    short = dict.fromkeys(measure.SHORT, "-") | {"tables": []}
    path.write_text(json.dumps({"title": "T", "about": "A.", "short": short}), "utf-8")
    assert measure.main(["--quick", "interop"]) == 0
    found = json.loads(path.read_text("utf-8"))
    assert {*found} == {*measure.KEYS, "short"}
    assert (found["title"], found["about"], found["short"]) == ("T", "A.", short)
    assert found["command"] == "symfric bench interop --quick"
    assert all(float(load) >= 0 for load in found["load"].split(" to "))
    assert found["tables"][0] == {"title": MOVES, "rows": [move | {"cost J [N^2 s]": "1.11"}]}
    assert found["tables"][1]["rows"][0]["integrator"] == "cvodes"
    page = measure.section("interop", found)
    assert "load " in page and "Condensed by hand" in page
    capsys.readouterr()


def test_what_is_no_subject_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert measure.main(["nothing"]) == 2
    assert "expected some of integrator" in capsys.readouterr().out
    assert measure.main([]) == 2
    capsys.readouterr()
