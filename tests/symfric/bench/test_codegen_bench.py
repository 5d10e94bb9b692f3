from math import nan

import pytest
from cortex import on_target

from symfric.bench import codegen
from symfric.bench.codegen import CodegenBenchmark, bench_codegen, bench_embedded
from symfric.bench.table import Goal, Table
from symfric.embedded import Absent


def few(monkeypatch) -> None:
    first = next(codegen.cases())
    monkeypatch.setattr(codegen, "cases", lambda: iter([first]))


@on_target
@pytest.mark.heavy
def test_a_row_has_our_c_beside_that_of_casadi(monkeypatch):
    few(monkeypatch)
    (row,) = codegen.cores(quick=False).to_dict()["rows"]
    assert row["avg"] < row["f"] < row["casadi"]
    assert row["avg"] < row["guarded"]
    assert row["goals"] == "75 ok"


@on_target
@pytest.mark.heavy
def test_every_core_is_measured(monkeypatch):
    few(monkeypatch)
    rows = bench_embedded().rows
    assert [(r.measured.core, r.measured.real) for r in rows] == list(codegen.TARGETS)
    assert all(r.ok for r in rows)
    assert max(r.measured.error for r in rows) < 1e-6


def test_absent_tools_are_named_and_nothing_fails(monkeypatch):
    monkeypatch.setattr(codegen, "find_tools", lambda: Absent(("qemu-system-arm",)))
    assert "apt-get" in bench_embedded().advice
    assert "apt-get" in codegen.cores(quick=True).notes[0]


def test_goals_are_met_on_their_own_side_and_never_by_a_number_that_is_not_there(tmp_path):
    goals = [Goal("a", 1.0, 2.0), Goal("b", 1.0, 2.0, ">="), Goal("c", nan, 2.0)]
    assert [goal.met for goal in goals] == [True, False, False]
    section = Table("title", ("name", "x"), (("a", 1.0), ("c", nan)), goals=goals)
    result = CodegenBenchmark({"made up": section})
    assert result.to_dict()["made up"]["rows"][1] == {"name": "c", "x": None}
    bars = result.plot(tmp_path / "goals.png").axes[0].patches
    assert [bar.get_width() < 0 for bar in bars] == [True, False]


def test_unknown_sections_are_refused():
    assert "cores" in codegen.SECTIONS
    with pytest.raises(ValueError, match="sections"):
        bench_codegen(sections=("nonsense",))
