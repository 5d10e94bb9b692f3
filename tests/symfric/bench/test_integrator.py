"""The benchmark of integrators, small: structure, finite numbers, interpolation of ratios."""

import json
from math import isfinite
from pathlib import Path
from typing import Any

import pytest

from symfric.bench import Benchmark, Row
from symfric.cli import main

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder: Path = tmp_path_factory.mktemp("bench")
    picture, report = folder / "bench.svg", folder / "bench.json"
    arguments = ["bench", "integrator", "--quick"]
    assert main([*arguments, "--json", str(report), "--plot", str(picture)]) == 0
    assert picture.stat().st_size > 0
    return json.loads(report.read_text(encoding="utf-8"))


def test_rows_are_complete_and_finite(result: dict[str, Any]) -> None:
    for row in result["rows"]:
        assert set(row) == {"case", "integrator", "rtol", "error", "time_s", "steps"}
        assert all(isfinite(row[key]) for key in ("rtol", "error", "time_s", "steps"))
        assert row["error"] >= 0
        assert row["time_s"] > 0


@pytest.mark.parametrize("case", ["rabinowicz/brown_mcphee", "rabinowicz/lugre"])
@pytest.mark.parametrize("integrator", ["symfric vm", "casadi cvodes", "casadi rosenbrock"])
def test_everyone_ran_at_every_tolerance(
    result: dict[str, Any], case: str, integrator: str
) -> None:
    rows = [r for r in result["rows"] if r["case"] == case and r["integrator"] == integrator]
    assert [row["rtol"] for row in rows] == [1e-5, 1e-6, 1e-7]
    assert rows[-1]["error"] < 1e-3
    assert rows[0]["steps"] > 100


def test_what_a_first_result_costs_is_reported(result: dict[str, Any]) -> None:
    for first in result["first"].values():
        assert set(first) == {"build_s", "compile_or_load_s", "run_s"}
    assert set(result["first"]) == {row["case"] for row in result["rows"]}


def test_ensembles_are_measured_on_one_thread_and_more(result: dict[str, Any]) -> None:
    for case in ("rabinowicz/brown_mcphee", "rabinowicz/lugre"):
        rows = [row for row in result["ensemble"] if row["case"] == case]
        assert rows[0]["workers"] == 1
        assert rows[0]["efficiency"] == 1.0
        assert len({row["workers"] for row in rows}) == len(rows)
        for row in rows:
            assert row["member_s"] == pytest.approx(row["time_s"] / row["members"])
            assert row["ratio"] == pytest.approx(row["cvodes_member_s"] / row["member_s"])
            assert row["error"] < 1e-3
            assert row["cvodes_error"] < 1e-1


def test_derivatives_are_measured_and_right(result: dict[str, Any]) -> None:
    rows = [row for row in result["sensitivities"] if row["integrator"] == "symfric vm"]
    assert [row["parameters"] for row in rows] == [1, 6, 1, 6]
    for row in rows:
        assert row["forward"] > 0
        assert row["adjoint"] > 0
        assert row["error"] < 1e-2


def rows(*points: tuple[float, float]) -> tuple[Row, ...]:
    return tuple(Row("case", "one", 1e-6, error, time, 1) for error, time in points)


def test_time_at_an_error_lies_on_the_line_in_both_logarithms() -> None:
    """Order 4: ten thousand times the accuracy for ten times the time."""
    benchmark = Benchmark(rows((1e-8, 1.0), (1e-4, 0.1)), {})
    assert benchmark.time_at("case", "one", 1e-6) == pytest.approx(0.1**0.5)
    assert benchmark.time_at("case", "one", 1e-8) == pytest.approx(1.0)


def test_slower_and_less_accurate_rows_count_for_nothing() -> None:
    benchmark = Benchmark(rows((1e-8, 1.0), (1e-6, 5.0), (1e-4, 0.1)), {})
    assert benchmark.time_at("case", "one", 1e-6) == pytest.approx(0.1**0.5)


def test_error_that_was_not_reached_has_no_time() -> None:
    benchmark = Benchmark(rows((1e-4, 0.1)), {})
    assert benchmark.time_at("case", "one", 1e-6) != benchmark.time_at("case", "one", 1e-6)
    assert benchmark.time_at("case", "one", 1e-3) == 0.1


def test_ratios_are_over_the_reference() -> None:
    ours = Row("case", "ours", 1e-6, 1e-8, 0.5, 1)
    benchmark = Benchmark((ours, *rows((1e-8, 2.0))), {})
    (ratio,) = [
        r["ratio"]
        for r in benchmark.ratios("ours")
        if r["integrator"] == "one" and r["error"] == 1e-7
    ]
    assert ratio == pytest.approx(4.0)
