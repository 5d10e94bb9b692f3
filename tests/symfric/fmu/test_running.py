"""A unit that is run here."""

import numpy as np
import pytest
from backends import needs_compiler

from symfric import BrownMcPhee
from symfric.bench import codegen_runs
from symfric.bench.report import GOALS, Report
from symfric.fmu import export_fmu
from symfric.fmu.export import running
from symfric.scenes import ALL_SCENES, Drive


@needs_compiler
def test_a_unit_runs_and_its_refusals_are_errors(tmp_path):
    unit = export_fmu(Drive(BrownMcPhee()), tmp_path / "unit.fmu")
    with running(unit.path, x=0.25, force=1.5) as one:
        assert one.get(["x", "force"]).tolist() == [0.25, 1.5]
        one.step(0.5)
        assert one.t == 0.5
        assert np.isfinite(one.get(["v"])).all()
        with pytest.raises(RuntimeError, match="more than 0 s"):
            one.step(0.0)
    refused = pytest.raises(RuntimeError, match="set m: expected a finite number")
    with refused, running(unit.path, m=-1.0):
        pass


def test_sources_alone_cannot_be_run(tmp_path, monkeypatch):
    monkeypatch.setattr("symfric.fmu.package.find_compiler", lambda: None)
    unit = export_fmu(Drive(BrownMcPhee()), tmp_path / "unit.fmu")
    with pytest.raises(ValueError, match="expected a binary in"), running(unit.path):
        pass


@pytest.mark.heavy
@needs_compiler
def test_the_table_has_a_row_for_what_simulate_finishes_and_goals_are_met(monkeypatch):
    monkeypatch.setattr(codegen_runs, "QUICK", ("drive",))
    monkeypatch.setattr(ALL_SCENES["drive"], "t_end", 0.5)
    measured = Report().collect({"fmu": lambda: codegen_runs.units(quick=True)}).tables
    assert len(measured[codegen_runs.UNITS]) == len(codegen_runs.LAWS)
    assert all(goal["met"] == "yes" for goal in measured[GOALS])
    tiny = f"attempts per step of {codegen_runs.TINY:g} s"
    assert all(row[tiny] < 0.1 for row in measured[codegen_runs.UNITS])


def test_without_a_compiler_there_are_no_rows(monkeypatch):
    monkeypatch.setattr(codegen_runs, "find_compiler", lambda: None)
    assert "no C compiler" in next(codegen_runs.units(quick=True))
