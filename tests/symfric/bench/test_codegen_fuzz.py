"""The table of the fuzz test."""

import pytest

from symfric.bench import codegen
from symfric.codegen import law_block
from symfric.laws import Dahl


@pytest.mark.heavy
def test_a_row_for_every_law_and_type(monkeypatch: pytest.MonkeyPatch, compiler: object) -> None:
    blocks = [(law_block(Dahl()), 2000)]
    monkeypatch.setattr(codegen, "_blocks", lambda _: blocks)
    found = codegen.fuzzing(quick=True)
    rows = found.to_dict()["rows"]
    assert [row["type"] for row in rows] == ["f64", "f32"]
    assert all(row["valid"] + row["repaired"] == 2000 for row in rows)
    assert all(goal.met for goal in found.goals)


def test_without_a_compiler_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(codegen, "find_compiler", lambda: None)
    found = codegen.fuzzing(quick=True)
    assert not found.rows
    assert "no C compiler" in found.notes[0]
    assert "fuzz" in codegen.SECTIONS
