"""The benchmark of mechanisms, small: structure, honest choices, files."""

import csv
import json
from math import isfinite, isnan
from pathlib import Path
from typing import Any

import pytest
from backends import needs_compiler

from symfric.bench import MultibodyBenchmark
from symfric.bench.multibody import LOOP, OURS, RunRow
from symfric.cli import main

pytestmark = needs_compiler


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bench")
    arguments = ["bench", "multibody", "--quick", "--links", "2,4"]
    files = {"--json": "b.json", "--csv": "b.csv", "--plot": "b.svg"}
    for option, name in files.items():
        arguments += [option, str(folder / name)]
    assert main(arguments) == 0
    return folder


@pytest.fixture(scope="module")
def result(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "b.json").read_text(encoding="utf-8"))


@pytest.mark.slow
def test_everything_of_the_issue_is_there(result: dict[str, Any]) -> None:
    for table in ("runs", "ratios", "compiled", "counts", "chains", "facts", "norms", "drifts"):
        assert result[table], table
    assert set(result["chain_exponents"]) == {"instructions", "step_s"}
    assert result["skipped"]["exudyn"] == "takes too long for --quick"


@pytest.mark.slow
def test_runs_are_finite_and_beside_their_errors(result: dict[str, Any]) -> None:
    for row in result["runs"]:
        assert all(isfinite(row[key]) for key in ("setting", "error", "time_s", "compile_s"))
        assert row["time_s"] > 0
        assert row["steps"] > 0
        assert 0 < row["error"] < 1


@pytest.mark.slow
def test_ratios_are_over_ours_at_the_same_bound(result: dict[str, Any]) -> None:
    ours = {(r["case"], r["bound"]): r for r in result["ratios"] if r["integrator"] == OURS}
    assert {case for case, _ in ours} == {"slider_crank", "pendulum_box"}
    for row in result["ratios"]:
        assert row["error"] <= row["bound"]
        base = ours[row["case"], row["bound"]]["time_s"]
        assert row["ratio"] == pytest.approx(row["time_s"] / base)


@pytest.mark.slow
def test_files_are_written(folder: Path, result: dict[str, Any]) -> None:
    with (folder / "b.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(result["runs"])
    assert float(rows[0]["error"]) == pytest.approx(result["runs"][0]["error"])
    assert (folder / "b.svg").stat().st_size > 0


def run(name: str, setting: float, error: float, time_s: float) -> RunRow:
    return RunRow("case", name, setting, error, time_s, 1, 0.0)


def test_everyone_is_given_the_loosest_tolerance_that_keeps_the_error() -> None:
    rows = (
        run(OURS, 1e-6, 1e-7, 3.0),
        run(OURS, 1e-4, 9e-5, 1.0),
        run(OURS, 1e-3, 2e-4, 0.5),
        run(LOOP, 1e-4, 9e-5, 0.5),
        run("other", 1e-2, 5e-5, 4.0),
        run("exudyn", 500, 2e-4, 10.0),
        run("exudyn", 5000, 1e-6, 100.0),
        run("exudyn", 1000, 5e-5, 20.0),
    )
    benchmark = MultibodyBenchmark(rows)
    found = {(r.integrator, r.bound): (r.setting, r.ratio) for r in benchmark.ratios()}
    loops = {(r.integrator, r.bound): r.loop_ratio for r in benchmark.ratios()}
    assert loops["other", 1e-4] == 8.0
    assert isnan(loops["exudyn", 1e-5])
    assert found[OURS, 1e-4] == (1e-4, 1.0)
    assert found["other", 1e-4] == (1e-2, 4.0)
    assert found["exudyn", 1e-4] == (1000, 20.0)
    assert found["exudyn", 1e-5] == (5000, pytest.approx(100 / 3))
    assert ("other", 1e-5) not in found


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["multibodies"], "expected one of integrator, calls, ensemble, multibody"),
        (["jitter", "--links", "2"], "expected no --links"),
        (["integrator", "--csv", "a.csv"], "expected no --csv"),
        (["multibody", "--links", "2,x"], "--links: expected positive whole numbers"),
    ],
)
def test_bad_input_is_described(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["bench", *arguments]) == 2
    assert message in capsys.readouterr().err
