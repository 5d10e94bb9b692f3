"""The benchmark of calls, small: every task by every way, errors that are errors."""

import json
from pathlib import Path

import pytest

from symfric.cli import main

pytestmark = pytest.mark.slow


def test_every_task_is_measured_and_right(tmp_path: Path) -> None:
    report = tmp_path / "calls.json"
    assert main(["bench", "calls", "--quick", "--json", str(report)]) == 0
    rows = json.loads(report.read_text(encoding="utf-8"))["rows"]
    tasks: dict[str, list[dict[str, float]]] = {}
    for row in rows:
        tasks.setdefault(row["task"], []).append(row)
    assert len(tasks) == 9
    for ways in tasks.values():
        assert ways[0]["ratio"] == 1.0
        assert all(way["time_us"] > 0 for way in ways)
        assert all(way.get("error", 0.0) < 1e-2 for way in ways)
