import pytest

from symfric.bench import codegen, codegen_runs
from symfric.bench.codegen_runs import PROVEN, compensation, plants, trials


@pytest.mark.heavy
def test_the_goals_are_met_and_the_table_has_a_row_a_case(monkeypatch) -> None:
    (bristles, law), *_ = plants(quick=True).items()
    first = trials()[0]
    monkeypatch.setattr(codegen_runs, "plants", lambda quick: {bristles: law})
    monkeypatch.setattr(codegen_runs, "trials", lambda: [first])
    section = compensation(quick=True)
    assert [row[0] for row in section.rows] == ["without", *first.cases]
    assert {len(row) for row in section.rows} == {len(section.head)}
    assert len(section.goals) == 2
    assert all(goal.met for goal in section.goals)
    assert PROVEN in first.cases


def test_it_is_a_section_of_the_benchmark() -> None:
    assert "compensation" in codegen.SECTIONS
