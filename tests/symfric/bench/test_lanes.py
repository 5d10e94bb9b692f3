"""The benchmark of members side by side, small."""

import json
from pathlib import Path

import pytest

from symfric.cli import main

pytestmark = pytest.mark.slow


def test_members_side_by_side_are_measured_and_right(tmp_path: Path) -> None:
    report = tmp_path / "ensemble.json"
    assert main(["bench", "ensemble", "--quick", "--json", str(report)]) == 0
    rows = json.loads(report.read_text(encoding="utf-8"))["rows"]
    assert [row["case"] for row in rows] == ["rabinowicz/brown_mcphee", "rabinowicz/lugre"]
    for row in rows:
        assert row["lanes"] in (4, 8, 16)
        assert row["ratio"] == pytest.approx(row["alone_us"] / row["member_us"])
        assert row["difference"] < 1e-5
        assert 0 <= row["equal"] <= 1


def test_it_draws_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "ensemble", "--plot", "x.png"]) != 0
    assert "bench ensemble: expected no --plot" in capsys.readouterr().err
