"""The mutants of `make mutants` are of this tree: their old lines stand there, and their tests."""

from pathlib import Path

from mutants.mutants import MUTANTS

ROOT = Path(__file__).parents[1]


def test_every_mutant_changes_one_place_and_names_tests_that_exist() -> None:
    assert len(MUTANTS) >= 30
    assert len({m.name for m in MUTANTS}) == len(MUTANTS)
    for m in MUTANTS:
        assert (ROOT / m.file).read_text(encoding="utf-8").count(m.old) == 1, m.name
        assert m.new != m.old, m.name
        assert m.tests, m.name
        assert all((ROOT / test.partition("::")[0]).exists() for test in m.tests), m.name
